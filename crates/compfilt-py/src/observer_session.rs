//! An observer at work on Python's arrays.

use crate::arrays::{Scalar, Signal, check_all_finite, columns};
use crate::observer_stream::ObserverEstimate;
use crate::precision::InPrecision;
use crate::state::{Numbers, State};
use compfilt_core::ObserverModel;
use compfilt_core::linear::Flags;
use numpy::ndarray::{Array2, ArrayView2, ArrayViewMut1, ArrayViewMut2, Axis};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The observer's matrices in float64; a correction of NaN where there is none.
#[derive(Clone, Debug)]
pub(crate) struct Matrices {
    pub(crate) a: Array2<f64>,
    pub(crate) b: Array2<f64>,
    pub(crate) c: Array2<f64>,
    pub(crate) l: Array2<f64>,
    pub(crate) correction: Array2<f64>,
}

impl PartialEq for Matrices {
    fn eq(&self, other: &Self) -> bool {
        // Where there is no correction its NaN must equal itself.
        let bits = |matrix: &Array2<f64>| matrix.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        self.a == other.a
            && self.b == other.b
            && self.c == other.c
            && self.l == other.l
            && bits(&self.correction) == bits(&other.correction)
    }
}

/// An observer with its state, in one scalar type: matrices column by column.
pub(crate) struct Session<T: Scalar> {
    a: Vec<T>,
    b: Vec<T>,
    c: Vec<T>,
    l: Vec<T>,
    correction: Vec<T>,
    x: Vec<T>,
    innovation: Vec<T>,
    input: Vec<T>,
    next: Vec<T>,
}

/// A session in the precision of the signals.
pub(crate) type AnySession = InPrecision<Session<f32>, Session<f64>>;

impl<T: Scalar> Session<T> {
    pub(crate) fn new(matrices: &Matrices) -> Self {
        // Column by column.
        let cast =
            |matrix: &Array2<f64>| matrix.t().iter().map(|value| T::literal(*value)).collect();
        let zeros = |count| vec![T::zero(); count];
        Self {
            a: cast(&matrices.a),
            b: cast(&matrices.b),
            c: cast(&matrices.c),
            l: cast(&matrices.l),
            correction: cast(&matrices.correction),
            x: zeros(matrices.a.nrows()),
            innovation: zeros(matrices.c.nrows()),
            input: zeros(matrices.b.ncols()),
            next: zeros(matrices.a.nrows()),
        }
    }

    /// The filtered estimate after the measurement `y`.
    pub(crate) fn correct(&mut self, y: &[T], filtered: &mut [T]) -> Flags {
        let model = ObserverModel {
            a: &self.a,
            b: &self.b,
            c: &self.c,
            l: &self.l,
            correction: &self.correction,
        };
        let flags = model.innovate(&self.x, y, &mut self.innovation);
        model.filter(&self.x, &self.innovation, filtered);
        flags
    }

    /// The estimate of the next sample.
    pub(crate) fn predict(&mut self, u: &[T]) -> (&[T], Flags) {
        let model = ObserverModel {
            a: &self.a,
            b: &self.b,
            c: &self.c,
            l: &self.l,
            correction: &self.correction,
        };
        let flags =
            model.advance(&mut self.x, &mut self.innovation, &mut self.input, u, &mut self.next);
        (&self.x, flags)
    }

    pub(crate) fn sizes(&self) -> (usize, usize, usize) {
        (self.x.len(), self.innovation.len(), self.input.len())
    }

