//! Samples that are not there: flags, held derivatives, the start, and where the poles go after a gap.

mod common;

use common::{
    Check, Kind, all_bits, backward_euler_filters, bits, butterworth, characteristic, close,
    every_filter, exp, first_order, fourth_order_chain, fourth_order_poles, gains, gappy_samples,
    pi, polynomial, run, second_order_inertial, split, third_order, third_order_butterworth,
};
use compfilt_core::linear::{Flags, Held, Input, Stream, StreamState};
use compfilt_core::nalgebra::{Complex, ComplexField, SMatrix};
use compfilt_core::{Chain, Discretise, Real, Recurrence, State};

const NAN: f64 = f64::NAN;

// -------------------------------------------------------------------------------------------------------- derivative held

#[test]
fn a_missing_derivative_is_held_then_zero() {
    let stream = Stream::new(first_order(1.0)).hold(0.035).expect("a hold");
    let gains = gains(&first_order(1.0), 0.01);
    let mut state = StreamState::from_levels([0.0]);
    let mut update = |u| {
        let before = state.level0();
        let flags = stream.update(&gains, &mut state, NAN, u, &mut ());
        (flags, state.level0() - before)
    };
    let (flags, moved) = update(2.0);
    assert_eq!(flags, Flags::MEASUREMENT_MISSING);
    close(moved, 0.02, 1e-16);
    for _ in 0..3 {
        let (flags, moved) = update(NAN);
        assert_eq!(flags, Flags::MEASUREMENT_MISSING | Flags::DERIVATIVE_HELD);
        close(moved, 0.02, 1e-16);
    }
    for _ in 0..3 {
        let (flags, moved) = update(f64::INFINITY);
        assert_eq!(flags, Flags::MEASUREMENT_MISSING | Flags::DERIVATIVE_MISSING);
        close(moved, 0.0, 0.0);
    }
    let (flags, moved) = update(-1.0);
    assert_eq!(flags, Flags::MEASUREMENT_MISSING);
    close(moved, -0.01, 1e-16);
    assert_eq!(update(NAN).0, Flags::MEASUREMENT_MISSING | Flags::DERIVATIVE_HELD);
}

#[test]
fn a_hold_of_zero_holds_nothing() {
    let stream = Stream::new(first_order(1.0)).hold(0.0).expect("a hold");
    let gains = gains(&first_order(1.0), 0.01);
    let mut state = StreamState::from_levels([0.0]);
    stream.update(&gains, &mut state, 0.0, 5.0, &mut ());
    let flags = stream.update(&gains, &mut state, 0.0, NAN, &mut ());
    assert_eq!(flags, Flags::DERIVATIVE_MISSING);
}

/// A derivative that never came counts as zero.
#[test]
fn no_derivative_at_all() {
    let stream = Stream::new(first_order(1.0));
    let gains = gains(&first_order(1.0), 0.01);
    let mut state = StreamState::from_levels([0.5]);
    assert_eq!(stream.update(&gains, &mut state, 0.5, NAN, &mut ()), Flags::DERIVATIVE_MISSING);
    assert_eq!(bits(state.level0()), bits(0.5));
}

#[test]
fn the_age_of_a_held_derivative_can_be_renewed() {
    let mut held = StreamState::<f64, 1>::new().input;
    assert!(held.value.is_nan());
    held.renew(3.0);
    assert_eq!(held, Held { value: 3.0, age: 0.0 });
}

// ------------------------------------------------------------------------------------------------------------------ flags

#[test]
fn flags_are_a_set() {
    let all = Flags::MEASUREMENT_MISSING
        | Flags::DERIVATIVE_HELD
        | Flags::DERIVATIVE_MISSING
        | Flags::NOT_STARTED
        | Flags::RESTARTED;
    assert_eq!(all.bits(), 31);
    let mut some = Flags::default();
    some |= Flags::NOT_STARTED;
    assert!(all.contains(some) && !some.contains(all) && some.contains(Flags::default()));
}

