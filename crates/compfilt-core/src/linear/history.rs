//! Past estimates, for a measurement that arrives late.

use super::poles::poles;
use crate::{Error, Real, Rule};
use nalgebra::{Complex, ComplexField};

/// What a measurement is compared with: the estimate now, or the one at the time that it belongs to.
pub trait Hindsight<T> {
    /// Whether measurements belong to now.
    fn is_now(&self) -> bool;

    /// Keeps the estimate before the first step.
    fn begin(&mut self, level0: T);

    /// Keeps the estimate that a step of `dt` led to.
    fn remember(&mut self, level0: T, dt: T);

    /// The estimate at the time that the measurement belongs to; `now` is the present one.
    fn recall(&self, now: T) -> T;

    /// Replaces the newest estimate after its correction.
    fn amend(&mut self, level0: T);
}

/// No delay: the measurement belongs to now.
impl<T> Hindsight<T> for () {
    #[inline(always)]
    fn is_now(&self) -> bool {
        true
    }

    #[inline(always)]
    fn begin(&mut self, _: T) {}

    #[inline(always)]
    fn remember(&mut self, _: T, _: T) {}

    #[inline(always)]
    fn recall(&self, now: T) -> T {
        now
    }

    #[inline(always)]
    fn amend(&mut self, _: T) {}
}

/// One past estimate of level 0 and the time step that led to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past<T> {
    /// Level 0.
    pub level0: T,
    /// Seconds since the estimate before.
    pub dt: T,
}

/// A ring of past estimates: an array in firmware, a slice of any length elsewhere.
///
/// The innovation of a measurement that is `delay` seconds old is taken against the estimate of that time, linearly
/// interpolated; the correction moves the present state. A recall costs as many looks as samples lie within the delay.
///
/// ```
/// use compfilt_core::linear::{Hindsight, History, Past};
/// let ring = [Past { level0: 0.0_f64, dt: 0.0 }; 8];
/// let mut history = History::new(ring, 0.015)?;
/// for n in 0..20 {
///     history.remember(f64::from(n), 0.01);
/// }
/// assert!((history.recall(19.0) - 17.5).abs() < 1e-12);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct History<T, R> {
    ring: R,
    newest: usize,
    filled: usize,
    delay: T,
}

impl<T: Real, R: AsRef<[Past<T>]> + AsMut<[Past<T>]>> History<T, R> {
    /// An empty history in `ring` for a measurement that is `delay` seconds old.
    ///
    /// The ring holds `delay/dt + 2` estimates at least; with fewer, its oldest one stands in.
    ///
    /// # Errors
    /// `delay` is not finite or negative, or `ring` holds fewer than two estimates.
    pub fn new(ring: R, delay: T) -> Result<Self, Error> {
        if !(delay.is_finite() && delay >= T::zero()) {
            return Err(Error::new("delay", Rule::NotNegative));
        }
        if ring.as_ref().len() < 2 {
            return Err(Error::new("delay", Rule::WithinHistory));
        }
        Ok(Self { ring, newest: 0, filled: 0, delay })
    }

    /// [`new`](Self::new) for samples every `dt` seconds.
    ///
    /// # Errors
    /// As there, and where `ring` holds fewer estimates than the delay needs, `delay/dt + 2`.
    pub fn at_period(ring: R, delay: T, dt: T) -> Result<Self, Error> {
        let history = Self::new(ring, delay)?;
        let mut reach = T::zero();
        for _ in 2..history.ring.as_ref().len() {
            reach += dt;
        }
        if delay > reach { Err(Error::new("delay", Rule::WithinHistory)) } else { Ok(history) }
    }

    /// The delay in seconds.
    pub fn delay(&self) -> T {
        self.delay
    }

    /// The estimates to which a measurement may still belong, newest first: back to the first one as old as the delay.
    pub fn iter(&self) -> impl Iterator<Item = Past<T>> {
        let (mut age, mut age_of_newer) = (T::zero(), T::zero());
        self.stored().take_while(move |past| {
            let newer_is_young = age_of_newer < self.delay;
            age_of_newer = age;
            age += past.dt;
            newer_is_young
        })
    }

