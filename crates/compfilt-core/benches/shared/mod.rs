//! What the benches share: their inputs, and every filter under its name as a step over them.
#![allow(dead_code)] // Every bench uses its own part.

pub(crate) mod attitude;
pub(crate) mod linear;
pub(crate) mod sensors;

use criterion::{BenchmarkGroup, Throughput, measurement::WallTime};
use std::hint::black_box;

/// Dependent steps in one measurement.
pub(crate) const STEPS: usize = 1024;

/// What does something with a filter: measures its time, or counts its instructions.
pub(crate) trait Run {
    /// Takes `step` over the samples in their order; its output counts as used.
    fn run<S, O>(&mut self, name: &str, samples: &[S], step: impl FnMut(&S) -> O);
}

impl Run for BenchmarkGroup<'_, WallTime> {
    fn run<S, O>(&mut self, name: &str, samples: &[S], mut step: impl FnMut(&S) -> O) {
        self.throughput(Throughput::Elements(samples.len() as u64));
        self.bench_function(name, |bencher| bencher.iter(|| over(samples, &mut step)));
    }
}

/// The step over all samples.
pub(crate) fn over<S, O>(samples: &[S], step: &mut impl FnMut(&S) -> O) {
    for sample in samples {
        black_box(step(sample));
    }
}
