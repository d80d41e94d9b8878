//! Channels side by side: eight at once, each through the same operations as alone.

use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter, ROWS, Rows, Steps, follow, run, run_careful};
use crate::lanes::{Columns, Row, TILE, Tile, columns_of_zeros, to_columns, to_rows};
use crate::simd::{Level, WIDTH};
use compfilt_core::nalgebra::ComplexField;
use compfilt_core::{Discretise, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut2, ArrayViewMut3, Axis, Slice};

/// Runs some channels of a block, eight side by side; bit for bit what [`run`] does one at a time.
pub(crate) fn run_lanes<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    mut gains: D::Gains,
    channels: &mut [Channel<T, N>],
    mut block: Block<'_, T>,
) -> D::Gains {
    let rows = block.measurement.nrows();
    if channels.len() < 2 || rows < TILE {
        return run(filter, gains, channels, block);
    }
    let mut desk = Desk::new();
    let mut row_gains = Vec::new();
    let is_plain = |channel: &Channel<T, N>| channel.is_plain(filter);
    for start in (0..rows).step_by(ROWS) {
        let end = rows.min(start + ROWS);
        let (begin_gains, mut end_gains) = (gains, gains);
        let steady = gains_of_rows(filter, &mut end_gains, block.steps, start..end, &mut row_gains);
        for (group, eight) in channels.chunks_mut(WIDTH).enumerate() {
            let place = Place { first: group * WIDTH, start, end };
            let done = if steady {
                desk.run_plain(&is_plain, &row_gains, eight, &mut block, place)
            } else {
                [false; WIDTH]
            };
            for (lane, channel) in eight.iter_mut().enumerate().filter(|(lane, _)| !done[*lane]) {
                end_gains = begin_gains;
                let rows = Rows { channel: place.first + lane, start, end };
                run_careful(filter, &mut end_gains, channel, &mut block, rows);
            }
        }
        gains = end_gains;
    }
    gains
}

/// The gains of each row, once for all channels: one set if no step differs. False if a step starts anew.
fn gains_of_rows<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    gains: &mut D::Gains,
    steps: Steps<'_, T>,
    rows: std::ops::Range<usize>,
    row_gains: &mut Vec<D::Gains>,
) -> bool {
    row_gains.clear();
    let Steps::Each(steps) = steps else {
        row_gains.push(*gains);
        return true;
    };
    let steps = &steps[rows];
    if !steps.iter().all(ComplexField::is_finite) {
        return false;
    }
    for dt in steps {
        follow(filter, gains, *dt);
        row_gains.push(*gains);
    }
    true
}

/// Where a group of channels has its turn.
#[derive(Clone, Copy)]
struct Place {
    first: usize,
    start: usize,
    end: usize,
}

/// Where a group is worked on: a few kilobytes.
struct Desk<T, const N: usize> {
    level: Level,
    columns: Columns<T>,
    tile: Tile<T, N>,
}

impl<T: Scalar, const N: usize> Desk<T, N> {
    fn new() -> Self {
        Self { level: Level::new(), columns: columns_of_zeros(), tile: Tile::new() }
    }

    /// Filters the rows of up to eight channels as plain steps. Returns which of them that was true for; the others keep
    /// their states.
    fn run_plain<G: Recurrence<T, N>>(
        &mut self,
        is_plain: &dyn Fn(&Channel<T, N>) -> bool,
        gains: &[G],
        channels: &mut [Channel<T, N>],
        block: &mut Block<'_, T>,
        place: Place,
    ) -> [bool; WIDTH] {
        let mut plain = [false; WIDTH];
        let mut lanes = [Row([T::zero(); WIDTH]); N];
        for (lane, channel) in channels.iter().enumerate() {
            plain[lane] = is_plain(channel);
            if plain[lane] {
                for (row, x) in lanes.iter_mut().zip(&channel.state.levels.levels) {
                    row.0[lane] = *x;
                }
            }
        }
        if !plain.contains(&true) {
            return plain;
        }
        let Place { first, start, end } = place;
        let area = (Slice::from(start..end), Slice::from(first..first + channels.len()));
        let levels = block.levels.slice_axis_mut(Axis(1), area.0);
        self.steps(
            gains,
            &mut lanes,
            block.measurement.slice_axis(Axis(0), area.0).slice_axis_move(Axis(1), area.1),
            block.derivative.slice_axis(Axis(0), area.0).slice_axis_move(Axis(1), area.1),
            levels.slice_axis_move(Axis(2), area.1),
        );
        for (lane, channel) in channels.iter_mut().enumerate() {
            let end_levels = lanes.map(|row| row.0[lane]);
            let last = block.derivative[(end - 1, first + lane)];
            plain[lane] = plain[lane] && channel.take_plain(end_levels, last);
        }
        plain
    }

