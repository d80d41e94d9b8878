//! The rate filter.

use crate::design::Kind;
use crate::first_order::FirstOrder;
use crate::linear_filter::LinearFilter;
use pyo3::prelude::*;

/// The rate filter of the balancing cube: a gyro through the high-pass, an integrated angular acceleration through the
/// low-pass.
///
///     a_n = a_(n-1) + dt alpha_n
///     w_n = alpha (w_(n-1) + g_n - g_(n-1)) + (1 - alpha) a_n,   alpha = tau/(tau + dt)
///
/// ``filter(measurement=gyro, derivative=angular_acceleration)`` in rad/s and rad/s^2. Unlike in the other filters the
/// measurement passes the high-pass; ``frequency_response`` returns the low branch, from the integrated angular
/// acceleration, first. The integral runs open loop: a bias
/// of the angular acceleration makes it drift, and the low-pass does not remove that. Without ``initial`` it starts at the
/// gyro's first reading, whose bias then stays. ``drift_free`` fuses the same
/// signals without drift. Source: the cube's note on complementary filters, equation (30).
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     tau is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.RateFilter(tau=1.0).filter([1.0], [0.0], fs=4.0, initial=0.0)
/// array([0.8])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct RateFilter {
    /// The time constant in seconds.
    #[pyo3(get)]
    tau: f64,
}

#[pymethods]
impl RateFilter {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { tau }, Kind::Rate { tau }, None)
    }

    /// The pair that does not drift: FirstOrder(tau), whose measurement is the gyro and whose derivative is the angular
    /// acceleration.
    #[getter]
    fn drift_free(&self, py: Python<'_>) -> PyResult<Py<FirstOrder>> {
        Py::new(py, FirstOrder::new(self.tau)?)
    }
}
