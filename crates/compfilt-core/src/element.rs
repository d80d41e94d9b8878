//! What a linear filter can filter.

use crate::Real;
use core::ops::{Add, Mul, Sub};
use nalgebra::SVector;

/// A value that the recurrence adds and scales: a scalar, a lane of `L` channels, or a vector.
///
/// Every component goes through the same operations in the same order, so that a lane gives the
/// same bits as its channels one at a time.
pub trait Element<T>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<T, Output = Self>
{
    /// The neutral element of the addition.
    fn neutral() -> Self;
}

impl Element<f32> for f32 {
    fn neutral() -> Self {
        0.0
    }
}

impl Element<f64> for f64 {
    fn neutral() -> Self {
        0.0
    }
}

impl<T: Real, const L: usize> Element<T> for SVector<T, L> {
    fn neutral() -> Self {
        SVector::zeros()
    }
}