    /// Tile by tile.
    fn steps<G: Recurrence<T, N>>(
        &mut self,
        gains: &[G],
        lanes: &mut [Row<T>; N],
        measurement: ArrayView2<'_, T>,
        derivative: ArrayView2<'_, T>,
        mut levels: ArrayViewMut3<'_, T>,
    ) {
        let all = levels.len_of(Axis(0)) > 1;
        let tiles = measurement
            .axis_chunks_iter(Axis(0), TILE)
            .zip(derivative.axis_chunks_iter(Axis(0), TILE))
            .zip(levels.axis_chunks_iter_mut(Axis(1), TILE));
        let mut row = 0;
        for ((y, u), mut out) in tiles {
            let rows = y.nrows();
            read(self.level, &mut self.columns, y, &mut self.tile.measurement);
            read(self.level, &mut self.columns, u, &mut self.tile.derivative);
            let gains = gains.get(row..row + rows).unwrap_or(gains);
            self.tile.filter(self.level, gains, lanes, rows, all);
            for (out, tile) in out.outer_iter_mut().zip(&self.tile.levels) {
                write(self.level, tile, &mut self.columns, out);
            }
            row += rows;
        }
    }
}

/// A tile of an array at any strides; what lies beyond its rows and channels stays as it is.
fn read<T: Scalar>(
    level: Level,
    columns: &mut Columns<T>,
    source: ArrayView2<'_, T>,
    rows: &mut [Row<T>; TILE],
) {
    if source.strides()[1] == 1 {
        for (row, source) in rows.iter_mut().zip(source.outer_iter()) {
            copy(source.as_slice().unwrap_or_default(), &mut row.0);
        }
    } else if source.strides()[0] == 1 {
        for (column, source) in columns.iter_mut().zip(source.columns()) {
            copy(source.as_slice().unwrap_or_default(), column);
        }
        to_rows(level, columns, rows);
    } else {
        for (row, source) in rows.iter_mut().zip(source.outer_iter()) {
            for (to, from) in row.0.iter_mut().zip(source) {
                *to = *from;
            }
        }
    }
}

/// The way back.
fn write<T: Scalar>(
    level: Level,
    rows: &[Row<T>; TILE],
    columns: &mut Columns<T>,
    mut target: ArrayViewMut2<'_, T>,
) {
    if target.strides()[1] == 1 {
        for (row, mut target) in rows.iter().zip(target.outer_iter_mut()) {
            copy_part(&row.0, target.as_slice_mut().unwrap_or_default());
        }
    } else if target.strides()[0] == 1 {
        to_columns(level, rows, columns);
        for (column, mut target) in columns.iter().zip(target.columns_mut()) {
            copy_part(column, target.as_slice_mut().unwrap_or_default());
        }
    } else {
        for (row, target) in rows.iter().zip(target.outer_iter_mut()) {
            for (to, from) in target.into_iter().zip(&row.0) {
                *to = *from;
            }
        }
    }
}

/// Copies the whole length where it is there, at once, otherwise what is there.
#[inline(always)]
fn copy<T: Copy, const L: usize>(source: &[T], target: &mut [T; L]) {
    match source.first_chunk() {
        Some(whole) => *target = *whole,
        None => target[..source.len()].copy_from_slice(source),
    }
}

/// The same the other way round.
#[inline(always)]
fn copy_part<T: Copy, const L: usize>(source: &[T; L], target: &mut [T]) {
    match target.first_chunk_mut() {
        Some(whole) => *whole = *source,
        None => target.copy_from_slice(&source[..target.len()]),
    }
}
