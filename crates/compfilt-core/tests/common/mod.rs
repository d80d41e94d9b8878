//! What the test files share: signals, consistent motions, and every linear filter.
#![allow(dead_code)] // Every test file uses its own part.

use compfilt_core::linear::{FrequencyResponse, Stream, StreamState};
use compfilt_core::nalgebra::{Complex, SMatrix};
use compfilt_core::{
    Butterworth, Chain, Discretise, Dt, FirstOrder, PiForm, RateFilter, Real, Recurrence,
    SecondOrderInertial, ThirdOrder,
};

/// Uniform noise in [-1, 1) from a linear congruential generator. All values are exact in `f32`.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(2 * seed + 1)
    }

    pub(crate) fn value<T: Real>(&mut self) -> T {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let bits = u32::try_from(self.0 >> 40).expect("24 bits");
        T::literal(f64::from(bits) / f64::from(1 << 23) - 1.0)
    }

    pub(crate) fn values<T: Real>(&mut self, count: usize) -> Vec<T> {
        (0..count).map(|_| self.value()).collect()
    }
}

/// The bits of a number, widened: `assert_eq!` on them is equality bit for bit.
pub(crate) fn bits<T: Real>(value: T) -> u64 {
    value.to_f64().to_bits()
}

/// The same for the levels of a filter.
pub(crate) fn all_bits<T: Real>(values: &[T]) -> Vec<u64> {
    values.iter().map(|value| bits(*value)).collect()
}

/// The gains at a time step in seconds, without `at`'s check that none of them vanishes.
pub(crate) fn gains<T: Real, D: Discretise<T, N>, const N: usize>(design: &D, dt: T) -> D::Gains {
    design.gains(Dt::new(dt).expect("a time step"))
}

/// One sample of both signals and the time step that led to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<T> {
    pub(crate) dt: T,
    pub(crate) y: T,
    pub(crate) u: T,
}

/// Runs a stream over samples; level 0 after each of them.
pub(crate) fn run<T: Real, D: Discretise<T, N>, const N: usize>(
    stream: &Stream<T, D>,
    state: &mut StreamState<T, N>,
    samples: &[Sample<T>],
) -> Vec<T> {
    let output = |sample: &Sample<T>| {
        stream.update(&gains(stream.design(), sample.dt), state, sample.y, sample.u, &mut ());
        state.level0()
    };
    samples.iter().map(output).collect()
}

/// Noise for both signals at time steps between 0.2 and 1.8 times `dt`.
pub(crate) fn noisy_samples<T: Real>(seed: u64, count: usize, dt: f64) -> Vec<Sample<T>> {
    let mut noise = Noise::new(seed);
    let sample = |_| Sample {
        dt: T::literal(dt * (1.0 + 0.8 * noise.value::<f64>())),
        y: noise.value(),
        u: noise.value(),
    };
    (0..count).map(sample).collect()
}

/// The same with a single missing measurement, with runs of them, and with a missing derivative.
pub(crate) fn gappy_samples<T: Real>(seed: u64, count: usize, dt: f64) -> Vec<Sample<T>> {
    let mut samples = noisy_samples(seed, count, dt);
    for (n, sample) in samples.iter_mut().enumerate() {
        if n % 11 == 5 || (20..27).contains(&n) || n % 40 > 33 {
            sample.y = T::NAN;
        }
        if n % 17 == 3 {
            sample.u = T::NAN;
        }
    }
    samples
}

/// How a filter moves its levels with an input that is constant within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Every level by the new value of the level above.
    BackwardEuler,
    /// Every level by the Taylor series of those above.
    Exact,
    /// The input is the change itself.
    Change,
}

/// A motion that a filter reproduces whatever its gains: level `i` is the `i`-th derivative.
pub(crate) struct Path<T> {
    motion: Motion,
    /// The levels below the input.
    pub(crate) levels: Vec<T>,
    /// The same path with the sizes of all summands: what rounding errors are measured against.
    pub(crate) sizes: Vec<T>,
}

impl<T: Real> Path<T> {
    pub(crate) fn new(motion: Motion, levels: Vec<T>) -> Self {
        let sizes = levels.iter().map(|level: &T| level.abs()).collect();
        Self { motion, levels, sizes }
    }

    /// Moves on with the input `u`; returns level 0.
    pub(crate) fn advance(&mut self, dt: T, u: T) -> T {
        move_path(self.motion, &mut self.levels, dt, u);
        move_path(self.motion, &mut self.sizes, dt, u.abs());
        self.levels[0]
    }
}

fn move_path<T: Real>(motion: Motion, levels: &mut [T], dt: T, u: T) {
    match motion {
        Motion::Change => levels[0] += u,
        Motion::BackwardEuler => {
            let mut above = u;
            for level in levels.iter_mut().rev() {
                *level += dt * above;
                above = *level;
            }
        }
        Motion::Exact => {
            for i in 0..levels.len() {
                let mut weight = T::one();
                let mut distance = T::zero();
                for j in i + 1..=levels.len() {
                    distance += T::one();
                    weight *= dt / distance;
                    let source = levels.get(j).copied().unwrap_or(u);
                    levels[i] += weight * source;
                }
            }
        }
    }
}