    /// Whether the next step might push out an estimate that is still needed.
    pub fn is_short(&self) -> bool {
        let capacity = self.ring.as_ref().len();
        let all_but_two = self.stored().take(capacity - 2);
        self.filled == capacity
            && all_but_two.fold(T::zero(), |age, past| age + past.dt) < self.delay
    }

    fn stored(&self) -> impl Iterator<Item = Past<T>> {
        let ring = self.ring.as_ref();
        let before_wrap = ring.get(..=self.newest).unwrap_or_default();
        let after_wrap = ring.get(self.newest + 1..).unwrap_or_default();
        before_wrap.iter().rev().chain(after_wrap.iter().rev()).take(self.filled).copied()
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.filled = 0;
        self.newest = 0;
    }
}

impl<T: Real, R: AsRef<[Past<T>]> + AsMut<[Past<T>]>> Hindsight<T> for History<T, R> {
    fn is_now(&self) -> bool {
        false
    }

    fn begin(&mut self, level0: T) {
        if self.filled == 0 {
            self.remember(level0, T::zero());
        }
    }

    fn remember(&mut self, level0: T, dt: T) {
        let ring = self.ring.as_mut();
        self.newest = if self.newest + 1 < ring.len() { self.newest + 1 } else { 0 };
        self.filled = (self.filled + 1).min(ring.len());
        if let Some(slot) = ring.get_mut(self.newest) {
            *slot = Past { level0, dt };
        }
    }

    fn recall(&self, now: T) -> T {
        let mut age = T::zero();
        let mut newer = Past { level0: now, dt: T::zero() };
        for (place, past) in self.iter().enumerate() {
            if place > 0 {
                let older_age = age + newer.dt;
                if older_age >= self.delay && newer.dt > T::zero() {
                    let fraction = (self.delay - age) / newer.dt;
                    return newer.level0 + (past.level0 - newer.level0) * fraction;
                }
                age = older_age;
            }
            newer = past;
        }
        newer.level0
    }

    fn amend(&mut self, level0: T) {
        if let Some(slot) = self.ring.as_mut().get_mut(self.newest) {
            slot.level0 = level0;
        }
    }
}

/// The delay in seconds at which, with the coefficients `k_1 … k_N` and the split (the order, for a chain), the loop `e = y(t) - x_0(t - delay)` becomes unstable: the least phase margin divided by
/// its gain crossover.
///
/// The open loop is LP/HP of the undelayed filter. Continuous time: a sample period more shortens it a little.
pub fn longest_delay<T: Real, const N: usize>(coefficients: &[T; N], split: usize) -> T {
    let unit =
        poles(coefficients).iter().fold(T::zero(), |m, pole| m.max(pole.re.abs() + pole.im.abs()));
    let open_loop = |omega: T| -> Complex<T> {
        let response = super::continuous_response(coefficients, split, omega);
        response.low / response.high
    };
    let gain = |omega: T| -> T { ComplexField::modulus(open_loop(omega)) };
    let factor = T::literal(0.97);
    let mut longest = T::max_value().unwrap_or(T::one());
    let mut above = unit * T::literal(1e2);
    // From far above all poles down through nine decades: every crossing of the gain through 1.
    for _ in 0..700 {
        let below = above * factor;
        if (gain(above) < T::one()) != (gain(below) < T::one()) {
            let (mut high, mut low) = (above, below);
            let falling = gain(above) < T::one();
            for _ in 0..40 {
                let middle = (high + low) * T::literal(0.5);
                if (gain(middle) < T::one()) == falling { high = middle } else { low = middle }
            }
            let phase = ComplexField::argument(open_loop(high));
            let margin = if phase > T::zero() { phase - T::pi() } else { phase + T::pi() };
            let margin = if margin > T::zero() { margin } else { margin + T::two_pi() };
            longest = longest.min(margin / high);
        }
        above = below;
    }
    longest
}
