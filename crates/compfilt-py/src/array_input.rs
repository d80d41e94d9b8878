//! The arrays that describe several sensors, checked for shape and type; what they must mean is the core's to check.

use crate::arrays::{Scalar, Signal};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use numpy::ndarray::{ArrayView3, Ix3};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

fn shape_error(name: &str, expected: &str, shape: &[usize]) -> PyErr {
    PyValueError::new_err(format!("{name} must have the shape {expected}, got {shape:?}"))
}

/// The numbers of an array in C order. Adding zero makes -0 the same as 0.
fn numbers(signal: &Signal<'_>) -> PyResult<Vec<f64>> {
    Ok(signal.typed::<f64>()?.as_array().iter().map(|value| value + 0.0).collect())
}

fn vectors(values: &[f64]) -> Vec<Vector3<f64>> {
    values.chunks_exact(3).map(Vector3::from_column_slice).collect()
}

pub(crate) fn positions_of(object: &Bound<'_, PyAny>) -> PyResult<Vec<Vector3<f64>>> {
    let signal = Signal::new(object, "positions")?;
    match *signal.shape() {
        [_, 3] => Ok(vectors(&numbers(&signal)?)),
        ref shape => Err(shape_error("positions", "(sensors, 3)", shape)),
    }
}

pub(crate) fn matrices_of(
    object: &Bound<'_, PyAny>,
    sensors: usize,
) -> PyResult<Vec<Matrix3<f64>>> {
    let signal = Signal::new(object, "rotations")?;
    if *signal.shape() != [sensors, 3, 3] {
        return Err(shape_error("rotations", &format!("({sensors}, 3, 3)"), signal.shape()));
    }
    Ok(numbers(&signal)?.chunks_exact(9).map(Matrix3::from_row_slice).collect())
}

pub(crate) fn channels_of(object: &Bound<'_, PyAny>, sensors: usize) -> PyResult<Vec<[bool; 3]>> {
    let array = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if shape != [sensors, 3] {
        return Err(shape_error("channels", &format!("({sensors}, 3)"), &shape));
    }
    let array = array
        .cast::<PyArray2<bool>>()
        .map_err(|_| PyTypeError::new_err("channels must be an array of bool"))?;
    let view = array.readonly();
    Ok(view.as_array().rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}

/// One standard deviation for all, one a sensor, or one a channel.
pub(crate) fn noise_of(object: &Bound<'_, PyAny>, sensors: usize) -> PyResult<Vec<Vector3<f64>>> {
    let signal = Signal::new(object, "noise")?;
    let shape = signal.shape().to_vec();
    let values = numbers(&signal)?;
    match *shape {
        [] => Ok(vec![Vector3::from_element(values[0]); sensors]),
        [count] if count == sensors => {
            Ok(values.iter().map(|sigma| Vector3::from_element(*sigma)).collect())
        }
        [count, 3] if count == sensors => Ok(vectors(&values)),
        _ => {
            let expected = format!("(), ({sensors},) or ({sensors}, 3)");
            Err(shape_error("noise", &expected, &shape))
        }
    }
}

/// Three values for each sensor: `(samples, sensors, 3)`.
pub(crate) fn readings<'a, T: Scalar>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
) -> PyResult<ArrayView3<'a, T>> {
    array
        .as_array()
        .into_dimensionality::<Ix3>()
        .map_err(|error| PyValueError::new_err(format!("expected three axes: {error}")))
}
