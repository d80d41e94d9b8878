//! One long channel in another order of the sums: parts of it side by side.
//!
//! A block is four tiles of eight runs of eight samples. The filter's own step goes through all of them side by side, each
//! from a start at zero; where each of them ends then tells where the next one starts, and what that start adds to its
//! samples is known beforehand. Blocks make chunks, and only the state between chunks is handed on, so that several workers
//! can share a channel. Every number depends on its place in the log alone: the bits are the same for any number of
//! workers and on every processor.

use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter, LEAD, Steps, run};
use crate::chunk_arrays::{BLOCKS, CHUNK, Later, Outputs, Signals, lie_in_one_piece};
use crate::lanes::are_finite;
use crate::relay::Relay;
use crate::runs::{BLOCK, FromZero, RUN, Signal, TILES, TileRuns};
use crate::shares::{split_columns, split_rows};
use crate::simd::{Level, WIDTH};
use compfilt_core::linear::{Motion, Runs};
use compfilt_core::{Discretise, Recurrence};
use numpy::ndarray::Axis;
use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

/// Chunks that one of several workers takes at once. With fewer, memory is fetched ahead for the wrong worker: half a megabyte
/// of every array at once takes 0.6 of the time of an eighth of that.
const CHUNKS: usize = 8;

/// Least rows for each of several workers: to start a thread takes as long as to filter some hundred thousand.
const ROWS_OF_A_WORKER: usize = 1 << 18;

