//! Latency per sample of the attitude filters.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

mod shared;

use criterion::{Criterion, criterion_group, criterion_main};
use shared::attitude::every_filter;

fn attitude(criterion: &mut Criterion) {
    every_filter::<f32>(&mut criterion.benchmark_group("attitude f32"));
    every_filter::<f64>(&mut criterion.benchmark_group("attitude f64"));
}

criterion_group!(benches, attitude);
criterion_main!(benches);
