//! The offline answer: the force in the gyro's frame, smoothed forward and backward.

use super::heading::{Heading, HeadingRule};
use super::rotation::Rotation;
use super::strapdown::StrapdownState;
use super::vector::Vector;
use crate::error::positive;
use crate::linear::Flags;
use crate::{Dt, Error, Number, Real};
use nalgebra::Vector3;

/// A block of the [`Smoother`]: its mean force, and what the passes leave of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherBlock<T> {
    force: Vector3<T>,
    time: T,
    middle: T,
    segment: u32,
    predicted: Estimate<T>,
    last: Estimate<T>,
}

impl<T: Real> SmootherBlock<T> {
    pub(super) fn new(force: Vector3<T>, time: T, middle: T, segment: u32) -> Self {
        let start = Estimate::start(force);
        Self { force, time, middle, segment, predicted: start, last: start }
    }

    /// The smoothed force in the gyro's frame.
    pub fn mean(&self) -> Vector3<T> {
        self.last.mean
    }
}

/// The force, its integrated innovation, and their common covariance per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate<T> {
    mean: Vector3<T>,
    velocity: Vector3<T>,
    mean_variance: T,
    covariance: T,
    velocity_variance: T,
}

impl<T: Real> Estimate<T> {
    fn start(force: Vector3<T>) -> Self {
        Self {
            mean: force,
            velocity: Vector3::zeros(),
            mean_variance: T::literal(100.0),
            covariance: T::zero(),
            velocity_variance: T::one(),
        }
    }
}

/// The second-order low-pass of the gravity filter, forward and backward: zero phase.
///
/// ```text
/// V' = f̄ - m,   m a random walk of density ω0⁴,   V measured as 0 with density 1
/// ```
///
/// is the Kalman filter whose smoother (Rauch, Tung, Striebel) has the squared magnitude of a second-order Butterworth low-pass
/// at `omega0` in the middle of a log, and is exact at its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoother<T> {
    /// `ω0⁴`.
    density: T,
}

impl<T: Real> Smoother<T> {
    /// With the time constant `tau` in seconds, `omega0 = √2/tau`.
    ///
    /// # Errors
    /// `tau` is not positive and finite.
    pub fn new(tau: T) -> Result<Self, Error> {
        let square = T::literal(2.0) / (positive("tau", tau)? * tau);
        Ok(Self { density: positive("tau", square * square)? })
    }

    /// Both passes over the blocks of a log, each segment by itself.
    pub fn smooth(&self, blocks: &mut [SmootherBlock<T>]) {
        let mut before: Option<SmootherBlock<T>> = None;
        for block in blocks.iter_mut() {
            let start = before.filter(|before| before.segment == block.segment);
            self.forward(block, start.map(|before| before.last));
            before = Some(*block);
        }
        let mut after: Option<SmootherBlock<T>> = None;
        for block in blocks.iter_mut().rev() {
            if let Some(after) = after.filter(|after| after.segment == block.segment) {
                backward(block, &after);
            }
            after = Some(*block);
        }
    }

    fn forward(&self, block: &mut SmootherBlock<T>, before: Option<Estimate<T>>) {
        let time = block.time;
        let mut x = before.unwrap_or_else(|| Estimate::start(block.force));
        if before.is_some() {
            x.mean_variance += self.density * time;
        }
        x.velocity += (block.force - x.mean) * time;
        let shared = time * x.mean_variance;
        x.velocity_variance += time * (shared - x.covariance - x.covariance);
        x.covariance -= shared;
        block.predicted = x;
        let scale = T::one() / (x.velocity_variance + T::one() / time);
        let (k_mean, k_velocity) = (x.covariance * scale, x.velocity_variance * scale);
        x.mean -= x.velocity * k_mean;
        x.velocity -= x.velocity * k_velocity;
        x.mean_variance -= k_mean * x.covariance;
        x.covariance *= T::one() - k_velocity;
        x.velocity_variance *= T::one() - k_velocity;
        block.last = x;
    }