/// Infinite is missing, as NaN is: the same bits.
struct InfiniteIsMissing;

impl<T: Real> Check<T> for InfiniteIsMissing {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let samples = gappy_samples::<T>(31, 90, 0.02);
        let stream = Stream::new(design);
        let wanted = run(&stream, &mut StreamState::new(), &samples);
        let infinity = T::one() / T::zero();
        for replacement in [infinity, -infinity] {
            let mut replaced = samples.clone();
            for sample in &mut replaced {
                sample.y = sample.y.finite_or(replacement);
                sample.u = sample.u.finite_or(replacement);
            }
            let found = run(&stream, &mut StreamState::new(), &replaced);
            assert_eq!(all_bits(&found), all_bits(&wanted), "{}", kind.name);
        }
    }
}

#[test]
fn infinite_samples_are_missing() {
    every_filter::<f64>(2.0, 0.5, &mut InfiniteIsMissing);
    every_filter::<f32>(2.0, 0.5, &mut InfiniteIsMissing);
}

// ------------------------------------------------------------------------------------------------------------------ start

#[test]
fn nothing_happens_before_the_first_measurement() {
    let stream = Stream::new(pi(2.0, 0.5));
    let gains = gains(&pi(2.0, 0.5), 0.01);
    let mut state = StreamState::new();
    for _ in 0..5 {
        let flags = stream.update(&gains, &mut state, NAN, 1.0, &mut ());
        assert_eq!(flags, Flags::NOT_STARTED | Flags::MEASUREMENT_MISSING);
        assert!(state.level0().is_nan() && !state.started);
    }
    assert_eq!(stream.predict(&gains, &mut state, 1.0, &mut ()), Flags::NOT_STARTED);
    assert_eq!(stream.correct(&gains, &mut state, NAN, &mut ()), Flags::MEASUREMENT_MISSING);
    // The first measurement stands for the state before its own step.
    let mut wanted = State::at_rest::<f64>(0.4);
    gains.step(&mut wanted, 0.4, 1.0);
    assert_eq!(stream.update(&gains, &mut state, 0.4, 1.0, &mut ()), Flags::default());
    assert_eq!(state.levels, wanted);
}

/// A derivative that came before the first measurement is where the first straight line begins.
#[test]
fn derivatives_before_the_first_measurement_are_remembered() {
    let stream = Stream::new(pi(2.0, 0.5)).input(Input::Trapezoid);
    let gains = gains(&pi(2.0, 0.5), 0.01);
    let mut state = StreamState::new();
    stream.update(&gains, &mut state, NAN, 1.0, &mut ());
    stream.update(&gains, &mut state, 0.0, 3.0, &mut ());
    let mut wanted = State::at_rest::<f64>(0.0);
    gains.step(&mut wanted, 0.0, 2.0);
    close(state.level0(), wanted.levels[0], 1e-16);
}

#[test]
fn a_correction_can_start_a_filter() {
    let stream = Stream::new(pi(2.0, 0.5));
    let gains = gains(&pi(2.0, 0.5), 0.01);
    let mut state = StreamState::default();
    assert_eq!(stream.correct(&gains, &mut state, 0.4, &mut ()), Flags::default());
    assert_eq!(state.levels, State::at_rest::<f64>(0.4));
    // Without a prediction in between there is no time for a second one.
    stream.correct(&gains, &mut state, 9.0, &mut ());
    assert_eq!(state.levels, State::at_rest::<f64>(0.4));
}

// ------------------------------------------------------------------------------------------------- predict and correct apart

/// Predictions at one rate and corrections at another are `update` with gaps, bit for bit.
struct TwoRates;

