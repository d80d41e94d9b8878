//! Throughput of the linear filters: from two slices into a third.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

mod shared;

use compfilt_core::{Discretise, Real, Recurrence, State};
use criterion::{
    BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main, measurement::WallTime,
};
use shared::linear::{Bench, every_filter, gains, samples};
use std::hint::black_box;

/// Samples of a slice.
const LENGTH: usize = 4096;

/// A block of samples at a time.
struct Slices<'a, 'b>(&'a mut BenchmarkGroup<'b, WallTime>);

impl<T: Real> Bench<T> for Slices<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let gains = black_box(gains(&design, T::literal(0.01)));
        let log = samples::<T>().into_iter().cycle().take(LENGTH);
        let (y, u): (Vec<T>, Vec<T>) = log.map(|sample| (sample.y, sample.u)).unzip();
        let mut out = vec![T::zero(); LENGTH];
        let mut state = State::at_rest::<T>(T::zero());
        self.0.throughput(Throughput::Elements(LENGTH as u64));
        self.0.bench_function(name, |bencher| {
            bencher.iter(|| {
                let mut own = state;
                for ((out, y), u) in out.iter_mut().zip(&y).zip(&u) {
                    *out = gains.step(&mut own, *y, *u);
                }
                state = own;
                black_box(&mut out);
            });
        });
    }
}

fn throughput(criterion: &mut Criterion) {
    every_filter::<f32>(&mut Slices(&mut criterion.benchmark_group("throughput f32")));
    every_filter::<f64>(&mut Slices(&mut criterion.benchmark_group("throughput f64")));
}

criterion_group!(benches, throughput);
criterion_main!(benches);
