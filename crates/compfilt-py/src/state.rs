//! A stored state: plain numbers that pickle, compare and bring a filter back bit for bit.

use crate::arrays::Scalar;
use compfilt_core::State as Levels;
use compfilt_core::linear::{Elapsed, Held, Past, RateInputs, StreamState};
use compfilt_core::nalgebra::SVector;
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// One channel as numbers: every float32 is a float64, so nothing is lost.
#[derive(Clone, Debug, Default)]
pub(crate) struct Numbers(Vec<f64>);

impl PartialEq for Numbers {
    fn eq(&self, other: &Self) -> bool {
        // NaN stands for "not yet": it must equal itself.
        let bits = |numbers: &Self| numbers.0.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        bits(self) == bits(other)
    }
}

impl Numbers {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    pub(crate) fn reader(&self) -> Reader<'_> {
        Reader(self.0.iter())
    }

    pub(crate) fn put<T: Scalar>(&mut self, values: &[T]) {
        self.0.extend(values.iter().map(|value| value.to_f64()));
    }

    /// All of them, for a filter whose state is plain numbers.
    pub(crate) fn values<T: Scalar>(&self) -> Vec<T> {
        self.0.iter().map(|value| T::literal(*value)).collect()
    }

    fn put_held<T: Scalar>(&mut self, held: &Held<T>) {
        self.put(&[held.value, held.age]);
    }

    /// The levels stand first, so that they can be read off.
    pub(crate) fn put_stream<T: Scalar, const N: usize>(&mut self, state: &StreamState<T, N>) {
        self.put(&state.levels.levels);
        self.0.push(f64::from(u8::from(state.started)));
        self.put_held(&state.input);
        match state.elapsed {
            Elapsed::None => self.0.push(0.0),
            Elapsed::One { dt } => {
                self.0.push(1.0);
                self.put(&[dt]);
            }
            Elapsed::Placed { time, transition } => {
                self.0.push(2.0);
                self.put(&[time]);
                for row in transition.levels {
                    self.put(row.as_slice());
                }
            }
            Elapsed::LongStep { time, start, driven } => {
                self.0.push(3.0);
                self.put(&[time]);
                self.put(&start.levels);
                self.put(&driven.levels);
            }
        }
    }

    pub(crate) fn put_rate<T: Scalar>(&mut self, inputs: &RateInputs<T>) {
        self.put(&[inputs.gyro, inputs.integral]);
        self.put_held(&inputs.angular_acceleration);
    }

    pub(crate) fn put_history<T: Scalar>(&mut self, past: impl Iterator<Item = Past<T>>) {
        let past: Vec<_> = past.collect();
        #[allow(clippy::cast_precision_loss)] // A history is far shorter than 2^52.
        self.0.push(past.len() as f64);
        for Past { level0, dt } in past {
            self.put(&[level0, dt]);
        }
    }
}

/// Reads the numbers in the order in which they were put.
pub(crate) struct Reader<'a>(std::slice::Iter<'a, f64>);

impl Reader<'_> {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.len() == 0
    }

    fn take<T: Scalar>(&mut self) -> Option<T> {
        self.0.next().map(|value| if value.is_nan() { T::NAN } else { T::literal(*value) })
    }

    fn take_array<T: Scalar, const N: usize>(&mut self) -> Option<[T; N]> {
        let mut values = [T::zero(); N];
        for value in &mut values {
            *value = self.take()?;
        }
        Some(values)
    }

    fn take_held<T: Scalar>(&mut self) -> Option<Held<T>> {
        Some(Held { value: self.take()?, age: self.take()? })
    }

    pub(crate) fn take_stream<T: Scalar, const N: usize>(&mut self) -> Option<StreamState<T, N>> {
        let levels = Levels { levels: self.take_array()? };
        let started = self.take::<f64>()? != 0.0;
        let input = self.take_held()?;
        let elapsed = match self.take::<f64>()? {
            0.0 => Elapsed::None,
            1.0 => Elapsed::One { dt: self.take()? },
            2.0 => {
                let time = self.take()?;
                let mut rows = [SVector::zeros(); N];
                for row in &mut rows {
                    *row = SVector::from(self.take_array::<T, N>()?);
                }
                Elapsed::Placed { time, transition: Levels { levels: rows } }
            }
            3.0 => Elapsed::LongStep {
                time: self.take()?,
                start: Levels { levels: self.take_array()? },
                driven: Levels { levels: self.take_array()? },
            },
            _ => return None,
        };
        Some(StreamState { levels, started, input, elapsed })
    }

    pub(crate) fn take_rate<T: Scalar>(&mut self) -> Option<RateInputs<T>> {
        let [gyro, integral] = self.take_array()?;
        Some(RateInputs { gyro, integral, angular_acceleration: self.take_held()? })
    }

    pub(crate) fn take_history<T: Scalar>(&mut self) -> Option<Vec<Past<T>>> {
        let length = self.take::<f64>()?;
        let mut past = Vec::new();
        while (0.0..length).contains(&f64::from(u32::try_from(past.len()).ok()?)) {
            past.push(Past { level0: self.take()?, dt: self.take()? });
        }
        Some(past)
    }
}

