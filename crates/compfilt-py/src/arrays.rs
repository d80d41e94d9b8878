//! The checks of arrays: dtypes, shapes, times, missing values.

use crate::simd::Lanes;
use compfilt_core::Real;
use numpy::ndarray::{ArrayView1, ArrayView2, ArrayViewMut2, Axis, Dimension, ShapeError};
use numpy::{
    Element, PyArray, PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyReadwriteArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use std::ops::Range;

/// A scalar type that numpy and the core share.
pub(crate) trait Scalar: Real + Element + Lanes + Send + Sync {
    /// numpy's name of the type.
    const NAME: &'static str;
}

impl Scalar for f32 {
    const NAME: &'static str = "float32";
}

impl Scalar for f64 {
    const NAME: &'static str = "float64";
}

/// What a signal's numbers are to be filtered in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    Single,
    Double,
}

impl Precision {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Single => f32::NAME,
            Self::Double => f64::NAME,
        }
    }

    /// float32 only if all signals are.
    pub(crate) fn with(self, other: Self) -> Self {
        if self == Self::Single { other } else { self }
    }
}

/// A signal as a numpy array, with its name for messages.
pub(crate) struct Signal<'py> {
    array: Bound<'py, PyUntypedArray>,
    pub(crate) name: &'static str,
    pub(crate) precision: Precision,
}

impl<'py> Signal<'py> {
    /// Takes an array, or what numpy can make one of. float32 stays, other real numbers become float64.
    pub(crate) fn new(object: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let array = match object.cast_exact::<PyUntypedArray>() {
            Ok(array) => array.clone(),
            Err(_) => asarray(object, name)?,
        };
        let dtype = array.dtype();
        let precision = match (dtype.kind(), dtype.itemsize()) {
            (b'f', 4) => Precision::Single,
            (b'f' | b'i' | b'u', _) => Precision::Double,
            _ => {
                return Err(PyTypeError::new_err(format!(
                    "{name} must hold real numbers, got dtype {dtype}: float32 and float64 are kept, \
                     other floats and integers become float64"
                )));
            }
        };
        Ok(Self { array, name, precision })
    }

    pub(crate) fn shape(&self) -> &[usize] {
        self.array.shape()
    }

    /// Whether the samples of a channel lie closer together than the channels of a sample, as in Fortran order.
    pub(crate) fn is_by_channel(&self) -> bool {
        matches!(self.array.strides(), [samples, channels] if samples.unsigned_abs() < channels.unsigned_abs())
    }

    /// The array in the scalar type: itself where it has that type and lies aligned, otherwise a copy.
    pub(crate) fn typed<T: Scalar>(&self) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
        if let Ok(array) = self.array.cast::<PyArrayDyn<T>>()
            && is_aligned(array)
        {
            return borrow(array, self.name);
        }
        let keywords = PyDict::new(self.array.py());
        keywords.set_item("order", "K")?;
        let converted = self.array.call_method("astype", (T::NAME,), Some(&keywords))?;
        borrow(converted.cast::<PyArrayDyn<T>>()?, self.name)
    }
}

impl<'py> Signal<'py> {
    /// The same, as a copy where the array shares memory with the output.
    pub(crate) fn typed_apart_from<T: Scalar>(
        &self,
        output: Option<&Bound<'py, PyArrayDyn<T>>>,
    ) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
        let array = self.typed::<T>()?;
        let Some(output) = output else { return Ok(array) };
        let (read, written) = (addresses(&array), addresses(output));
        if read.start.max(written.start) >= read.end.min(written.end) {
            return Ok(array);
        }
        let copy = array.call_method1("copy", ("K",))?;
        borrow(copy.cast::<PyArrayDyn<T>>()?, self.name)
    }
}

/// Like [`asarray`] for the optional `out`: it must be the array itself, of the right type and shape.
pub(crate) fn output<'py, T: Scalar>(
    object: &Bound<'py, PyAny>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    let array = object.cast::<PyArrayDyn<T>>().map_err(|_| {
        PyTypeError::new_err(format!("out must be a numpy array of dtype {}", T::NAME))
    })?;
    if array.shape() != shape {
        return Err(PyValueError::new_err(format!(
            "out must have the shape {shape:?} of the measurement, got {:?}",
            array.shape()
        )));
    }
    if !is_aligned(array) {
        return Err(PyValueError::new_err("out must be aligned"));
    }
    Ok(array.clone())
}

