//! Channels side by side: eight at once, each through the same operations as alone.

use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter, Rows, Steps, follow, run, run_careful, turns};
use crate::lanes::{Row, TILE, Tile, are_finite};
use crate::lanes_direct::{filter_columns, filter_rows};
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
    // Two channels would fill a quarter of the registers: one after the other they take half of the time.
    if channels.len() < 3 || rows < TILE {
        return run(filter, gains, channels, block);
    }
    let mut desk = Desk::new();
    let mut row_gains = Vec::new();
    let is_plain = |channel: &Channel<T, N>| channel.is_plain(filter);
    let wait = channels.iter().any(|channel| !channel.state.started);
    for (start, end) in turns(rows, turn_of(block.measurement), wait) {
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
    if !are_finite(steps) {
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
    tile: Tile<T, N>,
}

impl<T: Scalar, const N: usize> Desk<T, N> {
    fn new() -> Self {
        Self { level: Level::new(), tile: Tile::new() }
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

    /// From memory to memory where that can be, the rest tile by tile.
    fn steps<G: Recurrence<T, N>>(
        &mut self,
        gains: &[G],
        lanes: &mut [Row<T>; N],
        measurement: ArrayView2<'_, T>,
        derivative: ArrayView2<'_, T>,
        mut levels: ArrayViewMut3<'_, T>,
    ) {
        let (samples, all) = (measurement.nrows(), levels.len_of(Axis(0)) > 1);
        let (y, u) = (Source::of(measurement), Source::of(derivative));
        let mut targets = levels.outer_iter_mut().map(Target::of);
        let mut targets: [Option<Target<'_, T>>; N] = std::array::from_fn(|_| targets.next());
        let done =
            if all { 0 } else { self.direct(gains, lanes, (&y, &u), &mut targets[0], samples) };
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

    /// Returns how many rows were filtered without a tile between memory and the steps.
    fn direct<G: Recurrence<T, N>>(
        &self,
        gains: &[G],
        lanes: &mut [Row<T>; N],
        signals: (&Source<'_, T>, &Source<'_, T>),
        target: &mut Option<Target<'_, T>>,
        rows: usize,
    ) -> usize {
        match (signals, target) {
            ((Source::Rows(y), Source::Rows(u)), Some(Target::Rows(out))) => {
                filter_rows(self.level, gains, lanes, (*y, *u), out)
            }
            ((Source::Columns(y), Source::Columns(u)), Some(Target::Columns(out))) => {
                filter_columns(self.level, gains, lanes, (*y, *u), out, rows)
            }
            _ => 0,
        }
    }
}
