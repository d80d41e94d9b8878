//! A gyro's rate that is held where it is missing.

use super::vector::Vector;
use crate::linear::Flags;
use crate::{Change, FlagSet, Mask, Number};
use nalgebra::Vector3;

/// No gyro reads this in rad/s: a larger rate is missing, and so is one that is not a number.
const FASTEST: f64 = 1e6;

/// The last rate in rad/s and its age in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: nalgebra::Scalar + serde::Serialize",
        deserialize = "T: nalgebra::Scalar + serde::Deserialize<'de>"
    ))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct HeldRate<T> {
    /// The last rate; zero before the first and once it is older than it may be held.
    pub value: Vector3<T>,
    /// Seconds since it came.
    pub age: T,
}

/// What a filter takes for its rate.
pub(super) struct Taken<T: Number> {
    pub(super) value: Vector<T>,
    /// The sample itself.
    pub(super) fresh: T::Mask,
    /// Missing for longer than it is held.
    pub(super) lost: T::Mask,
}

impl<T: Number> HeldRate<T> {
    /// None yet: counts as zero.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { value: Vector::zero().0, age: T::literal(0.0) }
    }

    /// The new rate if it is there, otherwise the last for as long as `hold` seconds, then zero.
    #[inline(always)]
    pub(super) fn take(
        &mut self,
        rate: &Vector3<T>,
        dt: T,
        hold: T,
        flags: &mut T::Flags,
    ) -> Taken<T> {
        let (rate, zero) = (Vector(*rate), T::literal(0.0));
        let fresh = rate.is_within(T::literal(FASTEST));
        if fresh.all() {
            *self = Self { value: rate.0, age: zero };
            let (fresh, lost) = (T::Mask::same(true), T::Mask::same(false));
            return Taken { value: rate, fresh, lost };
        }
        let age = self.age + dt;
        let held = age.at_most(hold);
        let bridged = Vector::choose(held, Vector(self.value), Vector::zero());
        let value = Vector::choose(fresh, rate, bridged);
        *self = Self { value: value.0, age: T::choose(fresh, zero, age) };
        flags.raise(Flags::DERIVATIVE_HELD, held & !fresh);
        let lost = !(held | fresh);
        flags.raise(Flags::DERIVATIVE_MISSING, lost);
        Taken { value, fresh, lost }
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let value = Vector::choose(mask, Vector(yes.value), Vector(no.value)).0;
        Self { value, age: T::choose(mask, yes.age, no.age) }
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> HeldRate<U> {
        HeldRate { value: Vector(self.value).each(change).0, age: change.number(self.age) }
    }
}
