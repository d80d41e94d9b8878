//! An attitude filter at work on Python's arrays.

use crate::arrays::{Scalar, Signal, check_all_finite, check_vectors, columns, empty};
use crate::attitude_batch::Runner;
use crate::attitude_log::{Log, Rows};
use crate::attitude_many::about;
use crate::batch::Steps;
use crate::precision::InPrecision;
use crate::session::{Handling, steps};
use crate::state::State;
use compfilt_core::Real;
use compfilt_core::attitude::Rotation;
use compfilt_core::nalgebra::{Matrix3, Vector3};
use numpy::ndarray::{Array2, Ix1, Ix2};
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArray1, PyReadwriteArray2,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An attitude filter at work in one scalar type.
pub(crate) struct Session<T: Scalar> {
    pub(crate) runner: Box<dyn Runner<T>>,
    pub(crate) fs: Option<f64>,
    pub(crate) time: Option<f64>,
    pub(crate) kind: String,
}

/// A session in the precision of the signals.
pub(crate) type AnySession = InPrecision<Session<f32>, Session<f64>>;

/// The arrays of one call.
pub(crate) struct Signals<'a, 'py> {
    pub(crate) gyr: Signal<'py>,
    pub(crate) acc: Signal<'py>,
    pub(crate) mag: Option<Signal<'py>>,
    pub(crate) t: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> Signals<'a, 'py> {
    pub(crate) fn new(
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        mag: Option<&Bound<'py, PyAny>>,
        t: Option<&'a Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let (gyr, acc) = (Signal::new(gyr, "gyr")?, Signal::new(acc, "acc")?);
        let mag = mag.map(|mag| Signal::new(mag, "mag")).transpose()?;
        let samples = check_vectors(&gyr)?;
        for other in [Some(&acc), mag.as_ref()].into_iter().flatten() {
            let count = check_vectors(other)?;
            if count != samples {
                return Err(PyValueError::new_err(format!(
                    "gyr and {} must have the same number of samples, got {samples} and {count}",
                    other.name
                )));
            }
        }
        Ok(Self { gyr, acc, mag, t })
    }

    /// float32 only if all signals are.
    pub(crate) fn precision(&self) -> crate::arrays::Precision {
        let precision = self.gyr.precision.with(self.acc.precision);
        self.mag.as_ref().map_or(precision, |mag| precision.with(mag.precision))
    }
}

/// A recording among others: its place, its signals, where it starts from.
pub(crate) type Recording<'a, 's, 'py> = (usize, &'a Signals<'s, 'py>, Option<Bound<'py, PyAny>>);

/// The arrays that a run leaves.
pub(crate) struct Arrays<'py> {
    pub(crate) quaternion: Bound<'py, PyAny>,
    pub(crate) up: Bound<'py, PyAny>,
    pub(crate) bias: Bound<'py, PyAny>,
    pub(crate) at_rest: Bound<'py, PyAny>,
    pub(crate) calibration: Option<Bound<'py, PyAny>>,
    pub(crate) delay: Option<f64>,
    pub(crate) flags: Bound<'py, PyArray1<u8>>,
}

/// The arrays of one recording: what is read, and what is filled.
pub(crate) struct Prepared<'py, T: Scalar> {
    gyr: PyReadonlyArrayDyn<'py, T>,
    acc: PyReadonlyArrayDyn<'py, T>,
    mag: Option<PyReadonlyArrayDyn<'py, T>>,
    steps: Option<Vec<T>>,
    /// The time of the last sample.
    pub(crate) time: Option<f64>,
    quaternion: Bound<'py, PyArray2<T>>,
    up: Bound<'py, PyArray2<T>>,
    bias: Bound<'py, PyArray2<T>>,
    at_rest: Bound<'py, PyArray1<bool>>,
    flags: Bound<'py, PyArray1<u8>>,
}

/// The results while they are filled.
pub(crate) struct Borrowed<'py, T: Scalar> {
    quaternion: PyReadwriteArray2<'py, T>,
    up: PyReadwriteArray2<'py, T>,
    bias: PyReadwriteArray2<'py, T>,
    at_rest: PyReadwriteArray1<'py, bool>,
    flags: PyReadwriteArray1<'py, u8>,
}

