//! A filter that carries its state from call to call.

use crate::arrays::{Scalar, Signal, samples_and_channels};
use crate::batch::Options;
use crate::design::Design;
use crate::errors::{alone, beside};
use crate::estimate::Estimate;
use crate::precision::with_precision;
use crate::session::{AnySession, Handling, Input, Results, Session, Wanted, step};
use crate::state::State;
use compfilt_core::nalgebra::ComplexField;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyFloat;

/// A filter at work: samples or blocks go in as they come, the state stays.
///
/// It comes from ``design.stream(...)``. Any way of cutting a signal into blocks and single samples gives the same bits as
/// one call of ``filter`` on the whole. A stream belongs to one thread at a time: a second one that calls it meanwhile
/// gets a RuntimeError.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.PiForm(kp=2.0, ki=1.0).stream(fs=100.0, initial=0.0)
/// >>> angle = stream.update(0.02, 0.1)
/// >>> stream.process([0.02, 0.03], [0.1, 0.1]).shape
/// (2,)
#[pyclass(module = "compfilt._core")]
pub(crate) struct Stream {
    pub(crate) session: AnySession,
    pub(crate) design: Design,
    pub(crate) options: Options,
    pub(crate) handling: Handling,
    /// `None`: one channel, scalars and (n,) arrays.
    pub(crate) channels: Option<usize>,
    /// How the stream was made, for pickling: the design and its keywords.
    pub(crate) made_by: Py<PyAny>,
    pub(crate) keywords: Py<PyAny>,
}

impl Stream {
    fn check_channels(&self, signal: &Signal<'_>) -> PyResult<()> {
        let (_, channels) = samples_and_channels(signal)?;
        let axes = signal.shape().len();
        match self.channels {
            None if axes == 1 => Ok(()),
            Some(expected) if axes == 2 && channels == expected => Ok(()),
            None => Err(PyValueError::new_err(format!(
                "this stream has one channel: a block has the shape (samples,), got {:?}; use stream(channels={channels})",
                signal.shape()
            ))),
            Some(expected) => Err(PyValueError::new_err(format!(
                "this stream has {expected} channels: a block has the shape (samples, {expected}), got {:?}",
                signal.shape()
            ))),
        }
    }

    fn run<'py>(
        &mut self,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
        wanted: &Wanted<'_, 'py>,
    ) -> PyResult<Results<'py>> {
        let measurement = Signal::new(y, "y")?;
        let derivative = Signal::new(u, "u")?;
        self.check_channels(&measurement)?;
        let input = Input { measurement: &measurement, derivative: &derivative, t };
        let handling = self.handling;
        with_precision!(&mut self.session, session => session.process(py, &input, handling, wanted))
    }

    fn stored(&self) -> State {
        with_precision!(&self.session, session => session.state())
    }

    fn output<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        with_precision!(&self.session, session => level0(py, session, self.channels))
    }
}

/// Level 0 of all channels: a float, or an array with one value a channel.
fn level0<'py, T: Scalar>(
    py: Python<'py>,
    session: &Session<T>,
    channels: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let runner = &session.runner;
    if channels.is_none() {
        return Ok(runner.level(0, 0).to_f64().into_pyobject(py)?.into_any());
    }
    let values = (0..runner.channels()).map(|channel| runner.level(channel, 0));
    Ok(PyArray1::from_iter(py, values).into_any())
}

/// One sample: a float, or one value a channel.
fn sample<T: Scalar>(
    value: &Bound<'_, PyAny>,
    name: &'static str,
    channels: Option<usize>,
) -> PyResult<Vec<T>> {
    if channels.is_none()
        && let Ok(number) = value.cast::<PyFloat>()
    {
        return Ok(vec![T::literal(number.value())]);
    }
    let signal = Signal::new(value, name)?;
    let expected = channels.map_or(vec![], |channels| vec![channels]);
    if signal.shape() != expected {
        return Err(PyValueError::new_err(format!(
            "{name} must have the shape {expected:?}, got {:?}",
            signal.shape()
        )));
    }
    let array = signal.typed::<T>()?;
    Ok(array.as_array().iter().copied().collect())
}

fn update<T: Scalar>(
    session: &mut Session<T>,
    channels: Option<usize>,
    handling: Handling,
    y: &Bound<'_, PyAny>,
    u: &Bound<'_, PyAny>,
    dt: Option<f64>,
) -> PyResult<()> {
    // The common case, without an array.
    if channels.is_none()
        && !handling.raise_missing
        && let (Ok(y), Ok(u)) = (y.cast::<PyFloat>(), u.cast::<PyFloat>())
    {
        let dt = step::<T>(session.fs, &mut session.time, dt)?;
        session.runner.update(0, T::literal(y.value()), T::literal(u.value()), dt);
        return Ok(());
    }
    let y = sample::<T>(y, "y", channels)?;
    let u = sample::<T>(u, "u", channels)?;
    check_present(&y, "y", handling)?;
    check_present(&u, "u", handling)?;
    let dt = step::<T>(session.fs, &mut session.time, dt)?;
    for (channel, (y, u)) in y.into_iter().zip(u).enumerate() {
        session.runner.update(channel, y, u, dt);
    }
    Ok(())
}

