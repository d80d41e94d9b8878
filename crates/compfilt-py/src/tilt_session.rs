//! A tilt filter at work on Python's arrays.

use crate::arrays::{Precision, Scalar, Signal, check_all_finite, check_vectors, columns};
use crate::batch::{Options, Steps};
use crate::design::{Design, KindOfState};
use crate::precision::InPrecision;
use crate::session::{Handling, steps};
use crate::state::State;
use crate::tilt_batch::{Block, Make, Runner, Settings};
use compfilt_core::nalgebra::Vector2;
use numpy::ndarray::ArrayView2;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A tilt filter at work in one scalar type.
pub(crate) struct Session<T: Scalar> {
    pub(crate) runner: Box<dyn Runner<T>>,
    pub(crate) fs: Option<f64>,
    pub(crate) time: Option<f64>,
    kind: KindOfState,
}

/// A session in the precision of the signals.
pub(crate) type AnySession = InPrecision<Session<f32>, Session<f64>>;

/// The arrays of one call.
pub(crate) struct Signals<'a, 'py> {
    pub(crate) gyr: Signal<'py>,
    pub(crate) acc: Signal<'py>,
    pub(crate) t: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> Signals<'a, 'py> {
    pub(crate) fn new(
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&'a Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let (gyr, acc) = (Signal::new(gyr, "gyr")?, Signal::new(acc, "acc")?);
        let (samples, other) = (check_vectors(&gyr)?, check_vectors(&acc)?);
        if samples != other {
            return Err(PyValueError::new_err(format!(
                "gyr and acc must have the same number of samples, got {samples} and {other}"
            )));
        }
        Ok(Self { gyr, acc, t })
    }
}

/// The arrays that a run of a tilt filter leaves.
pub(crate) struct Arrays<'py> {
    pub(crate) angles: Bound<'py, PyAny>,
    pub(crate) levels: Option<Bound<'py, PyAny>>,
    pub(crate) flags: Bound<'py, PyArrayDyn<u8>>,
}

/// A force of no length has no direction: for `missing="raise"`.
fn check_lengths<T: Scalar>(acc: ArrayView2<'_, T>) -> PyResult<()> {
    match acc.rows().into_iter().position(|force| force.iter().all(|part| *part == T::zero())) {
        None => Ok(()),
        Some(row) => Err(PyValueError::new_err(format!(
            "acc has a missing sample (zero force) at row {row}, and missing is \"raise\""
        ))),
    }
}

impl<T: Scalar> Session<T> {
    pub(crate) fn new(
        design: &Design,
        settings: Settings,
        options: &Options,
        fs: Option<f64>,
    ) -> PyResult<Self> {
        let make = Make { settings, options, fs };
        let kind = design.kind_of_state("tilt", options.rule);
        Ok(Self { runner: design.with::<T, _>(options.rule, make)??, fs, time: None, kind })
    }

    pub(crate) fn process<'py>(
        &mut self,
        py: Python<'py>,
        signals: &Signals<'_, 'py>,
        handling: Handling,
        keep_levels: bool,
    ) -> PyResult<Arrays<'py>> {
        let (gyr, acc) = (signals.gyr.typed::<T>()?, signals.acc.typed::<T>()?);
        let (gyr, acc) = (columns(&gyr)?, columns(&acc)?);
        let samples = gyr.nrows();
        let (steps, time) = steps::<T>(signals.t, self.fs, self.time, samples, handling.backwards)?;
        if handling.raise_missing {
            check_all_finite(gyr, "gyr")?;
            check_all_finite(acc, "acc")?;
            check_lengths(acc)?;
        }
        let angles = PyArray2::<T>::zeros(py, [samples, 2], false);
        let levels =
            keep_levels.then(|| PyArray3::<T>::zeros(py, [self.runner.order(), samples, 2], false));
        let flags = PyArray1::<u8>::zeros(py, [samples], false);
        {
            let mut angles = angles.readwrite();
            let mut levels = levels.as_ref().map(PyArrayMethods::readwrite);
            let mut flags = flags.readwrite();
            let block = Block {
                gyr,
                acc,
                steps: steps.as_deref().map_or(Steps::Uniform, Steps::Each),
                angles: angles.as_array_mut(),
                levels: levels.as_mut().map(|levels| levels.as_array_mut()),
                flags: flags.as_array_mut(),
            };
            let runner = &mut self.runner;
            py.detach(|| runner.block(block));
        }
        self.time = time;
        Ok(Arrays {
            angles: angles.into_any(),
            levels: levels.map(Bound::into_any),
            flags: flags.to_dyn().clone(),
        })
    }

    pub(crate) fn state(&self) -> State {
        State {
            order: self.runner.order(),
            dtype: T::NAME.to_owned(),
            time: self.time,
            kind: self.kind.to_string(),
            numbers: self.runner.store(),
        }
    }

    pub(crate) fn set_state(&mut self, state: &State) -> PyResult<()> {
        state.check(&self.kind.to_string(), self.runner.order(), 2, T::NAME)?;
        let before = self.runner.store();
        if !self.runner.restore(&state.numbers) {
            self.runner.restore(&before);
            return Err(PyValueError::new_err("the state belongs to another kind of filter"));
        }
        self.time = state.time;
        Ok(())
    }

    pub(crate) fn start(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let Some(initial) = initial else {
            self.runner.reset(None);
            self.time = None;
            return Ok(());
        };
        if let Ok(state) = initial.cast::<State>() {
            return self.set_state(state.get());
        }
        let signal = Signal::new(initial, "initial")?;
        let values = signal.typed::<f64>()?;
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        match values[..] {
            [first, second] if first.is_finite() && second.is_finite() => {
                self.runner.reset(Some(Vector2::new(T::literal(first), T::literal(second))));
                self.time = None;
                Ok(())
            }
            _ => Err(PyValueError::new_err(
                "initial must be two finite angles in rad, or a State of this filter",
            )),
        }
    }
}

impl AnySession {
    pub(crate) fn new(
        precision: Precision,
        design: &Design,
        settings: Settings,
        options: &Options,
        fs: Option<f64>,
    ) -> PyResult<Self> {
        Ok(match precision {
            Precision::Single => Self::Single(Session::new(design, settings, options, fs)?),
            Precision::Double => Self::Double(Session::new(design, settings, options, fs)?),
        })
    }
}
