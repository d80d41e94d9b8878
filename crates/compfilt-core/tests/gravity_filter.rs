//! The plain gravity filter: the linear filter in the frame that the gyro turns, its start, its gaps, and when a body rests.

use compfilt_core::attitude::{GravityFilter, GravityState, RestRule, Rotation};
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::{UnitQuaternion, Vector3};
use compfilt_core::{Butterworth, Chain, Discretise, Dt, Recurrence, Split, State};
use proptest::prelude::{ProptestConfig, Strategy};
use proptest::{prop_assert, prop_assert_eq, proptest};

const DT: f64 = 0.01;
const DEGREE: f64 = core::f64::consts::PI / 180.0;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn split<const N: usize>(omega0: f64, split: usize) -> Split<f64, N> {
    Butterworth::<f64, N>::new(omega0).unwrap().chain().split(split).unwrap()
}

fn second_order() -> GravityFilter<f64, 2> {
    GravityFilter::second_order(3.0, 0.5).unwrap()
}

/// Reproducible numbers that do not repeat.
fn wave(n: u32, size: f64) -> Vector3<f64> {
    let phase = f64::from(n) * 0.1;
    Vector3::new((1.3 * phase).sin(), (0.7 * phase + 1.0).sin(), (2.1 * phase + 2.0).sin()) * size
}

/// A start that is no start: the filter is as it will always be.
fn begun<const N: usize>(up: &Vector3<f64>) -> GravityState<f64, N> {
    GravityState::from_rotation(Rotation::from_up(up))
}

// ----------------------------------------------------------------------------------------------- the linear filter

fn is_the_linear_filter<const N: usize>(degree: usize) {
    let design = split::<N>(0.7, degree);
    let filter = GravityFilter::new(design).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = begun::<N>(&Vector3::new(0.6, 0.0, 0.8));
    let mut linear =
        [0, 1, 2].map(|axis| State { levels: state.levels.levels.map(|level| level[axis]) });
    for n in 0..500 {
        let force = Vector3::new(0.0, 1.0, 9.0) + wave(n, 3.0);
        // Every fifth is missing, and the next counts for both.
        let there = n % 5 != 3;
        let read = if there { force } else { Vector3::zeros() };
        filter.update(&gains, &mut state, &Vector3::zeros(), &read, None);
        let after_two = design.gains(Dt::new(DT + DT).unwrap());
        let own = if n % 5 == 4 { after_two } else { gains };
        for (axis, linear) in linear.iter_mut().enumerate() {
            if there {
                own.step(linear, force[axis], 0.0);
            }
            for (level, vector) in linear.levels.iter().zip(&state.levels.levels) {
                assert_eq!(
                    level.to_bits(),
                    vector[axis].to_bits(),
                    "order {N}, split {degree}, sample {n}"
                );
            }
        }
    }
    // It rested the whole time without a bias: nothing turned.
    assert_eq!(state.rest.bias, Vector3::zeros());
}

#[test]
fn in_a_frame_that_does_not_turn_it_is_the_linear_filter() {
    is_the_linear_filter::<1>(1);
    for degree in 1..=2 {
        is_the_linear_filter::<2>(degree);
    }
    for degree in 1..=3 {
        is_the_linear_filter::<3>(degree);
    }
    for degree in 1..=4 {
        is_the_linear_filter::<4>(degree);
    }
    is_the_linear_filter::<5>(2);
    is_the_linear_filter::<6>(1);
    is_the_linear_filter::<6>(6);
}