    /// The smoothed force at a time since the first sample, linear between the middles of a segment's blocks; `near` is where
    /// the search begins, and is moved on. `None` in a segment without blocks.
    fn at(
        blocks: &[SmootherBlock<T>],
        near: &mut usize,
        time: T,
        segment: u32,
    ) -> Option<Vector3<T>> {
        let before = |block: &SmootherBlock<T>| {
            block.segment < segment || block.segment == segment && block.middle <= time
        };
        while blocks.get(*near + 1).is_some_and(before) {
            *near += 1;
        }
        // The first half block of a segment is nearer to its own first block than to the last of the one before.
        if blocks.get(*near).is_some_and(|here| here.segment < segment)
            && blocks.get(*near + 1).is_some_and(|next| next.segment == segment)
        {
            *near += 1;
        }
        let here = blocks.get(*near).filter(|here| here.segment == segment)?;
        match blocks.get(*near + 1) {
            Some(next) if time > here.middle && next.segment == here.segment => {
                let part = (time - here.middle) / (next.middle - here.middle);
                Some(here.mean() + (next.mean() - here.mean()) * part)
            }
            _ => Some(here.mean()),
        }
    }
}

/// Moves a filtered estimate by what the blocks after it have said.
fn backward<T: Real>(block: &mut SmootherBlock<T>, after: &SmootherBlock<T>) {
    let (x, ahead, time) = (block.last, after.predicted, after.time);
    // C = P Aᵀ P⁻¹ with A = [[1, 0], [-time, 1]]
    let (p00, p10) = (x.mean_variance, x.covariance);
    let (p01, p11) = (p10 - time * p00, x.velocity_variance - time * p10);
    let (a, b, d) = (ahead.mean_variance, ahead.covariance, ahead.velocity_variance);
    let scale = T::one() / (a * d - b * b);
    let (mean, velocity) = (after.last.mean - ahead.mean, after.last.velocity - ahead.velocity);
    let weight = |p: T, q: T| (mean * (p * d - q * b) + velocity * (q * a - p * b)) * scale;
    block.last.mean += weight(p00, p01);
    block.last.velocity += weight(p10, p11);
}

/// The second pass over the samples: the smoothed force as an attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedAttitude<T: Number> {
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// The world's up in body axes.
    pub up: Vector3<T>,
    heading: Heading<T>,
    near: usize,
}

impl<T: Real> SmoothedAttitude<T> {
    /// Before the first sample, with a rotation whose heading is to be kept.
    pub fn new(rotation: Option<Rotation<T>>) -> Self {
        let heading = if rotation.is_some() { Heading::given() } else { Heading::new() };
        Self {
            rotation: rotation.unwrap_or(Rotation::identity()),
            up: Vector3::z(),
            heading,
            near: 0,
        }
    }

    /// One sample after the strapdown's step of `dt`, which must have begun anew: the force at the middle of the step. The
    /// heading is the gyro's, or follows `magnetic_field` as it does online. `None` in a segment without blocks.
    pub fn step(
        &mut self,
        dt: Dt<T>,
        strapdown: &StrapdownState<T>,
        blocks: &[SmootherBlock<T>],
        heading: &HeadingRule<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> Option<Flags> {
        let dt = dt.seconds();
        let time = strapdown.time - dt * T::literal(0.5);
        self.rotation = self.rotation.times(&strapdown.turn).renormalised();
        let force = Smoother::at(blocks, &mut self.near, time, strapdown.segment)?;
        let (up, there) = Vector(force).direction();
        if !there {
            return None;
        }
        self.up = strapdown.frame.to_body(&up.0);
        self.rotation = self.rotation.upright(Vector(self.up));
        let (known, rotation, mut flags) =
            (&mut self.heading, &mut self.rotation, Flags::default());
        heading.update(known, rotation, magnetic_field, dt, true, &mut flags);
        Some(flags)
    }
}
