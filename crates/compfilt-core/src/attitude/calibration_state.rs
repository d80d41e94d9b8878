//! The state of the self-calibrating filter.

use super::calibration_block::{Block, Slope};
use super::heading::Heading;
use super::held_rate::HeldRate;
use super::rest::Rest;
use super::rotation::Rotation;
use super::vector::Vector;
use crate::linear::each;
use crate::{Change, Mask, Number, Real};
use nalgebra::{Matrix3, Vector3};

/// What is learnt: the gyro's bias, its sensitivity errors row by row, the delay between both sensors.
pub(super) const PARAMETERS: usize = 13;

/// The state of a [`SelfCalibratingFilter`](super::SelfCalibratingFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct SelfCalibrationState<T: Number> {
    /// From body to the gyro's frame.
    pub frame: Rotation<T>,
    /// The low-passed specific force in that frame, m/s².
    pub mean: Vector3<T>,
    /// Its velocity, in the filter's own units.
    pub velocity: Vector3<T>,
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// What was learnt of the sensitivity errors, to be added to those known before.
    pub matrix: Matrix3<T>,
    /// What was learnt of the delay in s, to be added to the filter's.
    pub delay: T,
    /// Rest, and the gyro's bias.
    pub rest: Rest<T>,
    /// The sensitivities to the parameters: three of the bias, nine of the matrix row by row, the delay.
    pub slopes: [Slope<T>; PARAMETERS],
    /// The block under way.
    pub block: Block<T>,
    /// The last rate.
    pub rate: HeldRate<T>,
    /// The heading's filter.
    pub heading: Heading<T>,
    /// Seconds since the start.
    pub age: T,
    /// Whether there is an attitude.
    pub started: T::Mask,
    /// Whether the first block is over.
    pub settled: T::Mask,
    /// Whether the body rests.
    pub resting: T::Mask,
}

impl<T: Real> SelfCalibrationState<T> {
    /// Starts from a known attitude, and a specific force of standard gravity.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let mean = rotation.up() * T::literal(9.806_65);
        let heading = Heading::given();
        Self {
            mean,
            rotation,
            heading,
            age: T::literal(1e4),
            started: true,
            settled: true,
            ..Self::new()
        }
    }

    /// The world's up in body axes; `None` before the start.
    pub fn up(&self) -> Option<Vector3<T>> {
        let (up, there) = Vector(self.mean).direction();
        (there && self.started).then(|| self.frame.to_body(&up.0))
    }
}

impl<T: Number> SelfCalibrationState<T> {
    /// Waits for the first measurement.
    #[inline(always)]
    pub fn new() -> Self {
        let (zero, nothing, not) = (T::literal(0.0), Vector::zero().0, T::Mask::same(false));
        Self {
            frame: Rotation::identity(),
            mean: nothing,
            velocity: nothing,
            rotation: Rotation::identity(),
            matrix: Matrix3::from_array_storage(nalgebra::ArrayStorage([[zero; 3]; 3])),
            delay: zero,
            rest: Rest::new(),
            slopes: [Slope::new(); PARAMETERS],
            block: Block::new(),
            rate: HeldRate::new(),
            heading: Heading::new(),
            age: zero,
            started: not,
            settled: not,
            resting: not,
        }
    }

    /// How the frame's turn with one parameter has turned the mean; nothing for the delay, which turns nothing.
    #[inline(always)]
    pub(super) fn turned(&self, index: usize) -> Vector<T> {
        match self.block.turned.get(index) {
            Some(turned) => Vector(*turned).cross(&Vector(self.mean)),
            None => Vector::zero(),
        }
    }

    /// The place of a parameter: the bias, the matrix row by row (it is stored column by column), the delay.
    #[inline(always)]
    pub(super) fn parameter(&mut self, index: usize) -> &mut T {
        let element = index.saturating_sub(3);
        let part = if index < 3 {
            self.rest.bias.data.0[0].get_mut(index)
        } else {
            self.matrix.data.0[element % 3].get_mut(element / 3)
        };
        part.unwrap_or(&mut self.delay)
    }