/// The writable view of `out`.
pub(crate) fn writable<'py, T: Scalar>(
    array: &Bound<'py, PyArrayDyn<T>>,
) -> PyResult<PyReadwriteArrayDyn<'py, T>> {
    array
        .try_readwrite()
        .map_err(|_| PyValueError::new_err("out must be writable and not in use elsewhere"))
}

fn borrow<'py, T: Scalar>(
    array: &Bound<'py, PyArrayDyn<T>>,
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    array
        .try_readonly()
        .map_err(|_| PyValueError::new_err(format!("{name} is being written to elsewhere")))
}

/// An array whose every element is about to be written: its memory holds anything, and need not be cleared first.
pub(crate) fn empty<'py, T: Element, D: Dimension>(
    py: Python<'py>,
    shape: impl IntoPyObject<'py>,
) -> PyResult<Bound<'py, PyArray<T, D>>> {
    static EMPTY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let array = EMPTY.import(py, "numpy", "empty")?.call1((shape, T::get_dtype(py)))?;
    Ok(array.cast_into::<PyArray<T, D>>()?)
}

fn asarray<'py>(object: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    // Looking the functions up takes longer than a short list.
    static IS_MASKED: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let py = object.py();
    let is_masked = IS_MASKED.import(py, "numpy.ma", "isMaskedArray")?.call1((object,))?;
    if is_masked.extract()? {
        return filled(object, name);
    }
    let array = ASARRAY.import(py, "numpy", "asarray")?.call1((object,)).map_err(|error| {
        // What the object's own conversion raises, an interrupt for example, is not ours to rename.
        if error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyValueError>(py) {
            PyTypeError::new_err(format!("{name} must be an array of numbers: {error}"))
        } else {
            error
        }
    })?;
    Ok(array.cast_into::<PyUntypedArray>()?)
}

/// A masked sample is a missing one.
fn filled<'py>(masked: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyUntypedArray>> {
    let kind: String = masked.getattr("dtype")?.getattr("kind")?.extract()?;
    let float = match kind.as_str() {
        "f" => masked.clone(),
        "i" | "u" => masked.call_method1("astype", (f64::NAME,))?,
        _ => return Err(PyTypeError::new_err(format!("{name} must hold real numbers"))),
    };
    Ok(float.call_method1("filled", (f64::NAN,))?.cast_into::<PyUntypedArray>()?)
}

/// The addresses between which the elements lie, as `numpy.may_share_memory` compares them: a call of that takes as long
/// as filtering a hundred samples.
fn addresses<T: Scalar>(array: &Bound<'_, PyArrayDyn<T>>) -> Range<usize> {
    let first = array.data().addr();
    if array.is_empty() {
        return first..first;
    }
    let (mut start, mut end) = (first, first + size_of::<T>());
    for (length, stride) in array.shape().iter().zip(array.strides()) {
        let span = (length - 1) * stride.unsigned_abs();
        if *stride < 0 { start -= span } else { end += span }
    }
    start..end
}

/// Whether every element lies at a multiple of its size: an array cut out of packed records may not.
fn is_aligned<T: Scalar>(array: &Bound<'_, PyArrayDyn<T>>) -> bool {
    let align = align_of::<T>();
    let strides_fit = array.strides().iter().all(|stride| stride.unsigned_abs() % align == 0);
    array.is_empty() || (array.data().addr().is_multiple_of(align) && strides_fit)
}

/// `(samples, channels)` of a signal; time is axis 0.
pub(crate) fn samples_and_channels(signal: &Signal<'_>) -> PyResult<(usize, usize)> {
    match *signal.shape() {
        [samples] => Ok((samples, 1)),
        [samples, channels] => Ok((samples, channels)),
        ref shape => Err(PyValueError::new_err(format!(
            "{} must have the shape (samples,) or (samples, channels), got {shape:?}",
            signal.name
        ))),
    }
}

/// The shapes must agree; one that fits the other way round is called transposed.
pub(crate) fn check_same_shape(first: &Signal<'_>, second: &Signal<'_>) -> PyResult<()> {
    if first.shape() == second.shape() {
        return Ok(());
    }
    let reversed: Vec<usize> = second.shape().iter().rev().copied().collect();
    let hint = if first.shape() == reversed {
        format!(": {} looks transposed, time is axis 0", second.name)
    } else {
        String::new()
    };
    Err(PyValueError::new_err(format!(
        "{} and {} must have the same shape, got {:?} and {:?}{hint}",
        first.name,
        second.name,
        first.shape(),
        second.shape()
    )))
}

