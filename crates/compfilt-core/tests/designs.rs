//! What a design refuses, with the parameter and the rule that it names; what it accepts, against the known numbers.
#![allow(clippy::float_cmp)] // These numbers are exact.

mod common;

use common::{close, fourth_order_poles, size, split};
use compfilt_core::linear::{Stream, alpha_to_tau, poles, tau_to_alpha};
use compfilt_core::nalgebra::Complex;
use compfilt_core::{
    Butterworth, Chain, Discretise, Dt, Error, FirstOrder, Number, PiForm, RateFilter, Real, Rule,
    SecondOrderInertial, ThirdOrder,
};
use proptest::prelude::ProptestConfig;
use proptest::proptest;

/// No positive number.
fn not_positive<T: Real>() -> [T; 5] {
    let infinity = T::one() / T::zero();
    [T::NAN, infinity, -infinity, T::zero(), -T::one()]
}

#[track_caller]
fn refused<V>(result: Result<V, Error>, parameter: &str, rule: Rule) {
    let error = result.err().expect("refused");
    assert_eq!((error.parameter(), error.rule()), (parameter, rule));
    assert!(error.to_string().starts_with(&format!("{parameter} must ")), "{error}");
}

/// `make` refuses what is not positive and accepts 1.
#[track_caller]
fn needs_positive<T: Real, V>(parameter: &str, make: impl Fn(T) -> Result<V, Error>) {
    for value in not_positive() {
        refused(make(value), parameter, Rule::Positive);
    }
    assert!(make(T::one()).is_ok());
}

fn designs_need_positive_parameters<T: Real>() {
    let one = T::one();
    needs_positive("tau", FirstOrder::<T>::new);
    needs_positive("kp", |kp| PiForm::<T>::new(kp, one));
    needs_positive("ki", |ki| PiForm::<T>::new(one, ki));
    needs_positive("omega0", Butterworth::<T, 1>::new);
    needs_positive("omega0", Butterworth::<T, 6>::new);
    needs_positive("omega0", |omega0| Butterworth::<T, 2>::with_q(omega0, one));
    needs_positive("q", |q| Butterworth::<T, 2>::with_q(one, q));
    needs_positive("tau", ThirdOrder::<T>::new);
    needs_positive("omega0", ThirdOrder::<T>::butterworth);
    let half = T::literal(0.5);
    needs_positive("k1", |k1| ThirdOrder::<T>::from_gains(k1, one, half));
    needs_positive("k2", |k2| ThirdOrder::<T>::from_gains(one, k2, half));
    needs_positive("k3", |k3: T| ThirdOrder::<T>::from_gains(one, one, k3 * half));
    needs_positive("tau", SecondOrderInertial::<T>::new);
    needs_positive("omega0", SecondOrderInertial::<T>::butterworth);
    needs_positive("tau", RateFilter::<T>::new);
    needs_positive("coefficients", |k| Chain::<T, 2, 1>::new([one, k]));
    needs_positive("coefficients", |k| Chain::<T, 2, 2>::new([k, one]));
}

#[test]
fn every_parameter_must_be_positive() {
    designs_need_positive_parameters::<f64>();
    designs_need_positive_parameters::<f32>();
}

fn time_steps_must_be_positive<T: Real>() {
    let one = T::one();
    let design = PiForm::<T>::new(one, one).expect("dt");
    needs_positive("dt", |dt| design.at(dt));
    needs_positive("dt", |dt| design.matched().at(dt));
    needs_positive("dt", |dt| RateFilter::<T>::new(one)?.at(dt));
    needs_positive("dt", |dt| split::<T, 2>(one, 1).at(dt));
    needs_positive("fs", Dt::<T>::from_rate);
    for dt in [T::NAN, one / T::zero(), -one] {
        refused(Dt::new(dt), "dt", Rule::NotNegative);
    }
    assert_eq!(Dt::new(T::zero()).map(Dt::seconds), Ok(T::zero()));
    assert_eq!(Dt::from_rate(T::literal(4.0)).map(Dt::seconds), Ok(T::literal(0.25)));
}

#[test]
fn every_time_step_is_checked() {
    time_steps_must_be_positive::<f64>();
    time_steps_must_be_positive::<f32>();
    refused(Dt::from_rate(1e-39_f32), "fs", Rule::Positive);
}

#[test]
fn stream_options_are_checked() {
    let stream = Stream::new(FirstOrder::new(1.0).expect("tau").chain());
    needs_positive("period", |period| stream.period(period));
    needs_positive("gap_cap", |cap| stream.gap_cap(cap));
    for hold in [f64::NAN, f64::INFINITY, -1.0] {
        refused(stream.hold(hold), "hold", Rule::NotNegative);
    }
    assert!(stream.hold(0.0).is_ok());
}