/// A body that only turns, by an exact rotation in each step.
fn reproduces_turns<const N: usize>(
    degree: usize,
    start: &Vector3<f64>,
    turns: &[Vector3<f64>],
    started: bool,
) -> f64 {
    let filter = GravityFilter::new(split::<N>(2.0, degree)).unwrap();
    let gains = filter.at(DT).unwrap();
    let gravity = Vector3::new(0.0, 0.0, 9.81);
    let mut truth = UnitQuaternion::from_scaled_axis(*start);
    let mut state = GravityState::new();
    if started {
        filter.update(
            &gains,
            &mut state,
            &Vector3::zeros(),
            &truth.inverse_transform_vector(&gravity),
            None,
        );
    }
    let mut worst = 0.0_f64;
    for (n, turn) in turns.iter().enumerate() {
        truth *= UnitQuaternion::from_scaled_axis(*turn);
        let force = truth.inverse_transform_vector(&gravity);
        let read = if n % 7 == 2 { Vector3::from_element(f64::NAN) } else { force };
        filter.update(&gains, &mut state, &(turn / DT), &read, None);
        worst = worst.max((state.levels.levels[0] - force).norm());
        worst = worst.max((state.up().unwrap() - force / 9.81).norm());
        worst = worst.max((state.rotation.up() - force / 9.81).norm());
        // The others rest at zero. Rounding grows in them with the speed at the start, 2/DT.
        let mut growth = 1.0;
        for level in &state.levels.levels[1..] {
            growth *= 2.0 / DT;
            worst = worst.max(level.norm() / growth);
        }
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_body_that_only_turns_is_reproduced(
        start in vector(3.0), axis in vector(2.0), spread in vector(0.5), started in proptest::bool::ANY
    ) {
        // The turns' series are good to 4e-12 each. Low-pass and high-pass add up to one in the turned frame, whatever the turns and the missing samples.
        let turns: Vec<_> = (0..150).map(|n| axis + wave(n, 1.0).component_mul(&spread)).collect();
        prop_assert!(reproduces_turns::<1>(1, &start, &turns, started) < 1e-8);
        prop_assert!(reproduces_turns::<2>(1, &start, &turns, started) < 1e-8);
        prop_assert!(reproduces_turns::<3>(2, &start, &turns, started) < 1e-8);
        prop_assert!(reproduces_turns::<4>(4, &start, &turns, started) < 1e-8);
        prop_assert!(reproduces_turns::<6>(1, &start, &turns, started) < 1e-8);
    }

    #[test]
    fn turns_of_the_body_change_nothing(body in vector(3.0), rate in vector(3.0), size in 0.0..20.0) {
        let filter = GravityFilter::new(split::<3>(0.5, 1)).unwrap().delay(0.004).unwrap();
        let gains = filter.at(DT).unwrap();
        let mounted = Rotation::of_turn(&body);
        let (mut state, mut other) = (GravityState::new(), GravityState::new());
        for n in 0..300 {
            let rate = rate + wave(3 * n, 2.0);
            let force = Vector3::new(1.0, -2.0, 9.0) + wave(n, size);
            filter.update(&gains, &mut state, &rate, &force, None);
            filter.update(&gains, &mut other, &mounted.to_body(&rate), &mounted.to_body(&force), None);
            for (one, turned) in state.levels.levels.iter().zip(&other.levels.levels) {
                prop_assert!((mounted.to_body(one) - turned).norm() < 1e-9);
            }
        }
        prop_assert!((mounted.to_body(&state.up().unwrap()) - other.up().unwrap()).norm() < 1e-10);
    }

    #[test]
    fn lengths_of_forces_scale_the_levels(size in -8_i32..8, rate in vector(3.0)) {
        // Exactly, by powers of two: nothing is normalised but the output.
        let filter = second_order().rest(RestRule::default().time(1e9).unwrap());
        let gains = filter.at(DT).unwrap();
        let (mut state, mut other) = (GravityState::new(), GravityState::new());
        let factor = f64::from(size).exp2();
        for n in 0..100 {
            let force = Vector3::new(0.0, 1.0, 9.0) + wave(n, 4.0);
            filter.update(&gains, &mut state, &rate, &force, None);
            filter.update(&gains, &mut other, &rate, &(force * factor), None);
            prop_assert_eq!(state.levels.levels.map(|level| level * factor), other.levels.levels);
            prop_assert_eq!(state.up(), other.up());
        }
    }
}

// ------------------------------------------------------------------------------------------------------- the start

/// `(s + speed)^N`, from the second coefficient on.
fn critical<const N: usize>(speed: f64) -> [f64; N] {
    let mut coefficients = [0.0; N];
    for _ in 0..N {
        let before = coefficients;
        for i in 0..N {
            coefficients[i] += speed * if i == 0 { 1.0 } else { before[i - 1] };
        }
    }
    coefficients
}

/// The design at the time `age`: the larger of each coefficient.
fn at_age<const N: usize>(design: &Split<f64, N>, age: f64) -> Split<f64, N> {
    let mut coefficients = *design.coefficients();
    for (own, fast) in coefficients.iter_mut().zip(critical::<N>(2.0 / age)) {
        *own = own.max(fast);
    }
    Chain::<f64, N, 1>::new(coefficients).unwrap().split(design.split()).unwrap()
}

/// How long the start lasts: until 2/t is as slow as the slower of the poles' mean and their geometric mean.
fn start<const N: usize>(design: &Split<f64, N>) -> f64 {
    let order = i32::try_from(N).map(f64::from).unwrap();
    let [first, .., last] = design.coefficients().as_slice() else {
        return 2.0 / design.coefficients()[0];
    };
    2.0 / (first / order).min(last.powf(1.0 / order))
}

fn starts_fast<const N: usize>(degree: usize) {
    // No sum of steps makes a tie of both.
    let design = split::<N>(0.8137, degree);
    let filter = GravityFilter::new(design).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::<f64, N>::new();
    let mut expected = State { levels: [Vector3::zeros(); N] };
    for n in 0..1500 {
        let force = Vector3::new(0.0, 1.0, 9.0) + wave(n, 3.0);
        filter.update(&gains, &mut state, &Vector3::zeros(), &force, None);
        if n == 0 {
            expected.levels[0] = force;
        } else if (N > 2 || degree > 1) && DT * f64::from(n) < start(&design) {
            expected.levels[0] += (force - expected.levels[0]) / f64::from(n + 1);
        } else {
            let age = DT * f64::from(n);
            let now = if age < start(&design) { at_age(&design, age) } else { design };
            now.gains(Dt::new(DT).unwrap()).step(&mut expected, force, Vector3::zeros());
        }
        for (level, expected) in state.levels.levels.iter().zip(&expected.levels) {
            assert!(
                (level - expected).norm() < 1e-9 * (1.0 + expected.norm()),
                "order {N}, sample {n}"
            );
        }
    }
}

#[test]
fn at_the_start_the_memory_is_the_time_since_then() {
    starts_fast::<1>(1);
    starts_fast::<2>(1);
    starts_fast::<2>(2);
    starts_fast::<3>(1);
    starts_fast::<4>(1);
    starts_fast::<5>(2);
    starts_fast::<6>(1);
}

fn forgets_the_first_sample<const N: usize>(degree: usize) {
    let filter = GravityFilter::new(split::<N>(0.01, degree)).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::<f64, N>::new();
    let off = |state: &GravityState<f64, N>| state.up().unwrap().x;
    filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(5.0, 0.0, 8.0), None);
    for n in 1..=400 {
        filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81), None);
        assert!(n < 200 || off(&state).abs() < 0.01, "order {N}, sample {n}: {}", off(&state));
    }
}

