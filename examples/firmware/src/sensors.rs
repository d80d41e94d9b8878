//! What has several sensors or outputs: tilt from gravity, the cube's pipeline, an observer.

use crate::DT;
use crate::recording::{force, force_with_gaps, gyro, gyro_with_gaps};
use crate::report::Report;
use compfilt_core::gravity::{Axes, Cube, Extraction, SensorWeights, TiltFilter, TiltState};
use compfilt_core::nalgebra::{
    ArrayStorage, Matrix2x3, Matrix3, Matrix3x1, Matrix3x2, Vector1, Vector2, Vector3,
};
use compfilt_core::{Discretise, FirstOrder, Observer, ObserverState, PiForm};
use core::hint::black_box;
use no_panic_probe as steps;

include!(concat!(env!("OUT_DIR"), "/cube.rs"));

pub fn run(report: &Report) -> Option<()> {
    tilt_of_gravity(report)?;
    tilt(report)?;
    cube(report)?;
    observer(report)
}

fn tilt_of_gravity(report: &Report) -> Option<()> {
    report.run(
        "tilt_of_gravity",
        black_box::<fn(&_) -> Option<_>>(steps::probe_tilt_of_gravity),
        (),
        force,
        |step, (), force| step(force),
        |(), angles| angles.unwrap_or(Vector2::repeat(f32::NAN)).into(),
    )
}

fn tilt(report: &Report) -> Option<()> {
    let filter = TiltFilter::new(PiForm::new(2.0, 0.5).ok()?.chain(), Axes::Flu);
    let gains = filter.design().at(DT).ok()?;
    report.run(
        "tilt",
        black_box::<fn(&_, &_, &mut _, &_, &_) -> _>(steps::probe_tilt),
        TiltState::new(),
        |n| (gyro_with_gaps(n), force_with_gaps(n)),
        |step, state, (gyro, force)| step(&filter, &gains, state, gyro, force),
        |state, flags| {
            let [roll, pitch] = filter.angles(state).into();
            [roll, pitch, f32::from(flags.bits())]
        },
    )
}

/// Six sensors that read the recording one after the other.
fn cube(report: &Report) -> Option<()> {
    let design = FirstOrder::new(0.5).ok()?.chain();
    let cube = Cube {
        rotations: ROTATIONS,
        gravity: Extraction { weights: WEIGHTS, centripetal: None },
        tilt: TiltFilter::new(design, Axes::Cube),
    };
    let gains = cube.tilt.design().at(DT).ok()?;
    let six = |sensor: fn(usize) -> Vector3<f32>, n| [0, 1, 2, 3, 4, 5].map(|i| sensor(n + i));
    report.run(
        "cube_first_order",
        black_box::<fn(&_, &_, &mut _, &[_; 6], &[_; 6], &_) -> _>(steps::probe_cube_first_order),
        TiltState::new(),
        |n| (six(gyro_with_gaps, n), six(force, n), gyro(n)),
        |step, state, (gyros, forces, wheels)| step(&cube, &gains, state, gyros, forces, wheels),
        |_, sample| {
            let [phi2, phi3] = sample.angles.into();
            let ([a, b, c], [x, y, z]) = (sample.body_rate.into(), sample.gravity.into());
            [phi2, phi3, a, b, c, x, y, z, f32::from(sample.flags.bits())]
        },
    )
}

/// Three states, two outputs, one input; `a · correction = l`.
fn observer(report: &Report) -> Option<()> {
    let observer = Observer::new(
        Matrix3::new(1.0, 0.5, 0.0, 0.0, 0.5, 0.25, 0.0, 0.0, 0.75),
        Matrix3x1::new(0.001, -0.2, 0.9),
        Matrix2x3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        Matrix3x2::new(0.25, 0.125, 0.1875, 0.125, 0.09375, 0.1875),
        Matrix3x2::new(0.09375, 0.0625, 0.3125, 0.125, 0.125, 0.25),
    )
    .ok()?;
    report.run(
        "observer",
        black_box::<fn(&_, &mut _, &_, &_) -> _>(steps::probe_observer),
        ObserverState::new(Vector3::zeros()),
        |n| (Vector2::new(force_with_gaps(n).x, gyro_with_gaps(n).y), Vector1::new(gyro(n).x)),
        |step, state, (y, u)| (state.x, step(&observer, state, y, u)),
        |_, (predicted, filtered)| {
            let ([a, b, c], [x, y, z]) = (predicted.into(), filtered.into());
            [a, b, c, x, y, z]
        },
    )
}
