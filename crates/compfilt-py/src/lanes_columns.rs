//! Eight channels that lie in one piece each, from memory through registers to memory, where level 0 alone is wanted.

use crate::arrays::Scalar;
use crate::lanes::{Row, keep, square, states, transposed};
use crate::prefetch::{LINE, ask_for};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::Recurrence;

/// Lines of memory that are asked for ahead in every channel: 24 streams are more than a processor fetches ahead by itself.
const LINES_AHEAD: usize = 32;

/// Steps through the first `rows` of the channels, eight rows at a time, and returns how many rows that were: the last few are left.
pub(crate) fn filter_columns<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    level: Level,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    signals: ([&[T]; WIDTH], [&[T]; WIDTH]),
    out: &mut [&mut [T]; WIDTH],
    rows: usize,
) -> usize {
    let rows = rows / WIDTH * WIDTH;
    dispatch!(level, simd => columns(simd, gains, lanes, signals, out, rows));
    rows
}

#[inline(always)]
fn columns<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    (measurement, derivative): ([&[T]; WIDTH], [&[T]; WIDTH]),
    out: &mut [&mut [T]; WIDTH],
    rows: usize,
) {
    let measurement = measurement.map(|column| &column[..rows]);
    let derivative = derivative.map(|column| &column[..rows]);
    let mut out = out.each_mut().map(|column| &mut column[..rows]);
    let mut state = states::<S, T, N>(lanes);
    let stride = usize::from(gains.len() > 1);
    for start in (0..rows).step_by(WIDTH) {
        let later = start + LINES_AHEAD * LINE / size_of::<T>();
        for column in 0..WIDTH {
            ask_for(measurement[column], later);
            ask_for(derivative[column], later);
            ask_for(out[column], later);
        }
        let y = square::<S, T>(&measurement, start);
        let u = square::<S, T>(&derivative, start);
        let mut x = y;
        for row in 0..WIDTH {
            x[row] = gains[(start + row) * stride].step(&mut state, y[row], u[row]);
        }
        for (column, x) in out.iter_mut().zip(transposed::<S, T>(x)) {
            column[start..start + WIDTH].copy_from_slice(&x.to_array());
        }
    }
    keep::<S, T, N>(&state, lanes);
}
