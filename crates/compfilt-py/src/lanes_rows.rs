//! Channels that lie side by side, from memory to memory as it comes, where level 0 alone is wanted.

use crate::arrays::Scalar;
use crate::lanes::{Row, keep, states, stepped};
use crate::simd::{Level, Simd, WIDTH, dispatch};
use compfilt_core::Recurrence;
use numpy::ndarray::{ArrayView2, ArrayViewMut2};

/// Steps through rows of numbers that lie side by side, eight of them for each state, with one set of gains for all rows or one
/// for each. If there are more than eight and no multiple of that, the last state is that of the last eight, some of which the
/// state before has too: both come to the same.
///
/// States of up to sixteen numbers stay in registers. Those of more stay in the nearest cache, from where they are back before
/// their next turn.
pub(crate) fn filter_rows<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    level: Level,
    gains: &[G],
    lanes: &mut [[Row<T>; N]],
    signals: (ArrayView2<'_, T>, ArrayView2<'_, T>),
    out: ArrayViewMut2<'_, T>,
) {
    match lanes {
        [lanes] => match out.ncols() {
            8.. => dispatch!(level, simd => eight(simd, gains, lanes, signals, out)),
            4.. => dispatch!(level, simd => few::<_, T, G, N, 4>(simd, gains, lanes, signals, out)),
            _ => dispatch!(level, simd => few::<_, T, G, N, 2>(simd, gains, lanes, signals, out)),
        },
        [first, last] => {
            dispatch!(level, simd => sixteen(simd, gains, [first, last], signals, out));
        }
        lanes => dispatch!(level, simd => many(simd, gains, lanes, signals, out)),
    }
}

#[inline(always)]
fn eight<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
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
        *out = stepped::<S, T, G, N>(&gains[row * stride], &mut state, (y, u));
    }
    keep::<S, T, N>(&state, lanes);
}

/// Rows of fewer than eight numbers, but no fewer than `HALF`.
#[inline(always)]
fn few<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize, const HALF: usize>(
    _: S,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    (measurement, derivative): (ArrayView2<'_, T>, ArrayView2<'_, T>),
    mut out: ArrayViewMut2<'_, T>,
) {
    let columns = out.ncols();
    let mut halves = lanes.map(|row| Row(spread::<T, HALF>(&row.0[..columns])));
    let mut state = states::<S, T, N>(&halves);
    let stride = usize::from(gains.len() > 1);
    let signals = measurement.outer_iter().zip(derivative.outer_iter());
    for (row, (mut out, (y, u))) in out.outer_iter_mut().zip(signals).enumerate() {
        let (Some(y), Some(u), Some(out)) = (y.to_slice(), u.to_slice(), out.as_slice_mut()) else {
            break;
        };
        let signals = (&spread::<T, HALF>(y), &spread::<T, HALF>(u));
        let x = stepped::<S, T, G, N>(&gains[row * stride], &mut state, signals);
        join::<T, HALF>(&x, out);
    }
    keep::<S, T, N>(&state, &mut halves);
    for (row, halves) in lanes.iter_mut().zip(&halves) {
        join::<T, HALF>(&halves.0, &mut row.0[..columns]);
    }
}

/// The first and the last numbers of a row, some of which are the same: two copies of known length. One of unknown length takes
/// longer than a step of a filter.
#[inline(always)]
fn spread<T: Scalar, const HALF: usize>(row: &[T]) -> [T; WIDTH] {
    let mut numbers = [T::zero(); WIDTH];
    if let (Some(first), Some(last)) = (row.first_chunk::<HALF>(), row.last_chunk::<HALF>()) {
        numbers[..HALF].copy_from_slice(first);
        numbers[HALF..2 * HALF].copy_from_slice(last);
    }
    numbers
}

/// Puts them back into their row.
#[inline(always)]
fn join<T: Scalar, const HALF: usize>(numbers: &[T; WIDTH], row: &mut [T]) {
    if let Some(first) = row.first_chunk_mut::<HALF>() {
        first.copy_from_slice(&numbers[..HALF]);
    }
    if let Some(last) = row.last_chunk_mut::<HALF>() {
        last.copy_from_slice(&numbers[HALF..2 * HALF]);
    }
}

#[inline(always)]
fn sixteen<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    gains: &[G],
    [first, last]: [&mut [Row<T>; N]; 2],
    (measurement, derivative): (ArrayView2<'_, T>, ArrayView2<'_, T>),
    mut out: ArrayViewMut2<'_, T>,
) {
    let mut state = states::<S, T, N>(first);
    let mut last_state = states::<S, T, N>(last);
    let stride = usize::from(gains.len() > 1);
    let signals = measurement.outer_iter().zip(derivative.outer_iter());
    for (row, (mut out, (y, u))) in out.outer_iter_mut().zip(signals).enumerate() {
        let (Some(y), Some(u), Some(out)) = (y.to_slice(), u.to_slice(), out.as_slice_mut()) else {
            break;
        };
        let gains = &gains[row * stride];
        if let (Some(y), Some(u), Some(out)) =
            (y.first_chunk(), u.first_chunk(), out.first_chunk_mut())
        {
            *out = stepped::<S, T, G, N>(gains, &mut state, (y, u));
        }
        if let (Some(y), Some(u), Some(out)) =
            (y.last_chunk(), u.last_chunk(), out.last_chunk_mut())
        {
            *out = stepped::<S, T, G, N>(gains, &mut last_state, (y, u));
        }
    }
    keep::<S, T, N>(&state, first);
    keep::<S, T, N>(&last_state, last);
}

#[inline(always)]
fn many<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
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
            *out = through_memory::<S, T, G, N>(gains, lanes, (y, u));
        }
        if out.len() % WIDTH > 0
            && let (Some(lanes), Some(y), Some(u), Some(out)) =
                (lanes.last_mut(), y.last_chunk(), u.last_chunk(), out.last_chunk_mut())
        {
            *out = through_memory::<S, T, G, N>(gains, lanes, (y, u));
        }
    }
}

#[inline(always)]
fn through_memory<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    gains: &G,
    lanes: &mut [Row<T>; N],
    signals: (&[T; WIDTH], &[T; WIDTH]),
) -> [T; WIDTH] {
    let mut state = states::<S, T, N>(lanes);
    let x = stepped::<S, T, G, N>(gains, &mut state, signals);
    keep::<S, T, N>(&state, lanes);
    x
}
