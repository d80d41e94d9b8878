//! Latency per sample: every filter's step in `f32` and `f64`, the stream around it, gains at a varying time step, a delayed
//! measurement, and the tilt filter. Every run is one chain of dependent steps, as in a control loop.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

mod shared;

use compfilt_core::linear::{History, Past, Stream};
use compfilt_core::nalgebra::SVector;
use compfilt_core::{Chain, Discretise, Element, PiForm, Real, Recurrence, State, ThirdOrder};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main};
use shared::Run;
use shared::linear::{
    Bench, Sample, Steps, every_filter, gains, rate_filter, samples, tilt_filters, update,
};
use std::hint::black_box;

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// The same through a stream.
struct Streams<'a, 'b>(&'a mut Group<'b>);

impl<T: Real> Bench<T> for Streams<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        update(self.0, name, &Stream::new(design), &samples(), &mut ());
    }
}

/// Gains made anew for every sample, then its step.
struct VaryingSteps<'a, 'b>(&'a mut Group<'b>);

impl<T: Real> Bench<T> for VaryingSteps<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let design = black_box(design);
        let start = State::at_rest::<T>(T::zero());
        self.0.run(name, start, &samples(), |state, sample: &Sample<T>| {
            gains(&design, sample.dt).step(state, sample.y, sample.u)
        });
    }
}

fn step(criterion: &mut Criterion) {
    every_filter::<f32>(&mut Steps(&mut criterion.benchmark_group("step f32")));
    every_filter::<f64>(&mut Steps(&mut criterion.benchmark_group("step f64")));
}

fn stream(criterion: &mut Criterion) {
    every_filter::<f32>(&mut Streams(&mut criterion.benchmark_group("stream f32")));
    every_filter::<f64>(&mut Streams(&mut criterion.benchmark_group("stream f64")));
}

fn varying(criterion: &mut Criterion) {
    every_filter::<f32>(&mut VaryingSteps(&mut criterion.benchmark_group("varying dt f32")));
    every_filter::<f64>(&mut VaryingSteps(&mut criterion.benchmark_group("varying dt f64")));
}

fn third_order<T: Real>() -> Chain<T, 3, 2> {
    ThirdOrder::new(T::literal(0.5)).expect("a design").chain()
}

/// A measurement in five, and one that is 35 ms late.
fn gaps_and_delay<T: Real>(group: &mut Group) {
    let stream = Stream::new(third_order());
    let mut gappy = samples::<T>();
    for (n, sample) in gappy.iter_mut().enumerate() {
        sample.y = if n % 5 == 4 { sample.y } else { T::NAN };
    }
    update(group, "a measurement in five", &stream, &gappy, &mut ());
    let ring = [Past { level0: T::zero(), dt: T::zero() }; 8];
    let mut history = History::new(ring, T::literal(0.035)).expect("a delay");
    update(group, "35 ms late", &stream, &samples(), &mut history);
}

fn third_order_stream(criterion: &mut Criterion) {
    gaps_and_delay::<f32>(&mut criterion.benchmark_group("third order f32"));
    gaps_and_delay::<f64>(&mut criterion.benchmark_group("third order f64"));
}

/// A lane of channels by one chain of steps.
fn lane<T: Real, const L: usize>(group: &mut Group) {
    let design = PiForm::new(T::one(), T::one()).expect("a design").chain();
    let gains = black_box(gains(&design, T::literal(0.01)));
    let start = State::at_rest::<T>(SVector::<T, L>::neutral());
    group.run(&format!("pi, {L} channels"), start, &samples(), |state, sample: &Sample<T>| {
        gains.step(state, SVector::repeat(sample.y), SVector::repeat(sample.u))
    });
}

fn lanes(criterion: &mut Criterion) {
    lane::<f32, 8>(&mut criterion.benchmark_group("lanes f32"));
    lane::<f64, 4>(&mut criterion.benchmark_group("lanes f64"));
}

fn tilt(criterion: &mut Criterion) {
    tilt_filters::<f32>(&mut criterion.benchmark_group("tilt f32"));
    tilt_filters::<f64>(&mut criterion.benchmark_group("tilt f64"));
}

fn rate(criterion: &mut Criterion) {
    rate_filter::<f32>(&mut criterion.benchmark_group("update f32"));
    rate_filter::<f64>(&mut criterion.benchmark_group("update f64"));
}

criterion_group!(latency, step, stream, varying, third_order_stream, lanes, tilt, rate);
criterion_main!(latency);
