//! Third order: position and acceleration give position, velocity and the acceleration's bias.

use super::butterworth::butterworth_coefficients;
use super::{Chain, chain_design};
use crate::error::positive;
use crate::{Error, Real};

/// The third-order complementary filter: a measured position corrects a twice integrated acceleration.
///
/// ```text
/// ẋ_0 = x_1 + k_1 e,   ẋ_1 = x_2 + u + k_2 e,   ẋ_2 = k_3 e,   e = y - x_0
/// ```
///
/// Levels: position, velocity, minus the bias of the acceleration. By backward Euler the velocity is half a sample
/// late; [`matched`](Self::matched) is not. Source: the "third-order" figure of the Chinese note on the origin of `K_P`
/// and `K_I`, with the sign of the error mended (`e = s_m - s_c`).
///
/// ```
/// use compfilt_core::{Recurrence, State, ThirdOrder};
/// let gains = ThirdOrder::new(2.0_f64)?.at(0.01)?;
/// let mut state = State::at_rest::<f64>(0.0);
/// for _ in 0..10_000 {
///     gains.step(&mut state, 5.0, 0.2); // standing at 5 m with an accelerometer that reads 0.2 m/s²
/// }
/// assert!((state.levels[0] - 5.0).abs() < 1e-9 && (state.levels[2] + 0.2).abs() < 1e-9);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ThirdOrder<T> {
    chain: Chain<T, 3, 2>,
}

impl<T: Real> ThirdOrder<T> {
    /// A triple pole at -1/`tau`: `k = 3/tau, 3/tau², 1/tau³`.
    ///
    /// # Errors
    /// `tau` is not positive and finite, or one of the coefficients is not representable.
    pub fn new(tau: T) -> Result<Self, Error> {
        let rate = T::one() / positive("tau", tau)?;
        let three = T::literal(3.0);
        let coefficients = [three * rate, three * (rate * rate), rate * rate * rate];
        Ok(Self { chain: Chain::of_design("tau", coefficients)? })
    }

    /// Butterworth poles at `omega0` in rad/s: `k = 2 omega0, 2 omega0², omega0³`.
    ///
    /// # Errors
    /// `omega0` is not positive and finite, or one of the coefficients is not representable.
    pub fn butterworth(omega0: T) -> Result<Self, Error> {
        let coefficients = butterworth_coefficients(positive("omega0", omega0)?);
        Ok(Self { chain: Chain::of_design("omega0", coefficients)? })
    }

    /// The gains themselves, in 1/s, 1/s², 1/s³.
    ///
    /// # Errors
    /// A gain is not positive and finite, or the filter would be unstable: `k1 k2` must be above `k3`.
    pub fn from_gains(k1: T, k2: T, k3: T) -> Result<Self, Error> {
        let coefficients = [positive("k1", k1)?, positive("k2", k2)?, positive("k3", k3)?];
        Ok(Self { chain: Chain::new(coefficients)? })
    }
}

chain_design!(ThirdOrder<T>, 3, 2);
