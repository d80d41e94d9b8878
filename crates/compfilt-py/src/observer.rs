//! The observer as a Python class.

use crate::arrays::{Precision, Signal};
use crate::observer_session::{AnySession, Matrices, Session};
use crate::observer_stream::{ObserverEstimate, ObserverStream};
use crate::options::choice;
use crate::precision::with_precision;
use crate::session::precision_of;
use numpy::ndarray::{Array2, Ix2};
use numpy::{PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A Luenberger observer, or a steady-state Kalman filter, of a linear system in discrete time.
///
///     x(k+1) = A x(k) + B u(k) + L (y(k) - C x(k))
///
/// The error obeys e(k+1) = (A - L C) e(k): its eigenvalues are ``poles``, and it decays if all lie inside the unit circle.
/// ``compfilt.design.luenberger`` designs L. Source: the balancing cube's section 1.4.
///
/// Parameters
/// ----------
/// A : array_like, shape (n, n)
/// B : array_like, shape (n, m)
///     m may be 0.
/// C : array_like, shape (p, n)
/// L : array_like, shape (n, p)
/// correction : array_like, shape (n, p), optional
///     The gain of the filtered estimate, A correction = L. Left out, the equation is solved; where A is singular and it has no
///     solution the filtered estimates are NaN.
///
/// Raises
/// ------
/// ValueError
///     A matrix is not finite, or the shapes do not fit.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> A, B, C = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]]), np.array([[1.0, 0.0]])
/// >>> observer = cf.Observer(A, B, C, L=[[0.6], [1.0]])
/// >>> predicted, filtered = observer.run(y=[1.0, 1.0], u=[0.0, 0.0])
/// >>> filtered.round(6)
/// array([[0.5, 1. ],
///        [0.8, 1.4]])
/// >>> abs(observer.poles).round(4)
/// array([0.7071, 0.7071])
#[pyclass(frozen, eq, module = "compfilt._core")]
#[derive(Clone, PartialEq)]
pub(crate) struct Observer {
    pub(crate) matrices: Matrices,
}

fn matrix(object: &Bound<'_, PyAny>, name: &'static str) -> PyResult<Array2<f64>> {
    let signal = Signal::new(object, name)?;
    let values = signal.typed::<f64>()?;
    let values = values.as_array().into_dimensionality::<Ix2>().map_err(|_| {
        PyValueError::new_err(format!(
            "{name} must have two axes, got the shape {:?}",
            signal.shape()
        ))
    })?;
    if values.iter().any(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(format!("{name} must be finite")));
    }
    // Adding zero makes -0 the same as 0.
    Ok(values.map(|value| value + 0.0))
}

fn shaped(matrix: Array2<f64>, name: &str, rows: usize, columns: usize) -> PyResult<Array2<f64>> {
    match matrix.dim() {
        shape if shape == (rows, columns) => Ok(matrix),
        shape => Err(PyValueError::new_err(format!(
            "{name} must have the shape ({rows}, {columns}), got {shape:?}"
        ))),
    }
}

/// The solution of `A x = L`, or NaN if there is none.
fn solve(py: Python<'_>, a: &Array2<f64>, l: &Array2<f64>) -> PyResult<Array2<f64>> {
    let least_squares = py.import("numpy")?.getattr("linalg")?.getattr("lstsq")?;
    let solve = |right: &Array2<f64>| -> PyResult<Array2<f64>> {
        let answer = least_squares.call1((array(py, a), array(py, right), 1e-13))?.get_item(0)?;
        Ok(answer.cast::<PyArray2<f64>>()?.to_owned_array())
    };
    let mut solution = solve(l)?;
    // One round of refinement: A may be badly scaled.
    let rest = l - &a.dot(&solution);
    solution += &solve(&rest)?;
    if largest(&(a.dot(&solution) - l)) > 1e-9 * largest(l) {
        solution.fill(f64::NAN);
    }
    Ok(solution)
}

fn largest(matrix: &Array2<f64>) -> f64 {
    matrix.iter().fold(0.0, |most, x| most.max(x.abs()))
}

fn array<'py>(py: Python<'py>, matrix: &Array2<f64>) -> Bound<'py, PyArray2<f64>> {
    PyArray2::from_array(py, matrix)
}

