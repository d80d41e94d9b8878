//! A filter at work on Python's arrays: what a call of `filter`, `estimate` or a stream does.

use crate::arrays::{
    Backwards, Precision, Scalar, Signal, check_all_finite, check_same_shape, columns, columns_mut,
    output, time_steps, writable,
};
use crate::batch::{Block, Options, Runner, Steps, runner};
use crate::design::{Design, KindOfState};
use crate::precision::InPrecision;
use crate::state::State;
use compfilt_core::Dt;
use numpy::ndarray::{ArrayViewMut3, Axis, Dimension};
use numpy::{IxDyn, PyArrayDyn, PyArrayMethods, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyFloat;
use std::num::NonZeroUsize;

/// What a caller chooses beside the filter's own options.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Handling {
    pub(crate) raise_missing: bool,
    pub(crate) backwards: Backwards,
    pub(crate) workers: NonZeroUsize,
    /// Whether the arithmetic keeps the order of a stream.
    pub(crate) exact: bool,
}

/// A filter bound to its channels in one scalar type.
pub(crate) struct Session<T: Scalar> {
    pub(crate) runner: Box<dyn Runner<T>>,
    pub(crate) fs: Option<f64>,
    /// The time of the last sample.
    pub(crate) time: Option<f64>,
    kind: KindOfState,
}

/// Which results a caller wants.
pub(crate) enum Wanted<'a, 'py> {
    /// Level 0, in a new array or in the one given.
    Level0(Option<&'a Bound<'py, PyAny>>),
    /// All levels and flags.
    Levels,
}

/// The arrays of a call.
pub(crate) struct Results<'py> {
    pub(crate) level0: Option<Bound<'py, PyAny>>,
    pub(crate) levels: Option<Bound<'py, PyAny>>,
    pub(crate) flags: Option<Bound<'py, PyArrayDyn<u8>>>,
}

/// The two signals of a call and their times.
pub(crate) struct Input<'a, 'py> {
    pub(crate) measurement: &'a Signal<'py>,
    pub(crate) derivative: &'a Signal<'py>,
    pub(crate) t: Option<&'a Bound<'py, PyAny>>,
}

impl<T: Scalar> Session<T> {
    pub(crate) fn new(
        design: &Design,
        options: &Options,
        fs: Option<f64>,
        channels: usize,
    ) -> PyResult<Self> {
        let kind = design.kind_of_state("linear", options.rule);
        Ok(Self { runner: runner(design, options, fs, channels)?, fs, time: None, kind })
    }

    /// Filters a block and carries the states on.
    pub(crate) fn process<'py>(
        &mut self,
        py: Python<'py>,
        input: &Input<'_, 'py>,
        handling: Handling,
        wanted: &Wanted<'_, 'py>,
    ) -> PyResult<Results<'py>> {
        check_same_shape(input.measurement, input.derivative)?;
        let shape = IxDyn(input.measurement.shape());
        let (steps, time) = steps::<T>(input.t, self.fs, self.time, shape[0], handling.backwards)?;
        let keep_levels = matches!(wanted, Wanted::Levels);
        let results = match *wanted {
            Wanted::Levels => {
                let levels = [&[self.runner.order()], shape.slice()].concat();
                PyArrayDyn::<T>::zeros(py, IxDyn(&levels), false)
            }
            Wanted::Level0(Some(out)) => output::<T>(out, shape.slice())?,
            Wanted::Level0(None) => {
                let signals = [input.measurement, input.derivative];
                let by_channel = signals.into_iter().all(Signal::is_by_channel);
                PyArrayDyn::<T>::zeros(py, shape.clone(), by_channel)
            }
        };
        let out = (!keep_levels).then_some(&results);
        let measurement = input.measurement.typed_apart_from::<T>(out)?;
        let derivative = input.derivative.typed_apart_from::<T>(out)?;
        if handling.raise_missing {
            check_all_finite(columns(&measurement)?, input.measurement.name)?;
            check_all_finite(columns(&derivative)?, input.derivative.name)?;
        }
        let flags = keep_levels.then(|| PyArrayDyn::<u8>::zeros(py, shape.clone(), false));
        {
            let mut results = writable(&results)?;
            let mut flags = flags.as_ref().map(PyArrayMethods::readwrite);
            let block = Block {
                measurement: columns(&measurement)?,
                derivative: columns(&derivative)?,
                steps: steps.as_deref().map_or(Steps::Uniform, Steps::Each),
                levels: levels_mut(&mut results, keep_levels)?,
                flags: flags.as_mut().map(columns_mut).transpose()?,
            };
            let runner = &mut self.runner;
            py.detach(|| runner.block(block, handling.workers, handling.exact));
        }
        self.time = time;
        let results = results.into_any();
        Ok(if keep_levels {
            Results { level0: None, levels: Some(results), flags }
        } else {
            Results { level0: Some(results), levels: None, flags }
        })
    }

    pub(crate) fn state(&self) -> State {
        State {
            order: self.runner.order(),
            dtype: T::NAME.to_owned(),
            time: self.time,
            kind: self.kind.to_string(),
            numbers: (0..self.runner.channels()).map(|c| self.runner.store(c)).collect(),
        }
    }

    pub(crate) fn set_state(&mut self, state: &State) -> PyResult<()> {
        let (order, channels) = (self.runner.order(), self.runner.channels());
        state.check(&self.kind.to_string(), order, channels, T::NAME)?;
        let before = self.state();
        let mut stored = state.numbers.iter().enumerate();
        if !stored.all(|(channel, numbers)| self.runner.restore(channel, numbers)) {
            for (channel, numbers) in before.numbers.iter().enumerate() {
                self.runner.restore(channel, numbers);
            }
            return Err(PyValueError::new_err("the state belongs to another kind of filter"));
        }
        self.time = state.time;
        Ok(())
    }

    /// `None`, level 0, all levels, or a state.
    pub(crate) fn start(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let (order, channels) = (self.runner.order(), self.runner.channels());
        let Some(initial) = initial else {
            self.time = None;
            (0..channels).for_each(|channel| self.runner.reset(channel, None));
            return Ok(());
        };
        if let Ok(state) = initial.cast::<State>() {
            return self.set_state(state.get());
        }
        // One number, the common case, without an array.
        if let Ok(number) = initial.cast_exact::<PyFloat>()
            && let level0 = T::literal(number.value())
            && level0.is_finite()
        {
            self.time = None;
            (0..channels).for_each(|channel| self.runner.reset(channel, Some(&[level0])));
            return Ok(());
        }
        let signal = Signal::new(initial, "initial")?;
        let shape = signal.shape().to_vec();
        let values = signal.typed::<T>()?;
        let values: Vec<T> = values.as_array().iter().copied().collect();
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(PyValueError::new_err(format!("initial must be finite, got {value}")));
        }
        let levels_of = |channel: usize| -> Option<Vec<T>> {
            match *shape {
                [] => Some(vec![values[0]]),
                [length] if channels == 1 && length == order => Some(values.clone()),
                [length] if length == channels => Some(vec![values[channel]]),
                [rows, columns] if rows == order && columns == channels => {
                    Some((0..order).map(|level| values[level * channels + channel]).collect())
                }
                _ => None,
            }
        };
        for channel in 0..channels {
            let levels = levels_of(channel).ok_or_else(|| {
                PyValueError::new_err(format!(
                    "initial must be one level 0 or one a channel ({channels}), all levels ({order}, {channels}), or a \
                     State; got the shape {shape:?}"
                ))
            })?;
            self.runner.reset(channel, Some(&levels));
        }
        self.time = None;
        Ok(())
    }
}

