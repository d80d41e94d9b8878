//! Conversions between the weight alpha and the time constant.

use crate::errors::value_error;
use pyo3::prelude::*;

/// The time constant in seconds of the weight alpha at the sample rate fs in Hz: tau = alpha/((1 - alpha) fs).
///
/// The same alpha means another time constant at another rate: that is why no filter takes it.
///
/// Parameters
/// ----------
/// alpha : float
///     Weight of the prediction, between 0 and 1.
/// fs : float
///     Sample rate in Hz.
///
/// Raises
/// ------
/// ValueError
///     alpha is not between 0 and 1, or fs is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> round(cf.alpha_to_tau(0.98, fs=100.0), 9)
/// 0.49
#[pyfunction]
#[pyo3(signature = (alpha, fs))]
pub(crate) fn alpha_to_tau(alpha: f64, fs: f64) -> PyResult<f64> {
    compfilt_core::linear::alpha_to_tau(alpha, fs).map_err(value_error)
}

/// The weight of the time constant tau in seconds at the sample rate fs in Hz: alpha = tau fs/(tau fs + 1).
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds.
/// fs : float
///     Sample rate in Hz.
///
/// Raises
/// ------
/// ValueError
///     tau or fs is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.tau_to_alpha(0.5, fs=2.0)
/// 0.5
#[pyfunction]
#[pyo3(signature = (tau, fs))]
pub(crate) fn tau_to_alpha(tau: f64, fs: f64) -> PyResult<f64> {
    compfilt_core::linear::tau_to_alpha(tau, fs).map_err(value_error)
}
