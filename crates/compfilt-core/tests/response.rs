//! Frequency responses: low + high = 1 for every filter, the known cut-offs, and the same as measured with sinusoids; poles.

mod common;

use common::{
    Check, Kind, Motion, butterworth, characteristic, close, every_filter, excess, exp,
    fourth_order_chain, fourth_order_poles, gains, pi, polynomial, size, split, third_order,
    with_q,
};
use compfilt_core::linear::{Transition, continuous_response, discrete_response};
use compfilt_core::nalgebra::Complex;
use compfilt_core::{Chain, Discretise, Matched, Real, Recurrence, Split, State};

/// A level or a tolerance in decibels.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Decibel(f64);

impl Decibel {
    fn of(z: Complex<f64>) -> Self {
        Self(20.0 * size(z).log10())
    }

    #[track_caller]
    fn assert(self, wanted: Self, tolerance: Self) {
        assert!((self.0 - wanted.0).abs() <= tolerance.0, "{self:?} instead of {wanted:?}");
    }
}

/// The half-power level, 10 lg ½.
fn half_power() -> Decibel {
    Decibel(10.0 * 0.5f64.log10())
}

fn frequencies() -> impl Iterator<Item = f64> {
    (-60..=60).map(|i| 10f64.powf(f64::from(i) / 15.0))
}

/// The whole chain as a split at its order: its response.
fn whole<const N: usize>(chain: &Chain<f64, N, 1>) -> Split<f64, N> {
    chain.split(N).expect("the order")
}

fn low<const N: usize>(design: &Split<f64, N>, omega: f64) -> Complex<f64> {
    continuous_response(design.coefficients(), design.split(), omega).low
}

// ------------------------------------------------------------------------------------------------------------ complementary

fn continuous_pair_is_complementary<const N: usize>() {
    let order = u32::try_from(N).expect("a small number");
    for degree in 1..=N {
        let design = split::<f64, N>(3.0, degree);
        for omega in frequencies() {
            let response = continuous_response(design.coefficients(), design.split(), omega);
            assert!(excess(&response) < 1e-14);
            // Independently: B(jω) as the product over the poles.
            let s = Complex::new(0.0, omega);
            let b = design.poles().iter().fold(Complex::new(1.0, 0.0), |b, p| b * (s - p));
            let constant = design.coefficients()[N - 1];
            if degree == 1 {
                assert!(size(response.low - Complex::new(constant, 0.0) / b) < 1e-10);
            }
            if degree == N {
                assert!(size(response.high - s.powu(order) / b) < 1e-10);
            }
        }
    }
}

#[test]
fn continuous_branches_sum_to_one() {
    continuous_pair_is_complementary::<1>();
    continuous_pair_is_complementary::<2>();
    continuous_pair_is_complementary::<3>();
    continuous_pair_is_complementary::<4>();
    continuous_pair_is_complementary::<5>();
    continuous_pair_is_complementary::<6>();
}

/// From far below the poles to the Nyquist frequency, at three sample periods.
struct Complementary;

impl Check<f64> for Complementary {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        for dt in [0.001, 0.02, 0.5] {
            let gains = gains(&design, dt);
            for omega in (1..=40).map(|i| std::f64::consts::PI / dt * 0.75f64.powi(40 - i)) {
                let response = discrete_response::<f64, D, N>(&gains, omega);
                let sum = excess(&response);
                assert!(sum < 1e-9, "{} at {omega} rad/s, {dt} s: {sum:e}", kind.name);
            }
            let still = discrete_response::<f64, D, N>(&gains, 0.0);
            assert_eq!((still.low.re, still.high.re), (1.0, 0.0), "{}", kind.name);
        }
    }
}

#[test]
fn discrete_branches_sum_to_one() {
    every_filter(3.0, 0.5, &mut Complementary);
}

// -------------------------------------------------------------------------------------------------------------- known values

/// The frequency at which the low branch falls through half power, by bisection between 0.1 and 1e5 rad/s.
fn cut_off<const N: usize>(design: &Split<f64, N>) -> f64 {
    let (mut below, mut above) = (0.1, 1e5);
    for _ in 0..200 {
        let middle = f64::sqrt(below * above);
        if size(low(design, middle)).powi(2) > 0.5 { below = middle } else { above = middle }
    }
    below
}

/// Y.-H. Jeon 2015 quotes 10, 13, 50 and 500 rad/s; these are the ones that his filters have.
#[test]
fn cut_offs_of_the_low_pass_with_q() {
    for (q, wanted, tolerance) in
        [(1.0, 20.6, 0.05), (0.625, 26.9, 0.05), (0.1, 142.0, 0.5), (0.01, 1414.0, 0.5)]
    {
        let chain = compfilt_core::Butterworth::with_q(10.0, q).expect("q").chain();
        let found = cut_off(&whole(&chain));
        close(found, wanted, tolerance);
        // |LP|² = ½ solved for ω².
        let (k1, k2) = (chain.coefficients()[0], chain.coefficients()[1]);
        let half = k2 + k1 * k1 / 2.0;
        close(found, (half + (half * half + k2 * k2).sqrt()).sqrt(), 1e-9 * found);
    }
}

