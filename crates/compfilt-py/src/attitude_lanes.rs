//! Many recordings at once: eight side by side, and over threads. Each one's results are the bits that it has alone.

use crate::arrays::Scalar;
use crate::attitude_batch::{Bound, ROWS};
use crate::attitude_family::{Family, Sample};
use crate::attitude_log::{Log, Part};
use crate::attitude_octet::{Octet, Spare};
use crate::shares::at_most_cores;
use crate::simd::{WIDTH, Wide, side_by_side};
use crate::simd_number::{WideMask, WideNumber};
use compfilt_core::Change;
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::ComplexField;
use fearless_simd::Simd;
use std::num::NonZeroUsize;

/// Recordings side by side below which each one is filtered by itself.
const FEWEST: usize = 3;

/// A recording and its state: before, later after it.
pub(crate) struct Job<'a, F: Family, T: Scalar> {
    pub(crate) log: Log<'a, T>,
    pub(crate) state: F::State<T>,
}

/// Filters all recordings; with `sampled`, at that period in s, otherwise at the steps of each.
pub(crate) fn filter_all<F: Family, T: Scalar>(
    filter: &F::Filter<T>,
    sampled: Option<T>,
    jobs: &mut [Job<'_, F, T>],
    workers: NonZeroUsize,
) {
    let mut shares: Vec<Share<'_, '_, F, T>> = Vec::new();
    shares.resize_with(at_most_cores(workers).get(), Share::default);
    let mut longest_first: Vec<_> = jobs.iter_mut().collect();
    longest_first.sort_by_key(|job| std::cmp::Reverse(job.log.len()));
    for job in longest_first {
        if let Some(share) = shares.iter_mut().min_by_key(|share| share.samples) {
            share.samples += job.log.len();
            share.jobs.push(job);
        }
    }
    let mut shares = shares.into_iter();
    let own = shares.next();
    std::thread::scope(|scope| {
        for share in shares.filter(|share| !share.jobs.is_empty()) {
            scope.spawn(move || share.filter(filter, sampled));
        }
        if let Some(own) = own {
            own.filter(filter, sampled);
        }
    });
}

/// The recordings of one worker.
struct Share<'s, 'a, F: Family, T: Scalar> {
    jobs: Vec<&'s mut Job<'a, F, T>>,
    samples: usize,
}

impl<F: Family, T: Scalar> Default for Share<'_, '_, F, T> {
    fn default() -> Self {
        Self { jobs: Vec::new(), samples: 0 }
    }
}

impl<F: Family, T: Scalar> Share<'_, '_, F, T> {
    fn filter(self, filter: &F::Filter<T>, sampled: Option<T>) {
        let (with_mag, without): (Vec<_>, Vec<_>) =
            self.jobs.into_iter().partition(|job| job.log.mag.is_some());
        for jobs in [with_mag, without] {
            if F::SIDE_BY_SIDE && jobs.len() >= FEWEST {
                let left = side_by_side!(
                    simd => Lanes::<F, T, _>::new(simd, filter, sampled, jobs).filter(),
                    otherwise => jobs.into_iter().map(|job| Lane { job, row: 0 }).collect()
                );
                for lane in left {
                    lane.finish(filter, sampled);
                }
            } else {
                for job in jobs {
                    Lane { job, row: 0 }.finish(filter, sampled);
                }
            }
        }
    }
}

/// A recording on its way through a lane.
struct Lane<'s, 'a, F: Family, T: Scalar> {
    job: &'s mut Job<'a, F, T>,
    /// The next row.
    row: usize,
}

impl<F: Family, T: Scalar> Lane<'_, '_, F, T> {
    fn left(&self) -> usize {
        self.job.log.len() - self.row
    }

    fn part(&mut self, rows: usize) -> Part<'_, T> {
        let start = self.row;
        self.row += rows;
        self.job.log.part(start..self.row)
    }

    /// The rest of the recording, by itself.
    fn finish(self, filter: &F::Filter<T>, sampled: Option<T>) {
        let Self { job, row } = self;
        let mut bound = Bound::<F, T>::from_state(*filter, sampled, job.state);
        bound.filter_from(&mut job.log, row);
        job.state = bound.state;
    }
}

/// Eight lanes and the recordings that wait for one.
struct Lanes<'s, 'a, F: Family, T: Scalar, S: Simd> {
    filter: F::Filter<T::Wide<S>>,
    gains: F::Gains<T::Wide<S>>,
    /// The time steps of the gains.
    dt: T::Wide<S>,
    state: F::State<T::Wide<S>>,
    taken: [Option<Lane<'s, 'a, F, T>>; WIDTH],
    waiting: std::vec::IntoIter<&'s mut Job<'a, F, T>>,
}

impl<'s, 'a, F: Family, T: Scalar, S: Simd> Lanes<'s, 'a, F, T, S> {
    #[inline(always)]
    fn new(
        _: S,
        filter: &F::Filter<T>,
        sampled: Option<T>,
        jobs: Vec<&'s mut Job<'a, F, T>>,
    ) -> Self {
        let filter = F::filter_in(filter, &mut Splat);
        let dt = T::Wide::<S>::from_array([sampled.unwrap_or(T::zero()); WIDTH]);
        let gains = F::gains(&filter, dt);
        let state = F::state_in(&F::start::<T>(None), &mut Splat);
        let taken = std::array::from_fn(|_| None);
        Self { filter, gains, dt, state, taken, waiting: jobs.into_iter() }
    }

