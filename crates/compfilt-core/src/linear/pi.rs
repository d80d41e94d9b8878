//! The PI form: proportional and integral gain.

use super::{Chain, chain_design};
use crate::error::positive;
use crate::{Error, Real};

/// The second-order complementary filter in proportional-integral form.
///
/// ```text
/// LP(s) = (k_p s + k_i)/(s² + k_p s + k_i),   HP(s) = s²/(the same),   k_1 = k_p, k_2 = k_i
/// ```
///
/// Its level 1 rests at minus the bias of the input, so that a constant bias leaves no error.
/// `k_p` is in 1/s, `k_i` in 1/s². Source: E. Iontchev, R. Miletiev, L. Hristov, equations (11) to (13).
///
/// ```
/// use compfilt_core::{PiForm, Recurrence, State};
/// let gains = PiForm::new(20.0_f64, 10.0)?.at(0.01)?;
/// let mut state = State::at_rest::<f64>(0.0);
/// for _ in 0..5000 {
///     gains.step(&mut state, 0.0, 0.03); // a gyro at rest that reads 0.03 rad/s
/// }
/// assert!(state.levels[0].abs() < 1e-9 && (state.levels[1] + 0.03).abs() < 1e-9);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PiForm<T> {
    chain: Chain<T, 2, 1>,
}

impl<T: Real> PiForm<T> {
    /// The filter with the gains `kp` in 1/s and `ki` in 1/s².
    ///
    /// # Errors
    /// A gain is not positive and finite.
    pub fn new(kp: T, ki: T) -> Result<Self, Error> {
        let coefficients = [positive("kp", kp)?, positive("ki", ki)?];
        Ok(Self { chain: Chain::of_design("kp", coefficients)? })
    }
}

chain_design!(PiForm<T>, 2, 1);
