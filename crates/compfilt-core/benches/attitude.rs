//! Latency per sample of the attitude filters.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyForm, MahonyState, SelfCalibratingFilter,
    SelfCalibrationState,
};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Discretise, Dt, PiForm, Real};
use criterion::{
    BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime,
};
use std::hint::black_box;

/// Dependent steps in one measurement.
const STEPS: usize = 1024;

/// A gyro and an accelerometer in motion.
fn motion<T: Real>() -> Vec<(Vector3<T>, Vector3<T>)> {
    let sample = |n: u16| {
        let (s, c) = (f64::from(n) * 0.01).sin_cos();
        let gyro = Vector3::new(s, c, s * c).map(T::literal);
        (gyro, Vector3::new(2.0 * s, 2.0 * c, 9.81).map(T::literal))
    };
    (0..).take(STEPS).map(sample).collect()
}

fn bench<T: Real>(group: &mut BenchmarkGroup<'_, WallTime>) {
    group.throughput(Throughput::Elements(STEPS as u64));
    let motion = black_box(motion::<T>());
    let dt = T::literal(0.0035);
    for (name, form) in
        [("mahony, explicit", MahonyForm::Explicit), ("mahony, passive", MahonyForm::Passive)]
    {
        let design = PiForm::new(T::one(), T::literal(0.1)).expect("a design").chain();
        let filter = Mahony::new(design, form);
        let gains = filter.design().at(dt).expect("gains");
        group.bench_function(name, |bencher| {
            let mut state = MahonyState::new();
            bencher.iter(|| {
                for (gyro, force) in &motion {
                    filter.update(&gains, &mut state, gyro, force, None);
                }
                state.rotation
            });
        });
    }
    let filter = GravityFilter::second_order(T::literal(3.0), T::literal(0.5)).expect("a filter");
    let gains = filter.at(dt).expect("gains");
    group.bench_function("gravity filter", |bencher| {
        let mut state = GravityState::new();
        bencher.iter(|| {
            for (gyro, force) in &motion {
                filter.update(&gains, &mut state, gyro, force, None);
            }
            state.rotation
        });
    });
    let filter = SelfCalibratingFilter::new(T::literal(5.0), T::literal(0.5)).expect("a filter");
    let dt = Dt::new(dt).expect("a time step");
    group.bench_function("gravity filter, self-calibrating", |bencher| {
        let mut state = SelfCalibrationState::new();
        bencher.iter(|| {
            for (gyro, force) in &motion {
                filter.update(dt, &mut state, gyro, force, None);
            }
            state.rotation
        });
    });
}

fn attitude(criterion: &mut Criterion) {
    bench::<f32>(&mut criterion.benchmark_group("attitude f32"));
    bench::<f64>(&mut criterion.benchmark_group("attitude f64"));
}

criterion_group!(benches, attitude);
criterion_main!(benches);
