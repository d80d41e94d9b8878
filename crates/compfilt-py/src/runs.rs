//! Eight runs of one channel side by side: the filter's own steps from a start at zero, then what each run's start adds.

use crate::arrays::Scalar;
use crate::lanes::{Row, are_finite, transposed};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::Recurrence;
use compfilt_core::linear::{Runs, State};

/// Samples of a run: as many as there are runs in a tile, so that a tile is turned and filtered in registers.
pub(crate) const RUN: usize = WIDTH;

/// Tiles of a block. No tile waits for another until all have ended.
pub(crate) const TILES: usize = 4;

/// The runs of a tile.
pub(crate) type TileRuns<T, const N: usize> = Runs<T, N, RUN, WIDTH>;

/// The runs of a tile as they lie one after the other.
type Tile<T> = [[T; RUN]; WIDTH];

/// One signal of a block.
pub(crate) type Signal<T> = [Tile<T>; TILES];

/// A number of each run, sample by sample.
type Rows<T> = [Row<T>; RUN];

/// A block from a start at zero.
#[derive(Clone)]
pub(crate) struct FromZero<T, const N: usize> {
    /// The levels of every sample, each run from its own start at zero.
    levels: [[Rows<T>; TILES]; N],
    /// The state after each run, from a start of the tile at zero.
    ends: [[Row<T>; N]; TILES],
}

impl<T: Scalar, const N: usize> FromZero<T, N> {
    pub(crate) fn new() -> Self {
        let row = Row([T::zero(); WIDTH]);
        Self { levels: [[[row; RUN]; TILES]; N], ends: [[row; N]; TILES] }
    }

    /// The state before each tile; `levels` goes from the start of the block to its end.
    #[inline(always)]
    pub(crate) fn starts(&self, runs: &TileRuns<T, N>, levels: &mut [T; N]) -> [[T; N]; TILES] {
        let mut starts = [*levels; TILES];
        for (start, ends) in starts.iter_mut().zip(&self.ends) {
            *start = *levels;
            runs.over_all(levels, &ends.map(|row| row.0[WIDTH - 1]));
        }
        starts
    }

    /// Steps through a block. Level 0 is kept, the others if `all` are wanted.
    pub(crate) fn filter<G: Recurrence<T, N>>(
        &mut self,
        level: Level,
        filter: (&G, &TileRuns<T, N>),
        signals: (&Signal<T>, &Signal<T>),
        all: bool,
    ) {
        dispatch!(level, simd => from_zero(simd, filter, signals, self, all));
    }

    /// A level of a block whose tiles start at `starts`. False if it overflows.
    pub(crate) fn finish(
        &self,
        level: Level,
        runs: &TileRuns<T, N>,
        starts: &[[T; N]; TILES],
        number: usize,
        out: &mut Signal<T>,
    ) -> bool {
        dispatch!(level, simd => finish(simd, self, runs, starts, number, out))
    }

    /// Both at once for level 0: the processor begins with the second while the first ends.
    pub(crate) fn filter_and_finish<G: Recurrence<T, N>>(
        &mut self,
        level: Level,
        filter: (&G, &TileRuns<T, N>),
        signals: (&Signal<T>, &Signal<T>),
        (levels, all): (&mut [T; N], bool),
        out: &mut Signal<T>,
    ) -> bool {
        dispatch!(level, simd => {
            from_zero(simd, filter, signals, self, all);
            let starts = self.starts(filter.1, levels);
            finish(simd, self, filter.1, &starts, 0, out)
        })
    }
}

#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn from_zero<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    simd: S,
    (gains, runs): (&G, &TileRuns<T, N>),
    (measurement, derivative): (&Signal<T>, &Signal<T>),
    to: &mut FromZero<T, N>,
    all: bool,
) {
    for tile in 0..TILES {
        let y = turned(simd, &measurement[tile]);
        let u = turned(simd, &derivative[tile]);
        let zero = T::Wide::<S>::from_array([T::zero(); WIDTH]);
        let mut state = State { levels: [zero; N] };
        for row in 0..RUN {
            gains.step(&mut state, y[row], u[row]);
            to.levels[0][tile][row] = Row(state.levels[0].to_array());
            if all {
                for level in 1..N {
                    to.levels[level][tile][row] = Row(state.levels[level].to_array());
                }
            }
        }
        for level in 0..N {
            to.ends[tile][level] = Row(state.levels[level].to_array());
        }
    }
    for ends in &mut to.ends {
        chain(simd, runs, ends);
    }
}

