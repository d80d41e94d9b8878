//! Eight numbers as the number that a step of the core is written in.

use crate::simd::{WIDTH, Wide, Wide32, Wide64, proof};
use compfilt_core::linear::Flags;
use compfilt_core::{FlagSet, Mask, Number};
use fearless_simd::{Bytes, Select, Simd, SimdBase, SimdMask, mask32x8, mask64x8, u32x8, u64x8};
use std::fmt;
use std::ops::{BitAnd, BitOr, Not};

/// Eight numbers in which a step can be written.
pub(crate) trait WideNumber<T>: Wide<T> + Number<Mask: WideMask, Flags = WideFlags> {}

/// Eight answers.
pub(crate) trait WideMask: Mask {
    fn at(self, lane: usize) -> bool;
    fn set(&mut self, lane: usize, answer: bool);
}

/// What happened to a sample of each of eight recordings.
#[derive(Clone, Copy, Default)]
pub(crate) struct WideFlags {
    pub(crate) any: bool,
    pub(crate) flags: [Flags; WIDTH],
}

impl<M: WideMask> FlagSet<M> for WideFlags {
    #[inline(always)]
    fn raise(&mut self, flag: Flags, mask: M) {
        if mask.any() {
            self.any = true;
            for (lane, flags) in self.flags.iter_mut().enumerate() {
                if mask.at(lane) {
                    *flags |= flag;
                }
            }
        }
    }
}

macro_rules! wide_number {
    ($Wide:ident, $T:ident, $WideMask:ident, $mask:ident, $bits:ident, $Bits:ident) => {
        /// Eight answers to a comparison.
        #[derive(Clone, Copy)]
        pub(crate) struct $WideMask<S: Simd>($mask<S>);

        impl<S: Simd> Mask for $WideMask<S> {
            #[inline(always)]
            fn same(answer: bool) -> Self {
                Self($mask::splat(proof(), answer))
            }

            #[inline(always)]
            fn any(self) -> bool {
                self.0.any_true()
            }

            #[inline(always)]
            fn all(self) -> bool {
                self.0.all_true()
            }
        }

        impl<S: Simd> WideMask for $WideMask<S> {
            #[inline(always)]
            fn at(self, lane: usize) -> bool {
                self.0.to_bitmask() >> lane & 1 == 1
            }

            #[inline(always)]
            fn set(&mut self, lane: usize, answer: bool) {
                self.0.set(lane, answer);
            }
        }

        impl<S: Simd> fmt::Debug for $WideMask<S> {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "{:08b}", self.0.to_bitmask())
            }
        }

        impl<S: Simd> PartialEq for $WideMask<S> {
            fn eq(&self, other: &Self) -> bool {
                self.0.to_bitmask() == other.0.to_bitmask()
            }
        }

        impl<S: Simd> BitAnd for $WideMask<S> {
            type Output = Self;

            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }
        }

        impl<S: Simd> BitOr for $WideMask<S> {
            type Output = Self;

            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl<S: Simd> Not for $WideMask<S> {
            type Output = Self;

            #[inline(always)]
            fn not(self) -> Self {
                Self(!self.0)
            }
        }

        impl<S: Simd> WideNumber<$T> for $Wide<S> {}

        impl<S: Simd> compfilt_core::Element<$Wide<S>> for $Wide<S> {
            #[inline(always)]
            fn neutral() -> Self {
                Self::splat(0.0)
            }
        }

        impl<S: Simd> Number for $Wide<S> {
            type Mask = $WideMask<S>;
            type Flags = WideFlags;

            const EPSILON: f64 = <$T as Number>::EPSILON;
            const ROOT_GUESS: u64 = <$T as Number>::ROOT_GUESS;
            const ROOT_STEPS: usize = <$T as Number>::ROOT_STEPS;

            #[inline(always)]
            fn literal(value: f64) -> Self {
                Self::splat($T::literal(value))
            }

            #[inline(always)]
            fn less(self, bound: Self) -> Self::Mask {
                $WideMask(self.0.simd_lt(bound.0))
            }

            #[inline(always)]
            fn at_most(self, bound: Self) -> Self::Mask {
                $WideMask(self.0.simd_le(bound.0))
            }

            #[inline(always)]
            fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self {
                Self(mask.0.select(yes.0, no.0))
            }

            #[inline(always)]
            fn magnitude(self) -> Self {
                Self(self.0.abs())
            }

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation)] // The guess has the bits of the type.
            fn root_guess(self) -> Self {
                let bits: $bits<S> = self.0.bitcast();
                let guess: $bits<S> =
                    $bits::splat(proof(), Self::ROOT_GUESS as $Bits) - (bits >> 1);
                Self(guess.bitcast())
            }
        }
    };
}

wide_number!(Wide32, f32, WideMask32, mask32x8, u32x8, u32);
wide_number!(Wide64, f64, WideMask64, mask64x8, u64x8, u64);
