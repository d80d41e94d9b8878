//! Second order, inertial: position and acceleration give position and velocity.

use super::butterworth::butterworth_coefficients;
use super::{Chain, chain_design};
use crate::error::positive;
use crate::{Error, Real};

/// The second-order inertial filter: a measured position corrects a twice integrated acceleration.
///
/// ```text
/// ẋ_0 = x_1 + k_1 e,   ẋ_1 = u + k_2 e,   e = y - x_0
/// ```
///
/// The third-order filter without its bias: a constant bias `b` of the acceleration leaves the position error
/// `b/k_2`. Levels: position, velocity.
///
/// ```
/// use compfilt_core::SecondOrderInertial;
/// let chain = SecondOrderInertial::new(0.5_f64)?.chain();
/// assert_eq!(chain.coefficients(), &[4.0, 4.0]);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SecondOrderInertial<T> {
    chain: Chain<T, 2, 2>,
}

impl<T: Real> SecondOrderInertial<T> {
    /// Critically damped, a double pole at -1/`tau`: `k = 2/tau, 1/tau²`.
    ///
    /// # Errors
    /// `tau` is not positive and finite, or one of the coefficients is not representable.
    pub fn new(tau: T) -> Result<Self, Error> {
        let rate = T::one() / positive("tau", tau)?;
        let coefficients = [T::literal(2.0) * rate, rate * rate];
        Ok(Self { chain: Chain::of_design("tau", coefficients)? })
    }

    /// Butterworth poles at `omega0` in rad/s: `k = √2 omega0, omega0²`.
    ///
    /// # Errors
    /// `omega0` is not positive and finite, or one of the coefficients is not representable.
    pub fn butterworth(omega0: T) -> Result<Self, Error> {
        let coefficients = butterworth_coefficients(positive("omega0", omega0)?);
        Ok(Self { chain: Chain::of_design("omega0", coefficients)? })
    }
}

chain_design!(SecondOrderInertial<T>, 2, 2);
