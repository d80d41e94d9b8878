//! The scalar: `f32` or `f64`.

use crate::Number;
use crate::linear::Flags;
use nalgebra::RealField;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`. Parameters are rounded to it once; design, gains and step then run in it.
pub trait Real: RealField + Copy + Number<Mask = bool, Flags = Flags> + sealed::Sealed {
    /// The one NaN that this crate writes, so that missing values have the same bits everywhere.
    const NAN: Self;

    /// The same number, widened.
    fn to_f64(self) -> f64;

    /// `value` if it is a number, otherwise `otherwise`.
    #[must_use]
    fn finite_or(self, otherwise: Self) -> Self {
        if self.is_finite() { self } else { otherwise }
    }
}

macro_rules! real {
    ($T:ident) => {
        impl Real for $T {
            const NAN: Self = $T::NAN;

            fn to_f64(self) -> f64 {
                f64::from(self)
            }
        }
    };
}

real!(f32);
real!(f64);