impl<'py, T: Scalar> Prepared<'py, T> {
    pub(crate) fn new(
        py: Python<'py>,
        signals: &Signals<'_, 'py>,
        handling: Handling,
        fs: Option<f64>,
        before: Option<f64>,
    ) -> PyResult<Self> {
        let (gyr, acc) = (signals.gyr.typed::<T>()?, signals.acc.typed::<T>()?);
        let mag = signals.mag.as_ref().map(Signal::typed::<T>).transpose()?;
        let samples = columns(&gyr)?.nrows();
        let (steps, time) = steps::<T>(signals.t, fs, before, samples, handling.backwards)?;
        if handling.raise_missing {
            check_all_finite(columns(&gyr)?, "gyr")?;
            check_all_finite(columns(&acc)?, "acc")?;
            mag.as_ref().map_or(Ok(()), |mag| check_all_finite(columns(mag)?, "mag"))?;
        }
        let vectors = |width| empty::<T, Ix2>(py, (samples, width));
        let (quaternion, up, bias) = (vectors(4)?, vectors(3)?, vectors(3)?);
        let at_rest = empty::<bool, Ix1>(py, samples)?;
        let flags = empty::<u8, Ix1>(py, samples)?;
        Ok(Self { gyr, acc, mag, steps, time, quaternion, up, bias, at_rest, flags })
    }

    pub(crate) fn borrow(&self) -> Borrowed<'py, T> {
        Borrowed {
            quaternion: self.quaternion.readwrite(),
            up: self.up.readwrite(),
            bias: self.bias.readwrite(),
            at_rest: self.at_rest.readwrite(),
            flags: self.flags.readwrite(),
        }
    }

    pub(crate) fn log<'a>(&'a self, results: &'a mut Borrowed<'py, T>) -> PyResult<Log<'a, T>> {
        Ok(Log {
            gyr: Rows::new(columns(&self.gyr)?),
            acc: Rows::new(columns(&self.acc)?),
            mag: self.mag.as_ref().map(|mag| columns(mag).map(Rows::new)).transpose()?,
            steps: self.steps.as_deref().map_or(Steps::Uniform, Steps::Each),
            quaternion: results.quaternion.as_slice_mut()?.as_chunks_mut().0,
            up: results.up.as_slice_mut()?.as_chunks_mut().0,
            bias: results.bias.as_slice_mut()?.as_chunks_mut().0,
            at_rest: results.at_rest.as_slice_mut()?,
            flags: results.flags.as_slice_mut()?,
        })
    }

    pub(crate) fn into_arrays(self) -> Arrays<'py> {
        Arrays {
            quaternion: self.quaternion.into_any(),
            up: self.up.into_any(),
            bias: self.bias.into_any(),
            at_rest: self.at_rest.into_any(),
            calibration: None,
            delay: None,
            flags: self.flags,
        }
    }
}

/// Makes the arrays of results and lets `work` fill them, without Python's lock. Returns them and the time after them.
pub(crate) fn fill<'py, T: Scalar>(
    py: Python<'py>,
    signals: &Signals<'_, 'py>,
    handling: Handling,
    fs: Option<f64>,
    before: Option<f64>,
    work: impl FnOnce(Log<'_, T>) + Send,
) -> PyResult<(Arrays<'py>, Option<f64>)> {
    let prepared = Prepared::new(py, signals, handling, fs, before)?;
    {
        let mut results = prepared.borrow();
        let log = prepared.log(&mut results)?;
        py.detach(|| work(log));
    }
    let time = prepared.time;
    Ok((prepared.into_arrays(), time))
}

/// An attitude to start from.
pub(crate) fn quaternion<T: Scalar>(initial: &Bound<'_, PyAny>) -> PyResult<Rotation<T>> {
    let signal = Signal::new(initial, "initial")?;
    let values = signal.typed::<f64>()?;
    let parts: Vec<T> = values.as_array().iter().map(|part| T::literal(*part)).collect();
    let rotation = match parts[..] {
        [w, x, y, z] if *signal.shape() == [4] => Rotation::new(w, Vector3::new(x, y, z)),
        _ => None,
    };
    rotation.filter(Rotation::is_finite).ok_or_else(|| {
        PyValueError::new_err(
            "initial must be a quaternion, four finite numbers that are not all zero, or a State of this filter",
        )
    })
}