/// A tile with its runs side by side.
#[inline(always)]
fn turned<S: Simd, T: Scalar>(_: S, tile: &Tile<T>) -> [T::Wide<S>; RUN] {
    let mut square = [T::Wide::<S>::from_array([T::zero(); WIDTH]); RUN];
    for (wide, run) in square.iter_mut().zip(tile) {
        *wide = T::Wide::<S>::from_array(*run);
    }
    transposed::<S, T>(square)
}

#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn finish<S: Simd, T: Scalar, const N: usize>(
    simd: S,
    block: &FromZero<T, N>,
    runs: &TileRuns<T, N>,
    starts: &[[T; N]; TILES],
    number: usize,
    out: &mut Signal<T>,
) -> bool {
    let weights = &runs.from_start()[number];
    let mut sums = [Row([T::zero(); WIDTH]); TILES];
    for tile in 0..TILES {
        let starts = run_starts(simd, runs, &starts[tile], &block.ends[tile]);
        sums[tile] =
            finish_tile(simd, weights, &starts, &block.levels[number][tile], &mut out[tile]);
    }
    sums.iter().all(|sums| are_finite(&sums.0))
}

/// Each run takes what the runs before it have left: those one, two, then four before.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn chain<S: Simd, T: Scalar, const N: usize>(
    simd: S,
    runs: &TileRuns<T, N>,
    ends: &mut [Row<T>; N],
) {
    let mut x = [T::Wide::<S>::from_array([T::zero(); WIDTH]); N];
    for level in 0..N {
        x[level] = T::Wide::<S>::from_array(ends[level].0);
    }
    x = take_over::<S, T, N, 1, 7>(simd, runs, x);
    x = take_over::<S, T, N, 2, 6>(simd, runs, x);
    x = take_over::<S, T, N, 4, 4>(simd, runs, x);
    for level in 0..N {
        ends[level] = Row(x[level].to_array());
    }
}

/// Adds what the run that is `BEFORE` runs earlier has left; `SHIFT` is the rest of the lanes.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn take_over<S: Simd, T: Scalar, const N: usize, const BEFORE: usize, const SHIFT: usize>(
    _: S,
    runs: &TileRuns<T, N>,
    x: [T::Wide<S>; N],
) -> [T::Wide<S>; N] {
    let mut sums = x;
    for column in 0..N {
        let before = after_zeros::<S, T, SHIFT>(x[column]);
        for row in 0..N {
            sums[row] += before * runs.powers()[row][column][BEFORE];
        }
    }
    sums
}

/// The state before each run of a tile that starts at `start`.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn run_starts<S: Simd, T: Scalar, const N: usize>(
    _: S,
    runs: &TileRuns<T, N>,
    start: &[T; N],
    ends: &[Row<T>; N],
) -> [T::Wide<S>; N] {
    let mut starts = [T::Wide::<S>::from_array([T::zero(); WIDTH]); N];
    for row in 0..N {
        let mut x = after_zeros::<S, T, 7>(T::Wide::<S>::from_array(ends[row].0));
        for column in 0..N {
            x += T::Wide::<S>::from_array(runs.powers()[row][column]) * start[column];
        }
        starts[row] = x;
    }
    starts
}

/// Adds what the starts of the runs give to every sample, and lays the runs one after the other. Returns sums that are
/// finite only if all samples are.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn finish_tile<S: Simd, T: Scalar, const N: usize>(
    _: S,
    weights: &[[T; N]; RUN],
    starts: &[T::Wide<S>; N],
    rows: &Rows<T>,
    out: &mut Tile<T>,
) -> Row<T> {
    let mut sum = T::Wide::<S>::from_array([T::zero(); WIDTH]);
    let mut square = [sum; RUN];
    for row in 0..RUN {
        let mut x = T::Wide::<S>::from_array(rows[row].0);
        for column in 0..N {
            x += starts[column] * weights[row][column];
        }
        sum += x;
        square[row] = x;
    }
    for (run, x) in out.iter_mut().zip(transposed::<S, T>(square)) {
        *run = x.to_array();
    }
    Row(sum.to_array())
}

/// Zeros from `SHIFT` on, then the first numbers of `x`.
#[inline(always)]
fn after_zeros<S: Simd, T: Scalar, const SHIFT: usize>(x: T::Wide<S>) -> T::Wide<S> {
    T::Wide::<S>::from_array([T::zero(); WIDTH]).slide::<SHIFT>(x)
}
