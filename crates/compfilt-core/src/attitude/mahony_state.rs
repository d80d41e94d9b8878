//! The state of Mahony's filters, and what a sample measures.

use super::held_rate::HeldRate;
use super::rotation::{Rotation, horizontal};
use super::vector::Vector;
use crate::{Change, Mask, Number, Real};
use nalgebra::Vector3;

/// The state of a [`Mahony`](super::Mahony) filter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct MahonyState<T: Number> {
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// The gyro's bias in rad/s.
    pub bias: Vector3<T>,
    /// The last rate.
    pub rate: HeldRate<T>,
    /// Seconds since the start, which shorten the filter's memory at the beginning; infinite where the attitude was given.
    pub age: T,
    /// Seconds since the last correction of the tilt.
    pub since_correction: T,
    /// Seconds since the last correction of the heading.
    pub since_heading: T,
    /// Whether there is an attitude.
    pub started: T::Mask,
    /// Whether a magnetometer has set the heading.
    pub heading_known: T::Mask,
}

impl<T: Real> MahonyState<T> {
    /// Starts from a known attitude.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let age = T::literal(f64::INFINITY);
        Self { rotation, age, started: true, heading_known: true, ..Self::new() }
    }
}

impl<T: Number> MahonyState<T> {
    /// Waits for the first measurement.
    #[inline(always)]
    pub fn new() -> Self {
        let zero = T::literal(0.0);
        Self {
            rotation: Rotation::identity(),
            bias: Vector::zero().0,
            rate: HeldRate::new(),
            age: zero,
            since_correction: zero,
            since_heading: zero,
            started: T::Mask::same(false),
            heading_known: T::Mask::same(false),
        }
    }

    /// The first vertical, and a heading where there is one.
    #[cold]
    #[inline(never)]
    pub(super) fn begun(self, measured: Directions<T>) -> Self {
        let mut begun = self;
        let upright = Rotation::upwards(measured.up);
        begun.rotation = Rotation::choose(measured.has_up, upright, self.rotation);
        begun.started = measured.has_up;
        begun.turned_north(measured.field, measured.has_field & measured.has_up)
    }

    /// Turns about the vertical until the field's horizontal part points north.
    #[cold]
    #[inline(never)]
    pub(super) fn turned_north(self, field: Vector<T>, turning: T::Mask) -> Self {
        let up = Vector(self.rotation.up());
        let (north, there) = horizontal(field, up);
        let facing = Rotation::of_axes(north.cross(&up), north, up);
        let rotation = Rotation::choose(turning & there, facing, self.rotation);
        Self { rotation, heading_known: self.heading_known | turning & there, ..self }
    }

    #[inline(always)]
    pub(super) fn is_finite(&self) -> T::Mask {
        // One number that is not finite makes the sum none.
        let [x, y, z] = Vector(self.bias).parts();
        (self.rotation.square() + x + y + z).is_number()
    }

    /// Forgets everything where it is `lost`.
    #[cold]
    #[inline(never)]
    pub(super) fn restart(&mut self, lost: T::Mask) {
        *self = Self::choose(lost, Self::new(), *self);
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(never)]
    pub(super) fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self {
            rotation: Rotation::choose(mask, yes.rotation, no.rotation),
            bias: Vector::choose(mask, Vector(yes.bias), Vector(no.bias)).0,
            rate: HeldRate::choose(mask, &yes.rate, &no.rate),
            age: T::choose(mask, yes.age, no.age),
            since_correction: T::choose(mask, yes.since_correction, no.since_correction),
            since_heading: T::choose(mask, yes.since_heading, no.since_heading),
            started: mask & yes.started | !mask & no.started,
            heading_known: mask & yes.heading_known | !mask & no.heading_known,
        }
    }

    /// The same state in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> MahonyState<U> {
        MahonyState {
            rotation: self.rotation.each(change),
            bias: Vector(self.bias).each(change).0,
            rate: self.rate.each(change),
            age: change.number(self.age),
            since_correction: change.number(self.since_correction),
            since_heading: change.number(self.since_heading),
            started: change.mask(self.started),
            heading_known: change.mask(self.heading_known),
        }
    }
}

impl<T: Number> Default for MahonyState<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// The measured directions of a sample: unit vectors, body axes.
#[derive(Clone, Copy)]
pub(super) struct Directions<T: Number> {
    pub(super) up: Vector<T>,
    pub(super) has_up: T::Mask,
    pub(super) field: Vector<T>,
    pub(super) has_field: T::Mask,
    /// Whether there is a magnetometer at all.
    pub(super) magnetometer: bool,
}
