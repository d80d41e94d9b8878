//! The loops of the linear filters: a filter bound to its channels' states, over one sample or a block of them.

use crate::arrays::Scalar;
use crate::batch_blocks::{pays, run_blocks};
use crate::batch_lanes::run_lanes;
use crate::design::{Design, Rule, Visitor};
use crate::memory::Memory;
use crate::shares::{IN_ORDER, at_most_cores, seems_complete, share, split_columns};
use crate::state::Numbers;
use compfilt_core::linear::{Flags, Input, RateInputs, Stream, StreamState};
use compfilt_core::nalgebra::ComplexField;
use compfilt_core::{Discretise, Dt, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut2, ArrayViewMut3, Axis, Slice};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;

/// Rows after which the next channel has its turn, so that a block of rows stays in the cache.
const ROWS: usize = 256;

/// Rows in which the first measurement has most often come.
pub(crate) const LEAD: usize = 4;

/// How a filter meets its samples, in the units of the caller.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Options {
    pub(crate) rule: Rule,
    pub(crate) input: Input,
    pub(crate) period: Option<f64>,
    pub(crate) delay: f64,
    pub(crate) hold: f64,
    pub(crate) gap_cap: Option<f64>,
}

/// The time steps of a block.
#[derive(Clone, Copy)]
pub(crate) enum Steps<'a, T> {
    /// Every sample takes the sample period.
    Uniform,
    /// One step a sample; NaN starts anew.
    Each(&'a [T]),
}

/// A block of samples, one column a channel, and where the results go.
pub(crate) struct Block<'a, T> {
    pub(crate) measurement: ArrayView2<'a, T>,
    pub(crate) derivative: ArrayView2<'a, T>,
    pub(crate) steps: Steps<'a, T>,
    /// `(1, samples, channels)` for level 0 alone, `(order, samples, channels)` for all levels.
    pub(crate) levels: ArrayViewMut3<'a, T>,
    pub(crate) flags: Option<ArrayViewMut2<'a, u8>>,
}

impl<T> Block<'_, T> {
    /// Whether channels lie side by side everywhere.
    pub(crate) fn lies_in_rows(&self) -> bool {
        [self.measurement.strides()[1], self.derivative.strides()[1], self.levels.strides()[2]]
            == [1; 3]
    }

    /// Whether every channel lies in one piece everywhere.
    pub(crate) fn lies_in_columns(&self) -> bool {
        [self.measurement.strides()[0], self.derivative.strides()[0], self.levels.strides()[1]]
            == [1; 3]
    }

    /// Whether more than level 0 is wanted.
    pub(crate) fn wants_all(&self) -> bool {
        self.levels.len_of(Axis(0)) > 1
    }
}

/// A filter of any order, bound to the states of its channels.
pub(crate) trait Runner<T: Scalar>: Send + Sync {
    fn order(&self) -> usize;
    fn channels(&self) -> usize;
    fn level(&self, channel: usize, level: usize) -> T;
    /// One sample of one channel, with the sample period or with another step.
    fn update(&mut self, channel: usize, y: T, u: T, dt: Option<Dt<T>>) -> Flags;
    fn predict(&mut self, channel: usize, u: T, dt: Option<Dt<T>>) -> Flags;
    fn correct(&mut self, channel: usize, y: T) -> Flags;
    /// `exact` keeps the order of the arithmetic of a stream.
    fn block(&mut self, block: Block<'_, T>, workers: NonZeroUsize, exact: bool);
    fn store(&self, channel: usize) -> Numbers;
    /// False if the numbers are not a state of this filter.
    fn restore(&mut self, channel: usize, numbers: &Numbers) -> bool;
    /// Waits for the first measurement, or starts from known levels.
    fn reset(&mut self, channel: usize, levels: Option<&[T]>);
}

/// Makes the runner of a design.
pub(crate) fn runner<T: Scalar>(
    design: &Design,
    options: &Options,
    fs: Option<f64>,
    channels: usize,
) -> PyResult<Box<dyn Runner<T>>> {
    let make = Make { design, options, fs, channels };
    design.with::<T, _>(options.rule, make)?
}

struct Make<'a> {
    design: &'a Design,
    options: &'a Options,
    fs: Option<f64>,
    channels: usize,
}

