//! A signal that is held where it is missing.

use super::Flags;
use crate::Real;

/// The last value of a signal and its age.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Held<T> {
    /// The last value, NaN before the first; zero once it is older than it may be held.
    pub value: T,
    /// Seconds since it came.
    pub age: T,
}

impl<T: Real> Held<T> {
    pub(crate) fn new() -> Self {
        Self { value: T::NAN, age: T::zero() }
    }

    /// Takes a value that is there.
    pub fn renew(&mut self, value: T) {
        *self = Self { value, age: T::zero() };
    }

    /// The new value if there is one, otherwise the last for as long as `hold`, then zero.
    #[inline]
    pub(crate) fn take(&mut self, value: T, dt: T, hold: T) -> (T, Flags) {
        if value.is_finite() {
            self.renew(value);
            return (value, Flags::default());
        }
        self.age += dt;
        if self.value.is_finite() && self.age <= hold {
            return (self.value, Flags::DERIVATIVE_HELD);
        }
        self.value = T::zero();
        (self.value, Flags::DERIVATIVE_MISSING)
    }
}
