//! First order: one time constant.

use super::{Chain, chain_design};
use crate::error::positive;
use crate::{Error, Real, Rule};

/// The first-order complementary filter with the time constant `tau` in seconds.
///
/// ```text
/// LP(s) = 1/(tau s + 1),   HP(s) = tau s/(tau s + 1),   k_1 = 1/tau
/// ```
///
/// At a fixed sample period it is `φ = α (φ + dt ω) + (1 - α) φ_acc` with `α = tau/(tau + dt)`. A constant bias `b` of
/// the input leaves the error `tau b`. Source: the classical angle filter of balancing robots.
///
/// ```
/// use compfilt_core::{FirstOrder, Recurrence, State};
/// let gains = FirstOrder::new(1.0_f64)?.at(0.25)?;
/// let mut state = State::at_rest::<f64>(0.0);
/// // The step response of the low-pass: 1 - α^n with α = tau/(tau + dt) = 0.8.
/// gains.step(&mut state, 1.0, 0.0);
/// gains.step(&mut state, 1.0, 0.0);
/// assert!((state.levels[0] - (1.0 - 0.8 * 0.8)).abs() < 1e-15);
/// assert_eq!(FirstOrder::new(0.0_f64).unwrap_err().to_string(), "tau must be positive and finite");
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FirstOrder<T> {
    tau: T,
    chain: Chain<T, 1, 1>,
}

impl<T: Real> FirstOrder<T> {
    /// The filter with the time constant `tau` in seconds.
    ///
    /// # Errors
    /// `tau` is not positive and finite, or 1/`tau` is not representable.
    pub fn new(tau: T) -> Result<Self, Error> {
        let k1 = T::one() / positive("tau", tau)?;
        Ok(Self { tau, chain: Chain::of_design("tau", [k1])? })
    }

    /// The time constant in seconds.
    pub fn tau(&self) -> T {
        self.tau
    }
}

chain_design!(FirstOrder<T>, 1, 1);

/// The time constant of the weight `alpha` at the sample rate `fs` in Hz: `tau = alpha / ((1 - alpha) fs)`.
///
/// # Errors
/// `alpha` is not between 0 and 1, `fs` is not positive and finite.
pub fn alpha_to_tau<T: Real>(alpha: T, fs: T) -> Result<T, Error> {
    if !(alpha > T::zero() && alpha < T::one()) {
        return Err(Error::new("alpha", Rule::Between(0, 1)));
    }
    positive("alpha", alpha / ((T::one() - alpha) * positive("fs", fs)?))
        .map_err(|_| Error::new("alpha", Rule::Representable))
}

/// The weight of the time constant `tau` in seconds at the sample rate `fs` in Hz: `alpha = tau fs / (tau fs + 1)`.
///
/// # Errors
/// `tau` or `fs` is not positive and finite.
pub fn tau_to_alpha<T: Real>(tau: T, fs: T) -> Result<T, Error> {
    let samples = positive("tau", tau)? * positive("fs", fs)?;
    Ok(if samples.is_finite() { samples / (samples + T::one()) } else { T::one() })
}
