//! Eight runs of one channel side by side: where each of them ends, then the filter's own step from where each starts.

use crate::arrays::Scalar;
use crate::lanes::{Columns, Row, TILE, Tile, are_finite, eight, steps, turn_in, turn_out};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::linear::Runs;
use compfilt_core::{Element, Recurrence};

/// The runs of a block.
pub(crate) type BlockRuns<T, const N: usize> = Runs<T, N, TILE, WIDTH>;

/// Both signals of a block: eight runs after the other are the columns of a tile as they lie.
pub(crate) type Pair<'a, T> = (&'a Columns<T>, &'a Columns<T>);

/// The state after each run, from a start of the block at zero.
pub(crate) fn ends<T: Scalar, const N: usize>(
    level: Level,
    runs: &BlockRuns<T, N>,
    pair: Pair<'_, T>,
) -> [Row<T>; N] {
    let mut ends = [Row([T::zero(); WIDTH]); N];
    dispatch!(level, simd => products(simd, runs, pair, &mut ends));
    // Each run takes what the runs before it have left.
    let mut end = [T::zero(); N];
    for lane in 0..WIDTH {
        runs.over_one(&mut end, &std::array::from_fn(|level| ends[level].0[lane]));
        for (row, x) in ends.iter_mut().zip(&end) {
            row.0[lane] = *x;
        }
    }
    ends
}

/// The state after each run from its own start at zero: weights times samples.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn products<S: Simd, T: Scalar, const N: usize>(
    _: S,
    runs: &BlockRuns<T, N>,
    (measurement, derivative): Pair<'_, T>,
    ends: &mut [Row<T>; N],
) {
    let mut parts = [[T::Wide::<S>::neutral(); WIDTH]; N];
    for lane in 0..WIDTH {
        for start in [0, WIDTH] {
            let y = eight::<S, T>(&measurement[lane], start);
            let u = eight::<S, T>(&derivative[lane], start);
            for level in 0..N {
                let from_y = eight::<S, T>(&runs.from_measurement()[level], start) * y;
                let from_u = eight::<S, T>(&runs.from_input()[level], start) * u;
                parts[level][lane] = parts[level][lane] + (from_y + from_u);
            }
        }
    }
    for level in 0..N {
        ends[level] = Row(sums::<S, T>(parts[level]).to_array());
    }
}

/// Zeros from `SHIFT` on, then the first numbers of `x`.
#[inline(always)]
fn after_zeros<S: Simd, T: Scalar, const SHIFT: usize>(x: T::Wide<S>) -> T::Wide<S> {
    T::Wide::<S>::neutral().slide::<SHIFT>(x)
}

/// Filters a block that starts at `levels` and whose runs end at `ends` from zero. Level 0 goes to `out`; the tile keeps it
/// and, if `all` are wanted, the other levels. False if a level overflows.
pub(crate) fn replay<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    level: Level,
    (gains, runs): (&G, &BlockRuns<T, N>),
    (levels, ends): (&[T; N], &[Row<T>; N]),
    pair: Pair<'_, T>,
    (tile, all): (&mut Tile<T, N>, bool),
    out: &mut Columns<T>,
) -> bool {
    // One call for all of it: the pieces are short, and each call waits a little for the one before.
    let mut lanes = [Row([T::zero(); WIDTH]); N];
    dispatch!(level, simd => {
        starts(simd, runs, levels, ends, &mut lanes);
        turn_in(simd, pair.0.each_ref(), &mut tile.measurement);
        turn_in(simd, pair.1.each_ref(), &mut tile.derivative);
        steps(simd, tile, std::slice::from_ref(gains), &mut lanes, TILE, all);
        turn_out(simd, &tile.levels[0], out.each_mut());
    });
    lanes.iter().all(|row| are_finite(&row.0))
}

/// The state before each run.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn starts<S: Simd, T: Scalar, const N: usize>(
    _: S,
    runs: &BlockRuns<T, N>,
    levels: &[T; N],
    ends: &[Row<T>; N],
    lanes: &mut [Row<T>; N],
) {
    for row in 0..N {
        let mut x = after_zeros::<S, T, 7>(T::Wide::<S>::from_array(ends[row].0));
        for column in 0..N {
            x = x + T::Wide::<S>::from_array(runs.powers()[row][column]) * levels[column];
        }
        lanes[row] = Row(x.to_array());
    }
}

/// The eight sums of eight vectors, in an order that does not depend on the processor.
#[inline(always)]
fn sums<S: Simd, T: Scalar>(x: [T::Wide<S>; WIDTH]) -> T::Wide<S> {
    let even = folded::<S, T>(folded::<S, T>(x[0], x[4]), folded::<S, T>(x[2], x[6]));
    let odd = folded::<S, T>(folded::<S, T>(x[1], x[5]), folded::<S, T>(x[3], x[7]));
    folded::<S, T>(even, odd)
}

/// The first half of both plus the second half, the two by turns.
#[inline(always)]
fn folded<S: Simd, T: Scalar>(a: T::Wide<S>, b: T::Wide<S>) -> T::Wide<S> {
    a.zip_low(b) + a.zip_high(b)
}