/// What a test needs to know of a filter besides its design.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    /// Which derivative of level 0 the input is.
    pub(crate) derivative_order: usize,
    pub(crate) motion: Motion,
}

/// A check that is made of every filter.
pub(crate) trait Check<T: Real> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D);
}

/// Makes `check` of every linear filter with poles around `rate` in rad/s; `shape` from 0 to 1 moves what else can be chosen.
pub(crate) fn every_filter<T: Real>(rate: T, shape: T, check: &mut impl Check<T>) {
    backward_euler_filters(rate, shape, check);
    matched_filters(rate, shape, check);
}

/// The filters that are stable at any sequence of time steps.
pub(crate) fn backward_euler_filters<T: Real>(rate: T, shape: T, check: &mut impl Check<T>) {
    let mut chain = Visit { motion: Motion::BackwardEuler, derivative_order: 1, check };
    chain.visit("first order", first_order(rate));
    chain.visit("pi", pi(rate, shape));
    chain.visit("butterworth q", with_q(rate, shape));
    chain.visit("butterworth 1", butterworth::<T, 1>(rate).chain());
    chain.visit("butterworth 2", butterworth::<T, 2>(rate).chain());
    chain.visit("butterworth 3", butterworth::<T, 3>(rate).chain());
    chain.visit("butterworth 4", butterworth::<T, 4>(rate).chain());
    chain.visit("butterworth 5", butterworth::<T, 5>(rate).chain());
    chain.visit("butterworth 6", butterworth::<T, 6>(rate).chain());
    chain.visit("split 1 of 1", split::<T, 1>(rate, 1));
    chain.visit("split 1 of 2", split::<T, 2>(rate, 1));
    chain.visit("split 2 of 2", split::<T, 2>(rate, 2));
    chain.visit("split 1 of 3", split::<T, 3>(rate, 1));
    chain.visit("split 2 of 3", split::<T, 3>(rate, 2));
    chain.visit("split 3 of 3", split::<T, 3>(rate, 3));
    chain.visit("split 1 of 4", split::<T, 4>(rate, 1));
    chain.visit("split 2 of 4", split::<T, 4>(rate, 2));
    chain.visit("split 3 of 4", split::<T, 4>(rate, 3));
    chain.derivative_order = 2;
    chain.visit("third order", third_order(rate));
    chain.visit("third order butterworth", third_order_butterworth(rate));
    chain.visit("third order raw", third_order_raw(rate, shape));
    chain.visit("second order inertial", second_order_inertial(rate));
    chain.visit("second order inertial butterworth", second_order_inertial_butterworth(rate));
    chain.derivative_order = 3;
    chain.visit("chain 4, 3", fourth_order_chain(rate));
    chain.derivative_order = 1;
    chain.motion = Motion::Change;
    chain.visit("rate filter", RateFilter::new(T::one() / rate).expect("a time constant"));
}

/// The filters with matched poles.
pub(crate) fn matched_filters<T: Real>(rate: T, shape: T, check: &mut impl Check<T>) {
    let mut matched = Visit { motion: Motion::Exact, derivative_order: 1, check };
    matched.visit("matched first order", first_order(rate).matched());
    matched.visit("matched pi", pi(rate, shape).matched());
    matched.visit("matched butterworth 2", butterworth::<T, 2>(rate).matched());
    matched.visit("matched butterworth 3", butterworth::<T, 3>(rate).matched());
    matched.visit("matched butterworth 4", butterworth::<T, 4>(rate).matched());
    matched.derivative_order = 2;
    matched.visit("matched third order", third_order(rate).matched());
    matched.visit("matched second order inertial", second_order_inertial(rate).matched());
    matched.derivative_order = 3;
    matched.visit("matched chain 4, 3", fourth_order_chain(rate).matched());
}

struct Visit<'a, C> {
    motion: Motion,
    derivative_order: usize,
    check: &'a mut C,
}

impl<C> Visit<'_, C> {
    fn visit<T: Real, D: Discretise<T, N>, const N: usize>(&mut self, name: &'static str, design: D)
    where
        C: Check<T>,
    {
        let Self { motion, derivative_order, .. } = *self;
        self.check.check(Kind { name, derivative_order, motion }, design);
    }
}

pub(crate) fn first_order<T: Real>(rate: T) -> Chain<T, 1, 1> {
    FirstOrder::new(T::one() / rate).expect("a time constant").chain()
}

/// Damping between 0.1 and 10.
pub(crate) fn pi<T: Real>(rate: T, shape: T) -> Chain<T, 2, 1> {
    let damping = T::literal(0.1) * T::literal(100.0).powf(shape);
    PiForm::new(damping * rate * T::literal(2.0), rate * rate).expect("gains").chain()
}

/// Q between 0.01 and 10.
pub(crate) fn with_q<T: Real>(rate: T, shape: T) -> Chain<T, 2, 1> {
    let q = T::literal(0.01) * T::literal(1000.0).powf(shape);
    Butterworth::with_q(rate, q).expect("a frequency").chain()
}

