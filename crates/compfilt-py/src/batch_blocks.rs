//! One long channel in another order of the sums: parts of it side by side.
//!
//! A block is four tiles of eight runs of eight samples. The filter's own step goes through all of them side by side, each
//! from a start at zero; where each of them ends then tells where the next one starts, and what that start adds to its
//! samples is known beforehand. Blocks make chunks, and only the state between chunks is handed on, so that several workers
//! can share a channel. Every number depends on its place in the log alone: the bits are the same for any number of
//! workers and on every processor.

use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter, LEAD, Steps, run};
use crate::lanes::are_finite;
use crate::prefetch::{LINE, ask_for_all};
use crate::relay::Relay;
use crate::runs::{FromZero, RUN, Signal, TILES, TileRuns};
use crate::shares::{split_columns, split_rows};
use crate::simd::{Level, WIDTH};
use compfilt_core::linear::{Motion, Runs};
use compfilt_core::{Discretise, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut1, Axis, Slice};
use std::borrow::Cow;
use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

/// Samples of a block.
const BLOCK: usize = TILES * WIDTH * RUN;

/// Blocks of a chunk: long enough that handing the state on costs nothing, short enough to stay in the cache.
const BLOCKS: usize = 32;

/// Samples of a chunk.
const CHUNK: usize = BLOCKS * BLOCK;

/// Whether another order of the sums is worth it: few channels, and enough samples to make up for the weights. Channels
/// side by side are as fast and exact.
pub(crate) fn pays<T>(block: &Block<'_, T>) -> bool {
    let (rows, channels) = block.measurement.dim();
    matches!(block.steps, Steps::Uniform) && channels < 4 && rows >= 4 * BLOCK
}

/// Filters each channel for itself.
pub(crate) fn run_blocks<T, D, const N: usize>(
    filter: &Filter<T, D>,
    gains: &D::Gains,
    channels: &mut [Channel<T, N>],
    block: Block<'_, T>,
    workers: NonZeroUsize,
) where
    T: Scalar,
    D: Discretise<T, N> + Send + Sync,
    D::Gains: Send + Sync,
{
    let runs = Runs::of::<D>(gains);
    let affine = Affine {
        level: Level::new(),
        gains,
        over_chunk: runs.repeated(BLOCKS * TILES),
        runs,
        is_plain: &|channel| channel.is_plain(filter),
        exactly: &|channel, block| {
            run(filter, *gains, std::slice::from_mut(channel), block);
        },
    };
    for (channel, block) in channels.iter_mut().zip(split_columns(block, 1)) {
        affine.channel(channel, block, workers);
    }
}

/// A filter with what makes it an affine map. It depends on the gains, not on the rule that they came from: half the code.
struct Affine<'a, T: Scalar, G, const N: usize> {
    level: Level,
    gains: &'a G,
    runs: TileRuns<T, N>,
    over_chunk: Motion<T, N>,
    is_plain: &'a (dyn Fn(&Channel<T, N>) -> bool + Sync),
    /// Any case, in the order of a stream.
    exactly: &'a (dyn Fn(&mut Channel<T, N>, Block<'_, T>) + Sync),
}