/// The observer as another library's system: `compfilt.interop` knows the libraries.
fn converted<'py>(
    observer: &Bound<'py, Observer>,
    into: &str,
    fs: Option<f64>,
    output: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let py = observer.py();
    let keywords = PyDict::new(py);
    keywords.set_item("fs", fs)?;
    keywords.set_item("output", output)?;
    let interop = py.import("compfilt.interop")?;
    let system = interop.getattr("of_observer")?.call((observer,), Some(&keywords))?;
    interop.call_method1(into, (system,))
}

#[pymethods]
#[allow(non_snake_case)] // The equation's names.
impl Observer {
    #[new]
    #[pyo3(signature = (A, B, C, L, correction=None))]
    fn new(
        py: Python<'_>,
        A: &Bound<'_, PyAny>,
        B: &Bound<'_, PyAny>,
        C: &Bound<'_, PyAny>,
        L: &Bound<'_, PyAny>,
        correction: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (a, b, c, l) = (matrix(A, "A")?, matrix(B, "B")?, matrix(C, "C")?, matrix(L, "L")?);
        let (states, outputs, inputs) = (a.nrows(), c.nrows(), b.ncols());
        if states == 0 || outputs == 0 {
            return Err(PyValueError::new_err("A and C must not be empty"));
        }
        let a = shaped(a, "A", states, states)?;
        let b = shaped(b, "B", states, inputs)?;
        let c = shaped(c, "C", outputs, states)?;
        let l = shaped(l, "L", states, outputs)?;
        let correction = match correction {
            None => solve(py, &a, &l)?,
            Some(given) => {
                let given = shaped(matrix(given, "correction")?, "correction", states, outputs)?;
                if largest(&(a.dot(&given) - &l)) > 1e-6 * largest(&l) {
                    return Err(PyValueError::new_err(
                        "correction must be such that A correction = L",
                    ));
                }
                given
            }
        };
        Ok(Self { matrices: Matrices { a, b, c, l, correction } })
    }

