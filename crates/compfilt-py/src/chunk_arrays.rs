//! The arrays of one channel's chunk, block by block at any stride.

use crate::arrays::Scalar;
use crate::batch::Block;
use crate::prefetch::ask_for_all;
use crate::runs::{BLOCK, RUN, Signal, TILES};
use crate::simd::WIDTH;
use numpy::ndarray::{ArrayView2, ArrayViewMut1, Axis, Slice};
use std::borrow::Cow;
use std::ops::Range;

/// Both signals of a chunk, each in one piece: a copy where it is not.
pub(crate) struct Signals<'a, T: Clone>(Cow<'a, [T]>, Cow<'a, [T]>);

impl<'a, T: Scalar> Signals<'a, T> {
    pub(crate) fn of(chunk: &Block<'a, T>) -> Self {
        let [y, u] = [chunk.measurement, chunk.derivative].map(|view| {
            piece(view).map_or_else(|| Cow::Owned(view.iter().copied().collect()), Cow::Borrowed)
        });
        Self(y, u)
    }

    pub(crate) fn blocks(&self) -> impl Iterator<Item = (&Signal<T>, &Signal<T>)> {
        blocks_of(&self.0).iter().zip(blocks_of(&self.1))
    }
}

/// The channel's samples, if they lie in one piece.
fn piece<'a, T>(view: ArrayView2<'a, T>) -> Option<&'a [T]> {
    view.index_axis_move(Axis(1), 0).to_slice()
}

/// Asks for the memory of a block of both signals that begins at `start` and may lie behind the chunk.
pub(crate) fn ask_for_signals<T>(chunk: &Block<'_, T>, start: usize) {
    for signal in [chunk.measurement, chunk.derivative].into_iter().filter_map(piece) {
        ask_for_all(signal, start, BLOCK);
    }
}

/// Where the levels of a chunk go, as far as they are wanted.
pub(crate) struct Outputs<'a, T, const N: usize>([Option<ArrayViewMut1<'a, T>>; N]);

impl<'a, T: Scalar, const N: usize> Outputs<'a, T, N> {
    pub(crate) fn of(chunk: &'a mut Block<'_, T>) -> Self {
        let mut levels = chunk.levels.outer_iter_mut();
        Self(std::array::from_fn(|_| levels.next().map(|level| level.index_axis_move(Axis(1), 0))))
    }

    /// Whether more than level 0 is wanted.
    pub(crate) fn want_all(&self) -> bool {
        self.0.iter().skip(1).any(Option::is_some)
    }

    /// Asks for the memory of a block.
    pub(crate) fn ask_for(&self, number: usize) {
        for output in self.0.iter().flatten().filter_map(|output| output.as_slice()) {
            ask_for_all(output, number * BLOCK, BLOCK);
        }
    }

    /// Lets a block of level 0 be written.
    pub(crate) fn write(&mut self, number: usize, write: impl FnOnce(&mut Signal<T>)) {
        let Some(Some(output)) = self.0.first_mut() else { return };
        if let Some(out) = block_in_place(output, number) {
            return write(out);
        }
        let mut out = [[[T::zero(); RUN]; WIDTH]; TILES];
        write(&mut out);
        put(output, number, &out);
    }

    /// Writes a block of the levels above.
    pub(crate) fn put_above(&mut self, number: usize, levels: &[Signal<T>; N]) {
        for (output, level) in self.0.iter_mut().zip(levels).skip(1) {
            if let Some(output) = output {
                put(output, number, level);
            }
        }
    }

    /// Lets a block of every level be changed. False if one of them is not finite.
    pub(crate) fn change(
        &mut self,
        number: usize,
        mut change: impl FnMut(usize, &mut Signal<T>) -> bool,
    ) -> bool {
        let mut is_finite = true;
        for (level, output) in self.0.iter_mut().enumerate() {
            let Some(output) = output else { continue };
            if let Some(out) = block_in_place(output, number) {
                is_finite &= change(level, out);
                continue;
            }
            let mut out = [[[T::zero(); RUN]; WIDTH]; TILES];
            let rows = output.slice_axis(Axis(0), Slice::from(rows(number)));
            for (to, from) in out.as_flattened_mut().as_flattened_mut().iter_mut().zip(rows) {
                *to = *from;
            }
            is_finite &= change(level, &mut out);
            put(output, number, &out);
        }
        is_finite
    }
}

fn rows(number: usize) -> Range<usize> {
    number * BLOCK..(number + 1) * BLOCK
}

/// A block of an output that lies in one piece.
fn block_in_place<'a, T>(
    output: &'a mut ArrayViewMut1<'_, T>,
    number: usize,
) -> Option<&'a mut Signal<T>> {
    let samples = output.as_slice_mut()?.get_mut(rows(number))?;
    samples.as_chunks_mut().0.as_chunks_mut().0.as_chunks_mut().0.first_mut()
}

/// Writes a block at any stride.
fn put<T: Scalar>(output: &mut ArrayViewMut1<'_, T>, number: usize, block: &Signal<T>) {
    let rows = output.slice_axis_mut(Axis(0), Slice::from(rows(number)));
    for (to, from) in rows.into_iter().zip(block.as_flattened().as_flattened()) {
        *to = *from;
    }
}

fn blocks_of<T>(signal: &[T]) -> &[Signal<T>] {
    signal.as_chunks().0.as_chunks().0.as_chunks().0
}