impl<T, G, const N: usize> Affine<'_, T, G, N>
where
    T: Scalar,
    G: Recurrence<T, N> + Send + Sync,
{
    /// One channel: a few samples until it has started, the chunks, the samples that fill no block.
    /// What is not plain all the time gains nothing here and loses nothing: its chunks go the exact way one after the other.
    fn channel(&self, channel: &mut Channel<T, N>, block: Block<'_, T>, workers: NonZeroUsize) {
        let lead = if (self.is_plain)(channel) { 0 } else { LEAD };
        let (lead, rest) = split_rows(block, lead);
        (self.exactly)(channel, lead);
        let rows = rest.measurement.nrows();
        let (rest, tail) = split_rows(rest, rows - rows % BLOCK);
        let mut rest = Some(rest);
        let workers = workers.get().min(rows.div_ceil(CHUNK));
        if workers > 1 {
            self.share(channel, rest, workers);
        } else {
            let mut desk = Box::new(FromZero::new());
            while let Some(chunk) = take_chunk(&mut rest) {
                self.alone(channel, chunk, &mut desk);
            }
        }
        (self.exactly)(channel, tail);
    }

    /// Several workers take the chunks as they come.
    fn share(&self, channel: &mut Channel<T, N>, block: Option<Block<'_, T>>, workers: usize) {
        let queue = Mutex::new((0, block));
        let relay = Relay::new(channel.clone());
        std::thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    let _guard = relay.guard();
                    let mut desk = vec![FromZero::new(); BLOCKS];
                    while let Some((number, chunk)) = next_chunk(&queue)
                        && self.in_turn(number, chunk, &relay, &mut desk, workers)
                    {
                    }
                });
            }
        });
        *channel = relay.last();
    }

    /// A chunk whose start is known: block by block, while it is in the nearest cache.
    fn alone(
        &self,
        channel: &mut Channel<T, N>,
        mut chunk: Block<'_, T>,
        block: &mut FromZero<T, N>,
    ) {
        if !(self.is_plain)(channel) {
            return (self.exactly)(channel, chunk);
        }
        let signals = Signals::of(&chunk);
        let all = wants_all(&chunk);
        let mut outputs = outputs(&mut chunk);
        let (mut levels, mut added) = (channel.state.levels.levels, [T::zero(); N]);
        let mut is_finite = true;
        for (number, pair) in signals.blocks().enumerate() {
            let filter = (self.gains, &self.runs);
            let mut start = levels;
            let [level0, ..] = outputs.as_mut_slice() else { break };
            is_finite &= to_rows(level0, number, |out| {
                let levels = (&mut levels, all);
                block.filter_and_finish(self.level, filter, pair, levels, out)
            });
            if all {
                is_finite &= self.finish(&mut start, block, 1, number, &mut outputs);
            }
            block.starts(&self.runs, &mut added);
            if !are_finite(&added) {
                break;
            }
        }
        match self.after(channel, &added, &chunk) {
            None => (self.exactly)(channel, chunk),
            Some(next) => {
                let mut begin = std::mem::replace(channel, next);
                if !is_finite {
                    (self.exactly)(&mut begin, chunk);
                }
            }
        }
    }

    /// A chunk whose start another worker finds meanwhile. False if that worker has panicked.
    fn in_turn(
        &self,
        number: usize,
        mut chunk: Block<'_, T>,
        relay: &Relay<Channel<T, N>>,
        blocks: &mut [FromZero<T, N>],
        workers: usize,
    ) -> bool {
        let signals = Signals::of(&chunk);
        signals.look();
        let all = wants_all(&chunk);
        let added = self.step_from_zero(&signals, &outputs(&mut chunk), blocks, all);
        let Some(mut begin) = relay.take(number) else { return false };
        let is_plain = (self.is_plain)(&begin);
        let Some(next) = is_plain.then(|| self.after(&begin, &added, &chunk)).flatten() else {
            (self.exactly)(&mut begin, chunk);
            relay.give(number + 1, begin);
            return true;
        };
        relay.give(number + 1, next);
        let mut levels = begin.state.levels.levels;
        let mut outputs = outputs(&mut chunk);
        let mut is_finite = true;
        for (number, (block, _)) in blocks.iter().zip(signals.blocks()).enumerate() {
            signals.ask_for(workers * CHUNK + number * BLOCK); // Most likely the next chunk of this worker.
            is_finite &= self.finish(&mut levels, block, 0, number, &mut outputs);
        }
        if !is_finite {
            (self.exactly)(&mut begin, chunk);
        }
        true
    }

    /// Steps through the blocks of a chunk that starts at zero. The memory of its results is asked for meanwhile.
    fn step_from_zero(
        &self,
        signals: &Signals<'_, T>,
        outputs: &Outputs<'_, T, N>,
        blocks: &mut [FromZero<T, N>],
        all: bool,
    ) -> [T; N] {
        let mut added = [T::zero(); N];
        for (number, (block, pair)) in blocks.iter_mut().zip(signals.blocks()).enumerate() {
            for output in outputs.iter().flatten().filter_map(|output| output.as_slice()) {
                ask_for_all(output, number * BLOCK, BLOCK);
            }
            block.filter(self.level, (self.gains, &self.runs), pair, all);
            block.starts(&self.runs, &mut added);
        }
        added
    }

    /// Writes the levels from `first` on of a block that starts at `levels`, which go to its end. False if one overflows.
    fn finish(
        &self,
        levels: &mut [T; N],
        block: &FromZero<T, N>,
        first: usize,
        number: usize,
        outputs: &mut Outputs<'_, T, N>,
    ) -> bool {
        let starts = block.starts(&self.runs, levels);
        let mut is_finite = true;
        for (level, output) in outputs.iter_mut().enumerate().skip(first) {
            is_finite &= to_rows(output, number, |out| {
                block.finish(self.level, &self.runs, &starts, level, out)
            });
        }
        is_finite
    }

    /// The channel after a chunk that adds `added`; none if a sample is missing.
    fn after(
        &self,
        channel: &Channel<T, N>,
        added: &[T; N],
        chunk: &Block<'_, T>,
    ) -> Option<Channel<T, N>> {
        let rows = chunk.measurement.nrows();
        let over =
            if rows == CHUNK { self.over_chunk } else { self.runs.repeated(rows / (WIDTH * RUN)) };
        let mut levels = channel.state.levels.levels;
        over.follow(&mut levels, added);
        let mut next = channel.clone();
        next.take_plain(levels, chunk.derivative[(rows - 1, 0)]).then_some(next)
    }
}

