//! Whether the body is at rest, and the gyro's bias while it is.

use super::vector::Vector;
use crate::error::positive;
use crate::{Change, Error, Mask, Number, Real};
use nalgebra::Vector3;

/// When a body counts as resting.
///
/// Gyro and accelerometer are low-passed with `memory` (a mean at first). Still is a sample where the gyro is within `rate` of
/// its low-pass, which is within `bias_limit` on every axis, where the accelerometer is within `force` of its own, and where that
/// has not drifted by more than `drift` since the stillness began: a slow turn about a horizontal axis drifts. Resting is to
/// have been still for `time`. Then the bias follows the low-passed gyro: as a mean at first, later with `bias_memory`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RestRule<T> {
    memory: T,
    time: T,
    rate: T,
    force: T,
    drift: T,
    bias_limit: T,
    bias_memory: T,
}

impl<T: Real> Default for RestRule<T> {
    /// 0.5 s, 1.5 s, 2 deg/s, 0.5 m/s², 0.1 m/s², 2 deg/s, 2 s.
    fn default() -> Self {
        let degrees = T::pi() / T::literal(180.0);
        Self {
            memory: T::literal(0.5),
            time: T::literal(1.5),
            rate: T::literal(2.0) * degrees,
            force: T::literal(0.5),
            drift: T::literal(0.1),
            bias_limit: T::literal(2.0) * degrees,
            bias_memory: T::literal(2.0),
        }
    }
}

macro_rules! setting {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        ///
        /// # Errors
        /// It is not positive and finite.
        pub fn $name(self, $name: T) -> Result<Self, Error> {
            Ok(Self { $name: positive(stringify!($name), $name)?, ..self })
        }
    )*};
}

impl<T: Real> RestRule<T> {
    setting! {
        /// The memory of the low-passes in s.
        memory
        /// How long in s a body must be still to count as resting.
        time
        /// How far in rad/s the gyro may be from its low-pass.
        rate
        /// How far in m/s² the accelerometer may be from its low-pass.
        force
        /// How far in m/s² the low-passed accelerometer may drift in a rest.
        drift
        /// The largest bias in rad/s on an axis.
        bias_limit
        /// The memory of the bias in s.
        bias_memory
    }
}

impl<T: Number> RestRule<T> {
    #[inline(always)]
    pub(super) fn largest_bias(&self) -> T {
        self.bias_limit
    }

    /// A sample after `dt` seconds, where both sensors are `there`; a sample that is not ends a rest. Where the body rests.
    #[inline(always)]
    pub(super) fn update(
        &self,
        rest: &mut Rest<T>,
        gyro: Vector<T>,
        force: Vector<T>,
        dt: T,
        there: T::Mask,
    ) -> T::Mask {
        let going = rest.begun & there;
        let mut resting = T::Mask::same(false);
        if going.any() {
            self.low_pass(rest, gyro, force, dt, going);
            resting = self.wait(rest, gyro, force, dt, going);
        } else {
            rest.still = T::literal(0.0);
        }
        if !going.all() {
            rest.begin(gyro, force, there & !going);
        }
        if resting.any() {
            self.follow(rest, dt, resting);
        }
        resting
    }

    /// How long the body has been still, where the low-passes are `going`, and where that is long enough.
    #[inline(always)]
    fn wait(
        &self,
        rest: &mut Rest<T>,
        gyro: Vector<T>,
        force: Vector<T>,
        dt: T,
        going: T::Mask,
    ) -> T::Mask {
        let zero = T::literal(0.0);
        let still = going & self.is_still(rest, gyro, force);
        if !still.all() {
            let moved = going & !still;
            rest.anchor = Vector::choose(moved, Vector(rest.force), Vector(rest.anchor)).0;
        }
        if !still.any() {
            rest.still = zero;
            return still;
        }
        rest.still = T::choose(still, (rest.still + dt).or_less(self.time), zero);
        still & self.time.at_most(rest.still)
    }

    /// Low-passes both sensors where `going`.
    #[inline(always)]
    fn low_pass(
        &self,
        rest: &mut Rest<T>,
        gyro: Vector<T>,
        force: Vector<T>,
        dt: T,
        going: T::Mask,
    ) {
        let age = (rest.age + dt).or_less(self.memory);
        let zero = T::literal(0.0);
        let weight = T::choose(zero.less(dt), dt / (age + dt), zero);
        let (gyro_mean, force_mean) = (Vector(rest.gyro), Vector(rest.force));
        let moved_gyro = gyro_mean + (gyro - gyro_mean) * weight;
        let moved_force = force_mean + (force - force_mean) * weight;
        rest.gyro = Vector::choose(going, moved_gyro, gyro_mean).0;
        rest.force = Vector::choose(going, moved_force, force_mean).0;
        rest.age = T::choose(going, age, rest.age);
    }

