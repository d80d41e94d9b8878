//! The linear filters and the tilt filter.

use super::{Run, STEPS};
use compfilt_core::gravity::{Axes, TiltFilter, TiltState};
use compfilt_core::linear::{Hindsight, RateState, Stream, StreamState};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{
    Butterworth, Discretise, Dt, FirstOrder, PiForm, RateFilter, Real, Recurrence,
    SecondOrderInertial, State, ThirdOrder,
};
use std::hint::black_box;

const GOOD: &str = "a design";

/// One sample of both signals, and the time step that led to it.
#[derive(Clone, Copy)]
pub(crate) struct Sample<T> {
    pub(crate) dt: T,
    pub(crate) y: T,
    pub(crate) u: T,
}

pub(crate) fn samples<T: Real>() -> Vec<Sample<T>> {
    let sample = |n: u16| {
        let phase = f64::from(n) * 0.01;
        let dt = 0.01 * (1.0 + 0.2 * (7.0 * phase).sin());
        Sample { dt: T::literal(dt), y: T::literal(phase.sin()), u: T::literal(phase.cos()) }
    };
    (0..).take(STEPS).map(sample).collect()
}

/// What is done with every linear filter.
pub(crate) trait Bench<T: Real> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D);
}

/// Every linear filter of the crate under its name.
pub(crate) fn every_filter<T: Real>(bench: &mut impl Bench<T>) {
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

pub(crate) fn gains<T: Real, D: Discretise<T, N>, const N: usize>(design: &D, dt: T) -> D::Gains {
    design.gains(Dt::new(dt).expect("a time step"))
}

/// Bare steps at a constant sample period.
pub(crate) struct Steps<'a, R>(pub(crate) &'a mut R);

impl<T: Real, R: Run> Bench<T> for Steps<'_, R> {
    fn bench<D: Discretise<T, N>, const N: usize>(&mut self, name: &str, design: D) {
        let gains = black_box(gains(&design, T::literal(0.01)));
        let start = State::at_rest::<T>(T::zero());
        self.0.run(name, start, &samples(), |state, sample: &Sample<T>| {
            gains.step(state, sample.y, sample.u)
        });
    }
}

/// The samples through a stream at a constant sample period.
pub(crate) fn update<T: Real, D: Discretise<T, N>, H: Hindsight<T>, const N: usize>(
    runner: &mut impl Run,
    name: &str,
    stream: &Stream<T, D>,
    samples: &[Sample<T>],
    history: &mut H,
) {
    let gains = black_box(gains(stream.design(), T::literal(0.01)));
    let start = StreamState::from_levels([T::zero(); N]);
    runner.run(name, start, samples, |state, sample| {
        let flags = stream.update(&gains, state, sample.y, sample.u, history);
        (state.level0(), flags)
    });
}

/// The rate filter from its own two signals.
pub(crate) fn rate_filter<T: Real>(runner: &mut impl Run) {
    let gains = RateFilter::new(T::literal(0.5)).expect(GOOD).at(T::literal(0.01));
    let gains = black_box(gains).expect("gains");
    let start = RateState::new(T::zero());
    runner.run("rate filter, both signals", start, &samples(), |state, sample: &Sample<T>| {
        gains.update(state, sample.y, sample.u)
    });
}

/// The tilt filter with two designs.
pub(crate) fn tilt_filters<T: Real>(runner: &mut impl Run) {
    let half = T::literal(0.5);
    tilt(runner, "tilt, first order", FirstOrder::new(half).expect(GOOD).chain());
    tilt(runner, "tilt, pi", PiForm::new(T::literal(2.0), half).expect(GOOD).chain());
}

fn tilt<T: Real, D: Discretise<T, N>, const N: usize>(
    runner: &mut impl Run,
    name: &str,
    design: D,
) {
    let filter = TiltFilter::new(design, Axes::Flu);
    let gains = black_box(gains(&design, T::literal(0.01)));
    let motion = |sample: &Sample<T>| {
        let gyro = Vector3::new(sample.y, sample.u, sample.y * sample.u);
        (gyro, Vector3::new(sample.y, sample.u, T::literal(9.81)))
    };
    let motion: Vec<_> = samples().iter().map(motion).collect();
    runner.run(name, TiltState::new(), &motion, |state, (gyro, force)| {
        let flags = filter.update(&gains, state, gyro, force);
        (filter.angles(state), flags)
    });
}