    /// Filters until too few recordings are left; these, with their states.
    #[inline(always)]
    fn filter(mut self) -> Vec<Lane<'s, 'a, F, T>> {
        let mut spare = Spare::new();
        loop {
            self.refill();
            let left: Vec<usize> = self.taken.iter().flatten().map(Lane::left).collect();
            if left.len() < FEWEST {
                break;
            }
            let rows = left.into_iter().min().unwrap_or(0).min(ROWS);
            let spares = spare.parts(rows);
            let parts = self.taken.iter_mut().zip(spares).map(|(lane, spare)| match lane {
                Some(lane) => lane.part(rows),
                None => spare,
            });
            let octet = Octet::new(parts);
            run::<F, T, S>(
                &self.filter,
                &mut self.gains,
                &mut self.dt,
                &mut self.state,
                octet,
                rows,
            );
        }
        self.drain()
    }

    /// Puts waiting recordings into the lanes that are done.
    #[inline(never)]
    fn refill(&mut self) {
        for (index, lane) in self.taken.iter_mut().enumerate() {
            while lane.as_ref().is_none_or(|lane| lane.left() == 0) {
                if let Some(done) = lane.take()
                    && done.row > 0
                {
                    done.job.state = F::state_in(&self.state, &mut TakeLane(index));
                }
                let Some(job) = self.waiting.next() else { break };
                self.state = put_lane::<F, T, S>(&self.state, index, &job.state);
                *lane = Some(Lane { job, row: 0 });
            }
        }
    }

    #[inline(never)]
    fn drain(mut self) -> Vec<Lane<'s, 'a, F, T>> {
        let mut left = Vec::new();
        for (index, lane) in self.taken.iter_mut().enumerate() {
            if let Some(lane) = lane.take() {
                lane.job.state = F::state_in(&self.state, &mut TakeLane(index));
                left.push(lane);
            }
        }
        left
    }
}

/// The samples of some rows.
#[inline(always)]
fn run<F: Family, T: Scalar, S: Simd>(
    filter: &F::Filter<T::Wide<S>>,
    gains: &mut F::Gains<T::Wide<S>>,
    before: &mut T::Wide<S>,
    state: &mut F::State<T::Wide<S>>,
    mut octet: Octet<'_, T>,
    rows: usize,
) {
    let mut now = *state;
    for row in 0..rows {
        let (mut any_restarted, mut restarted) = (false, [Flags::default(); WIDTH]);
        if let Some(steps) = octet.steps(row) {
            let mut steps = steps;
            if !steps.iter().all(ComplexField::is_finite) {
                any_restarted = true;
                for (lane, dt) in steps.iter_mut().enumerate().filter(|(_, dt)| !dt.is_finite()) {
                    now = put_lane::<F, T, S>(&now, lane, &F::start::<T>(None));
                    (*dt, restarted[lane]) = (T::zero(), Flags::RESTARTED);
                }
            }
            let dt = T::Wide::<S>::from_array(steps);
            if dt != *before {
                (*before, *gains) = (dt, F::gains(filter, dt));
            }
        }
        let sample: Sample<T::Wide<S>> = octet.sample(row);
        let mut flags = F::update(filter, gains, &mut now, &sample);
        if any_restarted {
            flags.any = true;
            for (flags, restarted) in flags.flags.iter_mut().zip(restarted) {
                *flags |= restarted;
            }
        }
        octet.write(row, &flags, &F::output(filter, &now));
    }
    *state = now;
}

/// The same number in every lane.
struct Splat;

impl<T: Scalar, W: WideNumber<T>> Change<T, W> for Splat {
    fn number(&mut self, number: T) -> W {
        W::from_array([number; WIDTH])
    }

    fn mask(&mut self, mask: bool) -> W::Mask {
        <W::Mask as compfilt_core::Mask>::same(mask)
    }
}

/// One lane's numbers.
struct TakeLane(usize);

impl<T: Scalar, W: WideNumber<T>> Change<W, T> for TakeLane {
    fn number(&mut self, number: W) -> T {
        number.to_array()[self.0]
    }

    fn mask(&mut self, mask: W::Mask) -> bool {
        mask.at(self.0)
    }
}

/// The state with one lane's own in its lane.
#[inline(never)]
fn put_lane<F: Family, T: Scalar, S: Simd>(
    state: &F::State<T::Wide<S>>,
    lane: usize,
    own: &F::State<T>,
) -> F::State<T::Wide<S>> {
    let mut numbers = Numbers(Vec::new());
    F::state_in(own, &mut numbers);
    F::state_in(state, &mut PutLane { lane, numbers: numbers.0.into_iter() })
}

/// A state's numbers in their order, 1 and 0 for its answers.
struct Numbers<T>(Vec<T>);

impl<T: Scalar> Change<T, T> for Numbers<T> {
    fn number(&mut self, number: T) -> T {
        self.0.push(number);
        number
    }

    fn mask(&mut self, mask: bool) -> bool {
        self.0.push(if mask { T::one() } else { T::zero() });
        mask
    }
}

/// Replaces one lane's numbers.
struct PutLane<T> {
    lane: usize,
    numbers: std::vec::IntoIter<T>,
}

impl<T: Scalar, W: WideNumber<T>> Change<W, W> for PutLane<T> {
    fn number(&mut self, number: W) -> W {
        let mut values = number.to_array();
        values[self.lane] = self.numbers.next().unwrap_or(T::NAN);
        W::from_array(values)
    }

    fn mask(&mut self, mut mask: W::Mask) -> W::Mask {
        mask.set(self.lane, self.numbers.next().is_some_and(|answer| answer != T::zero()));
        mask
    }
}
