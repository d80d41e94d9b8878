//! The arrays of one channel's chunk, block by block at any stride.

use crate::arrays::Scalar;
use crate::batch::Block;
use crate::prefetch::ask_for_all;
use crate::runs::{BLOCK, Signal};
use numpy::ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2, Axis};
use std::borrow::Cow;

/// Blocks of a chunk: what is missing in a chunk sends all of it the exact way.
pub(crate) const BLOCKS: usize = 32;

/// Samples of a chunk.
pub(crate) const CHUNK: usize = BLOCKS * BLOCK;

/// Both signals of a chunk, each in one piece: a copy where it is not.
pub(crate) struct Signals<'a, T: Clone>(Cow<'a, [T]>, Cow<'a, [T]>);

impl<'a, T: Scalar> Signals<'a, T> {
    pub(crate) fn of(chunk: &Block<'a, T>) -> Self {
        let [y, u] = [chunk.measurement, chunk.derivative].map(|view| {
            let samples = view.index_axis_move(Axis(1), 0);
            samples.to_slice().map_or_else(|| Cow::Owned(samples.to_vec()), Cow::Borrowed)
        });
        Self(y, u)
    }

    pub(crate) fn blocks(&self) -> impl Iterator<Item = (&Signal<T>, &Signal<T>)> {
        blocks_of(&self.0).iter().zip(blocks_of(&self.1))
    }
}

/// The channel's samples, if they lie in one piece.
fn piece<T>(view: ArrayView2<'_, T>) -> Option<&[T]> {
    view.index_axis_move(Axis(1), 0).to_slice()
}

/// What lies behind the signals of a chunk.
pub(crate) struct Later<'a, T>([Option<&'a [T]>; 2]);

impl<'a, T> Later<'a, T> {
    pub(crate) fn of(chunk: &Block<'a, T>) -> Self {
        Self([chunk.measurement, chunk.derivative].map(piece))
    }

    /// Asks for the memory of a block that begins `samples` behind the start of the chunk.
    pub(crate) fn ask_for(&self, samples: usize) {
        for signal in self.0.iter().flatten() {
            ask_for_all(signal, samples, BLOCK);
        }
    }
}

/// A level of a chunk, block by block: where it goes, or beside it if that is not in one piece.
struct Output<'a, T> {
    blocks: &'a mut [Signal<T>],
    strided: Option<ArrayViewMut1<'a, T>>,
}

impl<'a, T: Scalar> Output<'a, T> {
    fn of(level: ArrayViewMut2<'a, T>, beside: &'a mut [T]) -> Self {
        let mut level = level.index_axis_move(Axis(1), 0);
        if level.as_slice_mut().is_none() {
            return Self { blocks: blocks_of_mut(beside), strided: Some(level) };
        }
        Self { blocks: blocks_of_mut(level.into_slice().unwrap_or_default()), strided: None }
    }
}

/// Where the levels of a chunk go, as far as they are wanted.
pub(crate) struct Outputs<'a, T, const N: usize>([Option<Output<'a, T>>; N]);

impl<'a, T: Scalar, const N: usize> Outputs<'a, T, N> {
    /// `beside` has room for a chunk of each level if they do not lie in one piece.
    pub(crate) fn of(chunk: &'a mut Block<'_, T>, beside: &'a mut [T]) -> Self {
        let mut rooms = beside.chunks_mut(CHUNK);
        let mut levels = chunk.levels.outer_iter_mut();
        Self(std::array::from_fn(|_| {
            levels.next().map(|level| Output::of(level, rooms.next().unwrap_or_default()))
        }))
    }

    /// Whether more than level 0 is wanted.
    pub(crate) fn want_all(&self) -> bool {
        matches!(self.0.get(1), Some(Some(_)))
    }

    /// Asks for the memory of a block.
    pub(crate) fn ask_for(&self, number: usize) {
        for output in self.0.iter().flatten() {
            let samples = output.blocks.as_flattened().as_flattened().as_flattened();
            ask_for_all(samples, number * BLOCK, BLOCK);
        }
    }

    /// A block of each level that is wanted.
    pub(crate) fn block(&mut self, number: usize) -> impl Iterator<Item = &mut Signal<T>> {
        self.0.iter_mut().flatten().filter_map(move |output| output.blocks.get_mut(number))
    }

    /// Writes what is beside its place.
    pub(crate) fn put(&mut self) {
        for output in self.0.iter_mut().flatten() {
            let Output { blocks, strided: Some(strided) } = output else { continue };
            let samples = blocks.as_flattened().as_flattened().as_flattened();
            strided.iter_mut().zip(samples).for_each(|(to, from)| *to = *from);
        }
    }
}

/// Whether the levels of a block lie in one piece each.
pub(crate) fn lie_in_one_piece<T>(block: &Block<'_, T>) -> bool {
    block.levels.strides()[1] == 1
}

fn blocks_of<T>(signal: &[T]) -> &[Signal<T>] {
    signal.as_chunks().0.as_chunks().0.as_chunks().0
}

fn blocks_of_mut<T>(signal: &mut [T]) -> &mut [Signal<T>] {
    signal.as_chunks_mut().0.as_chunks_mut().0.as_chunks_mut().0
}
