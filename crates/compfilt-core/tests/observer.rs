//! The observer against its equation, its error dynamics, and what it does where samples are missing.

use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::{
    Matrix2x3, Matrix3, Matrix3x1, Matrix3x2, Vector1, Vector2, Vector3,
};
use compfilt_core::{Observer, ObserverState, Rule};
use proptest::prelude::Strategy;
use proptest::{prop_assert, prop_assert_eq, proptest};

const A: Matrix3<f64> = Matrix3::new(1.0, 0.01, 0.0, 0.4, 0.98, 0.02, -0.4, 0.01, 0.97);
const B: Matrix3x1<f64> = Matrix3x1::new(0.001, -0.2, 0.9);
const C: Matrix2x3<f64> = Matrix2x3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
const CORRECTION: Matrix3x2<f64> = Matrix3x2::new(0.01, -0.02, 0.4, 0.1, 0.05, 0.3);

fn observer() -> Observer<f64, 3, 2, 1> {
    Observer::new(A, B, C, A * CORRECTION, CORRECTION).unwrap()
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    (-5.0..5.0, -5.0..5.0, -5.0..5.0).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

proptest! {
    #[test]
    fn a_step_is_the_equation(x in vector(), truth in vector(), u in -3.0..3.0) {
        let mut state = ObserverState::new(x);
        let y = C * truth;
        let (filtered, flags) = observer().correct(&mut state, &y);
        let innovation = y - C * x;
        prop_assert!((filtered - (x + CORRECTION * innovation)).norm() < 1e-14);
        let flags = flags | observer().predict(&mut state, &Vector1::new(u));
        prop_assert!((state.x - (A * x + B * u + A * CORRECTION * innovation)).norm() < 1e-13);
        prop_assert_eq!(flags, Flags::default());
        // The next prediction is that of the filtered estimate, and the error obeys A - L C.
        prop_assert!((state.x - (A * filtered + B * u)).norm() < 1e-13);
        let next = A * truth + B * u;
        prop_assert!((next - state.x - (A - A * CORRECTION * C) * (truth - x)).norm() < 1e-13);
    }

    #[test]
    fn a_missing_output_corrects_nothing(x in vector(), y in -3.0..3.0) {
        let (mut one, mut other) = (ObserverState::new(x), ObserverState::new(x));
        let (_, flags) = observer().correct(&mut one, &Vector2::new(f64::NAN, y));
        prop_assert_eq!(flags, Flags::MEASUREMENT_MISSING);
        observer().correct(&mut other, &Vector2::new(x.y, y));
        prop_assert_eq!(one, other);
    }
}

#[test]
fn a_prediction_uses_up_the_innovation() {
    let mut state = ObserverState::new(Vector3::zeros());
    observer().correct(&mut state, &Vector2::new(1.0, 1.0));
    observer().predict(&mut state, &Vector1::new(0.0));
    let x = state.x;
    observer().predict(&mut state, &Vector1::new(0.0));
    assert!((state.x - A * x).norm() < 1e-15);
}

#[test]
fn a_missing_input_is_held() {
    let mut state = ObserverState::new(Vector3::zeros());
    assert_eq!(observer().predict(&mut state, &Vector1::new(f64::NAN)), Flags::DERIVATIVE_HELD);
    assert_eq!(state.x, Vector3::zeros());
    observer().predict(&mut state, &Vector1::new(2.0));
    let x = state.x;
    assert_eq!(
        observer().predict(&mut state, &Vector1::new(f64::INFINITY)),
        Flags::DERIVATIVE_HELD
    );
    assert!((state.x - (A * x + B * 2.0)).norm() < 1e-15);
}

#[test]
fn an_overflow_starts_anew() {
    let mut state = ObserverState::new(Vector3::from_element(1.7e308));
    let flags = observer().predict(&mut state, &Vector1::new(0.0));
    assert!(flags == Flags::RESTARTED && state.x == Vector3::zeros());
}

#[test]
fn matrices_must_be_finite() {
    let error = Observer::new(A, B, C, A * CORRECTION * f64::NAN, CORRECTION).unwrap_err();
    assert_eq!((error.parameter(), error.rule()), ("l", Rule::Finite));
}
