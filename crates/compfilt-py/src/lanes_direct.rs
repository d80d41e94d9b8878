//! Channels from memory to memory, where level 0 alone is wanted: what lies between a tile and its channels is copies.

use crate::arrays::Scalar;
use crate::lanes::{Row, keep, states, transposed};
use crate::prefetch::{LINE, ask_for};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::Recurrence;
use numpy::ndarray::{ArrayView2, ArrayViewMut2};

/// Steps through rows of eight or more numbers that lie side by side, eight of them for each state, with one set of gains for all
/// rows or one for each. If they are no multiple of eight the last state is that of the last eight, some of which the state before
/// has too: both come to the same. Memory comes in order; the states stay in the nearest cache, or in registers where there is one.
pub(crate) fn filter_rows<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    level: Level,
    gains: &[G],
    lanes: &mut [[Row<T>; N]],
    signals: (ArrayView2<'_, T>, ArrayView2<'_, T>),
    out: ArrayViewMut2<'_, T>,
) {
    match lanes {
        [lanes] => dispatch!(level, simd => rows_of_eight(simd, gains, lanes, signals, out)),
        lanes => dispatch!(level, simd => rows(simd, gains, lanes, signals, out)),
    }
}

#[inline(always)]
fn rows_of_eight<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    (measurement, derivative): (ArrayView2<'_, T>, ArrayView2<'_, T>),
    mut out: ArrayViewMut2<'_, T>,
) {
    let mut state = states::<S, T, N>(lanes);
    let stride = usize::from(gains.len() > 1);
    let signals = measurement.outer_iter().zip(derivative.outer_iter());
    for (row, (mut out, (y, u))) in out.outer_iter_mut().zip(signals).enumerate() {
        let (Some(y), Some(u), Some(out)) = (
            y.to_slice().and_then(<[T]>::first_chunk),
            u.to_slice().and_then(<[T]>::first_chunk),
            out.as_slice_mut().and_then(<[T]>::first_chunk_mut),
        ) else {
            break;
        };
        let (y, u) = (T::Wide::<S>::from_array(*y), T::Wide::<S>::from_array(*u));
        *out = gains[row * stride].step(&mut state, y, u).to_array();
    }
    keep::<S, T, N>(&state, lanes);
}

#[inline(always)]
fn rows<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &[G],
    lanes: &mut [[Row<T>; N]],
    (measurement, derivative): (ArrayView2<'_, T>, ArrayView2<'_, T>),
    mut out: ArrayViewMut2<'_, T>,
) {
    let stride = usize::from(gains.len() > 1);
    let signals = measurement.outer_iter().zip(derivative.outer_iter());
    for (row, (mut out, (y, u))) in out.outer_iter_mut().zip(signals).enumerate() {
        let (Some(y), Some(u), Some(out)) = (y.to_slice(), u.to_slice(), out.as_slice_mut()) else {
            break;
        };
        let gains = &gains[row * stride];
        let signals = y.as_chunks().0.iter().zip(u.as_chunks().0);
        for ((lanes, out), (y, u)) in lanes.iter_mut().zip(out.as_chunks_mut().0).zip(signals) {
            eight::<S, T, G, N>(gains, lanes, (y, u), out);
        }
        if out.len() % WIDTH > 0
            && let (Some(lanes), Some(y), Some(u), Some(out)) =
                (lanes.last_mut(), y.last_chunk(), u.last_chunk(), out.last_chunk_mut())
        {
            eight::<S, T, G, N>(gains, lanes, (y, u), out);
        }
    }
}

#[inline(always)]
fn eight<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    gains: &G,
    lanes: &mut [Row<T>; N],
    (y, u): (&[T; WIDTH], &[T; WIDTH]),
    out: &mut [T; WIDTH],
) {
    let mut state = states::<S, T, N>(lanes);
    let (y, u) = (T::Wide::<S>::from_array(*y), T::Wide::<S>::from_array(*u));
    *out = gains.step(&mut state, y, u).to_array();
    keep::<S, T, N>(&state, lanes);
}

/// Lines of memory that are asked for ahead in every channel: 24 streams are more than a processor fetches ahead by itself.
const LINES_AHEAD: usize = 32;

/// Steps through the first `rows` of channels that lie in one piece each, eight rows at a time in registers, and returns how many
/// rows that were: the last few are left.
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

/// Eight rows of eight channels.
#[inline(always)]
fn square<S: Simd, T: Scalar>(columns: &[&[T]; WIDTH], start: usize) -> [T::Wide<S>; WIDTH] {
    let mut square = [T::Wide::<S>::from_array([T::zero(); WIDTH]); WIDTH];
    for (wide, column) in square.iter_mut().zip(columns) {
        let mut values = [T::zero(); WIDTH];
        values.copy_from_slice(&column[start..start + WIDTH]);
        *wide = T::Wide::<S>::from_array(values);
    }
    transposed::<S, T>(square)
}