/// Whether another order of the sums is worth it: enough samples to make up for the weights, and one channel or few that lie in
/// one piece each. Channels side by side are as fast in the order of a stream.
pub(crate) fn pays<T>(block: &Block<'_, T>) -> bool {
    let (rows, channels) = block.measurement.dim();
    let most = if block.lies_in_columns() { 3 } else { 1 };
    matches!(block.steps, Steps::Uniform) && channels <= most && rows >= 4 * BLOCK
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
    affine.channels(channels, block, workers);
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
    /// Each channel: a few samples until it has started, the chunks, the samples that fill no block.
    /// What is not plain all the time gains nothing here and loses nothing: its chunks go the exact way one after the other.
    fn channels(&self, channels: &mut [Channel<T, N>], block: Block<'_, T>, workers: NonZeroUsize) {
        for (channel, block) in channels.iter_mut().zip(split_columns(block, 1)) {
            let lead = if (self.is_plain)(channel) { 0 } else { LEAD };
            let (lead, rest) = split_rows(block, lead);
            (self.exactly)(channel, lead);
            let rows = rest.measurement.nrows();
            let (chunks, tail) = split_rows(rest, rows - rows % BLOCK);
            match workers.get().min(rows / ROWS_OF_A_WORKER) {
                0 | 1 => self.alone(channel, chunks),
                workers => self.share(channel, chunks, workers),
            }
            (self.exactly)(channel, tail);
        }
    }

    fn alone(&self, channel: &mut Channel<T, N>, block: Block<'_, T>) {
        let mut desk = Desk::new(1, &block);
        let mut rest = Some(block);
        while let Some(chunk) = take_chunk(&mut rest) {
            self.chunk(channel, chunk, &mut desk);
        }
    }

    /// Several workers take chunks as they come.
    fn share(&self, channel: &mut Channel<T, N>, block: Block<'_, T>, workers: usize) {
        let at_once = if lie_in_one_piece(&block) { CHUNKS } else { 1 };
        let desk = Desk::new(at_once * BLOCKS, &block);
        let queue = Mutex::new((0, Some(block)));
        let relay = Relay::new(channel.clone());
        let work = || {
            let _guard = relay.guard();
            let mut desk = desk.clone();
            while let Some((number, chunks)) = next_chunks(&queue, at_once)
                && self.in_turn((number, workers), chunks, &relay, &mut desk)
            {}
        };
        std::thread::scope(|scope| {
            for _ in 1..workers {
                scope.spawn(work);
            }
            work();
        });
        *channel = relay.last();
    }

    /// A chunk whose start is known: block by block, while it is in the nearest cache.
    fn chunk(&self, channel: &mut Channel<T, N>, mut chunk: Block<'_, T>, desk: &mut Desk<T, N>) {
        if !(self.is_plain)(channel) {
            return (self.exactly)(channel, chunk);
        }
        let (signals, mut outputs) =
            (Signals::of(&chunk), Outputs::of(&mut chunk, &mut desk.beside));
        let (mut levels, mut added) = (channel.state.levels.levels, [T::zero(); N]);
        let mut is_finite = true;
        for (number, pair) in signals.blocks().enumerate() {
            let Some(block) = desk.blocks.first_mut() else { break };
            self.step_from_zero(block, pair, (&mut outputs, number), &mut desk.levels);
            is_finite &= self.finish(&mut levels, block, (&mut outputs, number));
            block.starts(&self.runs, &mut added);
            if !are_finite(&added) {
                break;
            }
        }
        outputs.put();
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

    /// Chunks whose start another worker finds meanwhile. False if that worker has panicked.
    fn in_turn(
        &self,
        (number, workers): (usize, usize),
        mut chunks: Vec<Block<'_, T>>,
        relay: &Relay<Channel<T, N>>,
        desk: &mut Desk<T, N>,
    ) -> bool {
        let mut added = [[T::zero(); N]; CHUNKS];
        let blocks = desk.blocks.chunks_mut(BLOCKS);
        for ((chunk, blocks), added) in chunks.iter_mut().zip(blocks).zip(&mut added) {
            let (signals, mut outputs) = (Signals::of(chunk), Outputs::of(chunk, &mut desk.beside));
            for (number, (pair, block)) in signals.blocks().zip(blocks).enumerate() {
                outputs.ask_for(number);
                self.step_from_zero(block, pair, (&mut outputs, number), &mut desk.levels);
                block.starts(&self.runs, added);
            }
        }
        let Some(mut channel) = relay.take(number) else { return false };
        let blocks = desk.blocks.chunks(BLOCKS);
        let mut started = Vec::with_capacity(CHUNKS);
        for ((chunk, blocks), added) in chunks.into_iter().zip(blocks).zip(&added) {
            let is_plain = (self.is_plain)(&channel);
            match is_plain.then(|| self.after(&channel, added, &chunk)).flatten() {
                None => (self.exactly)(&mut channel, chunk),
                Some(next) => {
                    started.push((chunk, blocks, std::mem::replace(&mut channel, next)));
                }
            }
        }
        relay.give(number + 1, channel);
        for (mut chunk, blocks, mut begin) in started {
            let rows = chunk.measurement.nrows();
            let mut levels = begin.state.levels.levels;
            let (later, mut outputs) =
                (Later::of(&chunk), Outputs::of(&mut chunk, &mut desk.beside));
            let mut is_finite = true;
            for (number, block) in blocks.iter().enumerate().take(rows / BLOCK) {
                // Most likely the next chunks of this worker.
                later.ask_for(workers * CHUNKS * CHUNK + number * BLOCK);
                is_finite &= self.finish(&mut levels, block, (&mut outputs, number));
            }
            outputs.put();
            if !is_finite {
                (self.exactly)(&mut begin, chunk);
            }
        }
        true
    }

    /// Steps through a block whose tiles start at zero, and lays the levels down as they result from there.
    fn step_from_zero(
        &self,
        block: &mut FromZero<T, N>,
        signals: (&Signal<T>, &Signal<T>),
        (outputs, number): (&mut Outputs<'_, T, N>, usize),
        levels: &mut [Signal<T>; N],
    ) {
        let filter = (self.gains, &self.runs);
        let all = outputs.want_all().then_some(levels);
        let mut outputs = outputs.block(number);
        let Some(level0) = outputs.next() else { return };
        match all {
            None => block.filter(self.level, filter, signals, level0, None),
            Some(levels) => {
                block.filter(self.level, filter, signals, level0, Some(levels));
                for (output, level) in outputs.zip(&levels[1..]) {
                    *output = *level;
                }
            }
        }
    }

    /// Adds to a block from zero what its start gives; `levels` goes from there to its end. False if one overflows.
    fn finish(
        &self,
        levels: &mut [T; N],
        block: &FromZero<T, N>,
        (outputs, number): (&mut Outputs<'_, T, N>, usize),
    ) -> bool {
        let starts = block.starts(&self.runs, levels);
        let mut is_finite = true;
        for (level, out) in outputs.block(number).enumerate() {
            is_finite &= block.finish(self.level, &self.runs, &starts, level, out);
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

/// The next chunks for a worker and the number of their turn.
fn next_chunks<'a, T: Scalar>(
    queue: &Mutex<(usize, Option<Block<'a, T>>)>,
    at_once: usize,
) -> Option<(usize, Vec<Block<'a, T>>)> {
    let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
    let chunks: Vec<_> = std::iter::from_fn(|| take_chunk(&mut queue.1)).take(at_once).collect();
    queue.0 += 1;
    (!chunks.is_empty()).then_some((queue.0 - 1, chunks))
}

/// What a worker keeps between both passes over its blocks, and what it needs in each.
#[derive(Clone)]
struct Desk<T, const N: usize> {
    blocks: Vec<FromZero<T, N>>,
    /// The levels of a block.
    levels: Box<[Signal<T>; N]>,
    /// A chunk of every level that does not lie in one piece.
    beside: Vec<T>,
}

impl<T: Scalar, const N: usize> Desk<T, N> {
    fn new(blocks: usize, block: &Block<'_, T>) -> Self {
        let levels = if lie_in_one_piece(block) { 0 } else { block.levels.len_of(Axis(0)) };
        Self {
            blocks: vec![FromZero::new(); blocks],
            levels: Box::new([[[[T::zero(); RUN]; WIDTH]; TILES]; N]),
            beside: vec![T::zero(); levels * CHUNK],
        }
    }
}
