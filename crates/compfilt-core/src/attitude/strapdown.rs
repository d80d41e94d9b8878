//! A strapdown with a known calibration: the mean force of blocks in the gyro's frame.

use super::held_rate::HeldRate;
use super::rotation::Rotation;
use super::sensors::Sensors;
use super::smoother::SmootherBlock;
use super::vector::Vector;
use crate::linear::Flags;
use crate::{Dt, Real};
use nalgebra::{Matrix3, Vector3};

/// A strapdown with a fixed calibration that averages the force in the gyro's frame over blocks. It is made by
/// [`SelfCalibratingFilter::strapdown`](super::SelfCalibratingFilter::strapdown).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strapdown<T> {
    bias: Vector3<T>,
    matrix: Matrix3<T>,
    sensors: Sensors<T>,
    block: T,
}

/// The state of a [`Strapdown`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrapdownState<T> {
    /// From body to the gyro's frame.
    pub frame: Rotation<T>,
    /// The turn of the last step.
    pub turn: Rotation<T>,
    /// Seconds since the first sample.
    pub time: T,
    rate: HeldRate<T>,
    force: Vector3<T>,
    force_time: T,
    block_time: T,
    pub(super) segment: u32,
}

impl<T: Real> StrapdownState<T> {
    /// Before the first sample.
    pub fn new() -> Self {
        Self {
            frame: Rotation::identity(),
            turn: Rotation::identity(),
            time: T::zero(),
            rate: HeldRate::new(),
            force: Vector3::zeros(),
            force_time: T::zero(),
            block_time: T::zero(),
            segment: 0,
        }
    }
}

impl<T: Real> Default for StrapdownState<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Strapdown<T> {
    pub(super) fn new(bias: Vector3<T>, matrix: Matrix3<T>, sensors: Sensors<T>, block: T) -> Self {
        Self { bias, matrix, sensors, block }
    }

    /// One sample after the time `dt`; the block that it ends, if it ends one. A force that is missing is left out.
    pub fn step(
        &self,
        dt: Dt<T>,
        state: &mut StrapdownState<T>,
        gyro: &Vector3<T>,
        force: &Vector3<T>,
    ) -> Option<SmootherBlock<T>> {
        let dt = dt.seconds();
        let Self { bias, matrix, sensors, .. } = self;
        let taken = state.rate.take(gyro, dt, sensors.hold, &mut Flags::default());
        let held = taken.value.0;
        let rate = if taken.lost { Vector3::zeros() } else { held - bias - matrix * held };
        state.turn = Rotation::of_turn(&(rate * dt));
        state.frame = state.frame.times(&state.turn).renormalised();
        state.time += dt;
        if dt > sensors.gap {
            // What happened in a gap is unknown, and no sample stands for it.
            (state.force, state.force_time, state.block_time) =
                (Vector3::zeros(), T::zero(), T::zero());
            state.segment = state.segment.wrapping_add(1);
            return None;
        }
        state.block_time += dt;
        if sensors.is_there(Vector(*force)) {
            state.force += state.frame.to_world(&(force - rate.cross(force) * sensors.delay)) * dt;
            state.force_time += dt;
        }
        let half = T::literal(0.5);
        let over = state.block_time + dt * half >= self.block && state.force_time > T::zero();
        over.then(|| {
            let (force, time) = (state.force / state.force_time, state.block_time);
            let middle = state.time - time * half;
            (state.force, state.force_time, state.block_time) =
                (Vector3::zeros(), T::zero(), T::zero());
            SmootherBlock::new(force, time, middle, state.segment)
        })
    }
}