impl<T: Scalar> Visitor<T> for Make<'_> {
    type Output = PyResult<Box<dyn Runner<T>>>;

    fn visit<D, const N: usize>(self, design: D) -> Self::Output
    where
        D: Discretise<T, N> + Send + Sync + 'static,
        D::Gains: Send + Sync,
    {
        let stream = bind(design, self.options)?;
        let sampled = match self.fs {
            None => None,
            Some(fs) => Some(sampled_gains::<T, D, N>(&design, fs)?),
        };
        let zero = Dt::new(T::zero()).map_err(crate::errors::value_error)?;
        let gains = sampled.unwrap_or_else(|| design.gains(zero));
        let memory = Memory::new(self.options.delay, self.fs)?;
        let channel = Channel {
            state: StreamState::new(),
            memory,
            rate: self.design.is_rate().then(|| RateInputs::new(T::NAN)),
        };
        Ok(Box::new(Channelwise {
            filter: Filter { hold: T::literal(self.options.hold), stream },
            sampled,
            gains,
            channels: vec![channel; self.channels],
        }))
    }
}

/// The gains at the sample rate `fs`, checked.
pub(crate) fn sampled_gains<T: Scalar, D: Discretise<T, N>, const N: usize>(
    design: &D,
    fs: f64,
) -> PyResult<D::Gains> {
    let dt = Dt::from_rate(T::literal(fs)).map_err(crate::errors::value_error)?;
    design.at(dt.seconds()).map_err(|error| {
        PyValueError::new_err(format!("fs must suit the filter: at {fs} Hz {error}"))
    })
}

/// The period of the sample rate, if there is one, with which the design has gains.
pub(crate) fn checked_period<T: Scalar, D: Discretise<T, N>, const N: usize>(
    design: &D,
    fs: Option<f64>,
) -> PyResult<Option<Dt<T>>> {
    let Some(fs) = fs else { return Ok(None) };
    sampled_gains::<T, D, N>(design, fs)?;
    Dt::from_rate(T::literal(fs)).map(Some).map_err(crate::errors::value_error)
}

/// The stream of a design with the caller's options.
pub(crate) fn bind<T: Scalar, D: Copy>(design: D, options: &Options) -> PyResult<Stream<T, D>> {
    let mut stream = Stream::new(design)
        .input(options.input)
        .hold(T::literal(options.hold))
        .map_err(crate::errors::value_error)?;
    if let Some(period) = options.period {
        stream = stream.period(T::literal(period)).map_err(crate::errors::value_error)?;
    }
    if let Some(cap) = options.gap_cap {
        stream = stream.gap_cap(T::literal(cap)).map_err(crate::errors::value_error)?;
    }
    Ok(stream)
}

/// What a channel carries from sample to sample.
#[derive(Clone)]
pub(crate) struct Channel<T: Scalar, const N: usize> {
    pub(crate) state: StreamState<T, N>,
    memory: Memory<T>,
    /// The rate filter's two inputs are prepared first.
    rate: Option<RateInputs<T>>,
}

/// What all channels share.
pub(crate) struct Filter<T, D> {
    pub(crate) stream: Stream<T, D>,
    pub(crate) hold: T,
}

struct Channelwise<T: Scalar, D: Discretise<T, N>, const N: usize> {
    filter: Filter<T, D>,
    /// The gains at the sample rate, if there is one.
    sampled: Option<D::Gains>,
    /// The gains of the last time step, whatever it was.
    gains: D::Gains,
    channels: Vec<Channel<T, N>>,
}

