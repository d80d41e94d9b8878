//! The arrays of one channel's chunk, block by block at any stride.

use crate::arrays::Scalar;
use crate::batch::Block;
use crate::prefetch::ask_for_all;
use crate::runs::{BLOCK, RUN, Signal, TILES};
use crate::simd::WIDTH;
use numpy::ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2, Axis, Slice};
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

/// Where a level of a chunk goes.
enum Output<'a, T> {
    Piece(&'a mut [Signal<T>]),
    Strided(ArrayViewMut1<'a, T>),
}

impl<'a, T: Scalar> Output<'a, T> {
    fn of(level: ArrayViewMut2<'a, T>) -> Self {
        let mut level = level.index_axis_move(Axis(1), 0);
        if level.as_slice_mut().is_none() {
            return Self::Strided(level);
        }
        let samples = level.into_slice().unwrap_or_default();
        Self::Piece(samples.as_chunks_mut().0.as_chunks_mut().0.as_chunks_mut().0)
    }
}

/// Where the levels of a chunk go, as far as they are wanted.
pub(crate) struct Outputs<'a, T, const N: usize>([Option<Output<'a, T>>; N]);

impl<'a, T: Scalar, const N: usize> Outputs<'a, T, N> {
    pub(crate) fn of(chunk: &'a mut Block<'_, T>) -> Self {
        let mut levels = chunk.levels.outer_iter_mut().map(Output::of);
        Self(std::array::from_fn(|_| levels.next()))
    }

    /// Whether more than level 0 is wanted.
    pub(crate) fn want_all(&self) -> bool {
        matches!(self.0.get(1), Some(Some(_)))
    }

    /// Asks for the memory of a block.
    pub(crate) fn ask_for(&self, number: usize) {
        for output in self.0.iter().flatten() {
            if let Output::Piece(blocks) = output {
                ask_for_all(
                    blocks.as_flattened().as_flattened().as_flattened(),
                    number * BLOCK,
                    BLOCK,
                );
            }
        }
    }

    /// Lets a block of level 0 be written.
    pub(crate) fn write(&mut self, number: usize, write: impl FnOnce(&mut Signal<T>)) {
        match &mut self.0[0] {
            Some(Output::Piece(blocks)) => write(&mut blocks[number]),
            Some(Output::Strided(samples)) => {
                let mut block = zeros();
                write(&mut block);
                put(samples, number, &block);
            }
            None => {}
        }
    }

    /// Writes a block of the levels above.
    pub(crate) fn put_above(&mut self, number: usize, levels: &[Signal<T>; N]) {
        for (output, level) in self.0.iter_mut().zip(levels).skip(1) {
            match output {
                Some(Output::Piece(blocks)) => blocks[number] = *level,
                Some(Output::Strided(samples)) => put(samples, number, level),
                None => {}
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
            match output {
                Some(Output::Piece(blocks)) => is_finite &= change(level, &mut blocks[number]),
                Some(Output::Strided(samples)) => {
                    let mut block = zeros();
                    let rows = samples.slice_axis(Axis(0), Slice::from(rows(number)));
                    let values = block.as_flattened_mut().as_flattened_mut();
                    values.iter_mut().zip(rows).for_each(|(to, from)| *to = *from);
                    is_finite &= change(level, &mut block);
                    put(samples, number, &block);
                }
                None => break,
            }
        }
        is_finite
    }
}

fn zeros<T: Scalar>() -> Signal<T> {
    [[[T::zero(); RUN]; WIDTH]; TILES]
}

fn rows(number: usize) -> Range<usize> {
    number * BLOCK..(number + 1) * BLOCK
}

/// Writes a block at any stride.
fn put<T: Scalar>(samples: &mut ArrayViewMut1<'_, T>, number: usize, block: &Signal<T>) {
    let rows = samples.slice_axis_mut(Axis(0), Slice::from(rows(number)));
    for (to, from) in rows.into_iter().zip(block.as_flattened().as_flattened()) {
        *to = *from;
    }
}

fn blocks_of<T>(signal: &[T]) -> &[Signal<T>] {
    signal.as_chunks().0.as_chunks().0.as_chunks().0
}
