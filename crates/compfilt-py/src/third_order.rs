//! Third order: position, velocity and the bias of the acceleration.

use crate::design::Kind;
use crate::linear_filter::LinearFilter;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Third order: position and acceleration give position, velocity and the bias of the acceleration.
///
///     x_0' = x_1 + k_1 e,   x_1' = x_2 + u + k_2 e,   x_2' = k_3 e,   e = y - x_0
///
/// ThirdOrder(tau) has a triple pole at -1/tau: k = 3/tau, 3/tau^2, 1/tau^3. By backward Euler the velocity is half a
/// sample late; with rule="matched" it is not. Source: the third-order figure of the Chinese note on the origin of K_P
/// and K_I, with the sign of the error mended.
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     A parameter is not positive and finite, or the gains are unstable.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.ThirdOrder(tau=2.0).coefficients
/// (1.5, 0.75, 0.125)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct ThirdOrder;

#[pymethods]
impl ThirdOrder {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self, Kind::ThirdOrder { tau }, None)
    }

    /// The gains themselves, in 1/s, 1/s^2, 1/s^3; stable if k1 k2 > k3.
    #[classmethod]
    fn from_gains(class: &Bound<'_, PyType>, k1: f64, k2: f64, k3: f64) -> PyResult<Py<Self>> {
        let kind = Kind::ThirdOrderGains { k1, k2, k3 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }

    /// Butterworth poles at omega0 in rad/s: k = 2 omega0, 2 omega0^2, omega0^3.
    #[classmethod]
    fn butterworth(class: &Bound<'_, PyType>, omega0: f64) -> PyResult<Py<Self>> {
        let kind = Kind::ThirdOrderButterworth { omega0 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }
}