impl<T: Scalar, const N: usize> Channel<T, N> {
    #[inline]
    fn update<D: Discretise<T, N>>(
        &mut self,
        filter: &Filter<T, D>,
        gains: &D::Gains,
        y: T,
        u: T,
    ) -> Flags {
        let Filter { stream, hold } = filter;
        let (measurement, u, mut flags) = match &mut self.rate {
            None => (y, u, Flags::default()),
            Some(inputs) => {
                let prepared = inputs.prepare(y, u, gains.dt(), *hold);
                if !self.state.started && y.is_finite() {
                    self.state.start(y);
                }
                prepared
            }
        };
        self.memory.make_room();
        flags |= stream.update(gains, &mut self.state, measurement, u, &mut self.memory);
        if self.rate.is_some() && flags.contains(Flags::RESTARTED) {
            self.state.start(y);
            self.rate = Some(RateInputs::new(y));
        }
        flags
    }

    /// Whether a sample is one step of the recurrence and nothing else, as long as both signals are there.
    pub(crate) fn is_plain<D: Copy>(&self, filter: &Filter<T, D>) -> bool {
        matches!(self.memory, Memory::Nothing)
            && self.rate.is_none()
            && filter.stream.is_plain_step(&self.state)
    }

    /// Takes the levels after plain steps whose last input was `u`. False, with the state as it was, if a sample was
    /// missing: what is not a number never leaves the levels again, so that one look at the end tells.
    pub(crate) fn take_plain(&mut self, levels: [T; N], u: T) -> bool {
        if !levels.iter().all(ComplexField::is_finite) {
            return false;
        }
        self.state.levels.levels = levels;
        self.state.input.renew(u);
        true
    }

    fn reset(&mut self) {
        self.state = StreamState::new();
        self.memory.clear();
        if let Some(inputs) = &mut self.rate {
            *inputs = RateInputs::new(T::NAN);
        }
    }
}

/// Changes the gains when the time step does.
#[inline]
pub(crate) fn follow<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    gains: &mut D::Gains,
    dt: T,
) {
    if gains.dt() != dt
        && let Ok(dt) = Dt::new(dt)
    {
        *gains = filter.stream.design().gains(dt);
    }
}

impl<T: Scalar, D: Discretise<T, N>, const N: usize> Channelwise<T, D, N> {
    fn gains_for(&mut self, dt: Option<Dt<T>>) -> D::Gains {
        match (dt, self.sampled) {
            (Some(dt), _) => follow(&self.filter, &mut self.gains, dt.seconds()),
            (None, Some(gains)) => self.gains = gains,
            (None, None) => {}
        }
        self.gains
    }

    /// Whether samples are plain steps once a channel has started, as far as they are there.
    fn has_plain_steps(&self) -> bool {
        self.channels.first().cloned().is_some_and(|mut channel| {
            channel.state = StreamState::from_levels([T::zero(); N]);
            channel.is_plain(&self.filter)
        })
    }
}

/// Some rows of a channel, at any stride.
fn rows_of<T>(
    view: ArrayView2<'_, T>,
    channel: usize,
    rows: std::ops::Range<usize>,
) -> impl Iterator<Item = &T> {
    view.index_axis_move(Axis(1), channel).slice_axis_move(Axis(0), Slice::from(rows)).into_iter()
}

/// Where turns begin and end. The first is short where a channel still waits for its first measurement: what follows is
/// plain again.
pub(crate) fn turns(rows: usize, turn: usize, wait: bool) -> impl Iterator<Item = (usize, usize)> {
    let lead = if wait { rows.min(LEAD) } else { 0 };
    let others = (lead..rows).step_by(turn).map(move |start| (start, rows.min(start + turn)));
    (lead > 0).then_some((0, lead)).into_iter().chain(others)
}

/// Where in a block a channel's turn begins and ends.
#[derive(Clone, Copy)]
pub(crate) struct Rows {
    pub(crate) channel: usize,
    pub(crate) start: usize,
    pub(crate) end: usize,
}

