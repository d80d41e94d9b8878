//! Second order, inertial: position and velocity.

use crate::design::Kind;
use crate::linear_filter::LinearFilter;
use pyo3::prelude::*;
use pyo3::types::PyType;

/// Second order, inertial: position and acceleration give position and velocity.
///
///     x_0' = x_1 + k_1 e,   x_1' = u + k_2 e,   e = y - x_0
///
/// SecondOrderInertial(tau) is critically damped: k = 2/tau, 1/tau^2. A constant bias b of the acceleration leaves the
/// position error b/k_2.
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     A parameter is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.SecondOrderInertial(tau=0.5).coefficients
/// (4.0, 4.0)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct SecondOrderInertial;

#[pymethods]
impl SecondOrderInertial {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self, Kind::SecondOrderInertial { tau }, None)
    }

    /// Butterworth poles at omega0 in rad/s: k = sqrt(2) omega0, omega0^2.
    #[classmethod]
    fn butterworth(class: &Bound<'_, PyType>, omega0: f64) -> PyResult<Py<Self>> {
        let kind = Kind::SecondOrderInertialButterworth { omega0 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }
}