    #[inline(always)]
    fn is_still(&self, rest: &Rest<T>, gyro: Vector<T>, force: Vector<T>) -> T::Mask {
        let (gyro_mean, force_mean) = (Vector(rest.gyro), Vector(rest.force));
        let [x, y, z] = gyro_mean.parts();
        let limit = self.bias_limit;
        let slow = x.magnitude().at_most(limit)
            & y.magnitude().at_most(limit)
            & z.magnitude().at_most(limit);
        slow & (gyro - gyro_mean).square().less(self.rate * self.rate)
            & (force - force_mean).square().less(self.force * self.force)
            & (force_mean - Vector(rest.anchor)).square().less(self.drift * self.drift)
    }

    /// Moves the bias to the low-passed gyro where the body rests.
    #[inline(always)]
    fn follow(&self, rest: &mut Rest<T>, dt: T, resting: T::Mask) {
        let rested = (rest.rested + dt).or_less(self.bias_memory);
        rest.rested = T::choose(resting, rested, rest.rested);
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let weight = (dt / T::choose(zero.less(rested), rested, one)).or_less(one);
        let bias = Vector(rest.bias);
        let moved = bias + (Vector(rest.gyro) - bias) * weight;
        rest.bias = Vector::choose(resting & zero.less(rested), moved, bias).0;
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> RestRule<U> {
        RestRule {
            memory: change.number(self.memory),
            time: change.number(self.time),
            rate: change.number(self.rate),
            force: change.number(self.force),
            drift: change.number(self.drift),
            bias_limit: change.number(self.bias_limit),
            bias_memory: change.number(self.bias_memory),
        }
    }
}

/// What a [`RestRule`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Rest<T: Number> {
    /// The gyro's bias in rad/s.
    pub bias: Vector3<T>,
    /// The low-passed gyro in rad/s.
    pub gyro: Vector3<T>,
    /// The low-passed accelerometer in m/s².
    pub force: Vector3<T>,
    /// Where that was when the body last was not still.
    pub anchor: Vector3<T>,
    /// How long in s the low-passes have been running, at most their memory.
    pub age: T,
    /// How long in s the body has been still, at most the time that makes a rest.
    pub still: T,
    /// How long in s it has rested in all, at most the bias's memory.
    pub rested: T,
    /// Whether the low-passes have begun.
    pub begun: T::Mask,
}

impl<T: Number> Rest<T> {
    /// Nothing yet.
    #[inline(always)]
    pub(super) fn new() -> Self {
        let (zero, nothing) = (T::literal(0.0), Vector::zero().0);
        Self {
            bias: nothing,
            gyro: nothing,
            force: nothing,
            anchor: nothing,
            age: zero,
            still: zero,
            rested: zero,
            begun: T::Mask::same(false),
        }
    }

    /// The low-passes begin: the time before the first sample is nobody's.
    #[inline(always)]
    fn begin(&mut self, gyro: Vector<T>, force: Vector<T>, beginning: T::Mask) {
        self.gyro = Vector::choose(beginning, gyro, Vector(self.gyro)).0;
        self.force = Vector::choose(beginning, force, Vector(self.force)).0;
        self.anchor = Vector::choose(beginning, force, Vector(self.anchor)).0;
        self.begun = self.begun | beginning;
    }

    /// The same bias, everything else forgotten.
    #[inline(always)]
    pub(super) fn renewed(&self) -> Self {
        Self { bias: self.bias, rested: self.rested, ..Self::new() }
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let vector = |a: Vector3<T>, b: Vector3<T>| Vector::choose(mask, Vector(a), Vector(b)).0;
        Self {
            bias: vector(yes.bias, no.bias),
            gyro: vector(yes.gyro, no.gyro),
            force: vector(yes.force, no.force),
            anchor: vector(yes.anchor, no.anchor),
            age: T::choose(mask, yes.age, no.age),
            still: T::choose(mask, yes.still, no.still),
            rested: T::choose(mask, yes.rested, no.rested),
            begun: mask & yes.begun | !mask & no.begun,
        }
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Rest<U> {
        Rest {
            bias: Vector(self.bias).each(change).0,
            gyro: Vector(self.gyro).each(change).0,
            force: Vector(self.force).each(change).0,
            anchor: Vector(self.anchor).each(change).0,
            age: change.number(self.age),
            still: change.number(self.still),
            rested: change.number(self.rested),
            begun: change.mask(self.begun),
        }
    }
}