/// The common case: both signals are there in all rows, so that every sample is one step and nothing else.
/// False, with the state as it was, if a sample is missing; the rows are then to be filtered anew.
fn run_plain<T: Scalar, G: Recurrence<T, N>, const N: usize>(
    gains: &G,
    channel: &mut Channel<T, N>,
    block: &mut Block<'_, T>,
    rows: Rows,
) -> bool {
    let Rows { channel: c, start, end } = rows;
    let mut state = channel.state.levels;
    let slices = (block.measurement.column(c), block.derivative.column(c));
    let only_level0 = block.levels.len_of(Axis(0)) == 1;
    let mut out = block.levels.index_axis_mut(Axis(2), c);
    match (slices.0.as_slice(), slices.1.as_slice(), out.row_mut(0).as_slice_mut()) {
        (Some(y), Some(u), Some(out)) if only_level0 => {
            let samples = y[start..end].iter().zip(&u[start..end]);
            for (out, (y, u)) in out[start..end].iter_mut().zip(samples) {
                *out = gains.step(&mut state, *y, *u);
            }
        }
        _ => {
            let y = rows_of(block.measurement, c, start..end);
            let u = rows_of(block.derivative, c, start..end);
            for (row, (y, u)) in (start..end).zip(y.zip(u)) {
                gains.step(&mut state, *y, *u);
                for (level, x) in state.levels.iter().take(out.nrows()).enumerate() {
                    out[(level, row)] = *x;
                }
            }
        }
    }
    channel.take_plain(state.levels, block.derivative[(end - 1, c)])
}

/// Any case, sample by sample.
pub(crate) fn run_careful<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    gains: &mut D::Gains,
    channel: &mut Channel<T, N>,
    block: &mut Block<'_, T>,
    rows: Rows,
) {
    let Rows { channel: c, start, end } = rows;
    let y = rows_of(block.measurement, c, start..end);
    let u = rows_of(block.derivative, c, start..end);
    let mut out = block.levels.index_axis_mut(Axis(2), c);
    for (row, (y, u)) in (start..end).zip(y.zip(u)) {
        let mut flags = Flags::default();
        if let Steps::Each(steps) = block.steps {
            let dt = steps[row];
            if dt.is_finite() {
                follow(filter, gains, dt);
            } else {
                channel.reset();
                follow(filter, gains, T::zero());
                flags |= Flags::RESTARTED;
            }
        }
        flags |= channel.update(filter, gains, *y, *u);
        for (level, x) in channel.state.levels.levels.iter().take(out.nrows()).enumerate() {
            out[(level, row)] = *x;
        }
        if let Some(out) = &mut block.flags {
            out[(row, c)] = flags.bits();
        }
    }
}

/// Runs some channels of a block one at a time.
pub(crate) fn run<T: Scalar, D: Discretise<T, N>, const N: usize>(
    filter: &Filter<T, D>,
    mut gains: D::Gains,
    channels: &mut [Channel<T, N>],
    mut block: Block<'_, T>,
) -> D::Gains {
    let is_uniform = matches!(block.steps, Steps::Uniform);
    let wait = channels.iter().any(|channel| !channel.state.started);
    for (start, end) in turns(block.measurement.nrows(), ROWS, wait) {
        let begin_gains = gains;
        for (c, channel) in channels.iter_mut().enumerate() {
            gains = begin_gains;
            let rows = Rows { channel: c, start, end };
            let is_done = is_uniform
                && channel.is_plain(filter)
                && run_plain(&gains, channel, &mut block, rows);
            if !is_done {
                run_careful(filter, &mut gains, channel, &mut block, rows);
            }
        }
    }
    gains
}

