//! A block cut into shares of its channels, one for each worker.

use crate::arrays::Scalar;
use crate::batch::Block;
use numpy::ndarray::{ArrayView2, ArrayViewMut, Axis, Dimension};

/// The block's columns in shares of as many channels.
pub(crate) fn split_columns<T: Scalar>(
    block: Block<'_, T>,
    share: usize,
) -> impl Iterator<Item = Block<'_, T>> {
    let columns = Axis(1);
    let mut level0 = parts(block.level0, columns, share);
    let mut flags = parts(block.flags, columns, share);
    let mut levels = parts(block.levels, Axis(2), share);
    let steps = block.steps;
    let measurement = parts_of_view(block.measurement, share);
    let derivative = parts_of_view(block.derivative, share);
    measurement.into_iter().zip(derivative).map(move |(measurement, derivative)| Block {
        measurement,
        derivative,
        steps,
        level0: level0.next(),
        levels: levels.next(),
        flags: flags.next(),
    })
}

fn parts_of_view<T>(view: ArrayView2<'_, T>, share: usize) -> Vec<ArrayView2<'_, T>> {
    let mut rest = view;
    let mut parts = Vec::new();
    while rest.ncols() > share {
        let (left, right) = rest.split_at(Axis(1), share);
        parts.push(left);
        rest = right;
    }
    parts.push(rest);
    parts
}

fn parts<T, D: Dimension>(
    view: Option<ArrayViewMut<'_, T, D>>,
    axis: Axis,
    share: usize,
) -> std::vec::IntoIter<ArrayViewMut<'_, T, D>> {
    let mut parts = Vec::new();
    if let Some(mut rest) = view {
        while rest.len_of(axis) > share {
            let (left, right) = rest.split_at(axis, share);
            parts.push(left);
            rest = right;
        }
        parts.push(rest);
    }
    parts.into_iter()
}
