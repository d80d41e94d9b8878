//! A block cut into shares of its channels, one for each worker.

use crate::arrays::Scalar;
use crate::batch::{Block, Steps};
use crate::simd::WIDTH;
use compfilt_core::nalgebra::ComplexField;
use numpy::ndarray::{ArrayView2, ArrayViewMut, Axis, Dimension};
use std::num::NonZeroUsize;
use std::sync::OnceLock;

/// More threads than cores would only wait for each other. Counting the cores takes as long as thousands of samples, so
/// that one worker does not.
pub(crate) fn at_most_cores(workers: NonZeroUsize) -> NonZeroUsize {
    static CORES: OnceLock<NonZeroUsize> = OnceLock::new();
    if workers == NonZeroUsize::MIN {
        return workers;
    }
    let count = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    workers.min(*CORES.get_or_init(count))
}

/// How many channels a worker takes: whole groups of those that run side by side.
pub(crate) fn share(channels: usize, workers: NonZeroUsize) -> usize {
    channels.div_ceil(WIDTH).div_ceil(workers.get()).max(1) * WIDTH
}

/// The least channels that a worker takes of a block whose rows are filtered as memory has them. One core reads and writes nearly as
/// much as two, and parts of rows take longer: half of 64 channels each took two workers twice the time of one.
pub(crate) const IN_ORDER: usize = 1024;

/// Whether few samples are missing, as far as some rows tell.
pub(crate) fn seems_complete<T: Scalar>(block: &Block<'_, T>) -> bool {
    const LOOKS: usize = 16;
    let rows = block.measurement.nrows();
    let step = rows.div_ceil(LOOKS).max(1);
    [block.measurement, block.derivative].iter().all(|signal| {
        let mut rows = (0..rows).step_by(step);
        rows.all(|row| signal.row(row).iter().all(ComplexField::is_finite))
    })
}

/// The block's first rows and the others.
pub(crate) fn split_rows<T: Scalar>(
    block: Block<'_, T>,
    rows: usize,
) -> (Block<'_, T>, Block<'_, T>) {
    let samples = Axis(0);
    let (measurement, later_measurement) = block.measurement.split_at(samples, rows);
    let (derivative, later_derivative) = block.derivative.split_at(samples, rows);
    let (levels, later_levels) = block.levels.split_at(Axis(1), rows);
    let (flags, later_flags) = block.flags.map(|flags| flags.split_at(samples, rows)).unzip();
    let (steps, later_steps) = match block.steps {
        Steps::Uniform => (Steps::Uniform, Steps::Uniform),
        Steps::Each(steps) => {
            let (steps, later) = steps.split_at(rows);
            (Steps::Each(steps), Steps::Each(later))
        }
    };
    let later = Block {
        measurement: later_measurement,
        derivative: later_derivative,
        steps: later_steps,
        levels: later_levels,
        flags: later_flags,
    };
    (Block { measurement, derivative, steps, levels, flags }, later)
}

/// The block's columns in shares of as many channels.
pub(crate) fn split_columns<T: Scalar>(
    block: Block<'_, T>,
    share: usize,
) -> impl Iterator<Item = Block<'_, T>> {
    let columns = Axis(1);
    let mut flags = parts(block.flags, columns, share);
    let mut levels = parts(Some(block.levels), Axis(2), share);
    let steps = block.steps;
    let measurement = parts_of_view(block.measurement, share);
    let derivative = parts_of_view(block.derivative, share);
    measurement.into_iter().zip(derivative).map_while(move |(measurement, derivative)| {
        let levels = levels.next()?;
        Some(Block { measurement, derivative, steps, levels, flags: flags.next() })
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
