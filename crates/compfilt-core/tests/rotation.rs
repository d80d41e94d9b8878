//! Quaternions against nalgebra's rotation matrices.

use compfilt_core::attitude::Rotation;
use compfilt_core::nalgebra::{Rotation3, Vector3};
use proptest::prelude::{ProptestConfig, Strategy};
use proptest::{prop_assert, proptest};

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn matrix(turn: &Vector3<f64>) -> Rotation3<f64> {
    Rotation3::new(*turn)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn a_turn_is_the_exponential(turn in vector(20.0), small in vector(0.1), v in vector(3.0)) {
        // The series' error doubles with every halving undone.
        let error = (Rotation::of_turn(&turn).to_world(&v) - matrix(&turn) * v).norm();
        prop_assert!(error < 2e-8 * (1.0 + turn.norm()) * v.norm());
        let error = (Rotation::of_turn(&small).to_world(&v) - matrix(&small) * v).norm();
        prop_assert!(error < 1e-12 * v.norm());
    }

    #[test]
    fn products_and_inverses_are_those_of_matrices(one in vector(2.0), other in vector(2.0), v in vector(3.0)) {
        let (p, q) = (Rotation::of_turn(&one), Rotation::of_turn(&other));
        prop_assert!((p.times(&q).to_world(&v) - p.to_world(&q.to_world(&v))).norm() < 1e-14);
        prop_assert!((q.to_body(&q.to_world(&v)) - v).norm() < 1e-13);
        prop_assert!((q.up() - q.to_body(&Vector3::z())).norm() < 1e-14);
        prop_assert!((q.matrix() * v - q.to_world(&v)).norm() < 1e-13);
    }

    #[test]
    fn the_world_axes_give_the_rotation_back(turn in vector(4.0)) {
        let q = Rotation::of_turn(&turn);
        let [east, north, up] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| q.to_body(&axis));
        let p = Rotation::from_axes(&east, &north, &up);
        let same = (p.w * q.w + p.v.dot(&q.v)).abs();
        prop_assert!((same - 1.0).abs() < 1e-13);
    }

    #[test]
    fn up_is_reached_by_the_smallest_turn(v in vector(1.0)) {
        let up = v.normalize();
        let q = Rotation::from_up(&up);
        prop_assert!((q.up() - up).norm() < 1e-13);
        // About a horizontal axis, and the cosine of its angle is up's z.
        prop_assert!(q.v.z == 0.0 && (2.0 * q.w * q.w - 1.0 - up.z).abs() < 1e-13);
    }

    #[test]
    fn renormalising_ends_at_unit_length(turn in vector(3.0), factor in 0.9..1.1_f64) {
        let q = Rotation::of_turn(&turn);
        let mut q: Rotation<f64> = Rotation { w: q.w * factor, v: q.v * factor };
        for _ in 0..5 {
            q = q.renormalised();
        }
        prop_assert!((q.w * q.w + q.v.norm_squared() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn extremes() {
    assert_eq!(Rotation::from_up(&-Vector3::z()).up(), -Vector3::<f64>::z());
    assert!(Rotation::new(0.0, Vector3::<f64>::zeros()).is_none());
    assert!(Rotation::new(f64::NAN, Vector3::zeros()).is_none());
    let tiny = Rotation::new(1e-200, Vector3::new(0.0, 1e-200, 0.0)).unwrap();
    assert!((tiny.w - 0.5_f64.sqrt()).abs() < 1e-15);
    assert!(Rotation::of_turn(&Vector3::new(1e10, 0.0, 0.0_f64)).is_finite());
}
