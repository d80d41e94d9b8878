//! An attitude filter at work on Python's arrays.

use crate::arrays::{Scalar, Signal, check_all_finite, check_vectors, columns};
use crate::attitude_batch::{Block, Runner};
use crate::batch::Steps;
use crate::precision::InPrecision;
use crate::session::{Handling, steps};
use crate::state::State;
use compfilt_core::Real;
use compfilt_core::attitude::Rotation;
use compfilt_core::nalgebra::{Matrix3, Vector3};
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
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

/// Makes the arrays of results and lets `work` fill them, without Python's lock. Returns them and the time after them.
pub(crate) fn fill<'py, T: Scalar>(
    py: Python<'py>,
    signals: &Signals<'_, 'py>,
    handling: Handling,
    fs: Option<f64>,
    before: Option<f64>,
    work: impl FnOnce(Block<'_, T>) + Send,
) -> PyResult<(Arrays<'py>, Option<f64>)> {
    let (gyr, acc) = (signals.gyr.typed::<T>()?, signals.acc.typed::<T>()?);
    let mag = signals.mag.as_ref().map(Signal::typed::<T>).transpose()?;
    let (gyr, acc) = (columns(&gyr)?, columns(&acc)?);
    let mag = mag.as_ref().map(columns).transpose()?;
    let samples = gyr.nrows();
    let (steps, time) = steps::<T>(signals.t, fs, before, samples, handling.backwards)?;
    if handling.raise_missing {
        check_all_finite(gyr, "gyr")?;
        check_all_finite(acc, "acc")?;
        mag.map_or(Ok(()), |mag| check_all_finite(mag, "mag"))?;
    }
    let vectors = |width| PyArray2::<T>::zeros(py, [samples, width], false);
    let (quaternion, up, bias) = (vectors(4), vectors(3), vectors(3));
    let at_rest = PyArray1::<bool>::zeros(py, [samples], false);
    let flags = PyArray1::<u8>::zeros(py, [samples], false);
    {
        let (mut quaternion, mut up) = (quaternion.readwrite(), up.readwrite());
        let (mut bias, mut at_rest) = (bias.readwrite(), at_rest.readwrite());
        let mut flags = flags.readwrite();
        let block = Block {
            gyr,
            acc,
            mag,
            steps: steps.as_deref().map_or(Steps::Uniform, Steps::Each),
            quaternion: quaternion.as_array_mut(),
            up: up.as_array_mut(),
            bias: bias.as_array_mut(),
            at_rest: at_rest.as_array_mut(),
            flags: flags.as_array_mut(),
        };
        py.detach(|| work(block));
    }
    let arrays = Arrays {
        quaternion: quaternion.into_any(),
        up: up.into_any(),
        bias: bias.into_any(),
        at_rest: at_rest.into_any(),
        calibration: None,
        delay: None,
        flags,
    };
    Ok((arrays, time))
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
            fill(py, signals, handling, self.fs, self.time, |block| runner.block(block))?;
        self.time = time;
        arrays.calibration = self.runner.calibration().map(|matrix| rows(py, &matrix));
        arrays.delay = self.runner.delay().map(Real::to_f64);
        Ok(arrays)
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
