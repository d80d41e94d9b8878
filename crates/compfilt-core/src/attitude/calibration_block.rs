//! What the self-calibrating filter gathers over a block of samples, and how it depends on its parameters.

use super::rotation::Rotation;
use super::vector::Vector;
use crate::{Change, Number};
use nalgebra::Vector3;

/// How the filter's state depends on one parameter, and what is known about that.
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
pub struct Slope<T> {
    /// The derivative of the low-passed force.
    pub mean: Vector3<T>,
    /// The derivative of its velocity.
    pub velocity: Vector3<T>,
    /// The information gathered so far, beside the prior's.
    pub information: T,
}

/// What a block of samples adds up to.
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
pub struct Block<T> {
    /// The force in the gyro's frame, times time.
    pub force: Vector3<T>,
    /// What it would be more by for each second that it is moved ahead, times time.
    pub ahead: Vector3<T>,
    /// How long there was a force.
    pub force_time: T,
    /// How the frame turns with each parameter.
    pub turned: [Vector3<T>; 12],
    /// Seconds.
    pub time: T,
}

impl<T: Number> Block<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let (zero, nothing) = (T::literal(0.0), Vector::zero().0);
        Self { force: nothing, ahead: nothing, force_time: zero, turned: [nothing; 12], time: zero }
    }

    /// A sample that lasts `dt`, with a force where it is `there`.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        frame: &Rotation<T>,
        rate: Vector<T>,
        force: Vector<T>,
        there: T::Mask,
        dt: T,
    ) {
        let [x, y, z] = frame.axes();
        let axes = [x * dt, y * dt, z * dt];
        let turned = |v: Vector<T>| {
            let [a, b, c] = v.parts();
            axes[0] * a + axes[1] * b + axes[2] * c
        };
        let force = Vector::choose(there, force, Vector::zero());
        self.force = (Vector(self.force) + turned(force)).0;
        self.ahead = (Vector(self.ahead) - turned(rate.cross(&force))).0;
        self.force_time += T::choose(there, dt, T::literal(0.0));
        let (bias, matrix) = self.turned.split_at_mut(3);
        for ((axis, bias), row) in axes.iter().zip(bias).zip(matrix.chunks_exact_mut(3)) {
            *bias = (Vector(*bias) + *axis).0;
            for (part, element) in rate.parts().iter().zip(row) {
                *element = (Vector(*element) + *axis * *part).0;
            }
        }
        self.time += dt;
    }

    /// The mean force, what it gains for each second that it is moved ahead, and where there was a force.
    #[inline(always)]
    pub(super) fn means(&self) -> (Vector<T>, Vector<T>, T::Mask) {
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let seen = zero.less(self.force_time);
        let scale = one / T::choose(seen, self.force_time, one);
        (Vector(self.force) * scale, Vector(self.ahead) * scale, seen)
    }

    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let vector = |a: Vector3<T>, b: Vector3<T>| Vector::choose(mask, Vector(a), Vector(b)).0;
        let mut turned = no.turned;
        for (turned, yes) in turned.iter_mut().zip(&yes.turned) {
            *turned = vector(*yes, *turned);
        }
        Self {
            force: vector(yes.force, no.force),
            ahead: vector(yes.ahead, no.ahead),
            force_time: T::choose(mask, yes.force_time, no.force_time),
            turned,
            time: T::choose(mask, yes.time, no.time),
        }
    }

    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Block<U> {
        Block {
            force: Vector(self.force).each(change).0,
            ahead: Vector(self.ahead).each(change).0,
            turned: self.turned.map(|turned| Vector(turned).each(change).0),
            force_time: change.number(self.force_time),
            time: change.number(self.time),
        }
    }
}

impl<T: Number> Slope<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        let nothing = Vector::zero().0;
        Self { mean: nothing, velocity: nothing, information: T::literal(0.0) }
    }

    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            mean: Vector::choose(mask, Vector(yes.mean), Vector(no.mean)).0,
            velocity: Vector::choose(mask, Vector(yes.velocity), Vector(no.velocity)).0,
            information: T::choose(mask, yes.information, no.information),
        }
    }

    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Slope<U> {
        Slope {
            mean: Vector(self.mean).each(change).0,
            velocity: Vector(self.velocity).each(change).0,
            information: change.number(self.information),
        }
    }
}
