//! Latency per sample: every filter's step in `f32` and `f64`, the stream around it, gains at a varying time step, a delayed
//! measurement, and the tilt filter. Every run is one chain of dependent steps, as in a control loop.
#![allow(missing_docs)] // The macros of Criterion make undocumented functions.

use compfilt_core::gravity::{Axes, TiltFilter, TiltState};
use compfilt_core::linear::{Hindsight, History, Past, RateState, Stream, StreamState};
use compfilt_core::nalgebra::{SVector, Vector3};
use compfilt_core::{
    Butterworth, Chain, Discretise, Dt, Element, FirstOrder, PiForm, RateFilter, Real, Recurrence,
    SecondOrderInertial, State, ThirdOrder,
};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

/// Dependent steps in one measurement.
const STEPS: usize = 1024;

type Group<'a> = BenchmarkGroup<'a, WallTime>;

/// One sample of both signals, and the time step that led to it.
#[derive(Clone, Copy)]
struct Sample<T> {
    dt: T,
    y: T,
    u: T,
}

fn samples<T: Real>() -> Vec<Sample<T>> {
    let sample = |n: u16| {
        let phase = f64::from(n) * 0.01;
        let dt = 0.01 * (1.0 + 0.2 * (7.0 * phase).sin());
        Sample { dt: T::literal(dt), y: T::literal(phase.sin()), u: T::literal(phase.cos()) }
    };
    (0..).take(STEPS).map(sample).collect()
}

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> Group<'a> {
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Elements(STEPS as u64));
    group
}

/// Every linear filter of the crate under its name.
trait Bench<T: Real> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D);
}

fn every_filter<T: Real>(bench: &mut impl Bench<T>) {
    const GOOD: &str = "a design";
    let two = T::literal(2.0);
    let half = T::literal(0.5);
    bench.bench("first order", FirstOrder::new(half).expect(GOOD).chain());
    bench.bench("pi", PiForm::new(two, half).expect(GOOD).chain());
    bench.bench("butterworth q", Butterworth::with_q(two, half).expect(GOOD).chain());
    bench.bench("butterworth 2", Butterworth::<T, 2>::new(two).expect(GOOD).chain());
    bench.bench("butterworth 3", Butterworth::<T, 3>::new(two).expect(GOOD).chain());
    bench.bench("butterworth 4", Butterworth::<T, 4>::new(two).expect(GOOD).chain());
    bench.bench("butterworth 5", Butterworth::<T, 5>::new(two).expect(GOOD).chain());
    bench.bench("butterworth 6", Butterworth::<T, 6>::new(two).expect(GOOD).chain());
    let split = |degree| Butterworth::<T, 4>::new(two).expect(GOOD).split(degree).expect(GOOD);
    bench.bench("split 1 of 2", Butterworth::<T, 2>::new(two).expect(GOOD).split(1).expect(GOOD));
    bench.bench("split 1 of 4", split(1));
    bench.bench("split 3 of 4", split(3));
    bench.bench("third order", ThirdOrder::new(half).expect(GOOD).chain());
    bench.bench("second order inertial", SecondOrderInertial::new(half).expect(GOOD).chain());
    bench.bench("rate filter", RateFilter::new(half).expect(GOOD));
    bench.bench("matched pi", PiForm::new(two, half).expect(GOOD).matched());
    bench.bench("matched third order", ThirdOrder::new(half).expect(GOOD).matched());
}

fn gains<T: Real, D: Discretise<T, N>, const N: usize>(design: &D, dt: T) -> D::Gains {
    design.gains(Dt::new(dt).expect("a time step"))
}

/// Bare steps at a constant sample period.
struct Steps<'a, 'b>(&'a mut Group<'b>);

impl<T: Real> Bench<T> for Steps<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let samples = samples::<T>();
        let gains = black_box(gains(&design, T::literal(0.01)));
        self.0.bench_function(name, |bencher| {
            let mut state = State::at_rest::<T>(T::zero());
            bencher.iter(|| {
                for sample in &samples {
                    gains.step(&mut state, sample.y, sample.u);
                }
                state.levels[0]
            });
        });
    }
}

/// The same through a stream.
struct Streams<'a, 'b>(&'a mut Group<'b>);

impl<T: Real> Bench<T> for Streams<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let stream = Stream::new(design);
        update(self.0, name, &stream, &samples(), &mut ());
    }
}

fn update<T: Real, D: Discretise<T, N>, H: Hindsight<T>, const N: usize>(
    group: &mut Group,
    name: &str,
    stream: &Stream<T, D>,
    samples: &[Sample<T>],
    history: &mut H,
) {
    let gains = black_box(gains(stream.design(), T::literal(0.01)));
    group.bench_function(name, |bencher| {
        let mut state = StreamState::from_levels([T::zero(); N]);
        bencher.iter(|| {
            for sample in samples {
                stream.update(&gains, &mut state, sample.y, sample.u, history);
            }
            state.level0()
        });
    });
}