/// A few samples of very many channels is most often a transposed array.
pub(crate) fn check_not_transposed(signal: &Signal<'_>) -> PyResult<()> {
    if let [samples, channels] = *signal.shape()
        && samples <= 16
        && channels > 16
        && channels > 10 * samples
    {
        return Err(PyValueError::new_err(format!(
            "{name} has the shape ({samples}, {channels}) and looks transposed: time is axis 0. Pass {name}.T; if it \
             really is {samples} samples of {channels} channels, use stream(channels={channels}).process",
            name = signal.name
        )));
    }
    Ok(())
}

/// Rows of three: body axes.
pub(crate) fn check_vectors(signal: &Signal<'_>) -> PyResult<usize> {
    match *signal.shape() {
        [samples, 3] => Ok(samples),
        ref shape => {
            let hint =
                if let [3, _] = *shape { ": it looks transposed, time is axis 0" } else { "" };
            Err(PyValueError::new_err(format!(
                "{} must have the shape (samples, 3), got {shape:?}{hint}",
                signal.name
            )))
        }
    }
}

/// `(rows, columns)` of an array whose elements follow one another, the common case: its view needs no axes that are
/// counted at run time, which take longer than a few samples.
fn shape_in_one_piece<T: Element>(array: &Bound<'_, PyArrayDyn<T>>) -> Option<(usize, usize)> {
    if !(array.is_c_contiguous() && array.is_aligned()) {
        return None;
    }
    match *array.shape() {
        [rows] => Some((rows, 1)),
        [rows, columns] => Some((rows, columns)),
        _ => None,
    }
}

fn not_two_axes(error: ShapeError) -> PyErr {
    PyValueError::new_err(format!("expected one or two axes: {error}"))
}

/// A signal with a column for every channel.
pub(crate) fn columns<'a, T: Scalar>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
) -> PyResult<ArrayView2<'a, T>> {
    if let Some(shape) = shape_in_one_piece(array) {
        return ArrayView2::from_shape(shape, array.as_slice()?).map_err(not_two_axes);
    }
    let view = array.as_array();
    let view = if view.ndim() == 1 { view.insert_axis(Axis(1)) } else { view };
    view.into_dimensionality().map_err(not_two_axes)
}

/// The same for the output.
pub(crate) fn columns_mut<'a, T: Element>(
    array: &'a mut PyReadwriteArrayDyn<'_, T>,
) -> PyResult<ArrayViewMut2<'a, T>> {
    if let Some(shape) = shape_in_one_piece(array) {
        return ArrayViewMut2::from_shape(shape, array.as_slice_mut()?).map_err(not_two_axes);
    }
    let view = array.as_array_mut();
    let view = if view.ndim() == 1 { view.insert_axis(Axis(1)) } else { view };
    view.into_dimensionality().map_err(not_two_axes)
}

/// The first sample that is missing, as an error: for `missing="raise"`.
pub(crate) fn check_all_finite<T: Scalar>(view: ArrayView2<'_, T>, name: &str) -> PyResult<()> {
    match view.indexed_iter().find(|(_, value)| !value.is_finite()) {
        None => Ok(()),
        Some(((row, column), _)) => Err(PyValueError::new_err(format!(
            "{name} has a missing sample (NaN or infinite) at row {row}, column {column}, and missing is \"raise\""
        ))),
    }
}

/// What to do when time runs backwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backwards {
    Raise,
    Restart,
}

/// Time steps from times in seconds, differenced in float64 and finite in the scalar type. NaN marks a restart.
pub(crate) fn time_steps<T: Scalar>(
    times: ArrayView1<'_, f64>,
    before: Option<f64>,
    backwards: Backwards,
) -> PyResult<Vec<T>> {
    let mut last = before.or_else(|| times.first().copied()).unwrap_or(0.0);
    let mut step = |(row, &t): (usize, &f64)| {
        let dt = t - last;
        if !t.is_finite() {
            return Err(PyValueError::new_err(format!("t must be finite: row {row} is {t}")));
        }
        if dt < 0.0 && backwards == Backwards::Raise {
            return Err(PyValueError::new_err(format!(
                "t must not run backwards: row {row} is {t} s after {last} s"
            )));
        }
        let step = T::literal(dt);
        if !step.is_finite() {
            return Err(PyValueError::new_err(format!(
                "t must have steps that are finite in {}: row {row} is {t} s after {last} s",
                T::NAME
            )));
        }
        last = t;
        Ok(if dt < 0.0 { T::NAN } else { step })
    };
    let mut steps = Vec::with_capacity(times.len());
    for row in times.iter().enumerate() {
        steps.push(step(row)?);
    }
    Ok(steps)
}
