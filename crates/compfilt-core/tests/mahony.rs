//! Mahony's filters: the linear loop for small errors, convergence from everywhere, and what happens to bad samples.

use compfilt_core::attitude::{Mahony, MahonyForm, MahonyState, Observation, Rotation};
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Chain, Discretise, Dt, FirstOrder, PiForm, Recurrence, State};
use proptest::prelude::{ProptestConfig, Strategy};
use proptest::{prop_assert, proptest};

const FORMS: [MahonyForm; 3] = [MahonyForm::Explicit, MahonyForm::Passive, MahonyForm::Direct];
const DT: f64 = 0.01;

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn pi() -> Chain<f64, 2, 1> {
    PiForm::new(1.0, 0.2).unwrap().chain()
}

/// The magnetic field of the world: north and down.
fn field() -> Vector3<f64> {
    Vector3::new(0.0, 20.0, -40.0)
}

/// What sensors at rest at the attitude `truth` read.
fn at_rest(truth: &Rotation<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (truth.to_body(&Vector3::new(0.0, 0.0, 9.81)), truth.to_body(&field()))
}

fn angle_between(one: &Rotation<f64>, other: &Rotation<f64>) -> f64 {
    2.0 * one.inverse().times(other).v.norm().min(1.0).asin()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn small_errors_obey_the_linear_filter(
        heading in vector(3.0), axis in vector(1.0), bias in vector(0.001), form in 0_usize..3
    ) {
        // About one axis the three forms are scalar loops; with a magnetometer the explicit form counts differently.
        let filter = Mahony::new(pi(), FORMS[form]);
        let gains = filter.design().at(DT).unwrap();
        let truth = Rotation::of_turn(&heading);
        // A horizontal axis: yaw is not observed.
        let axis = axis.cross(&truth.up()).normalize();
        let bias = bias.dot(&axis);
        let mut state = MahonyState::from_rotation(truth.turned(&(axis * 0.001)));
        let mut linear = State { levels: [0.001, 0.0] };
        let (force, _) = at_rest(&truth);
        for _ in 0..500 {
            filter.update(&gains, &mut state, &(axis * bias), &force, None);
            gains.predict(&mut linear, bias);
            let innovation = -linear.levels[0];
            gains.correct(&mut linear, innovation);
            let error = truth.inverse().times(&state.rotation).v * 2.0;
            prop_assert!((error - axis * linear.levels[0]).norm() < 1e-6 * 0.1);
            prop_assert!((state.bias + axis * linear.levels[1]).norm() < 1e-6);
        }
    }

    #[test]
    fn every_attitude_and_bias_is_found(
        truth in vector(3.0), start in vector(3.0), bias in vector(0.05), form in 0_usize..3
    ) {
        let filter = Mahony::new(pi(), FORMS[form]);
        let gains = filter.design().at(DT).unwrap();
        let mut truth = Rotation::of_turn(&truth);
        let mut state = MahonyState::from_rotation(Rotation::of_turn(&start));
        let rate = Vector3::new(0.1, -0.2, 0.3);
        for _ in 0..8_000 {
            truth = truth.turned(&(rate * DT));
            let (force, field) = at_rest(&truth);
            filter.update(&gains, &mut state, &(rate + bias), &force, Some(&field));
        }
        prop_assert!(angle_between(&state.rotation, &truth) < 1e-3);
        prop_assert!((state.bias - bias).norm() < 1e-3);
    }

    #[test]
    fn a_rotation_of_body_and_world_changes_nothing(
        body in vector(3.0), heading in -3.0..3.0, rates in vector(2.0), force in vector(10.0), form in 0_usize..3
    ) {
        let filter = Mahony::new(pi(), FORMS[form]);
        let gains = filter.design().at(DT).unwrap();
        let (mounted, turned) = (Rotation::of_turn(&body), Rotation::of_turn(&Vector3::new(0.0, 0.0, heading)));
        let start = Rotation::from_up(&Vector3::new(0.6, 0.0, 0.8));
        let mut state = MahonyState::from_rotation(start);
        let mut other = MahonyState::from_rotation(turned.times(&start).times(&mounted));
        for n in 0..100 {
            let phase = f64::from(n) * 0.1;
            let (rate, force) = (rates * phase.sin(), force + Vector3::new(0.0, phase.cos(), 10.0));
            filter.update(&gains, &mut state, &rate, &force, None);
            filter.update(&gains, &mut other, &mounted.to_body(&rate), &mounted.to_body(&force), None);
        }
        let expected = turned.times(&state.rotation).times(&mounted);
        prop_assert!(angle_between(&other.rotation, &expected) < 1e-10);
    }

    #[test]
    fn the_magnetometer_never_tilts(start in vector(3.0), fields in vector(50.0), form in 0_usize..3) {
        // What gravity says is what the estimate says: the field may then only turn it about the vertical.
        let filter = Mahony::new(pi(), FORMS[form]);
        let gains = filter.design().at(DT).unwrap();
        let mut state = MahonyState::from_rotation(Rotation::of_turn(&start));
        let up = state.rotation.up();
        for n in 0..50 {
            let field = fields + Vector3::new(f64::from(n), 0.0, 0.0);
            let still = state.bias;
            filter.update(&gains, &mut state, &still, &up, Some(&field));
            prop_assert!((state.rotation.up() - up).norm() < 1e-10);
        }
    }
}

