//! The gravity filter's offline passes: smoothing, and what the search for a delay looks at.

use crate::attitude_batch::{Bound, ROWS, Runner};
use crate::attitude_family::{GravityFamily, Sample, SelfCalibratingFamily};
use crate::attitude_log::{Log, Part};
use compfilt_core::Dt;
use compfilt_core::attitude::{HeadingRule, Rotation, SmoothedAttitude, Smoother, StrapdownState};
use compfilt_core::linear::Flags;
use numpy::ndarray::Array2;

/// What the offline passes take beside the filter itself.
pub(crate) struct Offline {
    pub(crate) smoother: Smoother<f64>,
    pub(crate) heading: HeadingRule<f64>,
    pub(crate) initial: Option<Rotation<f64>>,
}

/// The time step of a row. Where time began anew it is taken as a gap.
fn step(steps: Option<&[f64]>, sampled: Option<Dt<f64>>, row: usize) -> Option<Dt<f64>> {
    match steps {
        None => sampled,
        Some(steps) => Dt::new(if steps[row].is_finite() { steps[row] } else { 1e9 }).ok(),
    }
}

/// A forward pass for flags, rest and calibration; a strapdown with that; the smoothed attitude. All results stand in `log`.
pub(crate) fn smooth(
    filter: &mut Bound<SelfCalibratingFamily, f64>,
    offline: &Offline,
    mut log: Log<'_, f64>,
) {
    filter.filter(&mut log);
    let sampled = filter.sampled.and_then(|dt| Dt::new(dt).ok());
    let strapdown = filter.filter.strapdown(&filter.state);
    let bias = filter.state.rest.bias;
    let mut run = StrapdownState::new();
    let mut blocks = Vec::new();
    each_sample(&mut log, sampled, |_, _, dt, sample| {
        blocks.extend(strapdown.step(dt, &mut run, &sample.gyr, &sample.acc));
    });
    offline.smoother.smooth(&mut blocks);
    let mut run = StrapdownState::new();
    let mut attitude = SmoothedAttitude::new(offline.initial);
    each_sample(&mut log, sampled, |part, row, dt, sample| {
        strapdown.step(dt, &mut run, &sample.gyr, &sample.acc);
        // A log shorter than a block keeps the forward pass's answer.
        let mag = sample.mag.as_ref();
        if attitude.step(dt, &run, &blocks, &offline.heading, mag).is_some() {
            part.write_attitude(row, &attitude.rotation, &attitude.up);
            part.flags[row] &= !Flags::NOT_STARTED.bits();
        }
        part.bias[row] = bias.into();
    });
}

/// Level 1 of the plain filter after every sample: the low-passed velocity of the innovation.
pub(crate) fn velocities(
    filter: &mut Bound<GravityFamily<2>, f64>,
    mut log: Log<'_, f64>,
) -> Array2<f64> {
    let mut velocities = Array2::zeros((log.len(), 3));
    let mut rows = velocities.rows_mut().into_iter();
    let sampled = filter.sampled.and_then(|dt| Dt::new(dt).ok());
    each_sample(&mut log, sampled, |_, _, dt, sample| {
        filter.follow(Some(dt));
        filter.sample(sample);
        let velocity = filter.state.levels.levels[1];
        for (out, part) in rows.next().into_iter().flatten().zip(&velocity) {
            *out = *part;
        }
    });
    velocities
}

/// Calls `work` with every row of a log and its time step.
fn each_sample(
    log: &mut Log<'_, f64>,
    sampled: Option<Dt<f64>>,
    mut work: impl FnMut(&mut Part<'_, f64>, usize, Dt<f64>, &Sample<f64>),
) {
    for start in (0..log.len()).step_by(ROWS) {
        let mut part = log.part(start..log.len().min(start + ROWS));
        for row in 0..part.len() {
            if let Some(dt) = step(part.steps, sampled, row) {
                let sample = part.sample(row);
                work(&mut part, row, dt, &sample);
            }
        }
    }
}
