//! A checked time step.

use crate::{Error, Real, Rule};

/// A time step in seconds, finite and not negative: gains made from it cannot fail.
///
/// ```
/// use compfilt_core::Dt;
/// assert!(Dt::new(0.01_f32).is_ok());
/// assert_eq!(Dt::new(-1.0_f64).unwrap_err().to_string(), "dt must be finite and not negative");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dt<T>(T);

impl<T: Real> Dt<T> {
    /// Checks `seconds`.
    ///
    /// # Errors
    /// `dt` is NaN, infinite or negative.
    pub fn new(seconds: T) -> Result<Self, Error> {
        if seconds.is_finite() && seconds >= nalgebra::zero() {
            Ok(Self(seconds))
        } else {
            Err(Error::new("dt", Rule::NotNegative))
        }
    }

    /// The step of a sample rate: 1/`hertz`.
    ///
    /// # Errors
    /// `fs` is not positive and finite, or its period overflows.
    pub fn from_rate(hertz: T) -> Result<Self, Error> {
        let period = T::one() / crate::error::positive("fs", hertz)?;
        crate::error::positive("fs", period).map(Self)
    }

    /// The step in seconds.
    pub fn seconds(self) -> T {
        self.0
    }
}
