//! A gyro's rate that is held where it is missing.

use crate::Real;
use crate::linear::Flags;
use nalgebra::Vector3;

/// No gyro reads this in rad/s: a larger rate is missing, and so is one that is not a number.
const FASTEST: f64 = 1e6;

/// The last rate in rad/s and its age in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldRate<T> {
    /// The last rate; zero before the first and once it is older than it may be held.
    pub value: Vector3<T>,
    /// Seconds since it came.
    pub age: T,
}

impl<T: Real> HeldRate<T> {
    /// None yet: counts as zero.
    pub(super) fn new() -> Self {
        Self { value: Vector3::zeros(), age: T::zero() }
    }

    /// The new rate if it is there, otherwise the last for as long as `hold` seconds, then zero.
    pub(super) fn take(&mut self, rate: &Vector3<T>, dt: T, hold: T) -> (Vector3<T>, Flags) {
        if rate.iter().all(|part| part.abs() < T::literal(FASTEST)) {
            *self = Self { value: *rate, age: T::zero() };
            return (*rate, Flags::default());
        }
        self.age += dt;
        if self.age <= hold {
            return (self.value, Flags::DERIVATIVE_HELD);
        }
        self.value = Vector3::zeros();
        (self.value, Flags::DERIVATIVE_MISSING)
    }
}