/// The next chunk of a log that is cut at whole blocks.
fn take_chunk<'a, T: Scalar>(rest: &mut Option<Block<'a, T>>) -> Option<Block<'a, T>> {
    let block = rest.take()?;
    let rows = block.measurement.nrows();
    if rows == 0 {
        return None;
    }
    let (chunk, later) = split_rows(block, rows.min(CHUNK));
    *rest = Some(later);
    Some(chunk)
}

/// The next chunk and its number.
fn next_chunk<'a, T: Scalar>(
    queue: &Mutex<(usize, Option<Block<'a, T>>)>,
) -> Option<(usize, Block<'a, T>)> {
    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
    let chunk = take_chunk(&mut queue.1)?;
    queue.0 += 1;
    Some((queue.0 - 1, chunk))
}

/// Both signals of a chunk, each in one piece: a copy where it is not.
struct Signals<'a, T: Clone>(Cow<'a, [T]>, Cow<'a, [T]>);

impl<'a, T: Scalar> Signals<'a, T> {
    fn of(chunk: &Block<'a, T>) -> Self {
        let piece = |view: ArrayView2<'a, T>| -> Cow<'a, [T]> {
            let view = view.index_axis_move(Axis(1), 0);
            view.to_slice().map_or_else(|| Cow::Owned(view.to_vec()), Cow::Borrowed)
        };
        Self(piece(chunk.measurement), piece(chunk.derivative))
    }

    /// Reads a number of every line. Memory is fastest when it is asked for many lines at once and nothing is done between.
    fn look(&self) {
        let mut sum = T::zero();
        for (y, u) in self.0.iter().zip(self.1.iter()).step_by(LINE / size_of::<T>()) {
            sum += *y + *u;
        }
        std::hint::black_box(sum);
    }

    /// Asks for the memory of a block, which may lie behind the chunk.
    fn ask_for(&self, start: usize) {
        ask_for_all(&self.0, start, BLOCK);
        ask_for_all(&self.1, start, BLOCK);
    }

    fn blocks(&self) -> impl Iterator<Item = (&Signal<T>, &Signal<T>)> {
        blocks_of(&self.0).iter().zip(blocks_of(&self.1))
    }
}

fn blocks_of<T>(signal: &[T]) -> &[Signal<T>] {
    signal.as_chunks().0.as_chunks().0.as_chunks().0
}

fn blocks_of_mut<T>(signal: &mut [T]) -> &mut [Signal<T>] {
    signal.as_chunks_mut().0.as_chunks_mut().0.as_chunks_mut().0
}

/// Where the levels go, as far as they are wanted.
type Outputs<'a, T, const N: usize> = [Option<ArrayViewMut1<'a, T>>; N];

fn outputs<'a, T: Scalar, const N: usize>(chunk: &'a mut Block<'_, T>) -> Outputs<'a, T, N> {
    let mut levels = chunk.levels.outer_iter_mut();
    std::array::from_fn(|_| levels.next().map(|level| level.index_axis_move(Axis(1), 0)))
}

/// Whether more than level 0 is wanted.
fn wants_all<T>(block: &Block<'_, T>) -> bool {
    block.levels.len_of(Axis(0)) > 1
}

/// Lets the rows of a block be written, at any stride. What is not wanted is not written.
fn to_rows<T: Scalar>(
    output: &mut Option<ArrayViewMut1<'_, T>>,
    number: usize,
    write: impl FnOnce(&mut Signal<T>) -> bool,
) -> bool {
    let Some(output) = output else { return true };
    let rows = number * BLOCK..(number + 1) * BLOCK;
    if let Some([out]) = output.as_slice_mut().map(|out| blocks_of_mut(&mut out[rows.clone()])) {
        return write(out);
    }
    let mut out = [[[T::zero(); RUN]; WIDTH]; TILES];
    let is_finite = write(&mut out);
    let values = out.as_flattened().as_flattened();
    for (to, from) in output.slice_axis_mut(Axis(0), Slice::from(rows)).iter_mut().zip(values) {
        *to = *from;
    }
    is_finite
}