    /// The eigenvalues of A - L C, the largest first.
    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Matrices { a, c, l, .. } = &self.matrices;
        let numpy = py.import("numpy")?;
        let eigenvalues =
            numpy.getattr("linalg")?.call_method1("eigvals", (array(py, &(a - &l.dot(c))),))?;
        let eigenvalues = eigenvalues.call_method1("astype", ("complex128",))?;
        let sizes = numpy.call_method1("abs", (&eigenvalues,))?.neg()?;
        eigenvalues.get_item(numpy.call_method1("argsort", (sizes,))?)
    }

    #[getter]
    fn A<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.matrices.a)
    }

    #[getter]
    fn B<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.matrices.b)
    }

    #[getter]
    fn C<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.matrices.c)
    }

    #[getter]
    fn L<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.matrices.l)
    }

    /// The gain of the filtered estimate.
    #[getter]
    fn correction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        array(py, &self.matrices.correction)
    }

    /// Runs over two arrays.
    ///
    /// Parameters
    /// ----------
    /// y : array_like, shape (samples, p), or (samples,) if p is 1
    ///     The outputs. A component that is NaN or infinite is missing and corrects nothing.
    /// u : array_like, shape (samples, m), or (samples,) if m is 1
    ///     The inputs, each applied from its sample to the next. One that is missing is held, 0 before the first.
    /// initial : array_like, shape (n,), or State, optional
    ///     The estimate at the first sample, before its correction; zeros where it is left out.
    /// missing : {"coast", "raise"}
    ///
    /// Returns
    /// -------
    /// predicted, filtered : ndarray, shape (samples, n)
    ///     The estimate before and after each sample's correction.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The shapes do not fit, or a sample is missing and missing is "raise".
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> observer = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]])
    /// >>> observer.run(y=[2.0], u=[1.0], initial=[1.0])
    /// (array([[1.]]), array([[1.5]]))
    #[pyo3(signature = (y, u, *, initial=None, missing="coast"))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        initial: Option<&Bound<'py, PyAny>>,
        missing: &str,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let estimate = self.estimate(py, y, u, initial, missing)?;
        Ok((estimate.predicted.into_bound(py), estimate.filtered.into_bound(py)))
    }

    /// The same, with flags, counts and the state after the last sample. Returns an :class:`ObserverEstimate`.
    #[pyo3(signature = (y, u, *, initial=None, missing="coast"))]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        initial: Option<&Bound<'py, PyAny>>,
        missing: &str,
    ) -> PyResult<ObserverEstimate> {
        let raise = choice("missing", missing, &[("coast", false), ("raise", true)])?;
        let (y, u) = (Signal::new(y, "y")?, Signal::new(u, "u")?);
        let mut session = self.session(y.precision.with(u.precision));
        with_precision!(&mut session, session => {
            session.start(initial)?;
            session.process(py, &y, &u, raise)
        })
    }

    /// An observer that carries its state: for samples and blocks as they come.
    ///
    /// Parameters
    /// ----------
    /// initial, missing
    ///     As in ``run``.
    /// dtype : dtype
    ///     float64 or float32.
    ///
    /// Returns
    /// -------
    /// ObserverStream
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> stream = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]]).stream(initial=[1.0])
    /// >>> stream.correct([2.0])
    /// array([1.5])
    /// >>> stream.predict([1.0])
    /// array([1.75])
    #[pyo3(signature = (*, initial=None, dtype=None, missing="coast"))]
    fn stream<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        initial: Option<&Bound<'py, PyAny>>,
        dtype: Option<&Bound<'py, PyAny>>,
        missing: &str,
    ) -> PyResult<ObserverStream> {
        let raise = choice("missing", missing, &[("coast", false), ("raise", true)])?;
        let precision = precision_of(dtype)?;
        let mut session = slf.get().session(precision);
        with_precision!(&mut session, session => session.start(initial))?;
        let keywords = PyDict::new(py);
        keywords.set_item("dtype", precision.name())?;
        keywords.set_item("missing", missing)?;
        Ok(ObserverStream {
            session,
            raise,
            made_by: slf.clone().unbind(),
            keywords: keywords.unbind(),
        })
    }

    /// The observer as a ``scipy.signal.StateSpace`` in discrete time, from y and u to the estimate.
    ///
    /// Parameters
    /// ----------
    /// fs : float, optional
    ///     Sample rate in Hz. None: ``dt`` is True, a period that is not stated.
    /// output : {"filtered", "predicted"}
    ///     The estimate after the sample's correction, or before it.
    ///
    /// Returns
    /// -------
    /// scipy.signal.StateSpace
    ///     The inputs are those of y, then those of u. The state is the estimate before the sample's correction, so that an
    ///     initial state is what ``initial`` is to ``run``.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     SciPy is not installed: the extra ``design``.
    /// ValueError
    ///     fs is not positive and finite, or there is no filtered estimate.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> observer = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]])
    /// >>> observer.to_scipy(fs=10.0).B
    /// array([[0.25, 1.  ]])
    #[pyo3(signature = (*, fs=None, output="filtered"))]
    fn to_scipy<'py>(
        slf: &Bound<'py, Self>,
        fs: Option<f64>,
        output: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        converted(slf, "to_scipy", fs, output)
    }

    /// The observer as a ``control.StateSpace`` of python-control in discrete time, with names of inputs, outputs and states.
    ///
    /// Parameters
    /// ----------
    /// fs, output
    ///     As in ``to_scipy``.
    ///
    /// Returns
    /// -------
    /// control.StateSpace
    ///     As in ``to_scipy``.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     python-control is not installed.
    /// ValueError
    ///     fs is not positive and finite, or there is no filtered estimate.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> observer = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]])
    /// >>> observer.to_control(fs=10.0).input_labels
    /// ['y0', 'u0']
    #[pyo3(signature = (*, fs=None, output="filtered"))]
    fn to_control<'py>(
        slf: &Bound<'py, Self>,
        fs: Option<f64>,
        output: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        converted(slf, "to_control", fs, output)
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        format!("{:?}", self.matrices).hash(&mut hasher);
        hasher.finish()
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Matrices { a, b, c, l, correction } = &self.matrices;
        let matrices = [a, b, c, l].map(|matrix| array(py, matrix));
        let [a, b, c, l] = matrices;
        let known = correction.iter().all(|value| value.is_finite());
        let correction = known.then(|| array(py, correction));
        Ok((a, b, c, l, correction).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let (states, inputs) = self.matrices.b.dim();
        format!("Observer({states} states, {inputs} inputs, {} outputs)", self.matrices.c.nrows())
    }
}

impl Observer {
    fn session(&self, precision: Precision) -> AnySession {
        match precision {
            Precision::Single => AnySession::Single(Session::new(&self.matrices)),
            Precision::Double => AnySession::Double(Session::new(&self.matrices)),
        }
    }
}