#[test]
fn splits_are_checked() {
    let design = Butterworth::<f64, 3>::new(1.0).expect("omega0");
    refused(design.split(0), "split", Rule::AtMostOrder);
    refused(design.split(4), "split", Rule::AtMostOrder);
    for degree in 1..=3 {
        assert_eq!(design.split(degree).map(|split| split.split()), Ok(degree));
    }
}

/// Coefficients and gains that vanish or overflow in `f32`, although every parameter is a positive number.
#[test]
fn what_single_precision_cannot_hold_is_refused() {
    refused(FirstOrder::new(1e-39_f32), "tau", Rule::Representable);
    refused(ThirdOrder::new(1e16_f32), "tau", Rule::Representable);
    refused(ThirdOrder::new(1e-13_f32), "tau", Rule::Representable);
    refused(SecondOrderInertial::new(1e23_f32), "tau", Rule::Representable);
    refused(Butterworth::<f32, 6>::new(1e-8), "omega0", Rule::Representable);
    refused(Butterworth::<f32, 6>::new(1e7), "omega0", Rule::Representable);
    refused(Butterworth::<f32, 2>::with_q(1e10, 1e-30), "q", Rule::Representable);
    refused(Butterworth::<f32, 2>::with_q(1e-10, 1e38), "q", Rule::Representable);
    refused(ThirdOrder::butterworth(1e-16_f32), "omega0", Rule::Representable);

    refused(FirstOrder::new(1e38_f32).expect("tau").at(1e-8), "dt", Rule::Representable);
    refused(RateFilter::new(1e38_f32).expect("tau").at(1e-8), "dt", Rule::Representable);
    refused(Butterworth::<f32, 6>::new(1e-6).expect("omega0").at(1e-10), "dt", Rule::Representable);
    refused(Butterworth::<f32, 6>::new(1e6).expect("omega0").at(1e6), "dt", Rule::Representable);
    let split = Butterworth::<f32, 4>::new(1e-9).expect("omega0").split(2).expect("a degree");
    refused(split.at(1e-10), "dt", Rule::Representable);
    // The same in f64 is fine.
    assert!(FirstOrder::new(1e38_f64).is_ok_and(|design| design.at(1e-8).is_ok()));
    assert!(Butterworth::<f64, 6>::new(1e-6).is_ok_and(|design| design.at(1e-10).is_ok()));
}

#[test]
fn unstable_coefficients_are_refused() {
    refused(Chain::<f64, 3, 1>::new([1.0, 1.0, 1.0]), "coefficients", Rule::Stable);
    refused(Chain::<f64, 3, 2>::new([1.0, 1.0, 2.0]), "coefficients", Rule::Stable);
    refused(Chain::<f64, 4, 1>::new([1.0, 10.0, 1.0, 10.0]), "coefficients", Rule::Stable);
    refused(Chain::<f32, 5, 1>::new([1.0, 1.0, 1.0, 1.0, 10.0]), "coefficients", Rule::Stable);
    refused(ThirdOrder::from_gains(1.0, 1.0, 1.001_f64), "coefficients", Rule::Stable);
    assert!(ThirdOrder::from_gains(1.0, 1.0, 0.999_f64).is_ok());
    assert!(Chain::<f64, 1, 1>::new([1e-300]).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Routh's scheme says what the poles say.
    #[test]
    fn stable_is_what_the_poles_say(k in proptest::array::uniform5(0.1..10.0)) {
        let rightmost = poles(&k).iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.re));
        if rightmost.abs() > 1e-9 {
            assert_eq!(Chain::<f64, 5, 1>::new(k).is_ok(), rightmost < 0.0);
        }
    }
}

// ------------------------------------------------------------------------------------------------------------- alpha and tau

#[test]
fn alpha_and_tau_convert_into_each_other() {
    for fs in [1.0, 100.0, 8000.0] {
        for alpha in [0.001, 0.5, 0.8, 0.98, 0.9999] {
            let tau = alpha_to_tau(alpha, fs).expect("a weight");
            close(tau_to_alpha(tau, fs).expect("a time constant"), alpha, 1e-15);
            // It is the weight that the gains have: 1 - L.
            let gains = FirstOrder::new(tau).expect("tau").at(1.0 / fs).expect("dt");
            let found = 1.0 - compfilt_core::Recurrence::correction(&gains)[0];
            close(found, alpha, 1e-14);
        }
    }
    // 0.98 at 100 Hz: 0.49 s.
    close(alpha_to_tau(0.98, 100.0).expect("a weight"), 0.49, 1e-14);
    close(tau_to_alpha(1e300, 1e300).expect("a time constant"), 1.0, 0.0);
}

