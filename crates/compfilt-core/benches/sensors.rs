//! Latency per sample of what has several sensors or outputs: the accelerometer array, the cube's pipeline, the observer.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

mod shared;

use compfilt_core::Real;
use criterion::{Criterion, criterion_group, criterion_main};
use shared::sensors::{arrays, observer};

fn sensors_in<T: Real>(criterion: &mut Criterion, name: &str) {
    let mut group = criterion.benchmark_group(name);
    arrays::<T>(&mut group);
    observer::<T>(&mut group);
}

fn sensors(criterion: &mut Criterion) {
    sensors_in::<f32>(criterion, "sensors f32");
    sensors_in::<f64>(criterion, "sensors f64");
}

criterion_group!(benches, sensors);
criterion_main!(benches);
