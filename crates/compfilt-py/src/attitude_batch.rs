//! An attitude filter bound to its state: the loop over the samples of one recording, and what is stored of it.

use crate::arrays::Scalar;
use crate::attitude_family::{Family, Output, Sample};
use crate::attitude_lanes::{Job, filter_all};
use crate::attitude_log::Log;
use crate::state::Numbers;
use compfilt_core::attitude::Rotation;
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::Matrix3;
use compfilt_core::{Change, Dt};
use std::num::NonZeroUsize;

/// Rows that are taken at once: a copy of them stays in the cache.
pub(crate) const ROWS: usize = 512;

/// Any attitude filter at work.
pub(crate) trait Runner<T: Scalar>: Send + Sync {
    /// Takes the gains of a time step, or those of the sample period.
    fn follow(&mut self, dt: Option<Dt<T>>);
    fn sample(&mut self, sample: &Sample<T>) -> Flags;
    fn output(&self) -> Output<T>;
    fn filter(&mut self, log: &mut Log<'_, T>);
    /// Filters recordings that have nothing to do with this one's state, each from its own stored state.
    fn filter_many(&self, logs: Vec<Log<'_, T>>, states: &mut [Numbers], workers: NonZeroUsize);
    /// The gyro's sensitivity errors, where the filter learns them.
    fn calibration(&self) -> Option<Matrix3<T>>;
    /// The delay that it works with in s, where it learns that.
    fn delay(&self) -> Option<T>;
    fn store(&self) -> Numbers;
    fn restore(&mut self, numbers: &Numbers) -> bool;
    fn reset(&mut self, attitude: Option<Rotation<T>>);
}

/// A filter of a family bound to its state.
pub(crate) struct Bound<F: Family, T: Scalar> {
    pub(crate) filter: F::Filter<T>,
    /// The sample period in s, if there is one.
    pub(crate) sampled: Option<T>,
    /// The time step of the gains.
    dt: T,
    gains: F::Gains<T>,
    pub(crate) state: F::State<T>,
}

impl<F: Family, T: Scalar> Bound<F, T> {
    pub(crate) fn new(filter: F::Filter<T>, sampled: Option<Dt<T>>) -> Self {
        Self::from_state(filter, sampled.map(Dt::seconds), F::start(None))
    }

    pub(crate) fn from_state(filter: F::Filter<T>, sampled: Option<T>, state: F::State<T>) -> Self {
        let dt = sampled.unwrap_or(T::zero());
        Self { filter, sampled, dt, gains: F::gains(&filter, dt), state }
    }

    /// Takes the gains of another time step. Where time began anew there is none, and the filter starts anew too.
    #[inline(always)]
    fn step_to(&mut self, dt: T) -> Flags {
        let (mut dt, mut flags) = (dt, Flags::default());
        if !dt.is_finite() {
            self.state = F::start(None);
            flags = Flags::RESTARTED;
            dt = T::zero();
        }
        self.set_step(dt);
        flags
    }

    #[inline(always)]
    fn set_step(&mut self, dt: T) {
        if dt != self.dt {
            (self.dt, self.gains) = (dt, F::gains(&self.filter, dt));
        }
    }

    /// The rows of a recording from one on.
    pub(crate) fn filter_from(&mut self, log: &mut Log<'_, T>, first: usize) {
        let rows = log.len();
        for start in (first..rows).step_by(ROWS) {
            let mut part = log.part(start..rows.min(start + ROWS));
            for row in 0..part.len() {
                let mut flags =
                    part.steps.map_or(Flags::default(), |steps| self.step_to(steps[row]));
                flags |= F::update(&self.filter, &self.gains, &mut self.state, &part.sample(row));
                part.write(row, flags, &F::output(&self.filter, &self.state));
            }
        }
    }
}

impl<F: Family, T: Scalar> Runner<T> for Bound<F, T> {
    fn follow(&mut self, dt: Option<Dt<T>>) {
        if let Some(dt) = dt.map(Dt::seconds).or(self.sampled) {
            self.set_step(dt);
        }
    }

    fn sample(&mut self, sample: &Sample<T>) -> Flags {
        F::update(&self.filter, &self.gains, &mut self.state, sample)
    }

    fn output(&self) -> Output<T> {
        F::output(&self.filter, &self.state)
    }

    fn filter(&mut self, log: &mut Log<'_, T>) {
        self.follow(None);
        self.filter_from(log, 0);
    }

    fn filter_many(&self, logs: Vec<Log<'_, T>>, states: &mut [Numbers], workers: NonZeroUsize) {
        let mut jobs: Vec<Job<'_, F, T>> = logs
            .into_iter()
            .zip(&*states)
            .map(|(log, stored)| {
                let state = restored::<F, T>(&self.state, stored).unwrap_or(F::start(None));
                Job { log, state }
            })
            .collect();
        filter_all::<F, T>(&self.filter, self.sampled, &mut jobs, workers);
        for (job, stored) in jobs.iter().zip(states) {
            *stored = stored_numbers::<F, T>(&job.state);
        }
    }

    fn calibration(&self) -> Option<Matrix3<T>> {
        F::calibration(&self.filter, &self.state)
    }

    fn delay(&self) -> Option<T> {
        F::delay(&self.filter, &self.state)
    }

    fn store(&self) -> Numbers {
        stored_numbers::<F, T>(&self.state)
    }

    fn restore(&mut self, numbers: &Numbers) -> bool {
        let restored = restored::<F, T>(&self.state, numbers);
        if let Some(state) = restored {
            self.state = state;
        }
        restored.is_some()
    }

    fn reset(&mut self, attitude: Option<Rotation<T>>) {
        self.state = F::start(attitude);
    }
}

/// A state as numbers.
struct Stored(Numbers);

impl<T: Scalar> Change<T, T> for Stored {
    fn number(&mut self, number: T) -> T {
        self.0.put(&[number]);
        number
    }

    fn mask(&mut self, mask: bool) -> bool {
        self.0.put(&[f64::from(u8::from(mask))]);
        mask
    }
}

fn stored_numbers<F: Family, T: Scalar>(state: &F::State<T>) -> Numbers {
    let mut stored = Stored(Numbers::new());
    F::state_in(state, &mut stored);
    stored.0
}

/// Numbers as a state.
struct Restored<T> {
    numbers: std::vec::IntoIter<T>,
    complete: bool,
}

impl<T: Scalar> Change<T, T> for Restored<T> {
    fn number(&mut self, _: T) -> T {
        let number = self.numbers.next();
        self.complete &= number.is_some();
        number.unwrap_or(T::NAN)
    }

    fn mask(&mut self, _: bool) -> bool {
        self.number(T::NAN) != T::zero()
    }
}

/// The state that was stored, if it is one of this filter: the numbers are as many, and those of the attitude are of length 1.
fn restored<F: Family, T: Scalar>(like: &F::State<T>, numbers: &Numbers) -> Option<F::State<T>> {
    let numbers: Vec<T> = numbers.values();
    let mut restored = Restored { numbers: numbers.into_iter(), complete: true };
    let state = F::state_in(like, &mut restored);
    let whole = restored.complete && restored.numbers.next().is_none();
    let Rotation { w, v } = F::rotation(&state);
    let length = w * w + v.norm_squared();
    (whole && (length - T::one()).abs() < T::literal(1e-3)).then_some(state)
}