/// At `omega0` the low-pass of split 1 and the high-pass of the whole chain have half power.
fn half_power_at_omega0<const N: usize>() {
    let tolerance = Decibel(1e-9);
    let (steep, chain) = (split::<f64, N>(10.0, 1), split::<f64, N>(10.0, N));
    Decibel::of(continuous_response(steep.coefficients(), steep.split(), 10.0).low)
        .assert(half_power(), tolerance);
    Decibel::of(continuous_response(chain.coefficients(), chain.split(), 10.0).high)
        .assert(half_power(), tolerance);
    close(cut_off(&steep), 10.0, 1e-9);
    // 20 N dB a decade.
    let slope = Decibel::of(low(&steep, 1e4)).0 - Decibel::of(low(&steep, 1e3)).0;
    close(slope, -20.0 * f64::from(u32::try_from(N).expect("a small number")), 1e-2);
}

#[test]
fn butterworth_has_half_power_at_omega0() {
    half_power_at_omega0::<1>();
    half_power_at_omega0::<2>();
    half_power_at_omega0::<3>();
    half_power_at_omega0::<4>();
    half_power_at_omega0::<5>();
    half_power_at_omega0::<6>();
}

#[test]
fn the_low_pass_of_order_two_peaks() {
    let design = split::<f64, 2>(10.0, 2);
    let peak = (0..100_000).map(|i| size(low(&design, f64::from(i) * 1e-3))).fold(0.0, f64::max);
    Decibel(20.0 * peak.log10()).assert(Decibel(2.09), Decibel(0.005));
    let high = (0..100_000).map(|i| {
        size(continuous_response(design.coefficients(), design.split(), f64::from(i) * 1e-2).high)
    });
    assert!(high.fold(0.0, f64::max) <= 1.0, "the high-pass is maximally flat");
}

#[test]
fn the_split_low_pass_does_not_peak() {
    let design = split::<f64, 2>(10.0, 1);
    assert!(frequencies().all(|omega| size(low(&design, omega)) <= 1.0 + 1e-15));
}

/// At a short sample period the discrete pair is the continuous one.
#[test]
fn discrete_meets_continuous_at_short_periods() {
    let design = split::<f64, 3>(3.0, 2);
    let gains = gains(&design, 1e-5);
    for omega in [0.03, 0.3, 3.0, 30.0] {
        let discrete = discrete_response::<f64, Split<f64, 3>, 3>(&gains, omega);
        assert!(size(discrete.low - low(&design, omega)) < 1e-3);
    }
    let matched = butterworth::<f64, 3>(3.0).matched();
    let gains = common::gains(&matched, 1e-4);
    for omega in [0.03, 0.3, 3.0, 30.0] {
        let discrete = discrete_response::<f64, Matched<f64, 3, 1>, 3>(&gains, omega);
        let chain = whole(&butterworth::<f64, 3>(3.0).chain());
        assert!(size(discrete.low - low(&chain, omega)) < 1e-3);
    }
}

// -------------------------------------------------------------------------------------------------------------------- poles

fn assert_poles<D: Discretise<f64, N>, const N: usize>(
    design: &D,
    dt: f64,
    wanted: [Complex<f64>; N],
) {
    let step = Transition::of::<D>(&gains(design, dt));
    for (found, wanted) in characteristic(&step.state).into_iter().zip(polynomial(wanted)) {
        close(found, wanted, 1e-13 * f64::from(1 << N));
    }
}

/// 1/(1 - p T).
fn backward(poles: [Complex<f64>; 6], dt: f64) -> [Complex<f64>; 6] {
    poles.map(|p| backward_pole(p, dt))
}

fn backward_pole(pole: Complex<f64>, dt: f64) -> Complex<f64> {
    Complex::new(1.0, 0.0) / (Complex::new(1.0, 0.0) - pole * dt)
}

#[test]
fn backward_euler_poles_are_exact() {
    for dt in [0.001, 0.05, 1.0] {
        let six = butterworth::<f64, 6>(3.0).chain();
        assert_poles(&six, dt, backward(six.poles(), dt));
        let chain = third_order(3.0);
        assert_poles(&chain, dt, chain.poles().map(|p| backward_pole(p, dt)));
        let chain = fourth_order_chain(3.0);
        assert_poles(&chain, dt, fourth_order_poles(3.0).map(|p| backward_pole(p, dt)));
        let overdamped = with_q(3.0, 0.2);
        assert_poles(&overdamped, dt, overdamped.poles().map(|p| backward_pole(p, dt)));
        for degree in 1..=4 {
            let design = split::<f64, 4>(3.0, degree);
            assert_poles(&design, dt, design.poles().map(|p| backward_pole(p, dt)));
        }
    }
}

