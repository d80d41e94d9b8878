//! Any chain, by its coefficients.

use crate::design::{Kind, MAX_ORDER, small};
use crate::linear_filter::LinearFilter;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

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

    /// The chain that a system of SciPy is.
    ///
    /// Parameters
    /// ----------
    /// system : scipy.signal.lti or dlti
    ///     Of one input, the measurement: the low-pass; the high-pass follows from it. Or of two, the measurement and the
    ///     derivative. Output 0 is level 0; others do not matter, nor does what the states stand for.
    /// derivative_order : int, optional
    ///     Which derivative of the measurement the second signal is. Left out: what fits a system with two inputs, 1 for
    ///     one with one.
    /// rule : {"backward_euler", "matched"}
    ///     The rule that made a discrete system.
    ///
    /// Returns
    /// -------
    /// Chain
    ///     With the system's poles, its responses to 1e-6 of their size, and the split that fits them.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     SciPy is not installed: the extra ``design``.
    /// TypeError
    ///     system is no system of scipy.signal.
    /// ValueError
    ///     It is no chain: it is not stable, it changes a constant measurement, the numerator of its low-pass is not the end
    ///     of its denominator, its branches do not sum to 1, or it has more than 6 states.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> from scipy import signal
    /// >>> cf.Chain.from_scipy(signal.TransferFunction([0.25], [1.0, 1.0, 0.25])).split
    /// 1
    /// >>> cf.Chain.from_scipy(signal.TransferFunction([2.0], [1.0, 1.0]))
    /// Traceback (most recent call last):
    ///     ...
    /// ValueError: system must pass a constant measurement unchanged, its gain is 2
    #[staticmethod]
    #[pyo3(signature = (system, *, derivative_order=None, rule="backward_euler"))]
    fn from_scipy<'py>(
        system: &Bound<'py, PyAny>,
        derivative_order: Option<i64>,
        rule: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        recognised(system, "from_scipy", derivative_order, rule)
    }

    /// The chain that a system of python-control is.
    ///
    /// Parameters
    /// ----------
    /// system : control.StateSpace or control.TransferFunction
    ///     As in ``from_scipy``.
    /// derivative_order, rule
    ///     As in ``from_scipy``.
    ///
    /// Returns
    /// -------
    /// Chain
    ///     As in ``from_scipy``.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     python-control is not installed.
    /// TypeError
    ///     system is no system of python-control.
    /// ValueError
    ///     It is no chain; the reasons are those of ``from_scipy``.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> chain = cf.Chain.from_control(cf.ThirdOrder(tau=2.0).to_control())
    /// >>> chain.derivative_order, [round(k, 6) for k in chain.coefficients]
    /// (2, [1.5, 0.75, 0.125])
    #[staticmethod]
    #[pyo3(signature = (system, *, derivative_order=None, rule="backward_euler"))]
    fn from_control<'py>(
        system: &Bound<'py, PyAny>,
        derivative_order: Option<i64>,
        rule: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        recognised(system, "from_control", derivative_order, rule)
    }
}

/// The chain that another library's system is: `compfilt.interop` knows the libraries.
fn recognised<'py>(
    system: &Bound<'py, PyAny>,
    from: &str,
    derivative_order: Option<i64>,
    rule: &str,
) -> PyResult<Bound<'py, PyAny>> {
    crate::options::rule(rule)?;
    if let Some(order) = derivative_order {
        small("derivative_order", order)?;
    }
    let py = system.py();
    let keywords = PyDict::new(py);
    keywords.set_item("derivative_order", derivative_order)?;
    keywords.set_item("rule", rule)?;
    let interop = py.import("compfilt.interop")?;
    let matrices = interop.call_method1(from, (system,))?;
    interop.getattr("recognise")?.call((matrices,), Some(&keywords))
}