#[test]
fn a_slow_filter_forgets_a_wrong_first_sample() {
    // A memory of minutes, a first sample that is 32 degrees off, and two seconds.
    forgets_the_first_sample::<1>(1);
    forgets_the_first_sample::<2>(1);
    forgets_the_first_sample::<3>(1);
    forgets_the_first_sample::<4>(1);
    forgets_the_first_sample::<5>(1);
    forgets_the_first_sample::<6>(1);
    forgets_the_first_sample::<2>(2);
    forgets_the_first_sample::<6>(6);
}

fn worst_in_noise<const N: usize>() -> f64 {
    let filter = GravityFilter::new(split::<N>(0.47, 1)).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::<f64, N>::new();
    let mut worst = 0.0_f64;
    for n in 0..1000 {
        let force = Vector3::z() * 9.81 + wave(97 * n, 0.1);
        filter.update(&gains, &mut state, &Vector3::zeros(), &force, None);
        worst = worst.max((state.up().unwrap() - Vector3::z()).norm());
    }
    worst
}

#[test]
fn a_start_in_noise_is_never_worse_than_the_noise() {
    // Fast gains that change with time can make a stable filter grow: not here.
    let worst = [
        worst_in_noise::<1>(),
        worst_in_noise::<2>(),
        worst_in_noise::<3>(),
        worst_in_noise::<4>(),
        worst_in_noise::<5>(),
        worst_in_noise::<6>(),
    ];
    assert!(worst.iter().all(|worst| *worst < 0.05), "{worst:?}");
}