impl<T: Real> Check<T> for TwoRates {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let start = [T::literal(0.1); N];
        let (mut apart, mut together) =
            (StreamState::from_levels(start), StreamState::from_levels(start));
        for (n, sample) in common::noisy_samples::<T>(33, 90, 0.02).iter().enumerate() {
            let gains = gains(&design, sample.dt);
            let measured = n % 3 == 2;
            stream.predict(&gains, &mut apart, sample.u, &mut ());
            if measured {
                stream.correct(&gains, &mut apart, sample.y, &mut ());
            }
            let y = if measured { sample.y } else { T::NAN };
            stream.update(&gains, &mut together, y, sample.u, &mut ());
            let (found, wanted) = (&apart.levels.levels, &together.levels.levels);
            assert_eq!(all_bits(found), all_bits(wanted), "{}, sample {n}", kind.name);
        }
    }
}

#[test]
fn predictions_and_corrections_at_two_rates() {
    every_filter::<f64>(2.0, 0.5, &mut TwoRates);
    every_filter::<f32>(2.0, 0.5, &mut TwoRates);
}

/// A correction with other gains than the prediction's, as with a stored state, counts for the prediction's time.
struct CorrectsForThePrediction;

impl<T: Real> Check<T> for CorrectsForThePrediction {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let (long, short) = (gains(&design, T::literal(0.05)), gains(&design, T::literal(0.01)));
        for cap in [1.0, 0.03] {
            let stream = Stream::new(design).gap_cap(T::literal(cap)).expect("a cap");
            let start = StreamState::from_levels([T::literal(0.1); N]);
            let (mut found, mut wanted) = (start, start);
            for (state, gains) in [(&mut found, &short), (&mut wanted, &long)] {
                stream.predict(&long, state, T::one(), &mut ());
                stream.correct(gains, state, T::one(), &mut ());
            }
            for (found, wanted) in found.levels.levels.iter().zip(&wanted.levels.levels) {
                let allowed = (T::one() + wanted.abs()) * T::default_epsilon() * T::literal(8.0);
                assert!((*found - *wanted).abs() <= allowed, "{}: {found}, {wanted}", kind.name);
            }
        }
    }
}

#[test]
fn a_correction_counts_for_the_time_of_its_prediction() {
    every_filter::<f64>(2.0, 0.5, &mut CorrectsForThePrediction);
    every_filter::<f32>(2.0, 0.5, &mut CorrectsForThePrediction);
}

/// The same sample once more, with no time in between, changes nothing.
struct RepeatsInNoTime;

impl<T: Real> Check<T> for RepeatsInNoTime {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        if kind.motion == common::Motion::Change {
            return; // Its input is the change itself: repeating it is another change.
        }
        let stream = Stream::new(design);
        let mut state = StreamState::from_levels([T::literal(0.1); N]);
        for sample in gappy_samples::<T>(35, 60, 0.02) {
            stream.update(&gains(&design, sample.dt), &mut state, sample.y, sample.u, &mut ());
            let before = all_bits(&state.levels.levels);
            if sample.y.is_finite() {
                let still = gains(&design, T::zero());
                stream.update(&still, &mut state, sample.y, sample.u, &mut ());
                stream.update(&still, &mut state, T::NAN, sample.u, &mut ());
                stream.update(&still, &mut state, sample.y, sample.u, &mut ());
            }
            assert_eq!(all_bits(&state.levels.levels), before, "{}", kind.name);
        }
    }
}

#[test]
fn a_repeated_sample_changes_nothing() {
    every_filter::<f64>(2.0, 0.5, &mut RepeatsInNoTime);
    every_filter::<f32>(2.0, 0.5, &mut RepeatsInNoTime);
}

// -------------------------------------------------------------------------------------------------------- poles after a gap

/// The error's transition over a gap, `y` and `u` zero, probed level by level: the filter is linear.
fn probe<D: Discretise<f64, N>, const N: usize>(
    stream: &Stream<f64, D>,
    steps: &[f64],
) -> SMatrix<f64, N, N> {
    SMatrix::from_columns(&core::array::from_fn::<_, N, _>(|column| {
        let mut levels = [0.0; N];
        levels[column] = 1.0;
        let mut state = StreamState::from_levels(levels);
        for (n, dt) in steps.iter().enumerate() {
            let y = if n + 1 == steps.len() { 0.0 } else { NAN };
            stream.update(&gains(stream.design(), *dt), &mut state, y, 0.0, &mut ());
        }
        state.levels.levels.into()
    }))
}