/// More states than an observer has; a stored number beyond it is no order.
const MAX_ORDER: usize = 4096;

/// The state of a filter between two samples: picklable, comparable, independent of the sample rate.
///
/// It is not made by hand: it comes from ``Stream.state`` and ``Estimate.state`` and goes into ``initial=`` or ``Stream.state``; the filter
/// then continues bit for bit as if it had not been interrupted.
///
/// Attributes
/// ----------
/// order, channels : int
/// dtype : str
///     "float32" or "float64".
/// time : float or None
///     The time of the last sample in seconds, where the samples came with times.
/// kind : str
///     The family of filters that can go on from it.
/// levels : ndarray, shape (order, channels)
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.FirstOrder(1.0).stream(fs=100.0)
/// >>> _ = stream.update(0.5, 0.0)
/// >>> state = stream.state
/// >>> state.levels
/// array([[0.5]])
#[pyclass(frozen, eq, module = "compfilt._core")]
#[derive(Clone, PartialEq)]
pub(crate) struct State {
    #[pyo3(get)]
    pub(crate) order: usize,
    #[pyo3(get)]
    pub(crate) dtype: String,
    #[pyo3(get)]
    pub(crate) time: Option<f64>,
    /// The family of filters that can go on from it.
    #[pyo3(get)]
    pub(crate) kind: String,
    pub(crate) numbers: Vec<Numbers>,
}

impl State {
    /// Whether a filter of this order and kind can take the state.
    pub(crate) fn check(
        &self,
        kind: &str,
        order: usize,
        channels: usize,
        dtype: &str,
    ) -> PyResult<()> {
        if self.order != order || self.numbers.len() != channels {
            return Err(PyValueError::new_err(format!(
                "the state is of order {} with {} channels, the filter of order {order} with {channels}",
                self.order,
                self.numbers.len()
            )));
        }
        if self.dtype != dtype {
            return Err(PyValueError::new_err(format!(
                "the state is of dtype {}, the filter of dtype {dtype}",
                self.dtype
            )));
        }
        if self.kind != kind {
            return Err(PyValueError::new_err(format!(
                "the state belongs to another kind of filter: {} instead of {kind}",
                self.kind
            )));
        }
        Ok(())
    }
}

#[pymethods]
impl State {
    #[new]
    #[pyo3(signature = (order, dtype, time, kind, numbers))]
    fn new(
        order: i64,
        dtype: String,
        time: Option<f64>,
        kind: String,
        numbers: Vec<Vec<f64>>,
    ) -> PyResult<Self> {
        let Ok(order @ 1..=MAX_ORDER) = usize::try_from(order) else {
            return Err(PyValueError::new_err(format!(
                "order must lie between 1 and {MAX_ORDER}, got {order}"
            )));
        };
        if numbers.iter().any(|channel| channel.len() < order) {
            return Err(PyValueError::new_err(
                "numbers must hold at least the levels of every channel",
            ));
        }
        Ok(Self { order, dtype, time, kind, numbers: numbers.into_iter().map(Numbers).collect() })
    }

    #[getter]
    fn channels(&self) -> usize {
        self.numbers.len()
    }

    #[getter]
    fn levels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let levels = Array2::from_shape_fn((self.order, self.numbers.len()), |(level, channel)| {
            self.numbers[channel].0[level]
        });
        PyArray2::from_owned_array(py, levels)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let numbers: Vec<Vec<f64>> = self.numbers.iter().map(|channel| channel.0.clone()).collect();
        let arguments = (self.order, &self.dtype, self.time, &self.kind, numbers);
        Ok((py.get_type::<Self>(), arguments).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let Self { order, dtype, .. } = self;
        format!("State(order={order}, channels={}, dtype='{dtype}')", self.numbers.len())
    }
}
