//! Eight runs of one channel side by side: the filter's own steps from a start at zero, then what each run's start adds.

use crate::arrays::Scalar;
use crate::lanes::{Columns, Row, Rows, TILE, are_finite, eight_rows, turn_in, write, zeros};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::Recurrence;
use compfilt_core::linear::{Runs, State};

/// Tiles of a block. The processor steps through one while it waits for the other.
pub(crate) const TILES: usize = 2;

/// The runs of a tile.
pub(crate) type TileRuns<T, const N: usize> = Runs<T, N, TILE, WIDTH>;

/// One signal of a block: the runs, as they lie one after the other, are the columns of its tiles.
pub(crate) type Signal<T> = [Columns<T>; TILES];

/// Both signals of a block, row by row: kept from block to block, because clearing them takes time.
pub(crate) struct Rowwise<T> {
    measurement: [Rows<T>; TILES],
    derivative: [Rows<T>; TILES],
}

impl<T: Scalar> Rowwise<T> {
    pub(crate) fn new() -> Self {
        Self { measurement: [zeros(); TILES], derivative: [zeros(); TILES] }
    }
}

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
        Self { levels: [[zeros(); TILES]; N], ends: [[row; N]; TILES] }
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
        rowwise: &mut Rowwise<T>,
        all: bool,
    ) {
        dispatch!(level, simd => from_zero(simd, filter, signals, rowwise, self, all));
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
        rowwise: &mut Rowwise<T>,
        (levels, all): (&mut [T; N], bool),
        out: &mut Signal<T>,
    ) -> bool {
        dispatch!(level, simd => {
            from_zero(simd, filter, signals, rowwise, self, all);
            let starts = self.starts(filter.1, levels);
            finish(simd, self, filter.1, &starts, 0, out)
        })
    }
}

#[inline(always)]
fn from_zero<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    simd: S,
    (gains, runs): (&G, &TileRuns<T, N>),
    (measurement, derivative): (&Signal<T>, &Signal<T>),
    rowwise: &mut Rowwise<T>,
    to: &mut FromZero<T, N>,
    all: bool,
) {
    for tile in 0..TILES {
        turn_in(simd, measurement[tile].each_ref(), &mut rowwise.measurement[tile]);
        turn_in(simd, derivative[tile].each_ref(), &mut rowwise.derivative[tile]);
    }
    steps(simd, gains, rowwise, to, all);
    for ends in &mut to.ends {
        chain(simd, runs, ends);
    }
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

/// The filter's own steps through both tiles by turns, from zero.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn steps<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &G,
    rowwise: &Rowwise<T>,
    to: &mut FromZero<T, N>,
    all: bool,
) {
    let zero = T::Wide::<S>::from_array([T::zero(); WIDTH]);
    let mut states = [State { levels: [zero; N] }; TILES];
    for row in 0..TILE {
        for tile in 0..TILES {
            let y = T::Wide::<S>::from_array(rowwise.measurement[tile][row].0);
            let u = T::Wide::<S>::from_array(rowwise.derivative[tile][row].0);
            let state = &mut states[tile];
            gains.step(state, y, u);
            to.levels[0][tile][row] = Row(state.levels[0].to_array());
            if all {
                for level in 1..N {
                    to.levels[level][tile][row] = Row(state.levels[level].to_array());
                }
            }
        }
    }
    for tile in 0..TILES {
        for level in 0..N {
            to.ends[tile][level] = Row(states[tile].levels[level].to_array());
        }
    }
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
    simd: S,
    weights: &[[T; N]; TILE],
    starts: &[T::Wide<S>; N],
    rows: &Rows<T>,
    out: &mut Columns<T>,
) -> Row<T> {
    let mut sums = [T::Wide::<S>::from_array([T::zero(); WIDTH]); 2];
    let mut halves = [eight_rows(simd, rows, 0), eight_rows(simd, rows, WIDTH)];
    for half in 0..2 {
        for row in 0..WIDTH {
            let x = &mut halves[half][row];
            for column in 0..N {
                *x += starts[column] * weights[half * WIDTH + row][column];
            }
            sums[half] += *x;
        }
    }
    write(simd, halves, out.each_mut());
    Row((sums[0] + sums[1]).to_array())
}

/// Zeros from `SHIFT` on, then the first numbers of `x`.
#[inline(always)]
fn after_zeros<S: Simd, T: Scalar, const SHIFT: usize>(x: T::Wide<S>) -> T::Wide<S> {
    T::Wide::<S>::from_array([T::zero(); WIDTH]).slide::<SHIFT>(x)
}