fn backward(pole: Complex<f64>, tau: f64) -> Complex<f64> {
    Complex::new(1.0, 0.0) / (Complex::new(1.0, 0.0) - pole * tau)
}

/// One step, a gap of even steps, of uneven ones.
const GAPS: [&[f64]; 4] =
    [&[0.02], &[0.02, 0.02], &[0.01; 20], &[0.01, 0.2, 0.003, 0.05, 0.0, 0.001, 0.07]];

fn assert_poles_after_gaps<D: Discretise<f64, N>, const N: usize>(
    design: D,
    poles: [Complex<f64>; N],
    discrete: fn(Complex<f64>, f64) -> Complex<f64>,
    cap: Option<f64>,
) {
    let stream = Stream::new(design);
    let stream = cap.map_or(stream, |cap| stream.gap_cap(cap).expect("a cap"));
    for steps in GAPS {
        let elapsed = steps.iter().sum::<f64>().min(cap.unwrap_or(f64::MAX));
        let wanted = polynomial(poles.map(|pole| discrete(pole, elapsed)));
        for (found, wanted) in characteristic(&probe(&stream, steps)).into_iter().zip(wanted) {
            close(found, wanted, 1e-11);
        }
    }
}

fn all_poles_after_gaps(cap: Option<f64>) {
    let chain = first_order(3.0);
    assert_poles_after_gaps(chain, chain.poles(), backward, cap);
    let chain = pi(3.0, 0.3);
    assert_poles_after_gaps(chain, chain.poles(), backward, cap);
    let chain = second_order_inertial(3.0);
    assert_poles_after_gaps(chain, chain.poles(), backward, cap);
    let chain = third_order_butterworth(3.0);
    assert_poles_after_gaps(chain, chain.poles(), backward, cap);
    let chain = fourth_order_chain(3.0);
    assert_poles_after_gaps(chain, fourth_order_poles(3.0), backward, cap);
    let chain = butterworth::<f64, 6>(3.0).chain();
    assert_poles_after_gaps(chain, chain.poles(), backward, cap);
}

#[test]
fn the_poles_after_a_gap_are_those_of_its_length() {
    all_poles_after_gaps(None);
}

#[test]
fn a_cap_limits_what_one_measurement_counts() {
    all_poles_after_gaps(Some(0.03));
    all_poles_after_gaps(Some(0.015));
}

#[test]
fn matched_poles_after_a_gap() {
    let exact = |pole: Complex<f64>, tau: f64| exp(pole * tau);
    let chain = pi(3.0, 0.3);
    assert_poles_after_gaps(chain.matched(), chain.poles(), exact, None);
    let chain = third_order(3.0);
    assert_poles_after_gaps(chain.matched(), chain.poles(), exact, None);
    let chain = butterworth::<f64, 4>(3.0).chain();
    assert_poles_after_gaps(chain.matched(), chain.poles(), exact, None);
}

/// A split after a gap is one long step, a cap or none.
#[test]
fn a_split_takes_a_gap_as_one_step() {
    for degree in 1..=4 {
        let design = split::<f64, 4>(3.0, degree);
        assert_poles_after_gaps(design, design.poles(), backward, None);
        for steps in GAPS {
            let long = probe(&Stream::new(design), &[steps.iter().sum()]);
            assert!((probe(&Stream::new(design), steps) - long).amax() < 1e-13);
        }
    }
}

/// What the input adds during a gap is kept in full, whatever the split.
#[test]
fn a_split_integrates_during_a_gap() {
    let design = split::<f64, 3>(3.0, 2);
    for input in [Input::Sample, Input::Trapezoid] {
        let stream = Stream::new(design).input(input);
        let mut state = StreamState::from_levels([0.1, 0.0, 0.0]);
        for n in 1..=20 {
            stream.update(&gains(&design, 0.01), &mut state, NAN, 2.0, &mut ());
            close(state.level0(), 0.1 + 0.02 * f64::from(n), 1e-15);
        }
    }
}