pub(crate) fn butterworth<T: Real, const N: usize>(rate: T) -> Butterworth<T, N> {
    Butterworth::new(rate).expect("a frequency")
}

pub(crate) fn split<T: Real, const N: usize>(rate: T, split: usize) -> compfilt_core::Split<T, N> {
    butterworth::<T, N>(rate).split(split).expect("a degree")
}

pub(crate) fn third_order<T: Real>(rate: T) -> Chain<T, 3, 2> {
    ThirdOrder::new(T::one() / rate).expect("a time constant").chain()
}

pub(crate) fn third_order_butterworth<T: Real>(rate: T) -> Chain<T, 3, 2> {
    ThirdOrder::butterworth(rate).expect("a frequency").chain()
}

/// From well damped to close to the border of stability, `k1 k2 = k3`.
pub(crate) fn third_order_raw<T: Real>(rate: T, shape: T) -> Chain<T, 3, 2> {
    let (k1, k2) = (rate, rate * rate * T::literal(0.5));
    let fraction = T::literal(0.05) + T::literal(0.9) * shape;
    ThirdOrder::from_gains(k1, k2, k1 * k2 * fraction).expect("gains").chain()
}

pub(crate) fn second_order_inertial<T: Real>(rate: T) -> Chain<T, 2, 2> {
    SecondOrderInertial::new(T::one() / rate).expect("a time constant").chain()
}

pub(crate) fn second_order_inertial_butterworth<T: Real>(rate: T) -> Chain<T, 2, 2> {
    SecondOrderInertial::butterworth(rate).expect("a frequency").chain()
}

/// `(s + r)² (s + 2 r)²`, driven by the third derivative.
pub(crate) fn fourth_order_chain<T: Real>(rate: T) -> Chain<T, 4, 3> {
    let mut power = T::one();
    let scaled = [6.0, 13.0, 12.0, 4.0].map(|k| {
        power *= rate;
        T::literal(k) * power
    });
    Chain::new(scaled).expect("stable")
}

/// The poles of [`fourth_order_chain`]; found numerically, double roots are good to half the digits only.
pub(crate) fn fourth_order_poles(rate: f64) -> [Complex<f64>; 4] {
    [1.0, 1.0, 2.0, 2.0].map(|factor| Complex::new(-factor * rate, 0.0))
}

/// Whether a filter keeps its rounding errors small when long steps follow short ones: a long step of `longest` seconds
/// moves level 0 by `(rate longest)^(N-1)` times the error of the highest level, and the next correction has to take that
/// back.
pub(crate) fn forgives<T: Real, const N: usize>(rate: f64, longest: f64) -> bool {
    let below = i32::try_from(N).expect("a small number") - 1;
    T::default_epsilon().to_f64() * (rate * longest).powi(below) < 0.01
}

/// `Π (x - root)` without the leading 1, highest power first.
pub(crate) fn polynomial<const N: usize>(roots: [Complex<f64>; N]) -> [f64; N] {
    let mut all = vec![Complex::new(1.0, 0.0)];
    for root in roots {
        let mut next = all.clone();
        next.push(Complex::new(0.0, 0.0));
        for (i, c) in all.iter().enumerate() {
            next[i + 1] -= c * root;
        }
        all = next;
    }
    core::array::from_fn(|i| all[i + 1].re)
}

/// The characteristic polynomial of a matrix without the leading 1, highest power first, by traces of powers.
pub(crate) fn characteristic<const N: usize>(a: &SMatrix<f64, N, N>) -> [f64; N] {
    let mut m = SMatrix::<f64, N, N>::identity();
    let mut count = 0.0;
    core::array::from_fn(|_| {
        count += 1.0;
        let product = a * m;
        let c = -product.trace() / count;
        m = product + SMatrix::identity() * c;
        c
    })
}

/// The exponential of a complex number.
pub(crate) fn exp(z: Complex<f64>) -> Complex<f64> {
    Complex::new(z.re.exp() * z.im.cos(), z.re.exp() * z.im.sin())
}

/// The size of a complex number.
pub(crate) fn size(z: Complex<f64>) -> f64 {
    z.re.hypot(z.im)
}

/// How far low + high is from 1.
pub(crate) fn excess(response: &FrequencyResponse<f64>) -> f64 {
    size(response.low + response.high - Complex::new(1.0, 0.0))
}

/// Level 0 after `count` equal steps with constant signals.
pub(crate) fn settle<T: Real, G: Recurrence<T, N>, const N: usize>(
    gains: &G,
    state: &mut compfilt_core::State<T, N>,
    (y, u): (T, T),
    count: usize,
) -> T {
    for _ in 0..count {
        gains.step(state, y, u);
    }
    state.levels[0]
}

/// Asserts that two numbers differ by at most `tolerance`.
#[track_caller]
pub(crate) fn close(found: f64, wanted: f64, tolerance: f64) {
    assert!(
        (found - wanted).abs() <= tolerance,
        "{found:e} instead of {wanted:e}: off by {:e}, allowed {tolerance:e}",
        (found - wanted).abs()
    );
}