#[test]
fn without_a_magnetometer_yaw_is_the_gyros() {
    for form in FORMS {
        let filter = Mahony::new(FirstOrder::new(1.0).unwrap().chain(), form);
        let gains = filter.design().at(DT).unwrap();
        let mut state = MahonyState::from_rotation(Rotation::identity());
        for _ in 0..100 {
            filter.update(&gains, &mut state, &Vector3::new(0.0, 0.0, 0.5), &Vector3::z(), None);
        }
        let turned = Rotation::of_turn(&Vector3::new(0.0, 0.0, 0.5));
        assert!(angle_between(&state.rotation, &turned) < 1e-10);
    }
}

#[test]
fn the_first_measurements_are_averaged() {
    // A filter with a memory of 100 s starts at a wrong first sample and is right within a second.
    let filter = Mahony::new(FirstOrder::new(100.0).unwrap().chain(), MahonyForm::Explicit);
    let gains = filter.design().at(DT).unwrap();
    let mut state = MahonyState::new();
    let flags = filter.update(
        &gains,
        &mut state,
        &Vector3::zeros(),
        &Vector3::from_element(f64::NAN),
        None,
    );
    assert_eq!(flags, Flags::NOT_STARTED | Flags::MEASUREMENT_MISSING);
    filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(5.0, 0.0, 8.0), None);
    for _ in 0..99 {
        filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::z(), None);
    }
    assert!(state.rotation.up().x < 0.011);
}

#[test]
fn bad_samples_coast_and_are_flagged() {
    let filter = Mahony::new(pi(), MahonyForm::Passive).force_range(40.0).unwrap();
    let gains = filter.design().at(DT).unwrap();
    let mut state = MahonyState::from_rotation(Rotation::identity());
    let rate = Vector3::new(1.0, 0.0, 0.0);
    let bad = [
        Vector3::zeros(),
        Vector3::new(0.0, f64::NAN, 9.81),
        Vector3::new(0.0, 0.0, f64::INFINITY),
        Vector3::new(-40.0, 0.0, 0.0),
    ];
    for force in bad {
        let flags = filter.update(&gains, &mut state, &rate, &force, Some(&Vector3::zeros()));
        assert_eq!(flags, Flags::MEASUREMENT_MISSING | Flags::MAGNETOMETER_MISSING);
    }
    assert!(angle_between(&state.rotation, &Rotation::of_turn(&(rate * DT * 4.0))) < 1e-12);
    // The gyro is held for 0.1 s, then counts as zero.
    let nothing = Vector3::from_element(f64::NAN);
    for n in 0..20 {
        let flags = filter.update(&gains, &mut state, &nothing, &nothing, None);
        let held = if n < 10 { Flags::DERIVATIVE_HELD } else { Flags::DERIVATIVE_MISSING };
        assert!(flags.contains(held | Flags::MEASUREMENT_MISSING), "{n}");
    }
    assert!(angle_between(&state.rotation, &Rotation::of_turn(&(rate * DT * 14.0))) < 1e-12);
}

