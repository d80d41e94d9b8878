//! Gravity to angles, and body rates to angle rates.

use crate::arrays::{Precision, Scalar, Signal, check_vectors, columns};
use crate::options::choice;
use compfilt_core::gravity::{Axes, angle_rates, tilt};
use compfilt_core::nalgebra::{Vector2, Vector3};
use numpy::ndarray::{ArrayView1, Zip};
use numpy::{PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pub(crate) fn axes_of(axes: &str) -> PyResult<Axes> {
    choice("axes", axes, &[("flu", Axes::Flu), ("frd", Axes::Frd), ("cube", Axes::Cube)])
}

/// The angles in rad of the specific force: roll and pitch, or the cube's phi2 and phi3.
///
///     flu    phi = atan2(f_y, f_z)     theta = atan2(-f_x, sqrt(f_y^2 + f_z^2))
///     frd    phi = atan2(-f_y, -f_z)   theta = atan2(f_x, sqrt(f_y^2 + f_z^2))
///     cube   phi2 = atan2(-s_3, sqrt(s_1^2 + s_2^2))   phi3 = atan2(s_2, -s_1)
///
/// Parameters
/// ----------
/// acc : array_like, shape (n, 3)
///     Specific force in body axes, up to its length: what an accelerometer at rest reads.
/// axes : {"flu", "frd", "cube"}
///     Forward-left-up, forward-right-down (aircraft), or the balancing cube's.
///
/// Returns
/// -------
/// ndarray, shape (n, 2)
///     NaN where the force is not finite or has no length.
///
/// Raises
/// ------
/// ValueError
///     acc does not have the shape (n, 3), or axes is unknown.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.tilt([[0.0, 6.94, 6.94]]).round(4)
/// array([[0.7854, 0.    ]])
#[pyfunction]
#[pyo3(name = "tilt", signature = (acc, *, axes="flu"))]
pub(crate) fn tilt_of<'py>(
    py: Python<'py>,
    acc: &Bound<'py, PyAny>,
    axes: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let axes = axes_of(axes)?;
    let acc = Signal::new(acc, "acc")?;
    check_vectors(&acc)?;
    match acc.precision {
        Precision::Single => tilt_array::<f32>(py, &acc, axes),
        Precision::Double => tilt_array::<f64>(py, &acc, axes),
    }
}

fn tilt_array<'py, T: Scalar>(
    py: Python<'py>,
    acc: &Signal<'py>,
    axes: Axes,
) -> PyResult<Bound<'py, PyAny>> {
    let acc = acc.typed::<T>()?;
    let acc = columns(&acc)?;
    let out = PyArray2::<T>::zeros(py, [acc.nrows(), 2], false);
    Zip::from(out.readwrite().as_array_mut().rows_mut()).and(acc.rows()).for_each(|mut out, f| {
        let angles = tilt(axes, &vector(f)).unwrap_or(Vector2::new(T::NAN, T::NAN));
        out[0] = angles[0];
        out[1] = angles[1];
    });
    Ok(out.into_any())
}

/// The rates in rad/s of the two angles from the body rates.
///
///     flu, frd   phi' = p + tan(theta) (q sin(phi) + r cos(phi))      theta' = q cos(phi) - r sin(phi)
///     cube       phi2' = s3 u1 + c3 u2      phi3' = u3 + (s2 s3/c2) u2 - (s2 c3/c2) u1
///
/// Singular at theta (or phi2) = +-90 degrees; there the cosine's size is taken as 0.001 at least.
///
/// Parameters
/// ----------
/// angles : array_like, shape (n, 2)
///     Roll and pitch (or phi2 and phi3) in rad.
/// gyr : array_like, shape (n, 3)
///     Body rates in rad/s.
/// axes : {"flu", "frd", "cube"}
///
/// Returns
/// -------
/// ndarray, shape (n, 2)
///
/// Raises
/// ------
/// ValueError
///     The shapes do not fit, or axes is unknown.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> cf.angle_rates([[0.0, np.pi / 4]], [[0.0, 0.0, 1.0]]).round(6)
/// array([[1., 0.]])
#[pyfunction]
#[pyo3(name = "angle_rates", signature = (angles, gyr, *, axes="flu"))]
pub(crate) fn angle_rates_of<'py>(
    py: Python<'py>,
    angles: &Bound<'py, PyAny>,
    gyr: &Bound<'py, PyAny>,
    axes: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let axes = axes_of(axes)?;
    let angles = Signal::new(angles, "angles")?;
    let gyr = Signal::new(gyr, "gyr")?;
    let samples = check_vectors(&gyr)?;
    if *angles.shape() != [samples, 2] {
        return Err(PyValueError::new_err(format!(
            "angles must have the shape ({samples}, 2), got {:?}",
            angles.shape()
        )));
    }
    match angles.precision.with(gyr.precision) {
        Precision::Single => rates_array::<f32>(py, &angles, &gyr, axes),
        Precision::Double => rates_array::<f64>(py, &angles, &gyr, axes),
    }
}

fn rates_array<'py, T: Scalar>(
    py: Python<'py>,
    angles: &Signal<'py>,
    gyr: &Signal<'py>,
    axes: Axes,
) -> PyResult<Bound<'py, PyAny>> {
    let (angles, gyr) = (angles.typed::<T>()?, gyr.typed::<T>()?);
    let (angles, gyr) = (columns(&angles)?, columns(&gyr)?);
    let out = PyArray2::<T>::zeros(py, [gyr.nrows(), 2], false);
    Zip::from(out.readwrite().as_array_mut().rows_mut())
        .and(angles.rows())
        .and(gyr.rows())
        .for_each(|mut out, angles, gyr| {
            let rates = angle_rates(axes, &Vector2::new(angles[0], angles[1]), &vector(gyr));
            out[0] = rates[0];
            out[1] = rates[1];
        });
    Ok(out.into_any())
}

pub(crate) fn vector<T: Scalar>(row: ArrayView1<'_, T>) -> Vector3<T> {
    Vector3::new(row[0], row[1], row[2])
}
