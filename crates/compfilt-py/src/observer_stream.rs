//! The observer's results, and its stream.

use crate::arrays::{Scalar, Signal};
use crate::errors::{alone, beside};
use crate::estimate::counts;
use crate::observer::Observer;
use crate::observer_session::{AnySession, Session, one};
use crate::precision::with_precision;
use crate::state::State;
use compfilt_core::nalgebra::ComplexField;
use numpy::{PyArray1, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// All that an observer knows after a run.
///
/// Attributes
/// ----------
/// predicted, filtered : ndarray, shape (samples, n)
///     The estimate before and after each sample's correction.
/// flags : ndarray of uint8, shape (samples,)
///     A set of :class:`Flags` a sample: a missing output, a held input, a start anew after an overflow.
/// counts : dict
///     How many samples carry each flag.
/// state : State
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> estimate = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]]).estimate(y=[2.0, float("nan")], u=[1.0, 0.0])
/// >>> estimate.counts.get("measurement_missing")
/// 1
#[pyclass(frozen, module = "compfilt._core")]
pub(crate) struct ObserverEstimate {
    #[pyo3(get)]
    pub(crate) predicted: Py<PyAny>,
    #[pyo3(get)]
    pub(crate) filtered: Py<PyAny>,
    #[pyo3(get)]
    pub(crate) flags: Py<PyArrayDyn<u8>>,
    #[pyo3(get)]
    pub(crate) state: Py<State>,
}

#[pymethods]
impl ObserverEstimate {
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        counts(self.flags.bind(py))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let shape = self.predicted.bind(py).getattr("shape")?;
        Ok(format!("ObserverEstimate(estimates of shape {shape})"))
    }
}

/// An observer at work: samples or blocks go in as they come, the state stays.
///
/// A stream takes one call at a time: a second thread that calls it meanwhile gets a RuntimeError.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]]).stream()
/// >>> stream.update([2.0], [1.0])
/// array([1.])
#[pyclass(module = "compfilt._core")]
pub(crate) struct ObserverStream {
    pub(crate) session: AnySession,
    pub(crate) raise: bool,
    pub(crate) made_by: Py<Observer>,
    pub(crate) keywords: Py<PyDict>,
}

/// A sample, which may have to be complete.
fn sample<T: Scalar>(
    object: &Bound<'_, PyAny>,
    name: &'static str,
    width: usize,
    raise: bool,
) -> PyResult<Vec<T>> {
    let values = one::<T>(object, name, width)?;
    if raise && !values.iter().all(ComplexField::is_finite) {
        return Err(PyValueError::new_err(format!(
            "{name} is missing (NaN or infinite), and missing is \"raise\""
        )));
    }
    Ok(values)
}

fn correct<'py, T: Scalar>(
    py: Python<'py>,
    session: &mut Session<T>,
    y: &[T],
) -> Bound<'py, PyAny> {
    let mut filtered = vec![T::zero(); session.sizes().0];
    session.correct(y, &mut filtered);
    PyArray1::from_vec(py, filtered).into_any()
}

impl ObserverStream {
    fn stored(&self) -> State {
        with_precision!(&self.session, session => session.state())
    }
}

#[pymethods]
impl ObserverStream {
    /// Takes a measurement y, p numbers. Returns the filtered estimate.
    fn correct<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let raise = this.raise;
        with_precision!(&mut this.session, session => {
            let y = sample(y, "y", session.sizes().1, raise)?;
            Ok(correct(py, session, &y))
        })
    }

    /// Goes on to the next sample with the input u, m numbers, and the last correction. Returns the estimate there.
    fn predict<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let raise = this.raise;
        with_precision!(&mut this.session, session => {
            let u = sample(u, "u", session.sizes().2, raise)?;
            let (next, _) = session.predict(&u);
            Ok(PyArray1::from_slice(py, next).into_any())
        })
    }

    /// ``correct(y)``, then ``predict(u)``. Returns the filtered estimate.
    fn update<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let raise = this.raise;
        with_precision!(&mut this.session, session => {
            let (_, outputs, inputs) = session.sizes();
            let y = sample(y, "y", outputs, raise)?;
            let u = sample(u, "u", inputs, raise)?;
            let filtered = correct(py, session, &y);
            session.predict(&u);
            Ok(filtered)
        })
    }

    /// A block of samples; the state is carried on. Returns the estimates before and after each correction.
    fn process<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let estimate = Self::estimate(slf, py, y, u)?;
        Ok((estimate.predicted.into_bound(py), estimate.filtered.into_bound(py)))
    }

    /// A block of samples like ``process``, with flags and counts. Returns an :class:`ObserverEstimate`.
    fn estimate<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<ObserverEstimate> {
        let this = &mut *alone(slf)?;
        let (y, u, raise) = (Signal::new(y, "y")?, Signal::new(u, "u")?, this.raise);
        with_precision!(&mut this.session, session => session.process(py, &y, &u, raise))
    }

    /// Starts anew, from zeros or from ``initial`` as in ``run``.
    #[pyo3(signature = (initial=None))]
    fn reset(slf: &Bound<'_, Self>, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let this = &mut *alone(slf)?;
        with_precision!(&mut this.session, session => session.start(initial))
    }

    /// The state between two samples; set it to continue from there.
    #[getter]
    fn state(slf: &Bound<'_, Self>) -> PyResult<State> {
        Ok(beside(slf)?.stored())
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, state: &Bound<'_, State>) -> PyResult<()> {
        let this = &mut *alone(slf)?;
        with_precision!(&mut this.session, session => session.set_state(state.get()))
    }

    fn __eq__(slf: &Bound<'_, Self>, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let this = &*beside(slf)?;
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = &*beside(other)?;
        Ok(this.made_by.get() == other.made_by.get()
            && this.keywords.bind(py).eq(other.keywords.bind(py))?
            && this.stored() == other.stored())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let this = &*beside(slf)?;
        let restore = py.import("compfilt._core")?.getattr("_stream")?;
        let arguments = (&this.made_by, &this.keywords, this.stored());
        Ok((restore, arguments).into_pyobject(py)?.into_any())
    }

    fn __repr__(slf: &Bound<'_, Self>, py: Python<'_>) -> PyResult<String> {
        let this = &*beside(slf)?;
        Ok(format!(
            "{}.stream(**{})",
            this.made_by.bind(py).repr()?,
            this.keywords.bind(py).repr()?
        ))
    }
}
