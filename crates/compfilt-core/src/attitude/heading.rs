//! The heading of an attitude whose tilt is known otherwise.

use super::rotation::{Rotation, horizontal};
use super::vector::Vector;
use crate::error::positive;
use crate::linear::Flags;
use crate::{Change, Error, FlagSet, Mask, Number, Real};
use nalgebra::Vector3;

/// How the heading follows a magnetometer: a first-order filter on the turn about the vertical, with the gyro's turn as input.
///
/// The first field sets the heading; then the fields are averaged until that takes longer than the filter's memory `tau`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct HeadingRule<T> {
    tau: T,
}

impl<T: Real> Default for HeadingRule<T> {
    /// A memory of 10 s.
    fn default() -> Self {
        Self { tau: T::literal(10.0) }
    }
}

impl<T: Real> HeadingRule<T> {
    /// The filter with the time constant `tau` in seconds.
    ///
    /// # Errors
    /// `tau` is not positive and finite.
    pub fn new(tau: T) -> Result<Self, Error> {
        Ok(Self { tau: positive("heading_tau", tau)? })
    }
}

impl<T: Number> HeadingRule<T> {
    /// Turns `rotation` about the vertical towards the one in which the horizontal part of `field` points north, where the
    /// filter has `started`.
    #[inline(always)]
    pub(super) fn update(
        &self,
        heading: &mut Heading<T>,
        rotation: &mut Rotation<T>,
        field: Option<&Vector3<T>>,
        dt: T,
        started: T::Mask,
        flags: &mut T::Flags,
    ) {
        heading.since = T::choose(started, heading.since + dt, heading.since);
        let Some(field) = field else { return };
        let up = Vector(rotation.up());
        let (field, there) = Vector(*field).direction();
        let (north, is_level) = horizontal(field, up);
        let there = there & is_level;
        flags.raise(Flags::MAGNETOMETER_MISSING, started & !there);
        let zero = T::literal(0.0);
        let followed = started & there & heading.known & zero.less(heading.since);
        let turned = self.follow(heading, rotation, north, followed);
        *rotation = Rotation::choose(followed, turned, *rotation);
        let set = started & there & !heading.known;
        if set.any() {
            let facing = Rotation::of_axes(north.cross(&up), north, up);
            *rotation = Rotation::choose(set, facing, *rotation);
            heading.known = heading.known | set;
        }
        heading.since = T::choose(followed | set, zero, heading.since);
    }

    /// The attitude turned by the share that the memory leaves to this field.
    #[inline(always)]
    fn follow(
        &self,
        heading: &mut Heading<T>,
        rotation: &Rotation<T>,
        north: Vector<T>,
        followed: T::Mask,
    ) -> Rotation<T> {
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let since = heading.since;
        heading.age = T::choose(followed, heading.age + since, heading.age);
        // The mean of all so far, until that is longer than the memory.
        let weight = since / (heading.age.or_less(self.tau) + since);
        let [east, towards, _] = Vector(rotation.to_world(&north.0)).parts();
        // Behind by more than a quarter turn, the sine gets smaller again.
        let behind = T::choose(east.less(zero), -one, one);
        let sine = T::choose(towards.less(zero), behind, east);
        let turn = Rotation::of_turn(&Vector::new(zero, zero, sine * weight).0);
        turn.times(rotation).renormalised()
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> HeadingRule<U> {
        HeadingRule { tau: change.number(self.tau) }
    }
}

/// What a [`HeadingRule`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Heading<T: Number> {
    /// Seconds since the first field.
    pub age: T,
    /// Seconds since the last.
    pub since: T,
    /// Whether a field has set the heading.
    pub known: T::Mask,
}

impl<T: Number> Heading<T> {
    /// Nothing yet.
    #[inline(always)]
    pub(super) fn new() -> Self {
        let zero = T::literal(0.0);
        Self { age: zero, since: zero, known: T::Mask::same(false) }
    }

    /// Known from elsewhere, and for long.
    pub(super) fn given() -> Self {
        let (age, since) = (T::literal(f64::INFINITY), T::literal(0.0));
        Self { age, since, known: T::Mask::same(true) }
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            age: T::choose(mask, yes.age, no.age),
            since: T::choose(mask, yes.since, no.since),
            known: mask & yes.known | !mask & no.known,
        }
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Heading<U> {
        Heading {
            age: change.number(self.age),
            since: change.number(self.since),
            known: change.mask(self.known),
        }
    }
}
