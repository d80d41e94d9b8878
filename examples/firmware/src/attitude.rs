//! The filters on the rotation group.

use crate::DT;
use crate::recording::{force_with_gaps, gyro_with_gaps};
use crate::report::Report;
use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyForm, MahonyState, Rotation, SelfCalibratingFilter,
    SelfCalibrationState,
};
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Dt, PiForm};
use core::hint::black_box;
use no_panic_probe as steps;

type Sample = (Vector3<f32>, Vector3<f32>);

fn sample(n: usize) -> Sample {
    (gyro_with_gaps(n), force_with_gaps(n))
}

/// What is compared: the quaternion, the gyro's bias, the flags.
fn outputs(rotation: &Rotation<f32>, bias: &Vector3<f32>, flags: Flags) -> [f32; 8] {
    let ([x, y, z], [a, b, c]) = (rotation.v.into(), (*bias).into());
    [rotation.w, x, y, z, a, b, c, f32::from(flags.bits())]
}

pub fn run(report: &Report) -> Option<()> {
    mahony(report)?;
    gravity(report)?;
    self_calibrating(report)
}

fn mahony(report: &Report) -> Option<()> {
    let filter = Mahony::new(PiForm::new(1.0, 0.25).ok()?.chain(), MahonyForm::Explicit);
    let gains = PiForm::new(1.0, 0.25).ok()?.at(DT).ok()?;
    report.run(
        "mahony_explicit",
        black_box::<fn(&_, &_, &mut _, &_, &_) -> _>(steps::probe_mahony_explicit),
        MahonyState::new(),
        sample,
        |step, state, (gyro, force)| step(&filter, &gains, state, gyro, force),
        |state, flags| outputs(&state.rotation, &state.bias, flags),
    )
}

fn gravity(report: &Report) -> Option<()> {
    let filter = GravityFilter::second_order(3.0, 0.5).ok()?;
    let gains = filter.at(DT).ok()?;
    report.run(
        "gravity",
        black_box::<fn(&_, &_, &mut _, &_, &_) -> _>(steps::probe_gravity),
        GravityState::new(),
        sample,
        |step, state, (gyro, force)| step(&filter, &gains, state, gyro, force),
        |state, flags| outputs(&state.rotation, &state.rest.bias, flags),
    )
}

fn self_calibrating(report: &Report) -> Option<()> {
    let filter = SelfCalibratingFilter::new(5.0, 0.5).ok()?;
    let dt = Dt::new(DT).ok()?;
    report.run(
        "self_calibrating",
        black_box::<fn(&_, Dt<f32>, &mut _, &_, &_) -> _>(steps::probe_self_calibrating),
        SelfCalibrationState::new(),
        sample,
        |step, state, (gyro, force)| step(&filter, dt, state, gyro, force),
        |state, flags| outputs(&state.rotation, &state.rest.bias, flags),
    )
}
