//! Eight numbers at once: the one place that knows the processor.
//!
//! What is written with [`Wide64`] and [`Wide32`] is compiled for several instruction sets (SSE2, AVX2, AVX-512, NEON), one of which
//! is chosen when it is called. Each of the eight goes through the operations of a scalar in the same order, none is fused, so the
//! results are the same bits on all of them.
//!
//! Everything between `dispatch` and the operators must be inlined, or it is compiled for the oldest processor:
//! `#[inline(always)]` on functions, loops instead of closures that hold operators.

use crate::simd_number::WideNumber;
use compfilt_core::Element;
use fearless_simd::{SimdBase, SimdFrom, f32x8, f64x8};
use std::fmt;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

pub(crate) use fearless_simd::{Level, Simd};

/// Calls code that is generic in [`Simd`] with the instruction set of `$level`, inlined into it.
///
/// The library's own macro also compiles a copy for SSE4.2, which has nothing that the operators here would use: a quarter of
/// the binary.
macro_rules! dispatch {
    ($level:expr, $simd:ident => $body:expr) => {{
        let level: $crate::simd::Level = $level;
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some($simd) = level.as_avx512() {
            $crate::simd::Simd::vectorize($simd, #[inline(always)] || $body)
        } else if let Some($simd) = level.as_avx2() {
            $crate::simd::Simd::vectorize($simd, #[inline(always)] || $body)
        } else if let Some($simd) = level.as_sse2() {
            $crate::simd::Simd::vectorize($simd, #[inline(always)] || $body)
        } else {
            unreachable!("this processor has no SSE2, for which the library was compiled")
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        fearless_simd::dispatch!(level, $simd => $body)
    }};
}
pub(crate) use dispatch;

/// Runs the first expression with the widest instruction set of the processor in which eight numbers are worth it, and the other
/// where there is none.
macro_rules! side_by_side {
    ($simd:ident => $wide:expr, otherwise => $scalar:expr) => {{
        let level = $crate::simd::Level::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            if let Some($simd) = level.as_avx512() {
                ::fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $wide,
                )
            } else if let Some($simd) = level.as_avx2() {
                ::fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $wide,
                )
            } else {
                $scalar
            }
        }
        #[cfg(target_arch = "aarch64")]
        if let Some($simd) = level.as_neon() {
            ::fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $wide,
            )
        } else {
            $scalar
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
        {
            let _ = level;
            $scalar
        }
    }};
}
pub(crate) use side_by_side;

/// How many numbers a value holds.
pub(crate) const WIDTH: usize = 8;

/// The proof that the processor has the instructions of `S`, which constants cannot be handed.
///
/// The values live inside `dispatch` only, which had it.
#[allow(unsafe_code)]
#[inline(always)]
pub(super) fn proof<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0, "a proof holds no data") };
    // SAFETY: a type without data has one value. It stands for a check that `dispatch` made before it called anything that
    // names `Wide64<S>` or `Wide32<S>`, which no other code does.
    unsafe { std::mem::zeroed() }
}

macro_rules! wide {
    ($(#[$doc:meta])* $Wide:ident, $T:ident, $vector:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub(crate) struct $Wide<S: Simd>(pub(super) $vector<S>);

        impl<S: Simd> $Wide<S> {
            #[inline(always)]
            pub(crate) fn splat(value: $T) -> Self {
                Self($vector::splat(proof(), value))
            }

            #[inline(always)]
            pub(crate) fn from_array(values: [$T; WIDTH]) -> Self {
                Self($vector::simd_from(proof(), values))
            }

            #[inline(always)]
            pub(crate) fn to_array(self) -> [$T; WIDTH] {
                *self.0
            }
        }

        impl<S: Simd> fmt::Debug for $Wide<S> {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.to_array().fmt(formatter)
            }
        }

        impl<S: Simd> PartialEq for $Wide<S> {
            fn eq(&self, other: &Self) -> bool {
                self.to_array() == other.to_array()
            }
        }

        wide!(@operator $Wide, Add, add, AddAssign, add_assign);
        wide!(@operator $Wide, Sub, sub, SubAssign, sub_assign);
        wide!(@operator $Wide, Mul, mul, MulAssign, mul_assign);
        wide!(@operator $Wide, Div, div, DivAssign, div_assign);

        impl<S: Simd> Neg for $Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl<S: Simd> Mul<$T> for $Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn mul(self, factor: $T) -> Self {
                self * Self::splat(factor)
            }
        }

        impl<S: Simd> Element<$T> for $Wide<S> {
            #[inline(always)]
            fn neutral() -> Self {
                Self::splat(0.0)
            }
        }
    };
    (@operator $Wide:ident, $Operator:ident, $operator:ident, $Assign:ident, $assign:ident) => {
        impl<S: Simd> $Operator for $Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $operator(self, other: Self) -> Self {
                Self(self.0.$operator(other.0))
            }
        }

        impl<S: Simd> $Assign for $Wide<S> {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = self.$operator(other);
            }
        }
    };
}

wide!(
    /// Eight `f64` in registers of the instruction set `S`.
    Wide64,
    f64,
    f64x8
);
wide!(
    /// Eight `f32` in registers of the instruction set `S`.
    Wide32,
    f32,
    f32x8
);

/// Eight numbers of a scalar type, whatever that type is.
pub(crate) trait Wide<T>: Element<T> + Mul<Output = Self> {
    fn from_array(values: [T; WIDTH]) -> Self;
    fn to_array(self) -> [T; WIDTH];
    /// The first halves of both, one number of each by turns.
    fn zip_low(self, other: Self) -> Self;
    /// The second halves.
    fn zip_high(self, other: Self) -> Self;
    /// The numbers at even places of `self`, then of `other`.
    fn unzip_low(self, other: Self) -> Self;
    /// Those at odd places.
    fn unzip_high(self, other: Self) -> Self;
    /// The numbers from `SHIFT` on, then the first of `next`.
    fn slide<const SHIFT: usize>(self, next: Self) -> Self;
}

/// A scalar that the processor takes eight of.
pub(crate) trait Lanes: Sized {
    type Wide<S: Simd>: WideNumber<Self>;
}

macro_rules! lanes {
    ($T:ident, $Wide:ident) => {
        impl Lanes for $T {
            type Wide<S: Simd> = $Wide<S>;
        }

        impl<S: Simd> Wide<$T> for $Wide<S> {
            #[inline(always)]
            fn from_array(values: [$T; WIDTH]) -> Self {
                Self::from_array(values)
            }

            #[inline(always)]
            fn to_array(self) -> [$T; WIDTH] {
                self.to_array()
            }

            #[inline(always)]
            fn zip_low(self, other: Self) -> Self {
                Self(self.0.zip_low(other.0))
            }

            #[inline(always)]
            fn zip_high(self, other: Self) -> Self {
                Self(self.0.zip_high(other.0))
            }

            #[inline(always)]
            fn unzip_low(self, other: Self) -> Self {
                Self(self.0.unzip_low(other.0))
            }

            #[inline(always)]
            fn unzip_high(self, other: Self) -> Self {
                Self(self.0.unzip_high(other.0))
            }

            #[inline(always)]
            fn slide<const SHIFT: usize>(self, next: Self) -> Self {
                Self(self.0.slide::<SHIFT>(next.0))
            }
        }
    };
}

lanes!(f64, Wide64);
lanes!(f32, Wide32);
