//! What a step is written in: one number, or several side by side.

use crate::Element;
use crate::linear::Flags;
use core::fmt::Debug;
use core::ops::{AddAssign, BitAnd, BitOr, Div, MulAssign, Neg, Not, SubAssign};
use nalgebra::Scalar;

/// `f32`, `f64`, or several of them side by side, each of which belongs to a recording of its own.
///
/// A step that is written in numbers runs on one recording or on several at once, and does the same operations in the same order
/// on each: the results are the same bits. Where recordings side by side differ in what they need, all of it is computed and a
/// [`Mask`] chooses; what is needed rarely stands behind [`Mask::any`].
pub trait Number:
    Scalar
    + Element<Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Send
    + Sync
{
    /// The spacing of the numbers above 1.
    const EPSILON: f64;

    /// The answer to a comparison.
    type Mask: Mask;
    /// What happened to a sample.
    type Flags: FlagSet<Self::Mask>;

    /// The nearest number of this type: for constants of the formulas.
    fn literal(value: f64) -> Self;

    /// `self < bound`.
    fn less(self, bound: Self) -> Self::Mask;

    /// `self <= bound`.
    fn at_most(self, bound: Self) -> Self::Mask;

    /// `yes` where the mask is true, `no` elsewhere.
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// `|self|`.
    #[must_use]
    fn magnitude(self) -> Self;

    /// A first guess of `1/√self`: [`ROOT_GUESS`](Self::ROOT_GUESS) less half the number's bits, which halves the exponent.
    #[must_use]
    fn root_guess(self) -> Self;

    /// Bits for the guess.
    const ROOT_GUESS: u64;

    /// How many times Newton's rule makes the guess as good as the type.
    const ROOT_STEPS: usize;

    /// `1/√self` to one or two units in the last place, for normal numbers: one routine on every target, of products and sums,
    /// because not every target has a square root and not every one divides at once.
    #[inline(always)]
    #[must_use]
    fn reciprocal_root(self) -> Self {
        let half = self * Self::literal(0.5);
        let mut root = self.root_guess();
        for _ in 1..Self::ROOT_STEPS {
            root = root * (Self::literal(1.5) - half * root * root);
        }
        // The same rule as a small correction, which rounds less.
        root + root * (Self::literal(0.5) - half * root * root)
    }

    /// Neither NaN nor infinite.
    #[inline(always)]
    #[allow(clippy::eq_op)] // Of what is not finite the difference with itself is NaN.
    fn is_number(self) -> Self::Mask {
        (self - self).at_most(Self::literal(0.0))
    }

    /// The smaller of two numbers; `bound` where one of them is NaN.
    #[inline(always)]
    #[must_use]
    fn or_less(self, bound: Self) -> Self {
        Self::choose(self.less(bound), self, bound)
    }

    /// The larger of two numbers; `bound` where one of them is NaN.
    #[inline(always)]
    #[must_use]
    fn or_more(self, bound: Self) -> Self {
        Self::choose(bound.less(self), self, bound)
    }
}

/// The answer to a comparison: true or false for every number side by side.
pub trait Mask:
    Copy
    + Debug
    + PartialEq
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// The same answer everywhere.
    fn same(answer: bool) -> Self;

    /// True anywhere.
    fn any(self) -> bool;

    /// True everywhere.
    fn all(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn same(answer: bool) -> Self {
        answer
    }

    #[inline(always)]
    fn any(self) -> bool {
        self
    }

    #[inline(always)]
    fn all(self) -> bool {
        self
    }
}

/// What happened to a sample, of every recording side by side.
pub trait FlagSet<M>: Copy + Default {
    /// Adds `flag` where the mask is true.
    fn raise(&mut self, flag: Flags, mask: M);
}

impl FlagSet<bool> for Flags {
    #[inline(always)]
    fn raise(&mut self, flag: Flags, mask: bool) {
        if mask {
            *self |= flag;
        }
    }
}

/// Makes numbers of another type: several side by side of one, or one of several.
pub trait Change<T: Number, U: Number> {
    /// A number.
    fn number(&mut self, number: T) -> U;

    /// A mask.
    fn mask(&mut self, mask: T::Mask) -> U::Mask;
}

macro_rules! number {
    ($T:ident, $Bits:ident, $guess:literal, $steps:literal) => {
        impl Number for $T {
            type Mask = bool;
            type Flags = Flags;

            #[allow(clippy::cast_lossless)] // One of the two types is f64 itself.
            const EPSILON: f64 = $T::EPSILON as f64;
            const ROOT_GUESS: u64 = $guess;
            const ROOT_STEPS: usize = $steps;

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation)] // Rounding to the type is what it is for.
            fn literal(value: f64) -> Self {
                value as $T
            }

            #[inline(always)]
            fn less(self, bound: Self) -> bool {
                self < bound
            }

            #[inline(always)]
            fn at_most(self, bound: Self) -> bool {
                self <= bound
            }

            #[inline(always)]
            fn choose(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }

            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }

            #[inline(always)]
            fn root_guess(self) -> Self {
                $T::from_bits($Bits::wrapping_sub($guess, self.to_bits() >> 1))
            }
        }
    };
}

number!(f32, u32, 0x5f37_5a86, 3);
number!(f64, u64, 0x5fe6_eb50_c7b5_37a9, 4);
