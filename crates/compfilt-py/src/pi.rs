//! The PI form.

use crate::design::Kind;
use crate::linear_filter::LinearFilter;
use pyo3::prelude::*;

/// Second order in PI form: LP(s) = (kp s + ki)/(s^2 + kp s + ki), HP(s) = s^2/(the same).
///
/// Level 1 rests at minus the bias of the derivative, so that a constant bias leaves no error. Source: E. Iontchev,
/// R. Miletiev, L. Hristov, equations (11) to (13).
///
/// Parameters
/// ----------
/// kp : float
///     Proportional gain in 1/s, positive.
/// ki : float
///     Integral gain in 1/s^2, positive.
///
/// Raises
/// ------
/// ValueError
///     A gain is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.PiForm(kp=20.0, ki=10.0).coefficients
/// (20.0, 10.0)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct PiForm {
    /// Proportional gain in 1/s.
    #[pyo3(get)]
    kp: f64,
    /// Integral gain in 1/s^2.
    #[pyo3(get)]
    ki: f64,
}

#[pymethods]
impl PiForm {
    #[new]
    fn new(kp: f64, ki: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { kp, ki }, Kind::PiForm { kp, ki }, None)
    }
}
