//! What has several sensors or outputs: the accelerometer array, the cube's pipeline, the observer.

use super::{Run, STEPS};
use compfilt_core::gravity::{
    Accelerometer, AccelerometerArray, Axes, Cube, Quantity, Rate, TiltFilter, TiltState,
};
use compfilt_core::nalgebra::{
    Matrix2x3, Matrix3, Matrix3x1, Matrix3x2, Vector1, Vector2, Vector3,
};
use compfilt_core::{Discretise, FirstOrder, Observer, ObserverState, Real};
use std::hint::black_box;

/// Six two-axis sensors on the faces of a cube, each with its own rotation.
fn array() -> AccelerometerArray<[Accelerometer; 6]> {
    let first = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let third = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let fifth = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let sensors = [
        ([0.05, 0.02, 0.0], first),
        ([0.10, 0.05, 0.15], first),
        ([0.0, 0.05, 0.02], third),
        ([0.15, 0.09, 0.08], third),
        ([0.02, 0.0, 0.08], fifth),
        ([0.05, 0.15, 0.12], fifth),
    ];
    AccelerometerArray::new(sensors.map(|(position, rotation)| Accelerometer {
        rotation,
        channels: [true, true, false],
        ..Accelerometer::at(Vector3::from(position))
    }))
    .expect("a geometry that gives gravity")
}

/// The same readings over and over.
fn readings<T: Real>() -> Vec<[Vector3<T>; 6]> {
    let once = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|n: f64| Vector3::new(n, -n, 9.81));
    vec![once.map(|reading| reading.map(T::literal)); STEPS]
}

/// Gravity and the cube's pipeline.
pub(crate) fn arrays<T: Real>(runner: &mut impl Run) {
    let readings = readings::<T>();
    let rate = black_box(Vector3::new(1.0, 2.0, 3.0).map(T::literal));
    for (name, rate_known) in [("gravity", Rate::Unknown), ("gravity, rate known", Rate::Known)] {
        let extraction = array().extraction(Quantity::Gravity, rate_known).expect("gravity").cast();
        runner.run(name, (), &readings, |(), forces| extraction.step(forces, &rate));
    }
    let design = FirstOrder::new(T::literal(0.5)).expect("a design").chain();
    let cube =
        Cube::new(&array(), Rate::Unknown, TiltFilter::new(design, Axes::Cube)).expect("a cube");
    let gains = cube.tilt.design().at(T::literal(0.001)).expect("gains");
    runner.run("cube", TiltState::new(), &readings, |state, forces| {
        cube.update(&gains, state, forces, forces, &rate)
    });
}

/// An observer of three states.
pub(crate) fn observer<T: Real>(runner: &mut impl Run) {
    let a = Matrix3::new(1.0, 0.01, 0.0, 0.4, 0.98, 0.02, -0.4, 0.01, 0.97).map(T::literal);
    let b = Matrix3x1::new(0.001, -0.2, 0.9).map(T::literal);
    let c = Matrix2x3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0).map(T::literal);
    let correction = Matrix3x2::new(0.01, -0.02, 0.4, 0.1, 0.05, 0.3).map(T::literal);
    let observer =
        black_box(Observer::new(a, b, c, a * correction, correction).expect("an observer"));
    let start = ObserverState::new(Vector3::zeros());
    let inputs = vec![(Vector2::repeat(T::one()), Vector1::repeat(T::one())); STEPS];
    runner.run("observer, 3 states", start, &inputs, |state, (y, u)| {
        let filtered = observer.correct(state, y);
        (filtered, observer.predict(state, u))
    });
}