#[test]
fn a_known_attitude_is_no_start() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let mut state = begun::<2>(&Vector3::z());
    filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(5.0, 0.0, 8.0), None);
    assert!(state.up().unwrap().x < 1e-3);
}

// ------------------------------------------------------------------------------------------------- missing samples

#[test]
fn a_correction_counts_for_a_tenth_of_a_second_at_most() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let force = Vector3::new(3.0, 0.0, 9.0);
    for (missing, counted) in [(3, 0.04), (9, 0.1), (50, 0.1), (90, 0.1)] {
        let mut state = begun::<2>(&Vector3::z());
        let mut expected = state.levels;
        for _ in 0..missing {
            let flags =
                filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::zeros(), None);
            assert_eq!(flags, Flags::MEASUREMENT_MISSING);
            assert_eq!(state.levels, expected);
        }
        filter.update(&gains, &mut state, &Vector3::zeros(), &force, None);
        let own = filter.design().gains(Dt::new(counted).unwrap());
        own.step(&mut expected, force, Vector3::zeros());
        for (level, expected) in state.levels.levels.iter().zip(&expected.levels) {
            assert!((level - expected).norm() < 1e-12, "{missing}");
        }
    }
}

#[test]
fn a_long_gap_starts_anew_and_keeps_bias_and_heading() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::new();
    let bias = Vector3::new(0.01, -0.02, 0.005);
    let force = Vector3::new(0.0, 6.0, 8.0);
    for _ in 0..300 {
        filter.update(&gains, &mut state, &bias, &force, None);
    }
    assert!(state.resting && (state.rest.bias - bias).norm() < 1e-12);
    let short = filter.at(0.9).unwrap();
    let mut other = state;
    let flags = filter.update(&short, &mut other, &bias, &force, None);
    assert_eq!(flags, Flags::default());
    let before = state;
    let long = filter.at(1.1).unwrap();
    let later = Vector3::new(9.0, 0.0, 1.0);
    let flags = filter.update(&long, &mut state, &(bias * 1.5), &later, None);
    assert_eq!(flags, Flags::RESTARTED);
    assert_eq!(state.levels.levels, [later, Vector3::zeros()]);
    assert_eq!((state.age, state.rest.bias), (0.0, before.rest.bias));
    assert!(!state.resting);
    // What was not seen was no rest: it takes its time again.
    for n in 1..=400 {
        filter.update(&gains, &mut state, &(bias * 1.5), &later, None);
        assert!(n > 145 || !state.resting, "sample {n}");
        assert!((state.rest.bias - bias * 1.5).norm() <= (bias * 0.5).norm() + 1e-12);
    }
    assert!(state.resting);
    // Without a measurement it is not started, and says so.
    let flags = filter.update(&long, &mut state, &bias, &Vector3::zeros(), None);
    assert_eq!(flags, Flags::MEASUREMENT_MISSING | Flags::RESTARTED | Flags::NOT_STARTED);
    assert_eq!((state.up(), filter.attitude(&state)), (None, None));
}

