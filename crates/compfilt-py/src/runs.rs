//! Eight runs of one channel side by side: the filter's own steps from a start at zero, then what each run's start adds.

use crate::arrays::Scalar;
use crate::lanes::{Row, are_finite};
use crate::prefetch::ask_for;
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use crate::square::{lay, turned};
use compfilt_core::Recurrence;
use compfilt_core::linear::{Runs, State};

/// Samples of a run: as many as there are runs in a tile, so that a tile is turned and filtered in registers.
pub(crate) const RUN: usize = WIDTH;

/// Tiles of a block. No tile waits for another until all have ended.
pub(crate) const TILES: usize = 4;

/// Samples of a block.
pub(crate) const BLOCK: usize = TILES * WIDTH * RUN;

/// Samples ahead that memory is asked for, a line of each array between two steps: many lines at once wait for one another. The
/// processor by itself is sometimes faster, and often not.
const AHEAD: usize = 4 * BLOCK;

/// The runs of a tile.
pub(crate) type TileRuns<T, const N: usize> = Runs<T, N, RUN, WIDTH>;

/// The runs of a tile as they lie one after the other.
pub(crate) type Tile<T> = [[T; RUN]; WIDTH];

/// One signal of a block.
pub(crate) type Signal<T> = [Tile<T>; TILES];

/// Where the runs of a block end from a start of their tile at zero: all that is kept of a block between its two passes, and
/// the samples themselves, which lie where the results go.
#[derive(Clone)]
pub(crate) struct FromZero<T, const N: usize> {
    ends: [[Row<T>; N]; TILES],
}

impl<T: Scalar, const N: usize> FromZero<T, N> {
    pub(crate) fn new() -> Self {
        Self { ends: [[Row([T::zero(); WIDTH]); N]; TILES] }
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

    /// Steps through a block, each run from its own start at zero, to level 0 in `out` and to the others in `levels` if they are
    /// wanted.
    pub(crate) fn filter<G: Recurrence<T, N>>(
        &mut self,
        level: Level,
        filter: (&G, &TileRuns<T, N>),
        signals: (&Signal<T>, &Signal<T>),
        out: &mut Signal<T>,
        levels: Option<&mut [Signal<T>; N]>,
    ) {
        dispatch!(level, simd => from_zero(simd, filter, signals, self, out, levels));
    }

    /// Adds what the starts of the tiles give to a level of a block. False if it overflows.
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
}

#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn from_zero<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    simd: S,
    (gains, runs): (&G, &TileRuns<T, N>),
    (measurement, derivative): (&Signal<T>, &Signal<T>),
    to: &mut FromZero<T, N>,
    out: &mut Signal<T>,
    mut levels: Option<&mut [Signal<T>; N]>,
) {
    let zero = T::Wide::<S>::from_array([T::zero(); WIDTH]);
    for tile in 0..TILES {
        let y = turned(simd, &measurement[tile]);
        let u = turned(simd, &derivative[tile]);
        let mut state = State { levels: [zero; N] };
        let mut samples = [[zero; RUN]; N];
        for row in 0..RUN {
            let later = AHEAD + row * RUN;
            ask_for(measurement[tile].as_flattened(), later);
            ask_for(derivative[tile].as_flattened(), later);
            ask_for(out[tile].as_flattened(), later);
            gains.step(&mut state, y[row], u[row]);
            samples[0][row] = state.levels[0];
            if levels.is_some() {
                for level in 1..N {
                    samples[level][row] = state.levels[level];
                }
            }
        }
        lay(simd, samples[0], &mut out[tile]);
        if let Some(levels) = &mut levels {
            for level in 1..N {
                lay(simd, samples[level], &mut levels[level][tile]);
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
    let mut sum = T::Wide::<S>::from_array([T::zero(); WIDTH]);
    let mut weights = [sum; N];
    for column in 0..N {
        weights[column] =
            T::Wide::<S>::from_array(runs.from_start()[number].map(|row| row[column]));
    }
    for tile in 0..TILES {
        let starts = run_starts(simd, runs, &starts[tile], &block.ends[tile]);
        for (run, samples) in out[tile].iter_mut().enumerate() {
            let mut x = T::Wide::<S>::from_array(*samples);
            for column in 0..N {
                x += weights[column] * starts[column].0[run];
            }
            sum += x;
            *samples = x.to_array();
        }
    }
    are_finite(&sum.to_array())
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
) -> [Row<T>; N] {
    let mut starts = [Row([T::zero(); WIDTH]); N];
    for row in 0..N {
        let mut x = after_zeros::<S, T, 7>(T::Wide::<S>::from_array(ends[row].0));
        for column in 0..N {
            x += T::Wide::<S>::from_array(runs.powers()[row][column]) * start[column];
        }
        starts[row] = Row(x.to_array());
    }
    starts
}

/// Zeros from `SHIFT` on, then the first numbers of `x`.
#[inline(always)]
fn after_zeros<S: Simd, T: Scalar, const SHIFT: usize>(x: T::Wide<S>) -> T::Wide<S> {
    T::Wide::<S>::from_array([T::zero(); WIDTH]).slide::<SHIFT>(x)
}
