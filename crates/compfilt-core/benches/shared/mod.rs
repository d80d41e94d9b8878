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
    /// Takes the state over the samples in their order by `step`, whose output counts as used.
    fn run<X: Copy, S, O>(
        &mut self,
        name: &str,
        state: X,
        samples: &[S],
        step: impl FnMut(&mut X, &S) -> O,
    );
}

impl Run for BenchmarkGroup<'_, WallTime> {
    fn run<X: Copy, S, O>(
        &mut self,
        name: &str,
        mut state: X,
        samples: &[S],
        mut step: impl FnMut(&mut X, &S) -> O,
    ) {
        self.throughput(Throughput::Elements(samples.len() as u64));
        self.bench_function(name, |bencher| {
            bencher.iter(|| state = over(state, samples, &mut step));
        });
    }
}

/// The step over all samples. The state is the loop's own, as in a program, so that it may stay in registers.
pub(crate) fn over<X: Copy, S, O>(
    mut state: X,
    samples: &[S],
    step: &mut impl FnMut(&mut X, &S) -> O,
) -> X {
    for sample in samples {
        black_box(step(&mut state, sample));
    }
    state
}