/// `(levels, samples, channels)` of the results, which hold all levels or level 0 alone.
fn levels_mut<'a, T: Scalar>(
    results: &'a mut PyReadwriteArrayDyn<'_, T>,
    all: bool,
) -> PyResult<ArrayViewMut3<'a, T>> {
    if !all {
        return Ok(columns_mut(results)?.insert_axis(Axis(0)));
    }
    let shape = results.shape();
    let shape = (shape[0], shape[1], shape.get(2).copied().unwrap_or(1));
    ArrayViewMut3::from_shape(shape, results.as_slice_mut()?)
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

/// The time steps of a block and the time after it.
pub(crate) fn steps<T: Scalar>(
    t: Option<&Bound<'_, PyAny>>,
    fs: Option<f64>,
    before: Option<f64>,
    samples: usize,
    backwards: Backwards,
) -> PyResult<(Option<Vec<T>>, Option<f64>)> {
    match (t, fs) {
        (None, Some(_)) => Ok((None, before)),
        (Some(t), None) => {
            let t = Signal::new(t, "t")?;
            if *t.shape() != [samples] {
                return Err(PyValueError::new_err(format!(
                    "t must have the shape ({samples},), one time a sample, got {:?}: time is axis 0",
                    t.shape()
                )));
            }
            let times = t.typed::<f64>()?;
            let times = columns(&times)?;
            let times = times.column(0);
            let steps = time_steps(times, before, backwards)?;
            Ok((Some(steps), times.last().copied().or(before)))
        }
        _ => Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them")),
    }
}

/// The step of one sample, `None` for the sample period; moves the time on.
pub(crate) fn step<T: Scalar>(
    fs: Option<f64>,
    time: &mut Option<f64>,
    dt: Option<f64>,
) -> PyResult<Option<Dt<T>>> {
    match dt {
        Some(dt) => {
            let checked = Dt::new(T::literal(dt)).map_err(crate::errors::value_error)?;
            *time = time.map(|time| time + dt);
            Ok(Some(checked))
        }
        None if fs.is_some() => Ok(None),
        None => Err(PyValueError::new_err("give dt in seconds: this stream has no fs")),
    }
}

/// A session in the precision of the signals.
pub(crate) type AnySession = InPrecision<Session<f32>, Session<f64>>;

impl AnySession {
    pub(crate) fn new(
        precision: Precision,
        design: &Design,
        options: &Options,
        fs: Option<f64>,
        channels: usize,
    ) -> PyResult<Self> {
        Ok(match precision {
            Precision::Single => Self::Single(Session::new(design, options, fs, channels)?),
            Precision::Double => Self::Double(Session::new(design, options, fs, channels)?),
        })
    }
}

/// `dtype=` of a stream.
pub(crate) fn precision_of(dtype: Option<&Bound<'_, PyAny>>) -> PyResult<Precision> {
    let Some(dtype) = dtype else { return Ok(Precision::Double) };
    let name: String =
        dtype.py().import("numpy")?.call_method1("dtype", (dtype,))?.getattr("name")?.extract()?;
    match name.as_str() {
        "float32" => Ok(Precision::Single),
        "float64" => Ok(Precision::Double),
        _ => Err(PyTypeError::new_err(format!("dtype must be float32 or float64, got {name}"))),
    }
}