impl<T, D, const N: usize> Runner<T> for Channelwise<T, D, N>
where
    T: Scalar,
    D: Discretise<T, N> + Send + Sync,
    D::Gains: Send + Sync,
{
    fn order(&self) -> usize {
        N
    }

    fn channels(&self) -> usize {
        self.channels.len()
    }

    fn level(&self, channel: usize, level: usize) -> T {
        self.channels[channel].state.levels.levels[level]
    }

    fn update(&mut self, channel: usize, y: T, u: T, dt: Option<Dt<T>>) -> Flags {
        let gains = self.gains_for(dt);
        self.channels[channel].update(&self.filter, &gains, y, u)
    }

    fn predict(&mut self, channel: usize, u: T, dt: Option<Dt<T>>) -> Flags {
        let gains = self.gains_for(dt);
        let channel = &mut self.channels[channel];
        channel.memory.make_room();
        self.filter.stream.predict(&gains, &mut channel.state, u, &mut channel.memory)
    }

    fn correct(&mut self, channel: usize, y: T) -> Flags {
        let channel = &mut self.channels[channel];
        self.filter.stream.correct(&self.gains, &mut channel.state, y, &mut channel.memory)
    }

    fn block(&mut self, block: Block<'_, T>, workers: NonZeroUsize, exact: bool) {
        if let Some(gains) = self.sampled
            && matches!(block.steps, Steps::Uniform)
        {
            self.gains = gains;
        }
        let (filter, gains) = (&self.filter, self.gains);
        let workers = at_most_cores(workers);
        if !exact && pays(&block) {
            run_blocks(filter, &gains, &mut self.channels, block, workers);
            return;
        }
        let mut share = share(self.channels.len(), workers);
        if share < self.channels.len().min(IN_ORDER)
            && self.has_plain_steps()
            && block.lies_in_rows()
            && !block.wants_all()
            && seems_complete(&block)
        {
            share = IN_ORDER;
        }
        if share >= self.channels.len() {
            self.gains = run_lanes(filter, gains, &mut self.channels, block);
            return;
        }
        let mut shares = self.channels.chunks_mut(share).zip(split_columns(block, share));
        let first = shares.next();
        let run_share = |(channels, block)| run_lanes(filter, gains, channels, block);
        self.gains = std::thread::scope(|scope| {
            let threads: Vec<_> =
                shares.map(|share| scope.spawn(move || run_share(share))).collect();
            let gains_after = first.map_or(gains, run_share);
            let joined = threads.into_iter().map(std::thread::ScopedJoinHandle::join);
            joined
                .map(|gains| gains.unwrap_or_else(|panic| resume_unwind(panic)))
                .last()
                .unwrap_or(gains_after)
        });
    }

    fn store(&self, channel: usize) -> Numbers {
        let channel = &self.channels[channel];
        let mut numbers = Numbers::new();
        numbers.put_stream(&channel.state);
        if let Some(inputs) = &channel.rate {
            numbers.put_rate(inputs);
        }
        if let Memory::Past(history) = &channel.memory {
            numbers.put_history(history.iter());
        }
        numbers
    }

    fn restore(&mut self, channel: usize, numbers: &Numbers) -> bool {
        let channel = &mut self.channels[channel];
        let mut numbers = numbers.reader();
        let Some(state) = numbers.take_stream() else { return false };
        channel.state = state;
        if let Some(inputs) = &mut channel.rate {
            let Some(restored) = numbers.take_rate() else { return false };
            *inputs = restored;
        }
        channel.memory.clear();
        if let Memory::Past(history) = &channel.memory {
            let Some(past) = numbers.take_history() else { return false };
            channel.memory = Memory::of(history.delay(), past);
        }
        numbers.is_empty()
    }

    fn reset(&mut self, channel: usize, levels: Option<&[T]>) {
        let channel = &mut self.channels[channel];
        channel.reset();
        if let Some(levels) = levels {
            let levels = core::array::from_fn(|i| levels.get(i).copied().unwrap_or(T::zero()));
            channel.state = StreamState::from_levels(levels);
            if let Some(inputs) = &mut channel.rate {
                *inputs = RateInputs::new(levels[0]);
            }
        }
    }
}