#[test]
fn conversions_are_checked() {
    for alpha in [f64::NAN, f64::INFINITY, -0.1, 0.0, 1.0, 1.1] {
        refused(alpha_to_tau(alpha, 100.0), "alpha", Rule::Between(0, 1));
    }
    needs_positive("fs", |fs| alpha_to_tau(0.5, fs));
    needs_positive("fs", |fs| tau_to_alpha(0.5_f32, fs));
    needs_positive("tau", |tau| tau_to_alpha(tau, 100.0_f64));
    refused(alpha_to_tau(1e-30_f32, 1e30), "alpha", Rule::Representable);
}

#[test]
fn errors_say_what_is_wrong() {
    let says = |result: Result<f64, Error>| result.unwrap_err().to_string();
    assert_eq!(says(alpha_to_tau(2.0, 1.0)), "alpha must lie between 0 and 1, both excluded");
    assert_eq!(says(alpha_to_tau(0.5, 0.0)), "fs must be positive and finite");
    let error = ThirdOrder::from_gains(1.0, 1.0, 2.0).unwrap_err();
    assert!(error.to_string().contains("left half plane"));
    let boxed: Box<dyn core::error::Error> = Box::new(error);
    assert!(boxed.source().is_none());
}

// ------------------------------------------------------------------------------------------------------------- known numbers

#[track_caller]
fn coefficients_are<const N: usize>(wanted: [f64; N]) {
    for omega0 in [1.0, 0.3, 25.0] {
        let chain = Butterworth::<f64, N>::new(omega0).expect("omega0").chain();
        let mut power = 1.0;
        for (found, wanted) in chain.coefficients().iter().zip(wanted) {
            power *= omega0;
            close(found / power, wanted, 1e-13);
        }
        // All poles lie on the circle.
        assert!(chain.poles().iter().all(|pole| (size(*pole) / omega0 - 1.0).abs() < 1e-12));
    }
}

/// The tabulated polynomials, as sums of their factors' coefficients.
#[test]
fn butterworth_coefficients_are_the_known_ones() {
    let root2 = 2f64.sqrt();
    let root5 = 5f64.sqrt();
    coefficients_are([1.0]);
    coefficients_are([root2, 1.0]);
    coefficients_are([2.0, 2.0, 1.0]);
    let k1 = (4.0 + 2.0 * root2).sqrt();
    coefficients_are([k1, 2.0 + root2, k1, 1.0]);
    coefficients_are([1.0 + root5, 3.0 + root5, 3.0 + root5, 1.0 + root5, 1.0]);
    coefficients_are([
        3.863_703_305_156_273,
        7.464_101_615_137_754,
        9.141_620_172_685_64,
        7.464_101_615_137_754,
        3.863_703_305_156_273,
        1.0,
    ]);
}

#[test]
fn coefficients_of_the_other_designs() {
    let third = ThirdOrder::new(0.5_f64).expect("tau").chain();
    assert_eq!(third.coefficients(), &[6.0, 12.0, 8.0]);
    let third = ThirdOrder::butterworth(2.0_f64).expect("omega0").chain();
    for (found, wanted) in third.coefficients().iter().zip([4.0, 8.0, 8.0]) {
        close(*found, wanted, 1e-13);
    }
    let raw = ThirdOrder::from_gains(3.0, 2.0, 1.0_f64).expect("dt").chain();
    assert_eq!(raw.coefficients(), &[3.0, 2.0, 1.0]);
    let second = SecondOrderInertial::new(0.5_f64).expect("tau").chain();
    assert_eq!(second.coefficients(), &[4.0, 4.0]);
    let with_q = Butterworth::with_q(10.0_f64, 0.1).expect("q").chain();
    close(with_q.coefficients()[0], 2f64.sqrt() * 100.0, 1e-12);
    close(with_q.coefficients()[1], 100.0, 1e-12);
    assert_eq!(PiForm::new(20.0, 10.0_f64).expect("dt").chain().coefficients(), &[20.0, 10.0]);
    assert_eq!(FirstOrder::new(0.25_f64).expect("tau").chain().coefficients(), &[4.0]);
    close(FirstOrder::new(0.3_f64).expect("tau").tau(), 0.3, 0.0);
    let rate = RateFilter::new(0.25_f64).expect("tau");
    assert_eq!((rate.tau(), rate.drift_free()), (0.25, FirstOrder::new(0.25).expect("tau")));
}

// --------------------------------------------------------------------------------------------------------------------- poles