#[test]
fn a_missing_gyro_is_held_and_then_stands_still() {
    let filter = second_order().hold(0.105).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = begun::<2>(&Vector3::z());
    let rate = Vector3::new(1.0, 0.0, 0.0);
    filter.update(&gains, &mut state, &rate, &Vector3::zeros(), None);
    for n in 1..=20 {
        let nothing = Vector3::new(0.0, f64::NAN, 0.0);
        let flags = filter.update(&gains, &mut state, &nothing, &Vector3::zeros(), None);
        let held = if n <= 10 { Flags::DERIVATIVE_HELD } else { Flags::DERIVATIVE_MISSING };
        assert_eq!(flags, Flags::MEASUREMENT_MISSING | held, "{n}");
    }
    let turned = Rotation::of_turn(&(rate * (11.0 * DT)));
    assert!((state.up().unwrap() - turned.up()).norm() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_sample_is_missing_where_a_component_says_so(
        force in vector(45.0), gyro in vector(1.2e6), none in 0..9_usize, alone in 0..9_usize,
    ) {
        let filter = second_order().force_range(40.0).unwrap();
        let gains = filter.at(DT).unwrap();
        let mut state = begun::<2>(&Vector3::z());
        let mut force = force;
        if let Some(part) = force.as_mut_slice().get_mut(none) {
            *part = f64::NAN;
        }
        if alone < 3 {
            force = Vector3::from_fn(|i, _| if i == alone { force[i] } else { 0.0 });
        }
        let flags = filter.update(&gains, &mut state, &gyro, &force, None);
        let clipped = !force.iter().all(|part| part.abs() < 40.0);
        prop_assert_eq!(flags.contains(Flags::MEASUREMENT_MISSING), clipped);
        let too_fast = gyro.iter().any(|part| part.abs() >= 1e6);
        prop_assert_eq!(flags.contains(Flags::DERIVATIVE_HELD), too_fast);
    }
}

#[test]
fn bad_samples_coast_and_are_flagged() {
    let filter = second_order().force_range(40.0).unwrap();
    let gains = filter.at(DT).unwrap();
    let mut state = begun::<2>(&Vector3::z());
    let rate = Vector3::new(1.0, 0.0, 0.0);
    for (n, force) in [
        Vector3::zeros(),
        Vector3::new(0.0, f64::NAN, 9.81),
        Vector3::new(f64::NEG_INFINITY, 0.0, 0.0),
        Vector3::new(0.0, 40.0, 0.0),
        Vector3::new(0.0, 0.0, -1e300),
    ]
    .iter()
    .enumerate()
    {
        let flags = filter.update(&gains, &mut state, &rate, force, None);
        assert_eq!(flags, Flags::MEASUREMENT_MISSING, "{n}");
    }
    let turned = Rotation::of_turn(&(rate * (5.0 * DT)));
    assert!((state.up().unwrap() - turned.up()).norm() < 1e-12);
    // Without a range a huge force overflows the levels: the filter begins anew and is well at once.
    let filter = second_order();
    for force in [Vector3::new(0.0, 0.0, 1e308), Vector3::new(0.0, -1.7e308, 0.0), Vector3::z()] {
        filter.update(&gains, &mut state, &Vector3::repeat(1e300), &force, None);
    }
    let fresh = Vector3::new(0.0, 6.0, 8.0);
    for _ in 0..3000 {
        filter.update(&gains, &mut state, &Vector3::zeros(), &fresh, None);
    }
    assert!(state.rotation.is_finite());
}

#[test]
fn no_time_changes_nothing() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let none = filter.design().gains(Dt::new(0.0).unwrap());
    let mut state = GravityState::new();
    for n in 0..200 {
        filter.update(
            &gains,
            &mut state,
            &wave(n, 1.0),
            &(wave(n, 3.0) + Vector3::z() * 9.81),
            None,
        );
    }
    let before = state;
    let flags = filter.update(&none, &mut state, &wave(1, 1.0), &wave(1, 5.0), None);
    assert_eq!(flags, Flags::default());
    assert_eq!(state.levels, before.levels);
    assert!((state.rotation.v - before.rotation.v).norm() < 1e-15);
}

