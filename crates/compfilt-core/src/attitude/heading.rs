//! The heading of an attitude whose tilt is known otherwise.

use super::rotation::{Rotation, direction, horizontal};
use crate::error::positive;
use crate::linear::Flags;
use crate::{Error, Real};
use nalgebra::Vector3;

/// How the heading follows a magnetometer: a first-order filter on the turn about the vertical, with the gyro's turn as input.
///
/// The first field sets the heading; then the fields are averaged until that takes longer than the filter's memory `tau`.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    /// Turns `rotation` about the vertical towards the one in which the horizontal part of `field` points north.
    pub(super) fn update(
        &self,
        heading: &mut Heading<T>,
        rotation: &mut Rotation<T>,
        field: Option<&Vector3<T>>,
        dt: T,
    ) -> Flags {
        heading.since += dt;
        let Some(field) = field else { return Flags::default() };
        let up = rotation.up();
        let Some(north) = direction(field).and_then(|field| horizontal(&field, &up)) else {
            return Flags::MAGNETOMETER_MISSING;
        };
        if heading.known && heading.since <= T::zero() {
            return Flags::default();
        }
        if heading.known {
            let since = heading.since;
            heading.age += since;
            // The mean of all so far, until that is longer than the memory.
            let memory = if heading.age < self.tau { heading.age } else { self.tau };
            let weight = since / (memory + since);
            let measured = rotation.to_world(&north);
            let sine =
                if measured.y < T::zero() { T::one().copysign(measured.x) } else { measured.x };
            let turn = Rotation::of_turn(&Vector3::new(T::zero(), T::zero(), sine * weight));
            *rotation = turn.times(rotation).renormalised();
        } else {
            *rotation = Rotation::from_axes(&north.cross(&up), &north, &up);
            heading.known = true;
        }
        heading.since = T::zero();
        Flags::default()
    }
}

/// What a [`HeadingRule`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading<T> {
    /// Seconds since the first field.
    pub age: T,
    /// Seconds since the last.
    pub since: T,
    /// Whether a field has set the heading.
    pub known: bool,
}

impl<T: Real> Heading<T> {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self { age: T::zero(), since: T::zero(), known: false }
    }

    /// Known from elsewhere, and for long.
    pub(super) fn given() -> Self {
        Self { age: T::one() / T::zero(), since: T::zero(), known: true }
    }
}
