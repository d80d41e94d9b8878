//! One body rate from several gyros.

use crate::Real;
use nalgebra::{ComplexField, Matrix3, Vector3};

/// The mean of the gyros' readings, turned into the body's axes: `1/n Σ S_iᵀ ω_i` with `ω_i = S_i ω` in rad/s.
///
/// A gyro with a reading that is not finite is left out; the second value says whether none was. NaN if none is left.
/// Source: the balancing cube's (1.3), (1.4).
pub fn mean_rate<T: Real>(rotations: &[Matrix3<T>], gyros: &[Vector3<T>]) -> (Vector3<T>, bool) {
    let (mut sum, mut count, mut complete) = (Vector3::zeros(), T::zero(), true);
    for (rotation, gyro) in rotations.iter().zip(gyros) {
        if gyro.iter().all(ComplexField::is_finite) {
            sum += rotation.tr_mul(gyro);
            count += T::one();
        } else {
            complete = false;
        }
    }
    if count > T::zero() {
        (sum / count, complete)
    } else {
        (Vector3::from_element(T::NAN), complete)
    }
}
