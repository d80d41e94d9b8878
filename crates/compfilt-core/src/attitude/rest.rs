//! Whether the body is at rest, and the gyro's bias while it is.

use crate::error::positive;
use crate::{Error, Real};
use nalgebra::Vector3;

/// When a body counts as resting.
///
/// Gyro and accelerometer are low-passed with `memory` (a mean at first). Still is a sample where the gyro is within `rate` of
/// its low-pass, which is within `bias_limit` on every axis, where the accelerometer is within `force` of its own, and where that
/// has not drifted by more than `drift` since the stillness began: a slow turn about a horizontal axis drifts. Resting is to
/// have been still for `time`. Then the bias follows the low-passed gyro: as a mean at first, later with `bias_memory`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestRule<T> {
    memory: T,
    time: T,
    rate: T,
    force: T,
    drift: T,
    bias_limit: T,
    bias_memory: T,
}

impl<T: Real> Default for RestRule<T> {
    /// 0.5 s, 1.5 s, 2 deg/s, 0.5 m/s², 0.1 m/s², 2 deg/s, 2 s.
    fn default() -> Self {
        let degrees = T::pi() / T::literal(180.0);
        Self {
            memory: T::literal(0.5),
            time: T::literal(1.5),
            rate: T::literal(2.0) * degrees,
            force: T::literal(0.5),
            drift: T::literal(0.1),
            bias_limit: T::literal(2.0) * degrees,
            bias_memory: T::literal(2.0),
        }
    }
}

macro_rules! setting {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        ///
        /// # Errors
        /// It is not positive and finite.
        pub fn $name(self, $name: T) -> Result<Self, Error> {
            Ok(Self { $name: positive(stringify!($name), $name)?, ..self })
        }
    )*};
}

impl<T: Real> RestRule<T> {
    setting! {
        /// The memory of the low-passes in s.
        memory
        /// How long in s a body must be still to count as resting.
        time
        /// How far in rad/s the gyro may be from its low-pass.
        rate
        /// How far in m/s² the accelerometer may be from its low-pass.
        force
        /// How far in m/s² the low-passed accelerometer may drift in a rest.
        drift
        /// The largest bias in rad/s on an axis.
        bias_limit
        /// The memory of the bias in s.
        bias_memory
    }

    pub(super) fn largest_bias(&self) -> T {
        self.bias_limit
    }

    /// A sample after `dt` seconds; whether the body rests. Only with both sensors there; see [`Rest::disturb`].
    pub(super) fn update(
        &self,
        rest: &mut Rest<T>,
        gyro: &Vector3<T>,
        force: &Vector3<T>,
        dt: T,
    ) -> bool {
        if rest.begun {
            let longer = rest.age + dt;
            rest.age = if longer < self.memory { longer } else { self.memory };
            let weight = if dt > T::zero() { dt / (rest.age + dt) } else { T::zero() };
            rest.gyro += (gyro - rest.gyro) * weight;
            rest.force += (force - rest.force) * weight;
        } else {
            // The time before the first sample is nobody's.
            *rest = Rest { begun: true, gyro: *gyro, force: *force, anchor: *force, ..*rest };
            return false;
        }
        let still = rest.gyro.iter().all(|part| part.abs() <= self.bias_limit)
            && (gyro - rest.gyro).norm_squared() < self.rate * self.rate
            && (force - rest.force).norm_squared() < self.force * self.force
            && (rest.force - rest.anchor).norm_squared() < self.drift * self.drift;
        if !still {
            rest.still = T::zero();
            rest.anchor = rest.force;
            return false;
        }
        let longer = rest.still + dt;
        rest.still = if longer < self.time { longer } else { self.time };
        let resting = rest.still >= self.time;
        if resting {
            let longer = rest.rested + dt;
            rest.rested = if longer < self.bias_memory { longer } else { self.bias_memory };
            if rest.rested > T::zero() {
                let weight = dt / rest.rested;
                let weight = if weight < T::one() { weight } else { T::one() };
                rest.bias += (rest.gyro - rest.bias) * weight;
            }
        }
        resting
    }
}

/// What a [`RestRule`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest<T> {
    /// The gyro's bias in rad/s.
    pub bias: Vector3<T>,
    /// The low-passed gyro in rad/s.
    pub gyro: Vector3<T>,
    /// The low-passed accelerometer in m/s².
    pub force: Vector3<T>,
    /// Where that was when the body last was not still.
    pub anchor: Vector3<T>,
    /// How long in s the low-passes have been running, at most their memory.
    pub age: T,
    /// How long in s the body has been still, at most the time that makes a rest.
    pub still: T,
    /// How long in s it has rested in all, at most the bias's memory.
    pub rested: T,
    /// Whether the low-passes have begun.
    pub begun: bool,
}

impl<T: Real> Rest<T> {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self {
            bias: Vector3::zeros(),
            gyro: Vector3::zeros(),
            force: Vector3::zeros(),
            anchor: Vector3::zeros(),
            age: T::zero(),
            still: T::zero(),
            rested: T::zero(),
            begun: false,
        }
    }

    /// A sample that is not there ends a rest.
    pub(super) fn disturb(&mut self) {
        self.still = T::zero();
    }

    /// The same bias, everything else forgotten.
    pub(super) fn renew(&mut self) {
        *self = Self { bias: self.bias, rested: self.rested, ..Self::new() };
    }
}
