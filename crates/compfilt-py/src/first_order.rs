//! First order, by its time constant.

use crate::design::Kind;
use crate::linear_filter::LinearFilter;
use pyo3::prelude::*;

/// First order, by its time constant: LP(s) = 1/(tau s + 1), HP(s) = tau s/(tau s + 1), k_1 = 1/tau.
///
/// The classical angle filter: at a fixed rate phi = alpha (phi + dt omega) + (1 - alpha) phi_acc with
/// alpha = tau/(tau + dt). A constant bias b of the derivative leaves the error tau b.
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
/// >>> cf.FirstOrder(tau=0.5).filter([1.0, 1.0], [0.0, 0.0], fs=2.0, initial=0.0)
/// array([0.5 , 0.75])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct FirstOrder {
    /// The time constant in seconds.
    #[pyo3(get)]
    tau: f64,
}

#[pymethods]
impl FirstOrder {
    #[new]
    pub(crate) fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { tau }, Kind::FirstOrder { tau }, None)
    }
}
