//! Eight channels from memory to memory, where level 0 alone is wanted: what lies between a tile and its channels is copies.

use crate::arrays::Scalar;
use crate::lanes::{Row, keep, states, transposed};
use crate::prefetch::{LINE, ask_for};
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::Recurrence;
use numpy::ndarray::{ArrayView2, ArrayViewMut2};

/// Steps through rows of eight numbers that lie side by side, with one set of gains for all rows or one for each. Returns how
/// many rows that were: none if they are narrower.
pub(crate) fn filter_rows<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    level: Level,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    signals: (ArrayView2<'_, T>, ArrayView2<'_, T>),
    out: &mut ArrayViewMut2<'_, T>,
) -> usize {
    if out.ncols() != WIDTH {
        return 0;
    }
    dispatch!(level, simd => rows(simd, gains, lanes, signals, out));
    out.nrows()
}

#[inline(always)]
fn rows<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    (measurement, derivative): (ArrayView2<'_, T>, ArrayView2<'_, T>),
    out: &mut ArrayViewMut2<'_, T>,
) {
    let mut state = states::<S, T, N>(lanes);
    let stride = usize::from(gains.len() > 1);
    // Eight of many channels are a line here and a line there: the same lines of the next turn are asked for.
    let is_wide = out.strides()[0].unsigned_abs() > WIDTH;
    let later = [measurement.strides(), derivative.strides(), out.strides()]
        .map(|strides| strides[0].unsigned_abs() * out.nrows());
    let signals = measurement.outer_iter().zip(derivative.outer_iter());
    for (row, (mut out, (y, u))) in out.outer_iter_mut().zip(signals).enumerate() {
        let (Some(y), Some(u), Some(out)) = (
            y.to_slice().and_then(<[T]>::first_chunk),
            u.to_slice().and_then(<[T]>::first_chunk),
            out.as_slice_mut().and_then(<[T]>::first_chunk_mut),
        ) else {
            return;
        };
        if is_wide {
            ask_for(y, later[0]);
            ask_for(u, later[1]);
            ask_for(out, later[2]);
        }
        let (y, u) = (T::Wide::<S>::from_array(*y), T::Wide::<S>::from_array(*u));
        *out = gains[row * stride].step(&mut state, y, u).to_array();
    }
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