fn check_present<T: Scalar>(values: &[T], name: &str, handling: Handling) -> PyResult<()> {
    if handling.raise_missing && !values.iter().all(ComplexField::is_finite) {
        return Err(PyValueError::new_err(format!(
            "{name} is missing (NaN or infinite), and missing is \"raise\""
        )));
    }
    Ok(())
}

fn predict<T: Scalar>(
    session: &mut Session<T>,
    channels: Option<usize>,
    handling: Handling,
    u: &Bound<'_, PyAny>,
    dt: Option<f64>,
) -> PyResult<()> {
    let u = sample::<T>(u, "u", channels)?;
    check_present(&u, "u", handling)?;
    let dt = step::<T>(session.fs, &mut session.time, dt)?;
    for (channel, u) in u.into_iter().enumerate() {
        session.runner.predict(channel, u, dt);
    }
    Ok(())
}

fn correct<T: Scalar>(
    session: &mut Session<T>,
    channels: Option<usize>,
    handling: Handling,
    y: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let y = sample::<T>(y, "y", channels)?;
    check_present(&y, "y", handling)?;
    for (channel, y) in y.into_iter().enumerate() {
        session.runner.correct(channel, y);
    }
    Ok(())
}

#[pymethods]
impl Stream {
    /// One sample: predict with the derivative u, correct by the measurement y.
    ///
    /// Parameters
    /// ----------
    /// y, u : float, or array_like of shape (channels,)
    ///     NaN or infinite: missing.
    /// dt : float, optional
    ///     The time step in seconds; 1/fs where it is left out.
    ///
    /// Returns
    /// -------
    /// float, or ndarray of shape (channels,)
    ///     Level 0. NaN before the first measurement.
    #[pyo3(signature = (y, u, dt=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let (channels, handling) = (this.channels, this.handling);
        with_precision!(&mut this.session, session => update(session, channels, handling, y, u, dt))?;
        this.output(py)
    }

    /// A block of samples; the state is carried on. Returns level 0, shaped like y.
    ///
    /// Parameters
    /// ----------
    /// y, u : array_like, shape (n,) or (n, channels)
    /// t : array_like, shape (n,), optional
    ///     Times in seconds, for a stream without fs. The first step lasts from the last time of the block before; 0 in
    ///     the first block.
    #[pyo3(signature = (y, u, t=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        let wanted = Wanted::Level0(None);
        let results = this.run(py, y, u, t, &wanted)?;
        Ok(results.level0.unwrap_or_else(|| py.None().into_bound(py)))
    }

    /// A block of samples like ``process``, with all levels, flags and counts. Returns an :class:`Estimate`.
    #[pyo3(signature = (y, u, t=None))]
    fn estimate<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Estimate> {
        let this = &mut *alone(slf)?;
        let wanted = Wanted::Levels;
        let results = this.run(py, y, u, t, &wanted)?;
        let state = this.stored();
        Estimate::new(py, &this.design, results, state)
    }

    /// Moves the state on by dt seconds with the derivative u, without a measurement. Returns level 0.
    #[pyo3(signature = (u, dt=None))]
    fn predict<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        if this.design.is_rate() {
            return Err(PyValueError::new_err("the rate filter takes both signals: use update"));
        }
        let (channels, handling) = (this.channels, this.handling);
        with_precision!(&mut this.session, session => predict(session, channels, handling, u, dt))?;
        this.output(py)
    }

    /// Corrects by the measurement y, with the gains for the time since the last correction. Returns level 0.
    ///
    /// So a slow measurement corrects a fast prediction: ``predict`` whenever the derivative comes, ``correct`` whenever
    /// the measurement does. The first measurement starts the filter.
    fn correct<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        y: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let this = &mut *alone(slf)?;
        if this.design.is_rate() {
            return Err(PyValueError::new_err("the rate filter takes both signals: use update"));
        }
        let (channels, handling) = (this.channels, this.handling);
        with_precision!(&mut this.session, session => correct(session, channels, handling, y))?;
        this.output(py)
    }

    /// Forgets the state: waits for the first measurement, or starts from ``initial`` as in ``filter``.
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

    fn __eq__(slf: &Bound<'_, Self>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let this = &*beside(slf)?;
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let other = &*beside(other)?;
        let fs = |stream: &Self| with_precision!(&stream.session, session => session.fs);
        let workers = other.handling.workers;
        Ok(this.design == other.design
            && this.options == other.options
            && this.channels == other.channels
            && fs(this) == fs(other)
            && Handling { workers, ..this.handling } == other.handling
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

/// Rebuilds a stream that was pickled.
#[pyfunction]
pub(crate) fn _stream<'py>(
    made_by: &Bound<'py, PyAny>,
    keywords: &Bound<'py, pyo3::types::PyDict>,
    state: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let stream = made_by.call_method("stream", (), Some(keywords))?;
    stream.setattr("state", state)?;
    Ok(stream)
}