/// The cap holds for a single long step of every filter, and what it leaves of the gain is that of a step as long as itself.
#[test]
fn a_cap_holds_for_a_single_step_too() {
    for degree in 1..=2 {
        let design = split::<f64, 2>(3.0, degree);
        let stream = Stream::new(design).gap_cap(0.03).expect("a cap");
        let wanted = *gains(&design, 0.03).correction();
        for input in [Input::Sample, Input::Trapezoid] {
            let mut state = StreamState::from_levels([0.0; 2]);
            let long = gains(&design, 0.5);
            stream.input(input).update(&long, &mut state, 1.0, 0.0, &mut ());
            assert_eq!(all_bits(&state.levels.levels), all_bits(&wanted), "{input:?}");
        }
    }
}

/// Placed poles, N = 3: with `h` the sum of `T τ` over the gap, `L_2` grows by `L_3 (τ² - h)/τ`.
#[test]
fn third_order_after_a_gap_in_closed_form() {
    let chain = Chain::<f64, 3, 3>::new(*third_order::<f64>(3.0).coefficients()).expect("stable");
    for steps in &GAPS[1..] {
        let (mut tau, mut h) = (0.0, 0.0);
        for dt in *steps {
            tau += dt;
            h += dt * tau;
        }
        let mut wanted = *gains(&chain, tau).correction();
        wanted[1] += wanted[2] * (tau * tau - h) / tau;
        let mut state = StreamState::from_levels([0.0; 3]);
        let stream = Stream::new(chain);
        for (n, dt) in steps.iter().enumerate() {
            let y = if n + 1 == steps.len() { 1.0 } else { NAN };
            stream.update(&gains(&chain, *dt), &mut state, y, 0.0, &mut ());
        }
        for (found, wanted) in state.levels.levels.iter().zip(wanted) {
            close(*found, wanted, 1e-11 * wanted.abs().max(1.0));
        }
    }
}

/// Up to order 2 the gains of one step as long as the gap are right.
#[test]
fn up_to_second_order_a_gap_is_one_long_step() {
    let chain = pi(3.0, 0.3);
    let stream = Stream::new(chain);
    let mut state = StreamState::from_levels([0.0; 2]);
    for n in 0..25 {
        let y = if n == 24 { 1.0 } else { NAN };
        stream.update(&gains(&chain, 0.01), &mut state, y, 0.0, &mut ());
    }
    for (found, wanted) in state.levels.levels.iter().zip(gains(&chain, 0.25).correction()) {
        close(*found, *wanted, 1e-13);
    }
}

/// A measurement every `P` samples: stable where the gains of one sample are not.
#[test]
fn rare_measurements_stay_stable() {
    let chain = third_order(10.0);
    let (step, stream) = (gains(&chain, 0.01), Stream::new(chain));
    let (mut plain, mut placed) =
        (State::at_rest::<f64>(1.0), StreamState::from_levels([1.0, 0.0, 0.0]));
    let mut rare = 0.0f64;
    // k1 k2/k3 = 9 in seconds times rad/s; the gap is 2 s.
    for n in 1..=4000 {
        step.predict(&mut plain, 0.0);
        if n % 200 == 0 {
            let innovation = -plain.levels[0];
            step.correct(&mut plain, innovation);
        }
        let y = if n % 200 == 0 { 0.0 } else { NAN };
        stream.update(&step, &mut placed, y, 0.0, &mut ());
        if n % 200 == 0 && n > 3000 {
            rare = rare.max(placed.level0().abs());
        }
    }
    assert!(plain.levels[0].abs() > 1e3, "{}", plain.levels[0]);
    assert!(rare < 1e-3, "{rare}");
}

/// A gap so long that its powers overflow ends at the measurement.
struct EndlessGap;

