//! The step of an accelerometer array: readings in, gravity or the angular acceleration out.

use crate::Real;
use nalgebra::{ComplexField, Matrix3, SMatrix, SVector, Vector3};

/// One sensor's part in an [`Extraction`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorWeights<T> {
    /// From the sensor's axes to the body's.
    pub matrix: Matrix3<T>,
    /// Which of its channels are in use; what the others read does not matter.
    pub used: [bool; 3],
}

impl<T: Real> SensorWeights<T> {
    /// No weight at all.
    pub fn none() -> Self {
        Self { matrix: Matrix3::zeros(), used: [false; 3] }
    }
}

impl SensorWeights<f64> {
    /// The same, rounded to another scalar type.
    pub fn cast<T: Real>(&self) -> SensorWeights<T> {
        SensorWeights { matrix: self.matrix.map(T::literal), used: self.used }
    }
}

/// A quantity as a sum over sensors: `Σ W_i f_i`, less what the known body rate adds.
///
/// It is made in f64 by an [`AccelerometerArray`](super::AccelerometerArray) and used in f32 or f64; `W` is an array of
/// [`SensorWeights`], one a sensor, or anything that holds them. The fields are public so that a design can be written into
/// firmware as constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extraction<T, W> {
    /// The sensors' weights, in their order.
    pub weights: W,
    /// What the squares and products of the body rate add to the sum, in the order xx, yy, zz, xy, xz, yz; `None` where the
    /// rate is not needed.
    pub centripetal: Option<SMatrix<T, 3, 6>>,
}

impl<T: Real, W: AsRef<[SensorWeights<T>]>> Extraction<T, W> {
    /// The quantity in body axes. `forces` holds the sensors' readings in m/s², each in its own axes, `rate` the body rate in
    /// rad/s, which counts only where the extraction is made for a known rate. NaN where a reading in use is not finite.
    pub fn step(&self, forces: &[Vector3<T>], rate: &Vector3<T>) -> Vector3<T> {
        let mut sum = Vector3::zeros();
        for (sensor, force) in self.weights.as_ref().iter().zip(forces) {
            for (axis, used) in sensor.used.iter().enumerate() {
                if *used {
                    sum += sensor.matrix.column(axis) * force[axis];
                }
            }
        }
        if let Some(centripetal) = &self.centripetal {
            sum -= centripetal * products(rate);
        }
        if sum.iter().all(ComplexField::is_finite) { sum } else { Vector3::from_element(T::NAN) }
    }
}

impl<const S: usize> Extraction<f64, [SensorWeights<f64>; S]> {
    /// The same, rounded to another scalar type.
    pub fn cast<T: Real>(&self) -> Extraction<T, [SensorWeights<T>; S]> {
        Extraction {
            weights: self.weights.map(|sensor| sensor.cast()),
            centripetal: self.centripetal.map(|centripetal| centripetal.map(T::literal)),
        }
    }
}

fn products<T: Real>(rate: &Vector3<T>) -> SVector<T, 6> {
    let (x, y, z) = (rate.x, rate.y, rate.z);
    SVector::from([x * x, y * y, z * z, x * y, x * z, y * z])
}

/// `[ω]×² r` as a matrix that acts on the products of the rate.
pub(super) fn centripetal(r: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    SMatrix::from_row_slice(&[
        0.0, -r.x, -r.x, r.y, r.z, 0.0, //
        -r.y, 0.0, -r.y, r.x, 0.0, r.z, //
        -r.z, -r.z, 0.0, 0.0, r.x, r.y,
    ])
}
