//! The attitude filters' results, and their stream.

use crate::arrays::{Precision, Scalar, Signal};
use crate::attitude_family::{Output, Sample};
use crate::attitude_session::{AnySession, Arrays, Session, Signals};
use crate::errors::{alone, beside};
use crate::estimate::counts;
use crate::precision::with_precision;
use crate::session::{Handling, step};
use crate::state::State;
use compfilt_core::attitude::Rotation;
use compfilt_core::nalgebra::{ComplexField, Vector3};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// All that an attitude filter knows after a run.
///
/// Attributes
/// ----------
/// quaternion : ndarray, shape (n, 4)
///     Scalar first, from body to world (z up; x east, y north with a magnetometer, heading 0 at the start without); NaN before the
///     first measurement.
/// up : ndarray, shape (n, 3)
///     The world's up in body axes, a unit vector.
/// gyro_bias : ndarray, shape (n, 3)
///     In rad/s: what the gyro reads too much.
/// at_rest : ndarray of bool, shape (n,)
///     Whether the filter takes the body to be at rest; False where it does not look for that.
/// calibration : ndarray, shape (3, 3), or None
///     The gyro's sensitivity errors M after the last sample, where the filter learns them: the gyro reads bias + M rate too much.
/// gyro_delay : float or None
///     The delay in seconds after the last sample, where the filter learns it.
/// flags : ndarray of uint8, shape (n,)
///     A set of :class:`Flags` a sample.
/// counts : dict
///     How many samples carry each flag.
/// state : State
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> estimate = cf.Mahony(kp=1.0).estimate([[0.0, 0.0, 0.0]], [[0.0, 0.0, 9.81]], fs=100.0)
/// >>> estimate.quaternion
/// array([[1., 0., 0., 0.]])
#[pyclass(frozen, module = "compfilt._core")]
pub(crate) struct AttitudeEstimate {
    #[pyo3(get)]
    quaternion: Py<PyAny>,
    #[pyo3(get)]
    up: Py<PyAny>,
    #[pyo3(get)]
    gyro_bias: Py<PyAny>,
    #[pyo3(get)]
    at_rest: Py<PyAny>,
    #[pyo3(get)]
    calibration: Option<Py<PyAny>>,
    #[pyo3(get)]
    gyro_delay: Option<f64>,
    #[pyo3(get)]
    flags: Py<PyArrayDyn<u8>>,
    #[pyo3(get)]
    state: Py<State>,
}

impl AttitudeEstimate {
    pub(crate) fn new(py: Python<'_>, arrays: Arrays<'_>, state: State) -> PyResult<Self> {
        Ok(Self {
            quaternion: arrays.quaternion.unbind(),
            up: arrays.up.unbind(),
            gyro_bias: arrays.bias.unbind(),
            at_rest: arrays.at_rest.unbind(),
            calibration: arrays.calibration.map(Bound::unbind),
            gyro_delay: arrays.delay,
            flags: arrays.flags.to_dyn().clone().unbind(),
            state: Py::new(py, state)?,
        })
    }
}

#[pymethods]
impl AttitudeEstimate {
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        counts(self.flags.bind(py))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let shape = self.quaternion.bind(py).getattr("shape")?;
        Ok(format!("AttitudeEstimate(quaternions of shape {shape})"))
    }
}

/// What `estimate` of every attitude filter does.
pub(crate) fn estimate<'py>(
    py: Python<'py>,
    session: impl FnOnce(Precision) -> PyResult<AnySession>,
    signals: &Signals<'_, 'py>,
    fs: Option<f64>,
    initial: Option<&Bound<'py, PyAny>>,
    handling: Handling,
) -> PyResult<AttitudeEstimate> {
    if fs.is_some() == signals.t.is_some() {
        return Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them"));
    }
    let mut session = session(signals.precision())?;
    with_precision!(&mut session, session => {
        session.start(initial)?;
        let arrays = session.process(py, signals, handling)?;
        AttitudeEstimate::new(py, arrays, session.state())
    })
}

/// What `stream` of every attitude filter does.
pub(crate) fn stream<'py>(
    mut session: AnySession,
    made_by: &Bound<'py, PyAny>,
    keywords: Bound<'py, PyDict>,
    initial: Option<&Bound<'py, PyAny>>,
    handling: Handling,
) -> PyResult<AttitudeStream> {
    with_precision!(&mut session, session => session.start(initial))?;
    let made_by = made_by.clone().unbind();
    Ok(AttitudeStream { session, handling, made_by, keywords: keywords.unbind() })
}

