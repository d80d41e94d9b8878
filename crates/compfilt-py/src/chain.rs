//! Any chain, by its coefficients.

use crate::design::{Kind, MAX_ORDER, small};
use crate::linear_filter::LinearFilter;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Any complementary filter on a chain of integrators, by its coefficients k_1 ... k_N.
///
/// Parameters
/// ----------
/// coefficients : sequence of float
///     k_1 ... k_N of s^N + k_1 s^(N-1) + ... + k_N, positive; 1 to 6 of them. All roots must lie in the left half plane.
/// derivative_order : int
///     Which derivative of the measurement the second signal is.
/// split : int, optional
///     As in :class:`Butterworth`; only with derivative_order 1.
///
/// Raises
/// ------
/// ValueError
///     The filter would be unstable, or a parameter breaks its rule.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.Chain([3.0, 3.0, 1.0], derivative_order=2).poles.real.round(9)
/// array([-1., -1., -1.])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct Chain;

#[pymethods]
impl Chain {
    #[new]
    #[pyo3(signature = (coefficients, derivative_order=1, split=None))]
    fn new(
        coefficients: Vec<f64>,
        derivative_order: i64,
        split: Option<i64>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let derivative_order = small("derivative_order", derivative_order)?;
        let split = split.map(|split| small("split", split)).transpose()?;
        if !(1..=MAX_ORDER).contains(&coefficients.len()) {
            return Err(PyValueError::new_err(format!(
                "coefficients must be 1 to {MAX_ORDER} numbers, got {}",
                coefficients.len()
            )));
        }
        LinearFilter::with(Self, Kind::Chain { coefficients, derivative_order }, split)
    }
}