    pub(crate) fn process<'py>(
        &mut self,
        py: Python<'py>,
        y: &Signal<'py>,
        u: &Signal<'py>,
        raise_missing: bool,
    ) -> PyResult<ObserverEstimate> {
        let (states, outputs, inputs) = self.sizes();
        let (samples, other) = (samples_of(y, outputs)?, samples_of(u, inputs)?);
        if samples != other {
            return Err(PyValueError::new_err(format!(
                "y and u must have the same number of samples, got {samples} and {other}"
            )));
        }
        let (y, u) = (y.typed::<T>()?, u.typed::<T>()?);
        let (y, u) = (columns(&y)?, columns(&u)?);
        if raise_missing {
            check_all_finite(y, "y")?;
            check_all_finite(u, "u")?;
        }
        let predicted = PyArray2::<T>::zeros(py, [samples, states], false);
        let filtered = PyArray2::<T>::zeros(py, [samples, states], false);
        let flags = PyArray1::<u8>::zeros(py, [samples], false);
        {
            let (mut predicted, mut filtered) = (predicted.readwrite(), filtered.readwrite());
            let mut flags = flags.readwrite();
            let results = (predicted.as_array_mut(), filtered.as_array_mut(), flags.as_array_mut());
            py.detach(|| self.block(y, u, results));
        }
        Ok(ObserverEstimate {
            predicted: predicted.into_any().unbind(),
            filtered: filtered.into_any().unbind(),
            flags: flags.to_dyn().clone().unbind(),
            state: Py::new(py, self.state())?,
        })
    }

    fn block(
        &mut self,
        y: ArrayView2<'_, T>,
        u: ArrayView2<'_, T>,
        (mut predicted, mut filtered, mut flags): (
            ArrayViewMut2<'_, T>,
            ArrayViewMut2<'_, T>,
            ArrayViewMut1<'_, u8>,
        ),
    ) {
        let (states, outputs, inputs) = self.sizes();
        let (mut measured, mut input) = (vec![T::zero(); outputs], vec![T::zero(); inputs]);
        let mut corrected = vec![T::zero(); states];
        for row in 0..y.len_of(Axis(0)) {
            fill(&mut measured, y.row(row));
            fill(&mut input, u.row(row));
            predicted.row_mut(row).iter_mut().zip(&self.x).for_each(|(out, x)| *out = *x);
            let mut all = self.correct(&measured, &mut corrected);
            filtered.row_mut(row).iter_mut().zip(&corrected).for_each(|(out, x)| *out = *x);
            all |= self.predict(&input).1;
            flags[row] = all.bits();
        }
    }

    pub(crate) fn state(&self) -> State {
        let mut numbers = Numbers::new();
        for part in [&self.x, &self.innovation, &self.input] {
            numbers.put(part);
        }
        State {
            order: self.x.len(),
            dtype: T::NAME.to_owned(),
            time: None,
            kind: "observer".to_owned(),
            numbers: vec![numbers],
        }
    }

    pub(crate) fn set_state(&mut self, state: &State) -> PyResult<()> {
        state.check("observer", self.x.len(), 1, T::NAME)?;
        let numbers: Vec<T> = state.numbers[0].values();
        let (states, outputs, inputs) = self.sizes();
        if numbers.len() != states + outputs + inputs {
            return Err(PyValueError::new_err(
                "the state belongs to an observer with other outputs or inputs",
            ));
        }
        let parts = self.x.iter_mut().chain(&mut self.innovation).chain(&mut self.input);
        parts.zip(numbers).for_each(|(part, number)| *part = number);
        Ok(())
    }

    /// `None` for zeros, an estimate, or a state.
    pub(crate) fn start(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let (states, ..) = self.sizes();
        let x = match initial {
            None => vec![T::zero(); states],
            Some(initial) => {
                if let Ok(state) = initial.cast::<State>() {
                    return self.set_state(state.get());
                }
                one(initial, "initial", states)?
            }
        };
        if x.iter().any(|value| !value.is_finite()) {
            return Err(PyValueError::new_err("initial must be finite"));
        }
        self.x = x;
        self.innovation.fill(T::zero());
        self.input.fill(T::zero());
        Ok(())
    }
}

fn fill<T: Scalar>(values: &mut [T], row: numpy::ndarray::ArrayView1<'_, T>) {
    values.iter_mut().zip(row.iter()).for_each(|(value, x)| *value = *x);
}

fn samples_of(signal: &Signal<'_>, width: usize) -> PyResult<usize> {
    match *signal.shape() {
        [samples, columns] if columns == width => Ok(samples),
        [samples] if width == 1 => Ok(samples),
        ref shape => Err(PyValueError::new_err(format!(
            "{} must have the shape (samples, {width}), got {shape:?}",
            signal.name
        ))),
    }
}

/// One sample: `width` numbers, or a single number where the width is 1.
pub(crate) fn one<T: Scalar>(
    object: &Bound<'_, PyAny>,
    name: &'static str,
    width: usize,
) -> PyResult<Vec<T>> {
    let signal = Signal::new(object, name)?;
    match *signal.shape() {
        [count] if count == width => {}
        [] if width == 1 => {}
        ref shape => {
            return Err(PyValueError::new_err(format!(
                "{name} must be {width} numbers, got the shape {shape:?}"
            )));
        }
    }
    let values: PyReadonlyArrayDyn<'_, T> = signal.typed::<T>()?;
    Ok(values.as_array().iter().copied().collect())
}