/// An attitude filter at work: samples or blocks go in as they come, the state stays.
///
/// A stream takes one call at a time: a second thread that calls it meanwhile gets a RuntimeError.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.Mahony(kp=1.0).stream(fs=100.0)
/// >>> stream.update([0.0, 0.0, 0.0], [0.0, 0.0, 9.81])
/// array([1., 0., 0., 0.])
#[pyclass(module = "compfilt._core")]
pub(crate) struct AttitudeStream {
    pub(crate) session: AnySession,
    pub(crate) handling: Handling,
    pub(crate) made_by: Py<PyAny>,
    pub(crate) keywords: Py<PyDict>,
}

fn three<T: Scalar>(
    value: &Bound<'_, PyAny>,
    name: &'static str,
    raise: bool,
) -> PyResult<Vector3<T>> {
    let signal = Signal::new(value, name)?;
    if *signal.shape() != [3] {
        return Err(PyValueError::new_err(format!(
            "{name} must be three numbers, got the shape {:?}",
            signal.shape()
        )));
    }
    let array = signal.typed::<T>()?;
    let view = array.as_array();
    let vector = Vector3::new(view[0], view[1], view[2]);
    if raise && !vector.iter().all(ComplexField::is_finite) {
        return Err(PyValueError::new_err(format!(
            "{name} is missing (NaN or infinite), and missing is \"raise\""
        )));
    }
    Ok(vector)
}

/// One sample's arrays.
struct Given<'a, 'py> {
    gyr: &'a Bound<'py, PyAny>,
    acc: &'a Bound<'py, PyAny>,
    mag: Option<&'a Bound<'py, PyAny>>,
    dt: Option<f64>,
}

fn update<'py, T: Scalar>(
    py: Python<'py>,
    session: &mut Session<T>,
    raise: bool,
    sample: &Given<'_, 'py>,
) -> PyResult<Bound<'py, PyAny>> {
    let gyr = three::<T>(sample.gyr, "gyr", raise)?;
    let acc = three::<T>(sample.acc, "acc", raise)?;
    let mag = sample.mag.map(|mag| three::<T>(mag, "mag", raise)).transpose()?;
    let dt = step::<T>(session.fs, &mut session.time, sample.dt)?;
    session.runner.follow(dt);
    session.runner.sample(&Sample { gyr, acc, mag });
    let Output { rotation: Rotation { w, v }, started, .. } = session.runner.output();
    let parts = if started { [w, v.x, v.y, v.z] } else { [T::NAN; 4] };
    Ok(PyArray1::from_slice(py, &parts).into_any())
}

impl AttitudeStream {
    fn stored(&self) -> State {
        with_precision!(&self.session, session => session.state())
    }
}

#[pymethods]
impl AttitudeStream {
    /// One sample: gyr in rad/s, acc in m/s^2 and mag, three numbers each; dt in seconds where the stream has no fs. Returns the
    /// quaternion.
    #[pyo3(signature = (gyr, acc, mag=None, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let raise = this.handling.raise_missing;
        let sample = Given { gyr, acc, mag, dt };
        with_precision!(&mut this.session, session => update(py, session, raise, &sample))
    }

    /// A block of samples, (n, 3) each; the state is carried on. Returns the quaternions, (n, 4).
    #[pyo3(signature = (gyr, acc, mag=None, t=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let signals = Signals::new(gyr, acc, mag, t)?;
        let handling = this.handling;
        let arrays =
            with_precision!(&mut this.session, session => session.process(py, &signals, handling))?;
        Ok(arrays.quaternion)
    }

    /// A block of samples like ``process``, with all results. Returns an :class:`AttitudeEstimate`.
    #[pyo3(signature = (gyr, acc, mag=None, t=None))]
    fn estimate<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<AttitudeEstimate> {
        let this = &mut *alone(slf)?;
        let signals = Signals::new(gyr, acc, mag, t)?;
        let handling = this.handling;
        let (arrays, state) = with_precision!(&mut this.session, session => {
            (session.process(py, &signals, handling)?, session.state())
        });
        AttitudeEstimate::new(py, arrays, state)
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
        Ok(this.made_by.bind(py).eq(other.made_by.bind(py))?
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
