//! Past estimates of a channel, where its measurement arrives late: a ring that grows with the delay.

use crate::arrays::Scalar;
use compfilt_core::linear::{Hindsight, History, Past};
use pyo3::PyResult;

/// Nothing, or the past as far back as the measurement's delay.
#[derive(Clone)]
pub(crate) enum Memory<T: Scalar> {
    Nothing,
    Past(History<T, Vec<Past<T>>>),
}

impl<T: Scalar> Memory<T> {
    /// `delay` in seconds; with a sample rate the ring has its full length at once.
    pub(crate) fn new(delay: f64, fs: Option<f64>) -> PyResult<Self> {
        if delay == 0.0 {
            return Ok(Self::Nothing);
        }
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let samples = (delay * fs.unwrap_or(0.0)).clamp(0.0, 1e6) as usize;
        let ring = vec![Past { level0: T::NAN, dt: T::zero() }; samples + 3];
        let history = History::new(ring, T::literal(delay)).map_err(crate::errors::value_error)?;
        Ok(Self::Past(history))
    }

    /// The memory with these estimates in it, newest first.
    pub(crate) fn of(delay: T, past: Vec<Past<T>>) -> Self {
        let ring = vec![Past { level0: T::NAN, dt: T::zero() }; past.len() + 2];
        let Ok(mut history) = History::new(ring, delay) else { return Self::Nothing };
        for Past { level0, dt } in past.into_iter().rev() {
            history.remember(level0, dt);
        }
        Self::Past(history)
    }

    /// Doubles the ring where it does not reach back as far as the delay.
    pub(crate) fn make_room(&mut self) {
        if let Self::Past(history) = self
            && history.is_short()
        {
            let mut past: Vec<_> = history.iter().collect();
            let length = past.len();
            past.resize(2 * length, Past { level0: T::NAN, dt: T::zero() });
            let Ok(mut longer) = History::new(past.clone(), history.delay()) else { return };
            for Past { level0, dt } in past.into_iter().take(length).rev() {
                longer.remember(level0, dt);
            }
            *history = longer;
        }
    }

    pub(crate) fn clear(&mut self) {
        if let Self::Past(history) = self {
            history.clear();
        }
    }
}

impl<T: Scalar> Hindsight<T> for Memory<T> {
    #[inline(always)]
    fn is_now(&self) -> bool {
        matches!(self, Self::Nothing)
    }

    #[inline(always)]
    fn begin(&mut self, level0: T) {
        if let Self::Past(history) = self {
            history.begin(level0);
        }
    }

    #[inline(always)]
    fn remember(&mut self, level0: T, dt: T) {
        if let Self::Past(history) = self {
            history.remember(level0, dt);
        }
    }

    #[inline(always)]
    fn recall(&self, now: T) -> T {
        match self {
            Self::Nothing => now,
            Self::Past(history) => history.recall(now),
        }
    }

    #[inline(always)]
    fn amend(&mut self, level0: T) {
        if let Self::Past(history) = self {
            history.amend(level0);
        }
    }
}