// ------------------------------------------------------------------------------------------------------------ rest

/// The first sample that rests, if one does, of sensors that read this.
fn first_rest(
    filter: &GravityFilter<f64, 2>,
    dt: f64,
    samples: u32,
    read: impl Fn(u32) -> (Vector3<f64>, Vector3<f64>),
) -> (Option<u32>, GravityState<f64, 2>) {
    let gains = filter.at(dt).unwrap();
    let mut state = GravityState::new();
    let mut first = None;
    for n in 0..samples {
        let (gyro, force) = read(n);
        filter.update(&gains, &mut state, &gyro, &force, None);
        if state.resting && first.is_none() {
            first = Some(n);
        }
    }
    (first, state)
}

fn up() -> Vector3<f64> {
    Vector3::new(0.0, 6.0, 8.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn a_still_body_rests_after_the_rest_time(bias in vector(0.034), dt in 0.001..0.1, time in 0.2..4.0) {
        let filter = second_order().rest(RestRule::default().time(time).unwrap());
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few thousand at most.
        let needed = f64::ceil(time / dt) as u32;
        let (first, state) = first_rest(&filter, dt, needed + 200, |_| (bias, up()));
        let first = first.unwrap();
        prop_assert!(first + 2 >= needed && first <= needed + 1, "{first} {needed}");
        prop_assert!((state.rest.bias - bias).norm() < 1e-12);
    }

    #[test]
    fn the_bias_is_the_mean_of_a_noisy_gyro(bias in vector(0.03), seed in 0_u32..1000) {
        let noise = |n: u32| wave(17 * (n + seed), 0.01);
        let (first, state) = first_rest(&second_order(), DT, 2000, |n| (bias + noise(n), up() + noise(n) * 10.0));
        prop_assert!(first.is_some());
        prop_assert!((state.rest.bias - bias).norm() < 0.002);
    }

    #[test]
    fn a_bias_beyond_the_limit_is_a_turn(axis in 0_usize..3, excess in 1.05..20.0, sign in proptest::bool::ANY) {
        let mut gyro = Vector3::repeat(0.01);
        gyro[axis] = 2.0 * DEGREE * excess * if sign { 1.0 } else { -1.0 };
        let (first, state) = first_rest(&second_order(), DT, 500, |_| (gyro, up()));
        prop_assert!(first.is_none() && state.rest.bias == Vector3::zeros());
        let wide = second_order().rest(RestRule::default().bias_limit(1.0).unwrap());
        prop_assert!(first_rest(&wide, DT, 500, |_| (gyro, up())).0.is_some());
    }

    #[test]
    fn a_slow_turn_about_a_horizontal_axis_is_no_rest(rate in 0.7..2.0, heading in -3.0..3.0_f64) {
        // It drifts by more than rest_drift in the time of a rest.
        let axis = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let turned = |n: u32| UnitQuaternion::from_scaled_axis(-axis * (rate * DEGREE * DT * f64::from(n)));
        let read = |n| (axis * (rate * DEGREE), turned(n) * Vector3::new(0.0, 0.0, 9.81));
        let (first, state) = first_rest(&second_order(), DT, 3000, read);
        prop_assert!(first.is_none() && state.rest.bias == Vector3::zeros());
    }

    #[test]
    fn shaking_and_twitching_are_no_rest(axis in vector(1.0), every in 2_u32..140) {
        let axis = axis.normalize();
        let pulse = move |n: u32, size: f64| if n.is_multiple_of(every) { axis * size } else { Vector3::zeros() };
        let twitching = |n| (pulse(n, 0.1), up());
        prop_assert!(first_rest(&second_order(), DT, 1000, twitching).0.is_none());
        let shaking = |n| (Vector3::zeros(), up() + pulse(n, 1.5));
        prop_assert!(first_rest(&second_order(), DT, 1000, shaking).0.is_none());
    }

    #[test]
    fn a_missing_sample_ends_a_rest(gyro in proptest::bool::ANY, every in 10_u32..148) {
        let nothing = Vector3::from_element(f64::NAN);
        let read = |n: u32| match (n % every == 5, gyro) {
            (true, true) => (nothing, up()),
            (true, false) => (Vector3::zeros(), nothing),
            _ => (Vector3::zeros(), up()),
        };
        prop_assert!(first_rest(&second_order(), DT, 1000, read).0.is_none());
    }
}

#[test]
fn the_first_bias_is_a_mean_and_later_ones_move() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::new();
    let (one, other) = (Vector3::repeat(0.01), Vector3::repeat(0.02));
    for _ in 0..1000 {
        filter.update(&gains, &mut state, &one, &up(), None);
    }
    assert!((state.rest.bias - one).norm() < 1e-12);
    // A memory of 2 s, of a gyro that is low-passed with 0.5 s.
    for _ in 0..200 {
        filter.update(&gains, &mut state, &other, &up(), None);
    }
    let part = (state.rest.bias.x - 0.01) / 0.01;
    // 1 - (2 exp(-t/2) - 0.5 exp(-t/0.5))/1.5 at t = 2
    let expected = 1.0 - (2.0 * (-1.0_f64).exp() - 0.5 * (-4.0_f64).exp()) / 1.5;
    assert!((part - expected).abs() < 0.01, "{part} {expected}");
    assert!(state.resting);
}

