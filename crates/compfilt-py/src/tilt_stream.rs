//! The tilt filter's results, and its stream.

use crate::arrays::{Scalar, Signal};
use crate::design::Design;
use crate::errors::{alone, beside};
use crate::estimate::counts;
use crate::precision::with_precision;
use crate::session::{Handling, step};
use crate::state::State;
use crate::tilt_filter::TiltFilter;
use crate::tilt_session::{AnySession, Arrays, Session, Signals};
use compfilt_core::nalgebra::{ComplexField, Vector3};
use numpy::{PyArray1, PyArrayDyn};
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// All that a tilt filter knows after a run.
///
/// Attributes
/// ----------
/// angles : ndarray, shape (n, 2)
///     Roll and pitch (or phi2 and phi3) in rad, in their usual ranges; NaN before the first measurement.
/// levels : ndarray, shape (order, n, 2)
///     The levels of both filters; level 0 within one turn, pitch not yet brought into its usual range.
/// bias : ndarray, shape (n, 2)
///     The error of the angle rates in rad/s, where the design estimates one.
/// flags : ndarray of uint8, shape (n,)
///     A set of :class:`Flags` a sample.
/// counts : dict
///     How many samples carry each flag.
/// state : State
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> estimate = cf.TiltFilter(cf.FirstOrder(1.0)).estimate([[0.0, 0.0, 0.0]], [[0.0, 0.0, 9.81]], fs=100.0)
/// >>> estimate.roll
/// array([0.])
#[pyclass(frozen, module = "compfilt._core")]
pub(crate) struct TiltEstimate {
    #[pyo3(get)]
    angles: Py<PyAny>,
    #[pyo3(get)]
    levels: Py<PyAny>,
    #[pyo3(get)]
    flags: Py<PyArrayDyn<u8>>,
    #[pyo3(get)]
    state: Py<State>,
    bias_level: Option<usize>,
}

impl TiltEstimate {
    pub(crate) fn new(
        py: Python<'_>,
        design: &Design,
        arrays: Arrays<'_>,
        state: State,
    ) -> PyResult<Self> {
        let levels =
            arrays.levels.ok_or_else(|| PyValueError::new_err("the levels were not kept"))?;
        Ok(Self {
            angles: arrays.angles.unbind(),
            levels: levels.unbind(),
            flags: arrays.flags.unbind(),
            state: Py::new(py, state)?,
            bias_level: design.bias_level(),
        })
    }

    fn angle<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.angles.bind(py).getattr("T")?;
        columns.get_item(index)?.call_method0("copy")
    }
}

#[pymethods]
impl TiltEstimate {
    /// Roll in rad, a copy; with the cube's axes phi2.
    #[getter]
    fn roll<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.angle(py, 0)
    }

    /// Pitch in rad, a copy; with the cube's axes phi3.
    #[getter]
    fn pitch<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.angle(py, 1)
    }

    #[getter]
    fn bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let index = self
            .bias_level
            .ok_or_else(|| PyAttributeError::new_err("this design does not estimate a bias"))?;
        self.levels.bind(py).get_item(index)?.neg()
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        counts(self.flags.bind(py))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("TiltEstimate(angles of shape {})", self.angles.bind(py).getattr("shape")?))
    }
}

/// A tilt filter at work: samples or blocks go in as they come, the state stays.
///
/// A stream takes one call at a time: a second thread that calls it meanwhile gets a RuntimeError.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.TiltFilter(cf.FirstOrder(1.0)).stream(fs=100.0)
/// >>> stream.process([[0.0, 0.0, 0.0]], [[0.0, 0.0, 9.81]])
/// array([[0., 0.]])
#[pyclass(module = "compfilt._core")]
pub(crate) struct TiltStream {
    pub(crate) session: AnySession,
    pub(crate) handling: Handling,
    pub(crate) design: Design,
    pub(crate) made_by: Py<TiltFilter>,
    pub(crate) keywords: Py<PyDict>,
}

fn three<T: Scalar>(value: &Bound<'_, PyAny>, name: &'static str) -> PyResult<Vector3<T>> {
    let signal = Signal::new(value, name)?;
    if *signal.shape() != [3] {
        return Err(PyValueError::new_err(format!(
            "{name} must be three numbers, got the shape {:?}",
            signal.shape()
        )));
    }
    let array = signal.typed::<T>()?;
    let view = array.as_array();
    Ok(Vector3::new(view[0], view[1], view[2]))
}

fn update<'py, T: Scalar>(
    py: Python<'py>,
    session: &mut Session<T>,
    handling: Handling,
    gyr: &Bound<'py, PyAny>,
    acc: &Bound<'py, PyAny>,
    dt: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let (gyr, acc) = (three::<T>(gyr, "gyr")?, three::<T>(acc, "acc")?);
    let present =
        gyr.iter().chain(acc.iter()).all(ComplexField::is_finite) && acc != Vector3::zeros();
    if handling.raise_missing && !present {
        return Err(PyValueError::new_err(
            "gyr or acc is missing (NaN, infinite or zero force), and missing is \"raise\"",
        ));
    }
    let dt = step::<T>(session.fs, &mut session.time, dt)?;
    let angles = session.runner.update(&gyr, &acc, dt);
    Ok(PyArray1::from_iter(py, angles.iter().copied()).into_any())
}

impl TiltStream {
    fn stored(&self) -> State {
        with_precision!(&self.session, session => session.state())
    }
}

#[pymethods]
impl TiltStream {
    /// One sample: gyr in rad/s and acc in m/s^2, three numbers each; dt in seconds where the stream has no fs. Returns the
    /// two angles in rad.
    #[pyo3(signature = (gyr, acc, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let handling = this.handling;
        with_precision!(&mut this.session, session => update(py, session, handling, gyr, acc, dt))
    }

    /// A block of samples, (n, 3) each; the state is carried on. Returns the angles, (n, 2).
    #[pyo3(signature = (gyr, acc, t=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let signals = Signals::new(gyr, acc, t)?;
        let handling = this.handling;
        let arrays = with_precision!(&mut this.session, session => session.process(py, &signals, handling, false))?;
        Ok(arrays.angles)
    }

    /// A block of samples like ``process``, with all levels, flags and counts. Returns a :class:`TiltEstimate`.
    #[pyo3(signature = (gyr, acc, t=None))]
    fn estimate<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<TiltEstimate> {
        let this = &mut *alone(slf)?;
        let signals = Signals::new(gyr, acc, t)?;
        let handling = this.handling;
        let (arrays, state) = with_precision!(&mut this.session, session => {
            (session.process(py, &signals, handling, true)?, session.state())
        });
        TiltEstimate::new(py, &this.design, arrays, state)
    }

    /// Forgets the state: waits for the first measurement, or starts from ``initial`` as in ``estimate``.
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