#[test]
fn matched_poles_are_exact() {
    for dt in [0.001, 0.05, 0.5] {
        let exact = |p: Complex<f64>| exp(p * dt);
        let chain = butterworth::<f64, 4>(3.0).chain();
        assert_poles(&chain.matched(), dt, chain.poles().map(exact));
        let chain = third_order(3.0);
        assert_poles(&chain.matched(), dt, chain.poles().map(exact));
        let chain = butterworth::<f64, 5>(3.0).chain();
        assert_poles(&chain.matched(), dt, chain.poles().map(exact));
        let chain = pi(3.0, 0.9);
        assert_poles(&chain.matched(), dt, chain.poles().map(exact));
    }
}

/// The closed forms of the matched gains.
#[test]
fn matched_gains_are_the_closed_forms() {
    let dt = 0.1;
    let first = butterworth::<f64, 1>(3.0).matched();
    close(gains(&first, dt).correction()[0], 1.0 - (-0.3f64).exp(), 1e-15);

    let second = pi(3.0, 0.9);
    let [z1, z2] = second.poles().map(|p| (p.re * dt).exp());
    let found = gains(&second.matched(), dt);
    close(found.correction()[0], 1.0 - z1 * z2, 1e-14);
    close(found.correction()[1], (1.0 - z1) * (1.0 - z2) / dt, 1e-13);

    let z = (-0.3f64).exp();
    let found = gains(&third_order(3.0).matched(), dt);
    let (e1, e2, e3) = (3.0 * z, 3.0 * z * z, z * z * z);
    close(found.correction()[0], 1.0 - e3, 1e-14);
    close(found.correction()[1], (3.0 - e1 - e2 + 3.0 * e3) / (2.0 * dt), 1e-13);
    close(found.correction()[2], (1.0 - z).powi(3) / (dt * dt), 1e-12);
}

// ---------------------------------------------------------------------------------------------- as measured with a sinusoid

/// Runs a sinusoid through one branch until the start has died away; the ratio to the sinusoid over one period of so many
/// samples.
struct Measured(u32);

impl Measured {
    fn ratio(&self, mut output: impl FnMut(Complex<f64>) -> f64) -> Complex<f64> {
        let turn = std::f64::consts::TAU / f64::from(self.0);
        let mut sum = Complex::new(0.0, 0.0);
        let periods = 20_000 / self.0;
        for n in 0..periods * self.0 {
            let phasor = exp(Complex::new(0.0, turn * f64::from(n % self.0)));
            let value = output(phasor);
            if n >= (periods - 1) * self.0 {
                sum += phasor.conj() * (2.0 * value / f64::from(self.0));
            }
        }
        sum
    }
}

/// What the filter's own integration, undisturbed, makes of an input `z^n`: level 0 for a path of sinusoids.
fn integrated(kind: Kind, z: Complex<f64>, dt: f64) -> Complex<f64> {
    let one = Complex::new(1.0, 0.0);
    let w = z - one;
    let once = z * dt / w;
    match (kind.motion, kind.derivative_order) {
        (Motion::Change, _) => z / w,
        (Motion::BackwardEuler, order) => (0..order).fold(one, |g, _| g * once),
        (Motion::Exact, 1) => once,
        (Motion::Exact, 2) => z * (z + one) / (w * w) * (dt * dt / 2.0),
        (Motion::Exact, _) => z * (z * z + z * 4.0 + one) / (w * w * w) * (dt * dt * dt / 6.0),
    }
}

impl Check<f64> for Measured {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let dt = 0.05;
        let omega = std::f64::consts::TAU / (f64::from(self.0) * dt);
        let gains = gains(&design, dt);
        let response = discrete_response::<f64, D, N>(&gains, omega);

        let mut state = State::at_rest::<f64>(0.0);
        let low = self.ratio(|phasor| gains.step(&mut state, phasor.re, 0.0));
        assert!(size(low - response.low) < 1e-9, "{}: {low} {}", kind.name, response.low);

        let mut state = State::at_rest::<f64>(0.0);
        let high = self.ratio(|phasor| gains.step(&mut state, 0.0, phasor.re));
        let wanted = response.high * integrated(kind, exp(Complex::new(0.0, omega * dt)), dt);
        assert!(size(high - wanted) < 1e-9, "{}: {high} {wanted}", kind.name);
    }
}

#[test]
fn the_discrete_response_is_the_measured_one() {
    for period in [3, 8, 50, 400] {
        every_filter(3.0, 0.6, &mut Measured(period));
    }
}

/// In `f32` both branches stay within 1e-4 of the `f64` ones.
#[test]
fn responses_in_single_precision() {
    let single = gains(&butterworth::<f32, 3>(3.0).chain(), 0.02);
    let double = gains(&butterworth::<f64, 3>(3.0).chain(), 0.02);
    for omega in [0.3f32, 3.0, 30.0] {
        let found = discrete_response::<f32, Chain<f32, 3, 1>, 3>(&single, omega);
        let wanted = discrete_response::<f64, Chain<f64, 3, 1>, 3>(&double, omega.to_f64());
        close(f64::from(found.low.re), wanted.low.re, 1e-4);
        close(f64::from(found.high.im), wanted.high.im, 1e-4);
    }
}