#[test]
fn the_bias_counts_from_the_next_sample_on() {
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::new();
    let gyro = Vector3::new(0.01, 0.0, 0.0);
    for _ in 0..600 {
        filter.update(&gains, &mut state, &gyro, &Vector3::new(0.0, 0.0, 9.81), None);
    }
    assert!((state.up().unwrap() - Vector3::z()).norm() < 1e-3);
    // Left alone it stands still.
    let before = state.rotation;
    for _ in 0..1000 {
        filter.update(&gains, &mut state, &gyro, &Vector3::zeros(), None);
    }
    assert!((state.rotation.v - before.v).norm() < 1e-9);
}

// -------------------------------------------------------------------------------------------------- delay, advance

#[test]
fn the_delay_moves_the_force_ahead() {
    // One sample with a filter that is nothing but its last measurement.
    let rate = Vector3::new(0.5, -1.0, 2.0);
    let force = Vector3::new(1.0, 2.0, 9.0);
    for delay in [-0.02, 0.0, 0.005] {
        let filter = GravityFilter::new(split::<1>(1e9, 1)).unwrap().delay(delay).unwrap();
        let gains = filter.at(DT).unwrap();
        let mut state = begun::<1>(&Vector3::z());
        filter.update(&gains, &mut state, &rate, &force, None);
        let expected = force - rate.cross(&force) * delay;
        assert!((state.levels.levels[0] - expected).norm() < 1e-5);
    }
}

#[test]
fn a_late_accelerometer_is_put_right() {
    let rate = Vector3::new(1.0, 0.0, 0.0);
    let late = 0.02;
    let error = |delay: f64| {
        let filter = second_order().delay(delay).unwrap();
        let gains = filter.at(DT).unwrap();
        let mut state = GravityState::new();
        let mut truth = Rotation::identity();
        for n in 0..2000 {
            truth = Rotation::of_turn(&(rate * (DT * f64::from(n))));
            let then = Rotation::of_turn(&(rate * (DT * f64::from(n) - late)));
            filter.update(&gains, &mut state, &rate, &(then.up() * 9.81), None);
        }
        (state.up().unwrap() - truth.up()).norm()
    };
    assert!((error(0.0) - late).abs() < 1e-4);
    assert!(error(late) < 0.6 * late * late);
    assert!((error(-late) - 2.0 * late).abs() < 1e-3);
}