impl<T: Real> Check<T> for EndlessGap {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let mut state = StreamState::from_levels([T::literal(0.1); N]);
        let long = T::max_value().expect("a largest number") * T::literal(1e-6);
        for _ in 0..4 {
            stream.update(&gains(&design, long), &mut state, T::NAN, T::zero(), &mut ());
        }
        stream.update(&gains(&design, long), &mut state, T::literal(0.7), T::zero(), &mut ());
        assert!(state.level0().is_finite(), "{}", kind.name);
        for sample in common::noisy_samples::<T>(37, 400, 0.02) {
            stream.update(
                &gains(&design, sample.dt),
                &mut state,
                T::literal(0.7),
                T::zero(),
                &mut (),
            );
        }
        assert!(state.levels.levels.iter().all(ComplexField::is_finite), "{}", kind.name);
    }
}

#[test]
fn an_endless_gap_is_survived() {
    backward_euler_filters::<f64>(2.0, 0.5, &mut EndlessGap);
    backward_euler_filters::<f32>(2.0, 0.5, &mut EndlessGap);
}

/// The error after many random gaps, of a start that is off by 1; `share` of the measurements are missing.
fn error_after_gaps<const N: usize>(omega_dt: f64, share: f64) -> f64 {
    let stream = Stream::new(butterworth::<f64, N>(omega_dt).chain());
    let gains = stream.design().at(1.0).expect("gains");
    let mut state = StreamState::from_levels([0.0; N]);
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    for _ in 0..4000 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        #[allow(clippy::cast_precision_loss)]
        let missing = (random >> 11) as f64 / (1_u64 << 53) as f64 <= share;
        stream.update(&gains, &mut state, if missing { f64::NAN } else { 1.0 }, 0.0, &mut ());
    }
    (state.level0() - 1.0).abs()
}

/// However coarse the samples are and however many are missing: poles placed gap by gap would not promise that.
#[test]
fn random_gaps_do_not_make_high_orders_unstable() {
    for omega_dt in [0.05, 0.5, 3.0, 10.0, 30.0] {
        for share in [0.5, 0.8] {
            assert!(error_after_gaps::<4>(omega_dt, share) < 1e-9, "order 4, {omega_dt}, {share}");
            assert!(error_after_gaps::<5>(omega_dt, share) < 1e-9, "order 5, {omega_dt}, {share}");
            assert!(error_after_gaps::<6>(omega_dt, share) < 1e-9, "order 6, {omega_dt}, {share}");
        }
    }
}

/// The growth of the error over a cycle of gaps, at 100 Hz: each gap is so many predictions, then one measurement.
fn error_after_cycles<D: Discretise<f64, N>, const N: usize>(design: D, gaps: &[usize]) -> f64 {
    let stream = Stream::new(design);
    let gains = design.at(0.01).expect("gains");
    let mut state = StreamState::from_levels([0.0; N]);
    for gap in gaps.iter().cycle().take(60 * gaps.len()) {
        for _ in 1..*gap {
            stream.update(&gains, &mut state, f64::NAN, 0.0, &mut ());
        }
        stream.update(&gains, &mut state, 1.0, 0.0, &mut ());
    }
    (state.level0() - 1.0).abs()
}

/// Short gaps and very long ones by turns: placed poles grow by 1.6 to 4 a cycle here.
#[test]
fn gaps_of_different_length_do_not_make_filters_unstable() {
    for gaps in [&[100, 2000][..], &[20, 20, 20, 20, 3000], &[1, 500]] {
        assert!(error_after_cycles(pi(2.0, 0.7), gaps) < 1e-6, "pi, {gaps:?}");
        assert!(
            error_after_cycles(butterworth::<f64, 3>(2.0).chain(), gaps) < 1e-6,
            "order 3, {gaps:?}"
        );
        assert!(
            error_after_cycles(butterworth::<f64, 6>(2.0).chain(), gaps) < 1e-6,
            "order 6, {gaps:?}"
        );
        assert!(error_after_cycles(third_order(2.0), gaps) < 1e-6, "third order, {gaps:?}");
        assert!(error_after_cycles(split::<f64, 4>(2.0, 1), gaps) < 1e-6, "split, {gaps:?}");
    }
}