    /// Turns the attitude until the low-passed force is its vertical.
    #[inline(always)]
    pub(super) fn set_upright(&mut self) {
        let (up, there) = Vector(self.mean).direction();
        let upright = self.rotation.upright(Vector(self.frame.to_body(&up.0)));
        self.rotation = if (there & self.started).all() {
            upright
        } else {
            Rotation::choose(there & self.started, upright, self.rotation.renormalised())
        };
    }

    /// The vertical forgotten, heading and what was learnt kept.
    #[inline(never)]
    pub(super) fn renewed(self) -> Self {
        let mut slopes = [Slope::new(); PARAMETERS];
        for (slope, known) in slopes.iter_mut().zip(&self.slopes) {
            slope.information = known.information;
        }
        Self {
            rotation: self.rotation,
            matrix: self.matrix,
            delay: self.delay,
            rest: self.rest.renewed(),
            rate: self.rate,
            heading: self.heading,
            slopes,
            ..Self::new()
        }
    }

    #[inline(always)]
    pub(super) fn is_finite(&self) -> T::Mask {
        // One number that is not finite makes the sum none.
        let mut sum = self.rotation.square() + self.frame.square();
        for vector in [self.mean, self.velocity, self.rest.bias] {
            let [x, y, z] = Vector(vector).parts();
            sum += x + y + z;
        }
        for [x, y, z] in self.matrix.data.0 {
            sum += x + y + z;
        }
        sum.is_number()
    }

    /// [`choose`](Self::choose) for what is rare: not part of a loop's code.
    #[inline(never)]
    pub(super) fn choose_rarely(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self::choose(mask, yes, no)
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        let vector = |a: Vector3<T>, b: Vector3<T>| Vector::choose(mask, Vector(a), Vector(b)).0;
        let either = |a: T::Mask, b: T::Mask| mask & a | !mask & b;
        let (mut matrix, mut slopes) = (no.matrix, no.slopes);
        for (column, yes) in matrix.data.0.iter_mut().zip(&yes.matrix.data.0) {
            for (element, yes) in column.iter_mut().zip(yes) {
                *element = T::choose(mask, *yes, *element);
            }
        }
        for (slope, yes) in slopes.iter_mut().zip(&yes.slopes) {
            *slope = Slope::choose(mask, yes, slope);
        }
        Self {
            frame: Rotation::choose(mask, yes.frame, no.frame),
            mean: vector(yes.mean, no.mean),
            velocity: vector(yes.velocity, no.velocity),
            rotation: Rotation::choose(mask, yes.rotation, no.rotation),
            matrix,
            delay: T::choose(mask, yes.delay, no.delay),
            rest: Rest::choose(mask, &yes.rest, &no.rest),
            slopes,
            block: Block::choose(mask, &yes.block, &no.block),
            rate: HeldRate::choose(mask, &yes.rate, &no.rate),
            heading: Heading::choose(mask, &yes.heading, &no.heading),
            age: T::choose(mask, yes.age, no.age),
            started: either(yes.started, no.started),
            settled: either(yes.settled, no.settled),
            resting: either(yes.resting, no.resting),
        }
    }

    /// The same state in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> SelfCalibrationState<U> {
        // The numbers are stored in this order.
        SelfCalibrationState {
            rotation: self.rotation.each(change),
            frame: self.frame.each(change),
            mean: Vector(self.mean).each(change).0,
            velocity: Vector(self.velocity).each(change).0,
            matrix: matrix_each(&self.matrix, change),
            rest: self.rest.each(change),
            slopes: self.slopes.map(|slope| slope.each(change)),
            block: self.block.each(change),
            rate: self.rate.each(change),
            heading: self.heading.each(change),
            age: change.number(self.age),
            delay: change.number(self.delay),
            started: change.mask(self.started),
            settled: change.mask(self.settled),
            resting: change.mask(self.resting),
        }
    }
}

impl<T: Number> Default for SelfCalibrationState<T> {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(never)]
pub(super) fn matrix_each<T: Number, U: Number>(
    matrix: &Matrix3<T>,
    change: &mut impl Change<T, U>,
) -> Matrix3<U> {
    let columns = matrix.data.0.map(|column| each(&column, change));
    Matrix3::from_array_storage(nalgebra::ArrayStorage(columns))
}
