//! The cube's pipeline is its parts; its missing sensors are flagged.

use compfilt_core::gravity::{
    Accelerometer, AccelerometerArray, Axes, Cube, Quantity, Rate, TiltFilter, TiltState, mean_rate,
};
use compfilt_core::linear::{Flags, RateState};
use compfilt_core::nalgebra::{Vector2, Vector3};
use compfilt_core::{Chain, Discretise, Number, PiForm, RateFilter};

const CORNERS: [[f64; 3]; 4] =
    [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.0, 0.15, 0.0], [0.0, 0.0, 0.15]];

type Design = Chain<f32, 2, 1>;

fn array() -> AccelerometerArray<[Accelerometer; 4]> {
    AccelerometerArray::new(CORNERS.map(|r| Accelerometer::at(Vector3::from(r)))).unwrap()
}

fn tilt() -> TiltFilter<f32, Design> {
    TiltFilter::new(PiForm::new(2.0, 0.5).unwrap().chain(), Axes::Cube)
}

/// Readings of a cube that swings about x.
fn readings(n: u16) -> ([Vector3<f32>; 4], [Vector3<f32>; 4]) {
    let (s, c) = (f32::from(n) * 0.001).sin_cos();
    let rate = Vector3::new(c, 0.1 * s, -0.2);
    let forces = CORNERS.map(|r| {
        let r = Vector3::from(r).map(f32::literal);
        Vector3::new(-9.0, s, c) + rate.cross(&rate.cross(&r))
    });
    ([rate; 4], forces)
}

#[test]
fn the_pipeline_is_its_parts() {
    for rate in [Rate::Unknown, Rate::Known] {
        let array = array();
        let cube = Cube::new(&array, rate, tilt()).unwrap();
        let gains = cube.tilt.design().at(0.001).unwrap();
        let extraction = array.extraction(Quantity::Gravity, rate).unwrap().cast::<f32>();
        let (mut state, mut other) = (TiltState::new(), TiltState::new());
        let wheels = Vector3::new(100.0, -200.0, 300.0);
        for n in 0..2000 {
            let (gyros, forces) = readings(n);
            let sample = cube.update(&gains, &mut state, &gyros, &forces, &wheels);
            let (body_rate, _) = mean_rate(&array.rotations(), &gyros);
            let gravity = extraction.step(&forces, &body_rate);
            let flags = tilt().update(&gains, &mut other, &body_rate, &gravity);
            assert_eq!(
                (sample.body_rate, sample.gravity, sample.flags),
                (body_rate, gravity, flags)
            );
            assert_eq!(sample.angles, tilt().angles(&other));
            assert_eq!(sample.wheel_rate, body_rate + wheels);
        }
        assert_eq!(state, other);
    }
}

#[test]
fn a_lost_gyro_is_left_out_and_a_lost_accelerometer_coasts() {
    let cube = Cube::new(&array(), Rate::Unknown, tilt()).unwrap();
    let gains = cube.tilt.design().at(0.001).unwrap();
    let mut state = TiltState::from_angles(&Vector2::new(0.1, 0.2));
    let wheels = Vector3::zeros();
    let (mut gyros, mut forces) = readings(5);
    gyros[2].x = f32::NAN;
    let sample = cube.update(&gains, &mut state, &gyros, &forces, &wheels);
    assert_eq!(sample.flags, Flags::SENSOR_MISSING);
    assert!((sample.body_rate - gyros[0]).norm() < 1e-6);
    forces[1].z = f32::INFINITY;
    let sample = cube.update(&gains, &mut state, &gyros, &forces, &wheels);
    assert_eq!(sample.flags, Flags::SENSOR_MISSING | Flags::MEASUREMENT_MISSING);
    assert!(sample.angles.iter().all(|angle| angle.is_finite()));
}

#[test]
fn the_rate_filter_takes_the_arrays_angular_acceleration() {
    let array = array();
    let extraction = array.extraction(Quantity::AngularAcceleration, Rate::Unknown).unwrap();
    let dt = 0.001;
    let gains = RateFilter::new(0.5).unwrap().at(dt).unwrap();
    let mut state = RateState::new(0.0);
    // ω = t² about z, started from rest: a gyro with an offset, and the exact mean acceleration of each interval.
    for n in 1..=1000 {
        let (before, now) = (f64::from(n - 1) * dt, f64::from(n) * dt);
        let acceleration = Vector3::new(0.0, 0.0, before + now);
        let rate = Vector3::new(0.0, 0.0, now * now);
        let forces = CORNERS.map(|r| {
            let r = Vector3::from(r);
            Vector3::new(0.0, 0.0, 9.81) + acceleration.cross(&r) + rate.cross(&rate.cross(&r))
        });
        let found = extraction.step(&forces, &rate);
        let offset = 0.1;
        gains.update(&mut state, rate.z + offset, found.z);
    }
    // The offset's step passes the high-pass at once and decays with (tau/(tau + dt))^n.
    let left = 0.1 * (0.5_f64 / 0.501).powi(1000);
    assert!((state.rate.levels[0] - 1.0 - left).abs() < 1e-9);
}