/// Gains made anew for every sample, then its step.
struct VaryingSteps<'a, 'b>(&'a mut Group<'b>);

impl<T: Real> Bench<T> for VaryingSteps<'_, '_> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let samples = samples::<T>();
        let design = black_box(design);
        self.0.bench_function(name, |bencher| {
            let mut state = State::at_rest::<T>(T::zero());
            bencher.iter(|| {
                for sample in &samples {
                    gains(&design, sample.dt).step(&mut state, sample.y, sample.u);
                }
                state.levels[0]
            });
        });
    }
}

fn step(criterion: &mut Criterion) {
    every_filter::<f32>(&mut Steps(&mut group(criterion, "step f32")));
    every_filter::<f64>(&mut Steps(&mut group(criterion, "step f64")));
}

fn stream(criterion: &mut Criterion) {
    every_filter::<f32>(&mut Streams(&mut group(criterion, "stream f32")));
    every_filter::<f64>(&mut Streams(&mut group(criterion, "stream f64")));
}

fn varying(criterion: &mut Criterion) {
    every_filter::<f32>(&mut VaryingSteps(&mut group(criterion, "varying dt f32")));
    every_filter::<f64>(&mut VaryingSteps(&mut group(criterion, "varying dt f64")));
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
    gaps_and_delay::<f32>(&mut group(criterion, "third order f32"));
    gaps_and_delay::<f64>(&mut group(criterion, "third order f64"));
}

/// A lane of channels by one chain of steps.
fn lane<T: Real, const L: usize>(group: &mut Group) {
    let gains = black_box(gains(
        &PiForm::new(T::one(), T::one()).expect("a design").chain(),
        T::literal(0.01),
    ));
    let samples = samples::<T>();
    group.bench_function(format!("pi, {L} channels"), |bencher| {
        let mut state = State::at_rest::<T>(SVector::<T, L>::neutral());
        bencher.iter(|| {
            for sample in &samples {
                gains.step(&mut state, SVector::repeat(sample.y), SVector::repeat(sample.u));
            }
            state.levels[0]
        });
    });
}

fn lanes(criterion: &mut Criterion) {
    lane::<f32, 8>(&mut group(criterion, "lanes f32"));
    lane::<f64, 4>(&mut group(criterion, "lanes f64"));
}

fn tilt_of<T: Real, D: Discretise<T, N>, const N: usize>(group: &mut Group, name: &str, design: D) {
    let filter = TiltFilter::new(design, Axes::Flu);
    let gains = black_box(gains(&design, T::literal(0.01)));
    let motion = |sample: &Sample<T>| {
        let gyro = Vector3::new(sample.y, sample.u, sample.y * sample.u);
        (gyro, Vector3::new(sample.y, sample.u, T::literal(9.81)))
    };
    let motion: Vec<_> = samples().iter().map(motion).collect();
    group.bench_function(name, |bencher| {
        let mut state = TiltState::new();
        bencher.iter(|| {
            for (gyro, force) in &motion {
                filter.update(&gains, &mut state, gyro, force);
            }
            filter.angles(&state)
        });
    });
}

fn tilt_in<T: Real>(group: &mut Group) {
    let half = T::literal(0.5);
    tilt_of(group, "first order", FirstOrder::new(half).expect("a design").chain());
    tilt_of(group, "pi", PiForm::new(T::literal(2.0), half).expect("a design").chain());
}

fn tilt(criterion: &mut Criterion) {
    tilt_in::<f32>(&mut group(criterion, "tilt f32"));
    tilt_in::<f64>(&mut group(criterion, "tilt f64"));
}

/// The rate filter from its own two signals.
fn rate_of<T: Real>(group: &mut Group) {
    let gains = black_box(RateFilter::new(T::literal(0.5)).expect("a design")).at(T::literal(0.01));
    let gains = gains.expect("gains");
    let samples = samples::<T>();
    group.bench_function("rate filter", |bencher| {
        let mut state = RateState::new(T::zero());
        bencher.iter(|| {
            for sample in &samples {
                gains.update(&mut state, sample.y, sample.u);
            }
            state.rate.levels[0]
        });
    });
}

fn rate(criterion: &mut Criterion) {
    rate_of::<f32>(&mut group(criterion, "update f32"));
    rate_of::<f64>(&mut group(criterion, "update f64"));
}

criterion_group!(latency, step, stream, varying, third_order_stream, lanes, tilt, rate);
criterion_main!(latency);