#[test]
fn a_direction_opposite_to_the_estimate_is_flagged() {
    let filter = Mahony::new(pi(), MahonyForm::Explicit);
    let gains = filter.design().at(DT).unwrap();
    let mut state = MahonyState::from_rotation(Rotation::identity());
    let flags = filter.update(&gains, &mut state, &Vector3::zeros(), &-Vector3::z(), None);
    // The unstable equilibrium: the innovation vanishes.
    assert!(flags == Flags::AMBIGUOUS && state.rotation == Rotation::identity());
}

#[test]
fn after_a_gap_a_correction_counts_for_all_of_it() {
    let filter = Mahony::new(FirstOrder::new(1.0).unwrap().chain(), MahonyForm::Explicit);
    let design = *filter.design();
    let start = Rotation::of_turn(&Vector3::new(0.01, 0.0, 0.0));
    let (mut one, mut other) =
        (MahonyState::from_rotation(start), MahonyState::from_rotation(start));
    let nothing = Vector3::from_element(f64::NAN);
    for n in 0..50 {
        let force = if n == 49 { Vector3::z() } else { nothing };
        filter.update(&design.at(DT).unwrap(), &mut one, &Vector3::zeros(), &force, None);
    }
    let gains = design.gains(Dt::new(50.0 * DT).unwrap());
    filter.update(&gains, &mut other, &Vector3::zeros(), &Vector3::z(), None);
    assert!(angle_between(&one.rotation, &other.rotation) < 1e-12);
}

#[test]
fn any_number_of_directions() {
    let filter = Mahony::new(FirstOrder::new(1.0).unwrap().chain(), MahonyForm::Explicit);
    let gains = filter.design().at(DT).unwrap();
    let truth = Rotation::of_turn(&Vector3::new(1.0, -2.0, 0.5));
    let mut state = MahonyState::from_rotation(Rotation::identity());
    let stars =
        [Vector3::new(1.0, 0.2, 0.1), Vector3::new(0.0, 1.0, -0.3), Vector3::new(0.5, 0.5, 3.0)];
    for _ in 0..4_000 {
        let observed =
            stars.map(|world| Observation { body: truth.to_body(&world), world, weight: 0.7 });
        filter.update_with(&gains, &mut state, &Vector3::zeros(), &observed);
    }
    assert!(angle_between(&state.rotation, &truth) < 1e-6);
    let blind = [Observation { body: Vector3::zeros(), world: Vector3::z(), weight: 1.0 }];
    let flags = filter.update_with(&gains, &mut state, &Vector3::zeros(), &blind);
    assert_eq!(flags, Flags::SENSOR_MISSING | Flags::MEASUREMENT_MISSING);
}

#[test]
fn single_precision_keeps_its_length() {
    let filter = Mahony::new(PiForm::new(0.5_f32, 0.05).unwrap().chain(), MahonyForm::Explicit);
    let gains = filter.design().at(0.001).unwrap();
    let mut state = MahonyState::new();
    for n in 0..1_000_000_u32 {
        let phase = f64::from(n % 6_283) * 1e-3;
        let (s, c) = phase.sin_cos();
        #[allow(clippy::cast_possible_truncation)] // Readings of single precision are meant.
        let part = |x: f64| x as f32;
        let rate = Vector3::new(part(3.0 * s), part(-2.0 * c), part(s * c));
        filter.update(&gains, &mut state, &rate, &Vector3::new(part(s), part(c), 9.0), None);
    }
    let length = state.rotation.w.powi(2) + state.rotation.v.norm_squared();
    assert!((length - 1.0).abs() < 1e-6);
}
