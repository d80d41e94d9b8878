//! Accelerometer arrays on random rigid-body motion about a pivot: exact for every motion, least noise, honest refusals.

use compfilt_core::gravity::{
    Accelerometer, AccelerometerArray, BodyAxes, Failure, Form, Quantity, Rate, mean_rate,
};
use compfilt_core::nalgebra::{Matrix3, Rotation3, Vector3};
use compfilt_core::{Number, Rule};
use proptest::prelude::{ProptestConfig, Strategy, any};
use proptest::{prop_assert, prop_assert_eq, proptest};

const BOTH: [Rate; 2] = [Rate::Unknown, Rate::Known];
const QUANTITIES: [Quantity; 2] = [Quantity::Gravity, Quantity::AngularAcceleration];

/// How the body moves.
#[derive(Clone, Copy, Debug)]
struct Motion {
    rate: Vector3<f64>,
    acceleration: Vector3<f64>,
    gravity: Vector3<f64>,
}

impl Motion {
    /// What an accelerometer reads, in its own axes.
    fn force(&self, sensor: &Accelerometer) -> Vector3<f64> {
        let r = sensor.position;
        let a = self.acceleration.cross(&r) + self.rate.cross(&self.rate.cross(&r));
        sensor.rotation * (a + self.gravity)
    }

    fn forces<const S: usize>(&self, sensors: &[Accelerometer; S]) -> [Vector3<f64>; S] {
        sensors.map(|sensor| self.force(&sensor))
    }

    fn of(&self, quantity: Quantity) -> Vector3<f64> {
        match quantity {
            Quantity::Gravity => self.gravity,
            Quantity::AngularAcceleration => self.acceleration,
        }
    }
}

fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn motion() -> impl Strategy<Value = Motion> {
    (vector(10.0), vector(50.0), vector(10.0)).prop_map(|(rate, acceleration, gravity)| Motion {
        rate,
        acceleration,
        gravity,
    })
}

/// A sensor anywhere, turned anyhow, with any noise.
fn sensor() -> impl Strategy<Value = Accelerometer> {
    (vector(0.5), vector(3.0), vector(1.0)).prop_map(|(position, turn, noise)| Accelerometer {
        position,
        rotation: *Rotation3::new(turn).matrix(),
        channels: [true; 3],
        noise: noise.map(|part| 0.2 + part.abs()),
    })
}

fn at(position: [f64; 3]) -> Accelerometer {
    Accelerometer::at(Vector3::from(position))
}