/// Every wanted root has its own found root, whatever their order.
#[track_caller]
fn same_roots<const N: usize>(found: [Complex<f64>; N], wanted: [Complex<f64>; N], tolerance: f64) {
    let mut left = found.to_vec();
    for root in wanted {
        let distance = |other: &Complex<f64>| size(*other - root);
        let (place, nearest) = left
            .iter()
            .map(distance)
            .enumerate()
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .expect("as many roots");
        assert!(nearest <= tolerance * size(root), "{root} is not in {found:?}");
        left.remove(place);
    }
    // Conjugate pairs lie side by side and are exact mirror images.
    let mut roots = found.iter();
    while let Some(root) = roots.next() {
        if root.im != 0.0 {
            assert_eq!(roots.next(), Some(&root.conj()));
        }
    }
}

fn on_the_circle<const N: usize>(omega0: f64) -> [Complex<f64>; N] {
    let mut k = 0.0;
    core::array::from_fn(|_| {
        k += 1.0;
        let order = f64::from(u32::try_from(N).expect("a small number"));
        let angle = std::f64::consts::PI * (2.0 * k + order - 1.0) / (2.0 * order);
        Complex::new(omega0 * angle.cos(), omega0 * angle.sin())
    })
}

fn butterworth_poles<const N: usize>() {
    for omega0 in [1e-3, 1.0, 400.0] {
        let chain = Butterworth::<f64, N>::new(omega0).expect("omega0").chain();
        same_roots(chain.poles(), on_the_circle(omega0), 1e-12);
    }
}

#[test]
fn butterworth_poles_lie_where_they_should() {
    butterworth_poles::<1>();
    butterworth_poles::<2>();
    butterworth_poles::<3>();
    butterworth_poles::<4>();
    butterworth_poles::<5>();
    butterworth_poles::<6>();
}

fn real(re: f64) -> Complex<f64> {
    Complex::new(re, 0.0)
}

#[test]
fn poles_in_closed_form() {
    for tau in [0.01, 0.5, 30.0] {
        let first = FirstOrder::new(tau).expect("tau").chain();
        same_roots(first.poles(), [real(-1.0 / tau)], 1e-15);
        let second = SecondOrderInertial::new(tau).expect("tau").chain();
        same_roots(second.poles(), [real(-1.0 / tau); 2], 1e-15);
        let third = ThirdOrder::new(tau).expect("tau").chain();
        same_roots(third.poles(), [real(-1.0 / tau); 3], 1e-14);
    }
    // Overdamped, without cancellation: the slow pole of Y.-H. Jeon's q = 0.01 is near -0.0707 rad/s, the fast near -1414.
    let chain = Butterworth::with_q(10.0_f64, 0.01).expect("q").chain();
    let half: f64 = chain.coefficients()[0] / 2.0;
    let fast = -half - (half * half - 100.0).sqrt();
    same_roots(chain.poles(), [real(fast), real(100.0 / fast)], 1e-14);
    close(fast, -1414.0, 0.5);
    close(100.0 / fast, -0.0707, 1e-4);
}

/// Double roots, found to half the digits; none of them swallows another.
#[test]
fn double_poles_are_all_there() {
    for rate in [0.01, 0.5, 1.0, 2.0, 3.0, 7.3, 100.0] {
        let chain = common::fourth_order_chain(rate);
        same_roots(chain.poles(), fourth_order_poles(rate), 1e-6);
        let single = common::fourth_order_chain(f32::literal(rate)).poles();
        let single = single.map(|p| Complex::new(f64::from(p.re), f64::from(p.im)));
        same_roots(single, fourth_order_poles(rate), 5e-3);
    }
    // (s² + s + 1)²
    let root = Complex::new(-0.5, 0.75f64.sqrt());
    same_roots(poles(&[2.0, 3.0, 2.0, 1.0]), [root, root.conj(), root, root.conj()], 1e-6);
    // (s + 1)³ (s + 2)³
    let [one, two] = [real(-1.0), real(-2.0)];
    same_roots(poles(&[9.0, 33.0, 63.0, 66.0, 36.0, 8.0]), [one, one, one, two, two, two], 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The roots give the polynomial back.
    #[test]
    fn poles_give_the_coefficients_back(
        real_parts in proptest::array::uniform3(-3.0..-0.1), imaginary in proptest::array::uniform2(0.1..3.0),
    ) {
        let [a, b, c] = real_parts;
        let [upper, other] = [Complex::new(a, imaginary[0]), Complex::new(b, imaginary[1])];
        let k = common::polynomial([upper, upper.conj(), other, other.conj(), real(c)]);
        let found = poles(&k);
        for (again, k) in common::polynomial(found).into_iter().zip(k) {
            close(again / k, 1.0, 1e-9);
        }
        assert!(found.iter().all(|pole| pole.re < 0.0));
    }
}