#[test]
fn the_advance_turns_the_output_only() {
    let rate = Vector3::new(0.3, 1.0, -0.4);
    let (filter, ahead) = (second_order(), second_order().advance(0.05).unwrap());
    let gains = filter.at(DT).unwrap();
    let (mut state, mut other) = (GravityState::new(), GravityState::new());
    for n in 0..300 {
        let rate = rate + wave(n, 0.5);
        let force = Vector3::z() * 9.81 + wave(n, 1.0);
        filter.update(&gains, &mut state, &rate, &force, None);
        ahead.update(&gains, &mut other, &rate, &force, None);
        assert_eq!(state, other);
        let (rotation, up) = ahead.attitude(&other).unwrap();
        let turn = Rotation::of_turn(&(rate * 0.05));
        assert!((rotation.v - state.rotation.turned(&(rate * 0.05)).v).norm() < 1e-12);
        assert!((up - turn.to_body(&state.up().unwrap())).norm() < 1e-12);
        assert!((rotation.up() - up).norm() < 1e-12);
    }
}

// ----------------------------------------------------------------------------------------------------------- state

#[test]
fn a_state_is_a_value() {
    fn is_copy<T: Copy>(_: &T) {}
    let filter = second_order();
    let gains = filter.at(DT).unwrap();
    let mut state = GravityState::new();
    is_copy(&state);
    for n in 0..300 {
        filter.update(&gains, &mut state, &wave(n, 1.0), &(up() + wave(n, 2.0)), None);
    }
    let kept = state;
    let mut copy = state;
    for n in 300..600 {
        filter.update(&gains, &mut state, &wave(n, 1.0), &(up() + wave(n, 2.0)), None);
    }
    for n in 300..600 {
        filter.update(&gains, &mut copy, &wave(n, 1.0), &(up() + wave(n, 2.0)), None);
    }
    assert_eq!(state, copy);
    assert!(kept != copy);
}

#[test]
fn single_precision_lasts_a_million_samples() {
    let filter = GravityFilter::<f32, 2>::second_order(3.0, 0.5).unwrap();
    let gains = filter.at(0.001).unwrap();
    let (mut state, mut truth) = (GravityState::new(), UnitQuaternion::<f64>::identity());
    let mut worst = 0.0_f64;
    for n in 0..1_000_000_u32 {
        let phase = f64::from(n) * 1e-3;
        let rate =
            Vector3::new((1.3 * phase).sin(), (0.7 * phase).cos(), (0.9 * phase).sin()) * 2.0;
        let single = rate.cast::<f32>();
        truth *= UnitQuaternion::from_scaled_axis(single.cast::<f64>() * 1e-3);
        if n % 100_000 == 0 {
            truth.renormalize();
        }
        let up = truth.inverse_transform_vector(&Vector3::z());
        filter.update(&gains, &mut state, &single, &(up * 9.81).cast(), None);
        worst = worst.max((state.up().unwrap().cast::<f64>() - up).norm());
    }
    let length = state.rotation.w.powi(2) + state.rotation.v.norm_squared();
    assert!((length - 1.0).abs() < 1e-6);
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn parameters_are_checked() {
    let bad = [f64::NAN, f64::INFINITY];
    for value in bad.into_iter().chain([0.0, -1.0]) {
        assert_eq!(
            GravityFilter::<f64, 2>::second_order(value, 0.5).unwrap_err().parameter(),
            "tau"
        );
        assert_eq!(
            GravityFilter::<f64, 2>::second_order(1.0, value).unwrap_err().parameter(),
            "zeta"
        );
        assert_eq!(second_order().force_range(value).unwrap_err().parameter(), "force_range");
        assert_eq!(RestRule::<f64>::default().time(value).unwrap_err().parameter(), "time");
        assert_eq!(RestRule::<f64>::default().drift(value).unwrap_err().parameter(), "drift");
    }
    for value in bad {
        assert_eq!(second_order().delay(value).unwrap_err().parameter(), "delay");
        assert_eq!(second_order().advance(value).unwrap_err().parameter(), "advance");
    }
    assert_eq!(second_order().hold(-0.1).unwrap_err().parameter(), "hold");
    assert!(second_order().hold(0.0).is_ok() && second_order().delay(-0.1).is_ok());
}
