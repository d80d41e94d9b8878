//! The gravity filter's offline passes: smoothing, and what the search for a delay looks at.

use crate::attitude_batch::{Block, Filter, Runner};
use crate::batch::Steps;
use crate::gravity_batch::{Plain, SelfCalibrating};
use crate::tilt::vector;
use compfilt_core::Dt;
use compfilt_core::attitude::{HeadingRule, Rotation, SmoothedAttitude, Smoother, StrapdownState};
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::Vector3;
use numpy::ndarray::Array2;

/// What the offline passes take beside the filter itself.
pub(crate) struct Offline {
    pub(crate) smoother: Smoother<f64>,
    pub(crate) heading: HeadingRule<f64>,
    pub(crate) initial: Option<Rotation<f64>>,
}

/// The time step of a row. Where time began anew it is taken as a gap.
fn step(steps: &Steps<'_, f64>, sampled: Option<Dt<f64>>, row: usize) -> Option<Dt<f64>> {
    match steps {
        Steps::Uniform => sampled,
        Steps::Each(steps) => Dt::new(if steps[row].is_finite() { steps[row] } else { 1e9 }).ok(),
    }
}

/// A forward pass for flags, rest and calibration; a strapdown with that; the smoothed attitude. All results stand in `block`.
pub(crate) fn smooth(
    filter: &mut SelfCalibrating<f64>,
    offline: &Offline,
    mut block: Block<'_, f64>,
) {
    let steps = block.steps;
    filter.block(block.reborrow());
    let strapdown = filter.filter.strapdown(&filter.state);
    let bias = filter.state.rest.bias;
    let mut run = StrapdownState::new();
    let mut blocks = Vec::new();
    let rows = block.gyr.nrows();
    for row in 0..rows {
        let (gyr, acc) = (vector(block.gyr.row(row)), vector(block.acc.row(row)));
        if let Some(dt) = step(&steps, filter.sampled, row) {
            blocks.extend(strapdown.step(dt, &mut run, &gyr, &acc));
        }
    }
    offline.smoother.smooth(&mut blocks);
    let mut run = StrapdownState::new();
    let mut attitude = SmoothedAttitude::new(offline.initial);
    for row in 0..rows {
        let (gyr, acc) = (vector(block.gyr.row(row)), vector(block.acc.row(row)));
        let mag = block.mag.as_ref().map(|mag| vector(mag.row(row)));
        let Some(dt) = step(&steps, filter.sampled, row) else { continue };
        strapdown.step(dt, &mut run, &gyr, &acc);
        // A log shorter than a block keeps the forward pass's answer.
        if attitude.step(dt, &run, &blocks, &offline.heading, mag.as_ref()).is_some() {
            block.write_attitude(row, &attitude.rotation, &attitude.up);
            block.flags[row] &= !Flags::NOT_STARTED.bits();
        }
        block.write_bias(row, &bias);
    }
}

/// Level 1 of the plain filter after every sample: the low-passed velocity of the innovation.
pub(crate) fn velocities(filter: &mut Plain<f64, 2>, block: &Block<'_, f64>) -> Array2<f64> {
    let mut velocities = Array2::zeros((block.gyr.nrows(), 3));
    for (row, mut out) in velocities.rows_mut().into_iter().enumerate() {
        filter.follow(step(&block.steps, None, row));
        filter.sample(&vector(block.gyr.row(row)), &vector(block.acc.row(row)), None);
        let velocity: Vector3<f64> = filter.state.levels.levels[1];
        out.iter_mut().zip(velocity.iter()).for_each(|(out, part)| *out = *part);
    }
    velocities
}
