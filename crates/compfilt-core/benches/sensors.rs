//! Latency per sample of what has several sensors or outputs: the accelerometer array, the cube's pipeline, the observer.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

use compfilt_core::gravity::{
    Accelerometer, AccelerometerArray, Axes, Cube, Quantity, Rate, TiltFilter, TiltState,
};
use compfilt_core::nalgebra::{
    Matrix2x3, Matrix3, Matrix3x1, Matrix3x2, Vector1, Vector2, Vector3,
};
use compfilt_core::{Discretise, FirstOrder, Observer, ObserverState, Real};
use criterion::{
    BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime,
};
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

fn readings<T: Real>() -> [Vector3<T>; 6] {
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|n: f64| Vector3::new(n, -n, 9.81).map(T::literal))
}

fn bench_array<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>) {
    let forces = black_box(readings::<T>());
    let rate = black_box(Vector3::new(1.0, 2.0, 3.0).map(T::literal));
    for (name, rate_known) in [("gravity", Rate::Unknown), ("gravity, rate known", Rate::Known)] {
        let extraction = array().extraction(Quantity::Gravity, rate_known).expect("gravity").cast();
        group.bench_function(name, |bencher| {
            bencher.iter(|| extraction.step(black_box(&forces), &rate));
        });
    }
    let design = FirstOrder::new(T::literal(0.5)).expect("a design").chain();
    let cube =
        Cube::new(&array(), Rate::Unknown, TiltFilter::new(design, Axes::Cube)).expect("a cube");
    let gains = cube.tilt.design().at(T::literal(0.001)).expect("gains");
    group.bench_function("cube", |bencher| {
        let mut state = TiltState::new();
        bencher.iter(|| cube.update(&gains, &mut state, black_box(&forces), &forces, &rate).angles);
    });
}

fn bench_observer<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>) {
    let a = Matrix3::new(1.0, 0.01, 0.0, 0.4, 0.98, 0.02, -0.4, 0.01, 0.97).map(T::literal);
    let b = Matrix3x1::new(0.001, -0.2, 0.9).map(T::literal);
    let c = Matrix2x3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0).map(T::literal);
    let correction = Matrix3x2::new(0.01, -0.02, 0.4, 0.1, 0.05, 0.3).map(T::literal);
    let observer =
        black_box(Observer::new(a, b, c, a * correction, correction).expect("an observer"));
    group.bench_function("observer, 3 states", |bencher| {
        let mut state = ObserverState::new(Vector3::zeros());
        let (y, u) = (Vector2::repeat(T::one()), Vector1::repeat(T::one()));
        bencher.iter(|| {
            let (filtered, _) = observer.correct(&mut state, black_box(&y));
            observer.predict(&mut state, black_box(&u));
            filtered
        });
    });
}

fn sensors(criterion: &mut Criterion) {
    let mut single = criterion.benchmark_group("sensors f32");
    bench_array::<f32>(&mut single);
    bench_observer::<f32>(&mut single);
    single.finish();
    let mut double = criterion.benchmark_group("sensors f64");
    bench_array::<f64>(&mut double);
    bench_observer::<f64>(&mut double);
    double.finish();
}

criterion_group!(benches, sensors);
criterion_main!(benches);
