//! Channels side by side: eight at once, each through the same operations as alone.

use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter, Rows, Steps, follow, run, run_careful, turns};
use crate::lanes::{Row, TILE, Tile, are_finite};
use crate::lanes_columns::filter_columns;
use crate::lanes_rows::filter_rows;
use crate::layout::{Source, Target, turn_of};
use crate::simd::{Level, WIDTH};
use compfilt_core::{Discretise, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut3, Axis, Slice};

/// Runs some channels of a block, eight side by side; bit for bit what [`run`] does one at a time.
pub(crate) fn run_lanes<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    mut gains: D::Gains,
    channels: &mut [Channel<T, N>],
    mut block: Block<'_, T>,
) -> D::Gains {
    let rows = block.measurement.nrows();
    let all = block.wants_all();
    // Two channels would fill a quarter of the registers: one after the other they take less time, unless rows lie in order.
    let least = if block.lies_in_rows() && !all { 2 } else { 3 };
    if channels.len() < least || rows < TILE {
        return run(filter, gains, channels, block);
    }
    let mut desk = Desk::new();
    let mut row_gains = Vec::new();
    let is_plain = |channel: &Channel<T, N>| channel.is_plain(filter);
    let wait = channels.iter().any(|channel| !channel.state.started);
    for (start, end) in turns(rows, turn_of(block.measurement, all), wait) {
        let (begin_gains, mut end_gains) = (gains, gains);
        let steady = gains_of_rows(filter, &mut end_gains, block.steps, start..end, &mut row_gains);
        for (number, channels) in channels.chunks_mut(SIDE_BY_SIDE).enumerate() {
            let place = Place { first: number * SIDE_BY_SIDE, start, end };
            if steady {
                desk.run_plain(&is_plain, &row_gains, channels, &mut block, place);
            } else {
                desk.plain = [false; SIDE_BY_SIDE];
            }
            for (column, channel) in channels.iter_mut().enumerate() {
                if !desk.plain[column] {
                    end_gains = begin_gains;
                    let rows = Rows { channel: place.first + column, start, end };
                    run_careful(filter, &mut end_gains, channel, &mut block, rows);
                }
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
    if !are_finite(steps) {
        return false;
    }
    for dt in steps {
        follow(filter, gains, *dt);
        row_gains.push(*gains);
    }
    true
}

/// Channels whose states stay in the nearest cache while memory is read row by row.
const SIDE_BY_SIDE: usize = 2048;

/// Where some channels have their turn.
#[derive(Clone, Copy)]
struct Place {
    first: usize,
    start: usize,
    end: usize,
}

/// Where channels are worked on: a few kilobytes.
struct Desk<T, const N: usize> {
    level: Level,
    tile: Tile<T, N>,
    /// The states of eight channels each.
    lanes: Vec<[Row<T>; N]>,
    /// Which channels went through plain steps.
    plain: [bool; SIDE_BY_SIDE],
}

impl<T: Scalar, const N: usize> Desk<T, N> {
    fn new() -> Self {
        Self {
            level: Level::new(),
            tile: Tile::new(),
            lanes: Vec::new(),
            plain: [false; SIDE_BY_SIDE],
        }
    }

    /// Filters the rows of some channels as plain steps, and notes which of them that was true for; the others keep their states.
    fn run_plain<G: Recurrence<T, N>>(
        &mut self,
        is_plain: &dyn Fn(&Channel<T, N>) -> bool,
        gains: &[G],
        channels: &mut [Channel<T, N>],
        block: &mut Block<'_, T>,
        place: Place,
    ) {
        for (plain, channel) in self.plain.iter_mut().zip(&*channels) {
            *plain = is_plain(channel);
        }
        if !self.plain[..channels.len()].contains(&true) {
            return;
        }
        let in_rows = channels.len() > 1 && block.lies_in_rows() && !block.wants_all();
        let Place { first, start, end } = place;
        let area = (Slice::from(start..end), Slice::from(first..first + channels.len()));
        let measurement =
            block.measurement.slice_axis(Axis(0), area.0).slice_axis_move(Axis(1), area.1);
        let derivative =
            block.derivative.slice_axis(Axis(0), area.0).slice_axis_move(Axis(1), area.1);
        let levels = block.levels.slice_axis_mut(Axis(1), area.0).slice_axis_move(Axis(2), area.1);
        let columns = channels.len();
        // In rows, the last eight of more are eight, even if they are not all new.
        let last_first = if in_rows { columns.saturating_sub(WIDTH) } else { columns };
        let first_of = |group: usize| last_first.min(group * WIDTH);
        self.lanes.clear();
        for group in 0..columns.div_ceil(WIDTH) {
            let mut lanes = [Row([T::zero(); WIDTH]); N];
            for (lane, channel) in channels[first_of(group)..].iter().take(WIDTH).enumerate() {
                for (row, x) in lanes.iter_mut().zip(&channel.state.levels.levels) {
                    row.0[lane] = *x;
                }
            }
            self.lanes.push(lanes);
        }
        if in_rows {
            let out = levels.index_axis_move(Axis(0), 0);
            filter_rows(self.level, gains, &mut self.lanes, (measurement, derivative), out);
        } else {
            self.by_eight(gains, measurement, derivative, levels);
        }
        for (column, (channel, plain)) in channels.iter_mut().zip(&mut self.plain).enumerate() {
            let group = column / WIDTH;
            let end_levels = self.lanes[group].map(|row| row.0[column - first_of(group)]);
            let last = block.derivative[(end - 1, first + column)];
            *plain = *plain && channel.take_plain(end_levels, last);
        }
    }

    fn by_eight<G: Recurrence<T, N>>(
        &mut self,
        gains: &[G],
        measurement: ArrayView2<'_, T>,
        derivative: ArrayView2<'_, T>,
        mut levels: ArrayViewMut3<'_, T>,
    ) {
        let columns = measurement.ncols();
        for number in 0..columns.div_ceil(WIDTH) {
            let area = Slice::from(number * WIDTH..columns.min((number + 1) * WIDTH));
            self.eight(
                gains,
                number,
                measurement.slice_axis(Axis(1), area),
                derivative.slice_axis(Axis(1), area),
                levels.slice_axis_mut(Axis(2), area),
            );
        }
    }

    /// From memory to memory where that can be, the rest tile by tile.
    fn eight<G: Recurrence<T, N>>(
        &mut self,
        gains: &[G],
        number: usize,
        measurement: ArrayView2<'_, T>,
        derivative: ArrayView2<'_, T>,
        mut levels: ArrayViewMut3<'_, T>,
    ) {
        let lanes = &mut self.lanes[number];
        let (samples, all) = (measurement.nrows(), levels.len_of(Axis(0)) > 1);
        let (y, u) = (Source::of(measurement), Source::of(derivative));
        let mut targets = levels.outer_iter_mut().map(Target::of);
        let mut targets: [Option<Target<'_, T>>; N] = std::array::from_fn(|_| targets.next());
        let done = match (&y, &u, &mut targets[0]) {
            (Source::Columns(y), Source::Columns(u), Some(Target::Columns(out))) if !all => {
                filter_columns(self.level, gains, lanes, (*y, *u), out, samples)
            }
            _ => 0,
        };
        for start in (done..samples).step_by(TILE) {
            let rows = start..samples.min(start + TILE);
            y.read(self.level, rows.clone(), &mut self.tile.measurement);
            u.read(self.level, rows.clone(), &mut self.tile.derivative);
            let gains = gains.get(rows.clone()).unwrap_or(gains);
            self.tile.filter(self.level, gains, lanes, rows.len(), all);
            for (target, tile) in targets.iter_mut().zip(&self.tile.levels) {
                let Some(target) = target else { break };
                target.write(self.level, rows.clone(), tile);
            }
        }
    }
}
