//! Butterworth poles of any order.

use crate::design::{Kind, small};
use crate::linear_filter::LinearFilter;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Butterworth poles at omega0: k_i = a_i omega0^i with the coefficients of the normalised Butterworth polynomial.
///
/// Order 2 with a quality factor has k_1 = sqrt(2) omega0/q, k_2 = omega0^2; with q other than 1 the poles are no
/// Butterworth poles any more, although the source keeps the name. The high-pass is maximally flat; the low-pass of
/// split = order is not (order 2 peaks by 2.09 dB). Source: Y.-H. Jeon 2015, equations (8) to (19).
///
/// Parameters
/// ----------
/// omega0 : float
///     Radius of the poles in rad/s, positive.
/// order : int
///     1 to 6.
/// q : float
///     Quality factor, for order 2 only.
/// split : int, optional
///     The low-pass takes the terms of the polynomial below this degree: the order (default) gives the steepest
///     high-pass, 1 the steepest low-pass, a true Butterworth one without zeros. A constant bias of the derivative
///     leaves no error exactly when split >= 2.
///
/// Raises
/// ------
/// ValueError
///     A parameter breaks its rule.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.Butterworth(omega0=1.0, order=2).poles.round(3)
/// array([-0.707+0.707j, -0.707-0.707j])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct Butterworth {
    /// Radius of the poles in rad/s.
    #[pyo3(get)]
    omega0: f64,
    /// Quality factor; 1 for orders other than 2.
    #[pyo3(get)]
    q: f64,
}

#[pymethods]
impl Butterworth {
    #[new]
    #[pyo3(signature = (omega0, order=2, q=1.0, split=None))]
    #[allow(clippy::float_cmp)] // 1 is the default, not a computed value.
    fn new(
        omega0: f64,
        order: i64,
        q: f64,
        split: Option<i64>,
    ) -> PyResult<PyClassInitializer<Self>> {
        let order = small("order", order)?;
        let split = split.map(|split| small("split", split)).transpose()?;
        if order != 2 && q != 1.0 {
            return Err(PyValueError::new_err("q must be 1 unless order is 2"));
        }
        let kind = Kind::Butterworth { omega0, order, q };
        LinearFilter::with(Self { omega0, q }, kind, split)
    }
}