/// The six two-axis sensors of the balancing cube, (1.15)-(1.20), two a face; which corner is the pivot does not matter.
fn cube() -> [Accelerometer; 6] {
    let first = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let third = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let fifth = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    [
        ([0.05, 0.02, 0.0], first),
        ([0.10, 0.05, 0.15], first),
        ([0.0, 0.05, 0.02], third),
        ([0.15, 0.09, 0.08], third),
        ([0.02, 0.0, 0.08], fifth),
        ([0.05, 0.15, 0.12], fifth),
    ]
    .map(|(position, rotation)| Accelerometer {
        rotation,
        channels: [true, true, false],
        ..at(position)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_motion_is_told_from_gravity(
        sensors in proptest::array::uniform8(sensor()), motion in motion()
    ) {
        let array = AccelerometerArray::new(sensors).unwrap();
        prop_assert_eq!(array.form(), Form::General);
        for quantity in QUANTITIES {
            for rate in BOTH {
                let extraction = array.extraction(quantity, rate).unwrap();
                let found = extraction.step(&motion.forces(&sensors), &motion.rate);
                let gain = array.noise_gain(quantity, rate).amax();
                prop_assert!((found - motion.of(quantity)).norm() < 1e-11 * (1.0 + gain));
            }
        }
    }

    #[test]
    fn the_noise_gain_is_that_of_the_weights(sensors in proptest::array::uniform6(sensor())) {
        let array = AccelerometerArray::new(sensors).unwrap();
        for quantity in QUANTITIES {
            for rate in BOTH {
                let extraction = array.extraction(quantity, rate).unwrap();
                let mut variance = Vector3::zeros();
                for (weights, sensor) in extraction.weights.iter().zip(&sensors) {
                    let scaled = weights.matrix * Matrix3::from_diagonal(&sensor.noise);
                    variance += scaled.map(|part| part * part).column_sum();
                }
                let gain = array.noise_gain(quantity, rate);
                prop_assert!((variance.map(f64::sqrt) - gain).norm() < 1e-9 * gain.norm());
            }
        }
    }

    #[test]
    fn both_forms_agree_where_both_apply(
        positions in proptest::array::uniform6(vector(0.5)), noise in proptest::array::uniform6(0.1..3.0)
    ) {
        let mut sensors = cube();
        for ((sensor, position), noise) in sensors.iter_mut().zip(positions).zip(noise) {
            sensor.position = position;
            sensor.noise = Vector3::new(noise, 1.0, 1.0);
        }
        let aligned = AccelerometerArray::new(sensors).unwrap();
        prop_assert_eq!(aligned.form(), Form::Aligned);
        let general = aligned.with_form(Form::General).unwrap();
        for quantity in QUANTITIES {
            let gain = aligned.noise_gain(quantity, Rate::Unknown);
            let one = aligned.extraction(quantity, Rate::Unknown);
            let other = general.extraction(quantity, Rate::Unknown);
            let (Ok(one), Ok(other)) = (one, other) else {
                // Four positions may be all but coplanar.
                prop_assert!(gain.amax() > 1e3);
                continue;
            };
            for (one, other) in one.weights.iter().zip(&other.weights) {
                prop_assert!((one.matrix - other.matrix).amax() < 1e-10 * (1.0 + gain.amax().powi(2)));
            }
        }
    }

    #[test]
    fn the_cube_tells_any_motion_from_gravity(motion in motion(), unused in any::<f64>()) {
        let sensors = cube();
        let array = AccelerometerArray::new(sensors).unwrap();
        let forces = motion.forces(&sensors).map(|force| Vector3::new(force.x, force.y, unused));
        for rate in BOTH {
            let extraction = array.extraction(Quantity::Gravity, rate).unwrap();
            let error = extraction.step(&forces, &motion.rate) - motion.gravity;
            prop_assert!(error.norm() < 1e-11);
            let single = extraction.cast::<f32>();
            let forces = forces.map(|force| force.map(f32::literal));
            let found = single.step(&forces, &motion.rate.map(f32::literal));
            prop_assert!((found.map(f64::from) - motion.gravity).norm() < 1e-3);
        }
    }

    #[test]
    fn the_mean_rate_leaves_out_what_is_missing(rate in vector(10.0), gone in 0_usize..6) {
        let rotations = cube().map(|sensor| sensor.rotation);
        let mut gyros = rotations.map(|rotation| rotation * rate);
        let (mean, complete) = mean_rate(&rotations, &gyros);
        prop_assert!(complete && (mean - rate).norm() < 1e-14);
        gyros[gone].y = f64::NAN;
        let (mean, complete) = mean_rate(&rotations, &gyros);
        prop_assert!(!complete && (mean - rate).norm() < 1e-14);
    }

    #[test]
    fn two_sensors_leave_gravity_open_along_their_cross_product(
        first in vector(0.5), second in vector(0.5), along in 0.2..3.0, in_line in any::<bool>()
    ) {
        let second = if in_line { first * along + first } else { second };
        let array = AccelerometerArray::new([first, second].map(Accelerometer::at));
        if in_line {
            prop_assert!(array.unwrap().noise_gain(Quantity::Gravity, Rate::Unknown).amax() < 1e3);
        } else {
            let open = first.cross(&second).map(|part| part != 0.0);
            let rule = Rule::Gives(Quantity::Gravity, BodyAxes(open.into()), Failure::Ambiguous);
            prop_assert_eq!(array.unwrap_err().rule(), rule);
        }
    }
}

#[test]
fn a_reading_that_counts_must_be_there() {
    let sensors = cube();
    let array = AccelerometerArray::new(sensors).unwrap();
    let extraction = array.extraction(Quantity::Gravity, Rate::Unknown).unwrap();
    for missing in [f64::NAN, f64::INFINITY] {
        let mut forces = [Vector3::new(1.0, 1.0, f64::NAN); 6];
        assert!(extraction.step(&forces, &Vector3::zeros()).iter().all(|part| part.is_finite()));
        forces[3].x = missing;
        assert!(extraction.step(&forces, &Vector3::zeros()).iter().all(|part| part.is_nan()));
    }
    let (mean, complete) = mean_rate(&array.rotations(), &[Vector3::from_element(f64::NAN); 6]);
    assert!(!complete && mean.iter().all(|part| part.is_nan()));
}

/// What a layout of sensors along the body's axes gives without and with a known rate.
fn gives<const S: usize>(positions: [[f64; 3]; S]) -> (bool, bool) {
    let array = AccelerometerArray::new(positions.map(at)).unwrap();
    let gives = |rate| array.extraction(Quantity::Gravity, rate).is_ok();
    (gives(Rate::Unknown), gives(Rate::Known))
}

#[test]
fn what_a_layout_gives() {
    assert_eq!(gives([[0.0; 3]]), (true, true));
    assert_eq!(gives([[0.1, 0.2, 0.3], [-0.3, -0.6, -0.9]]), (true, true));
    // Three coplanar with the pivot, three in general.
    assert_eq!(gives([[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.3, 0.1, 0.0]]), (true, true));
    assert_eq!(gives([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]), (false, true));
    // Two of four coincide; two pairs that are symmetric about one point away from the pivot.
    assert_eq!(
        gives([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [0.0, 0.0, 0.1]]),
        (false, true)
    );
    assert_eq!(
        gives([[0.2, 0.1, 0.1], [0.0, 0.1, 0.1], [0.1, 0.2, 0.1], [0.1, 0.0, 0.1]]),
        (false, true)
    );
}

#[test]
fn a_geometry_that_only_a_gyro_completes_says_so() {
    let array =
        AccelerometerArray::new([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]].map(at))
            .unwrap();
    let error = array.extraction(Quantity::Gravity, Rate::Unknown).unwrap_err();
    assert_eq!(
        error.to_string(),
        "positions must give gravity along x, y and z, but that takes the body rate of a gyro as well"
    );
    assert!(
        array.noise_gain(Quantity::Gravity, Rate::Unknown).iter().all(|gain| gain.is_infinite())
    );
}

#[test]
fn a_beam_gives_two_axes_of_the_angular_acceleration() {
    let sensors = [[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]].map(at);
    let array = AccelerometerArray::new(sensors).unwrap();
    let error = array.extraction(Quantity::AngularAcceleration, Rate::Known).unwrap_err();
    assert_eq!(
        error.to_string(),
        "positions must give the angular acceleration about x, but another motion looks the same to every channel in use"
    );
    let beam = array
        .extraction_of(Quantity::AngularAcceleration, Rate::Known, [false, true, true])
        .unwrap();
    let motion = Motion {
        rate: Vector3::new(1.0, 2.0, 3.0),
        acceleration: Vector3::new(0.0, 5.0, 7.0),
        gravity: Vector3::new(1.0, -2.0, 9.0),
    };
    let found = beam.step(&motion.forces(&sensors), &motion.rate);
    assert!((found - motion.acceleration).norm() < 1e-12);
}

#[test]
fn refusals_name_the_parameter_and_the_rule() {
    let rule = |sensors: [Accelerometer; 2]| AccelerometerArray::new(sensors).unwrap_err().rule();
    let good = [at([0.1, 0.0, 0.0]), at([0.2, 0.0, 0.0])];
    let change = |change: &dyn Fn(&mut Accelerometer)| {
        let mut sensors = good;
        change(&mut sensors[1]);
        sensors
    };
    assert_eq!(rule(change(&|sensor| sensor.position.x = f64::NAN)), Rule::Finite);
    assert_eq!(rule(change(&|sensor| sensor.rotation[(0, 1)] = 1e-5)), Rule::Orthogonal);
    assert_eq!(rule(change(&|sensor| sensor.rotation *= f64::NAN)), Rule::Orthogonal);
    assert_eq!(rule(change(&|sensor| sensor.noise.z = 0.0)), Rule::Positive);
    let few = good.map(|sensor| Accelerometer { channels: [true, false, false], ..sensor });
    assert_eq!(rule(few), Rule::ThreeChannels);
    let blind = good.map(|sensor| Accelerometer { channels: [true, true, false], ..sensor });
    let unseen = Rule::Gives(Quantity::Gravity, BodyAxes([false, false, true]), Failure::Unseen);
    assert_eq!(rule(blind), unseen);
    let turned = Rotation3::new(Vector3::new(0.1, 0.0, 0.0));
    let array =
        AccelerometerArray::new(good.map(|s| Accelerometer { rotation: *turned.matrix(), ..s }))
            .unwrap();
    assert_eq!(array.with_form(Form::Aligned).unwrap_err().rule(), Rule::Aligned);
}

#[test]
fn sensors_that_all_but_coincide_are_refused() {
    let centre = Vector3::new(0.3, 0.2, 0.1);
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let layout = |size: f64| {
        AccelerometerArray::new(
            corners.map(|corner| Accelerometer::at(centre + Vector3::from(corner) * size)),
        )
    };
    let gain = layout(1e-5).unwrap().noise_gain(Quantity::Gravity, Rate::Unknown);
    // σ of the centre's reading is 1/2, that of the gradient along the centre |centre| / (2 size).
    assert!((gain.x * 2.0 * 1e-5 / centre.norm() - 1.0).abs() < 1e-6);
    let rule = layout(1e-8).unwrap_err().rule();
    assert!(matches!(rule, Rule::Gives(Quantity::Gravity, _, Failure::IllConditioned)));
}