impl Arrays<'_> {
    /// The real results in float32.
    pub(crate) fn narrow(&mut self) -> PyResult<()> {
        for array in [&mut self.quaternion, &mut self.up, &mut self.bias] {
            *array = array.call_method1("astype", (f32::NAME,))?;
        }
        if let Some(calibration) = &mut self.calibration {
            *calibration = calibration.call_method1("astype", (f32::NAME,))?;
        }
        Ok(())
    }
}

/// A matrix as an array.
pub(crate) fn rows<'py, T: Scalar>(py: Python<'py>, matrix: &Matrix3<T>) -> Bound<'py, PyAny> {
    let rows = Array2::from_shape_fn((3, 3), |(row, column)| matrix[(row, column)]);
    PyArray2::from_owned_array(py, rows).into_any()
}

impl<T: Scalar> Session<T> {
    pub(crate) fn process<'py>(
        &mut self,
        py: Python<'py>,
        signals: &Signals<'_, 'py>,
        handling: Handling,
    ) -> PyResult<Arrays<'py>> {
        let runner = &mut self.runner;
        let (mut arrays, time) =
            fill(py, signals, handling, self.fs, self.time, |mut log| runner.filter(&mut log))?;
        self.time = time;
        self.describe(py, &mut arrays);
        Ok(arrays)
    }

    /// Adds what was learnt.
    fn describe<'py>(&self, py: Python<'py>, arrays: &mut Arrays<'py>) {
        arrays.calibration = self.runner.calibration().map(|matrix| rows(py, &matrix));
        arrays.delay = self.runner.delay().map(Real::to_f64);
    }

    /// Filters recordings that have nothing to do with each other, each from its own state. Returns their results and states.
    pub(crate) fn process_many<'py>(
        &mut self,
        py: Python<'py>,
        recordings: Vec<Recording<'_, '_, 'py>>,
        handling: Handling,
    ) -> PyResult<Vec<(Arrays<'py>, State)>> {
        let (mut prepared, mut states) = (Vec::new(), Vec::new());
        for (index, signals, initial) in recordings {
            let mut prepare = || {
                self.start(initial.as_ref())?;
                Prepared::<T>::new(py, signals, handling, self.fs, self.time)
            };
            prepared.push(prepare().map_err(|error| about(py, index, error))?);
            states.push(self.runner.store());
        }
        {
            let mut results: Vec<_> = prepared.iter().map(Prepared::borrow).collect();
            let logs =
                prepared.iter().zip(&mut results).map(|(prepared, results)| prepared.log(results));
            let logs = logs.collect::<PyResult<Vec<_>>>()?;
            let runner = &self.runner;
            py.detach(|| runner.filter_many(logs, &mut states, handling.workers));
        }
        let mut all = Vec::new();
        for (prepared, numbers) in prepared.into_iter().zip(states) {
            self.runner.restore(&numbers);
            self.time = prepared.time;
            let mut arrays = prepared.into_arrays();
            self.describe(py, &mut arrays);
            all.push((arrays, self.state()));
        }
        Ok(all)
    }

    pub(crate) fn state(&self) -> State {
        State {
            order: 4,
            dtype: T::NAME.to_owned(),
            time: self.time,
            kind: self.kind.clone(),
            numbers: vec![self.runner.store()],
        }
    }

    pub(crate) fn set_state(&mut self, state: &State) -> PyResult<()> {
        state.check(&self.kind, 4, 1, T::NAME)?;
        let before = self.runner.store();
        if !self.runner.restore(&state.numbers[0]) {
            self.runner.restore(&before);
            return Err(PyValueError::new_err("the state belongs to another kind of filter"));
        }
        self.time = state.time;
        Ok(())
    }

    /// `None`, a quaternion, or a state.
    pub(crate) fn start(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let Some(initial) = initial else {
            self.runner.reset(None);
            self.time = None;
            return Ok(());
        };
        if let Ok(state) = initial.cast::<State>() {
            return self.set_state(state.get());
        }
        let rotation = quaternion(initial)?;
        self.runner.reset(Some(rotation));
        self.time = None;
        Ok(())
    }
}
