//! Tilt and angle rates against rotation matrices in all three systems of axes; the tilt filter on moving bodies.

mod common;

use common::{close, first_order, gains, pi};
use compfilt_core::gravity::{Axes, Rates, TiltFilter, TiltState, angle_rates, tilt};
use compfilt_core::linear::{Flags, StreamState};
use compfilt_core::nalgebra::{Matrix3, Vector2, Vector3};
use compfilt_core::{Chain, Number};
use proptest::prelude::ProptestConfig;
use proptest::proptest;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const ALL: [Axes; 3] = [Axes::Flu, Axes::Frd, Axes::Cube];

/// A turn by `angle` about a coordinate axis.
fn turn(axis: usize, angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    let mut matrix = Matrix3::identity();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    matrix[(i, i)] = c;
    matrix[(j, j)] = c;
    matrix[(i, j)] = -s;
    matrix[(j, i)] = s;
    matrix
}

/// Body to world: about the vertical first, the two tilt angles last.
fn attitude(axes: Axes, angles: &Vector2<f64>, heading: f64) -> Matrix3<f64> {
    match axes {
        Axes::Flu | Axes::Frd => turn(2, heading) * turn(1, angles[1]) * turn(0, angles[0]),
        Axes::Cube => turn(0, heading) * turn(1, angles[0]) * turn(2, angles[1]),
    }
}

/// The specific force of a body at rest in world axes: up.
fn up(axes: Axes) -> Vector3<f64> {
    match axes {
        Axes::Flu => Vector3::z() * 9.81,
        Axes::Frd => Vector3::z() * -9.81,
        Axes::Cube => Vector3::x() * -9.81,
    }
}

fn force(axes: Axes, angles: &Vector2<f64>, heading: f64) -> Vector3<f64> {
    attitude(axes, angles, heading).transpose() * up(axes)
}

/// The body rates of a motion of all three angles, from the attitude a little before and after.
fn body_rates(
    axes: Axes,
    angles: &Vector2<f64>,
    rates: &Vector2<f64>,
    turning: f64,
) -> Vector3<f64> {
    let at = |t: f64| attitude(axes, &(angles + rates * t), turning * t);
    let h = 1e-3;
    // Fourth order in h.
    let slope = ((at(h) - at(-h)) * 8.0 - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
    let spin = at(0.0).transpose() * slope;
    Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)])
}

fn roll_pitch(axes: Axes, free: f64, bounded: f64) -> Vector2<f64> {
    if axes == Axes::Cube { Vector2::new(bounded, free) } else { Vector2::new(free, bounded) }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn tilt_undoes_the_attitude(
        free in -PI..PI, bounded in -1.55..1.55, heading in -3.0..3.0, length in -20.0..20.0,
    ) {
        for axes in ALL {
            let angles = roll_pitch(axes, free, bounded);
            let force = force(axes, &angles, heading) * 10f64.powf(length);
            let found = tilt(axes, &force).expect("a force");
            assert!((found - angles).amax() < 1e-12, "{axes:?}: {found} {angles}");
        }
    }

    #[test]
    fn angle_rates_are_those_of_the_attitude(
        free in -3.0..3.0, bounded in -1.4..1.4, rates in proptest::array::uniform3(-2.0..2.0),
    ) {
        for axes in ALL {
            let angles = roll_pitch(axes, free, bounded);
            let wanted = Vector2::new(rates[0], rates[1]);
            let found = angle_rates(axes, &angles, &body_rates(axes, &angles, &wanted, rates[2]));
            assert!((found - wanted).amax() < 1e-8, "{axes:?}: {found} {wanted}");
        }
    }
}

#[test]
fn tilt_in_plain_words() {
    let degrees = |axes, x: f64, y, z| {
        let angles = tilt(axes, &Vector3::new(x, y, z)).expect("a force");
        (angles[0].to_degrees(), angles[1].to_degrees())
    };
    let is = |found: (f64, f64), wanted: (f64, f64)| {
        close(found.0, wanted.0, 1e-12);
        close(found.1, wanted.1, 1e-12);
    };
    is(degrees(Axes::Flu, 0.0, 0.0, 9.81), (0.0, 0.0));
    is(degrees(Axes::Flu, 0.0, 1.0, 1.0), (45.0, 0.0)); // left side up
    is(degrees(Axes::Flu, -1.0, 0.0, 1.0), (0.0, 45.0)); // nose down
    is(degrees(Axes::Frd, 0.0, 0.0, -9.81), (0.0, 0.0));
    is(degrees(Axes::Frd, 1.0, 0.0, -1.0), (0.0, 45.0)); // nose up
    is(degrees(Axes::Frd, 0.0, -1.0, -1.0), (45.0, 0.0)); // right side down
    is(degrees(Axes::Cube, -1.0, 0.0, 0.0), (0.0, 0.0));
    is(degrees(Axes::Cube, -1.0, 0.0, -1.0), (45.0, 0.0));
    is(degrees(Axes::Cube, -1.0, 1.0, 0.0), (0.0, 45.0));
}

/// A level body has the angle 0, not -0 or -π.
#[test]
fn level_is_zero() {
    for axes in ALL {
        let force = up(axes).map(|x| x + 0.0); // no -0
        let angles = tilt(axes, &force).expect("a force");
        assert_eq!(angles.map(f64::to_bits), Vector2::zeros(), "{axes:?}: {angles:?}");
    }
}

#[test]
fn no_force_has_no_tilt() {
    for axes in ALL {
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            assert_eq!(tilt(axes, &Vector3::new(0.0, bad, 0.0)), None);
        }
        let unit = tilt(axes, &Vector3::new(1.0, 2.0, -1.0));
        for size in [f64::MIN_POSITIVE, f64::MAX / 4.0] {
            assert_eq!(tilt(axes, &(Vector3::new(1.0, 2.0, -1.0) * size)), unit);
        }
    }
}

/// At the singularity the rates stay finite.
#[test]
fn angle_rates_stay_finite() {
    for axes in ALL {
        for bounded in [FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 + 1e-9] {
            let rates = angle_rates(axes, &roll_pitch(axes, 0.4, bounded), &Vector3::repeat(1.0));
            assert!(rates.amax() <= 1.0 + 1e3 * 2.0, "{rates}");
        }
    }
}

// ------------------------------------------------------------------------------------------------------------ the filter

type FirstOrderTilt = TiltFilter<f64, Chain<f64, 1, 1>>;

/// Runs a motion of the angles for `duration` seconds at 1 kHz with mean rates; the largest error after half of it.
fn largest_error(
    filter: &FirstOrderTilt,
    axes: Axes,
    duration: f64,
    motion: impl Fn(f64) -> (Vector2<f64>, f64),
) -> f64 {
    let dt = 1e-3;
    let gains = gains(filter.design(), dt);
    let mut state = TiltState::new();
    let mut largest = 0.0f64;
    let (mut t, mut before) = (0.0, motion(0.0));
    while t < duration {
        t += dt;
        let now = motion(t);
        let middle = motion(t - dt / 2.0).0;
        let rates = (now.0 - before.0) / dt;
        let gyro = body_rates(axes, &middle, &rates, (now.1 - before.1) / dt);
        filter.update(&gains, &mut state, &gyro, &force(axes, &now.0, now.1));
        if t > duration / 2.0 {
            let error = filter.angles(&state) - now.0;
            largest = largest.max(error.map(|e| e - TAU * (e / TAU).round()).amax());
        }
        before = now;
    }
    largest
}

#[test]
fn a_moving_body_is_followed() {
    for axes in ALL {
        let filter = TiltFilter::new(first_order(0.5), axes);
        let motion = |t: f64| {
            let angles = roll_pitch(axes, 0.7 * (1.1 * t).sin(), 0.9 * (0.8 * t).sin());
            (angles, 0.8 * t + (0.4 * t).sin())
        };
        let error = largest_error(&filter, axes, 20.0, motion);
        assert!(error < 3e-3, "{axes:?}: {error}");
    }
}

/// A steady turn at 60°/s with the nose 40° from level: without the conversion of the rates the roll is off by
/// τ ψ̇ sin θ, 18.9° at a = 0.98 and 100 Hz.
#[test]
fn a_steady_turn_leaves_no_error() {
    let (turning, pitch) = (60f64.to_radians(), 40f64.to_radians());
    let design = first_order(1.0 / 0.49);
    let gains = gains(&design, 0.01);
    for axes in [Axes::Flu, Axes::Frd] {
        let angles = Vector2::new(0.0, pitch);
        let gyro = body_rates(axes, &angles, &Vector2::zeros(), turning);
        let settled = |filter: FirstOrderTilt| {
            let mut state = TiltState::new();
            for _ in 0..2000 {
                filter.update(&gains, &mut state, &gyro, &force(axes, &angles, 0.0));
            }
            (filter.angles(&state) - angles).map(f64::to_degrees)
        };
        let filter = TiltFilter::new(design, axes);
        assert!(settled(filter).amax() < 1e-9);
        // Frozen at level is no conversion at all.
        let level = settled(filter.rates(Rates::Frozen(Vector2::zeros())));
        close(level[0].abs(), 18.9, 0.05);
        close(level[0].abs(), (0.49 * turning * pitch.sin()).to_degrees(), 1e-9);
        // Frozen where the body is, is right.
        assert!(settled(filter.rates(Rates::Frozen(angles))).amax() < 1e-9);
    }
}

/// A loop: through the singular attitude, on the back, and round again.
#[test]
fn a_loop_stays_finite_and_comes_back() {
    for axes in ALL {
        let filter = TiltFilter::new(pi(1.0, 0.5), axes);
        let gains = gains(filter.design(), 1e-3);
        let mut state = TiltState::new();
        for n in 0..=7000 {
            // One and three quarters of a turn in 7 s, then still.
            let bounded = (f64::from(n) * 1e-3).min(6.0) / 6.0 * TAU;
            let angles = roll_pitch(axes, 0.3, bounded);
            let moving = if n > 0 && n <= 6000 { TAU / 6.0 } else { 0.0 };
            let gyro = body_rates(axes, &angles, &roll_pitch(axes, 0.0, moving), 0.0);
            filter.update(&gains, &mut state, &gyro, &force(axes, &angles, 0.2));
            let found = filter.angles(&state);
            assert!(found.iter().all(|x| x.is_finite()), "{axes:?}, {n}");
            let apart = gravity_apart(axes, &found, &angles);
            assert!(apart < 0.05, "{axes:?}, {n}: {apart}");
        }
        let found = filter.angles(&state);
        assert!((found - roll_pitch(axes, 0.3, 0.0)).amax() < 0.01, "{axes:?}: {found}");
    }
}

/// The angle in rad between the gravities of two attitudes.
fn gravity_apart(axes: Axes, a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    force(axes, a, 0.0).angle(&force(axes, b, 0.0))
}

/// On the back, pitch beyond 90°, the measured pair is taken on the filter's side.
#[test]
fn the_measurement_is_taken_on_the_filters_side() {
    for axes in ALL {
        let filter = TiltFilter::new(first_order(2.0), axes);
        let gains = gains(filter.design(), 0.01);
        let raw = roll_pitch(axes, 0.2, 2.0);
        let start = |angle: f64| StreamState::from_levels([angle]);
        let mut state = TiltState { angles: [start(raw[0]), start(raw[1])] };
        filter.update(&gains, &mut state, &Vector3::zeros(), &force(axes, &raw, 0.7));
        assert!((state.raw() - raw).amax() < 1e-12, "{axes:?}: {}", state.raw());
        // The same attitude in the usual ranges.
        let usual = roll_pitch(axes, 0.2 - PI, PI - 2.0);
        assert!((filter.angles(&state) - usual).amax() < 1e-12, "{axes:?}");
    }
}

/// The roll goes on over ±180°.
#[test]
fn the_free_angle_runs_on() {
    for axes in ALL {
        let filter = TiltFilter::new(first_order(2.0), axes);
        let motion = |t: f64| (roll_pitch(axes, 2.0 * t, 0.1), 0.0);
        let error = largest_error(&filter, axes, 8.0, motion);
        assert!(error < 1e-4, "{axes:?}: {error}");
    }
}

// ----------------------------------------------------------------------------------------------------------------- missing

#[test]
fn missing_samples_of_the_tilt_filter() {
    let filter = TiltFilter::new(first_order(2.0), Axes::Flu).hold(0.015).expect("a hold");
    let gains = gains(filter.design(), 0.01);
    let mut state = TiltState::default();
    let (gyro, up) = (Vector3::new(0.5, 0.0, 0.0), Vector3::new(0.0, 0.0, 9.81));
    let gone = Vector3::new(0.0, f64::NAN, 0.0);
    let waiting = filter.update(&gains, &mut state, &gyro, &gone);
    // Without an attitude the body rates cannot be turned into angle rates either.
    let nothing_known = Flags::MEASUREMENT_MISSING | Flags::DERIVATIVE_MISSING;
    assert_eq!(waiting, Flags::NOT_STARTED | nothing_known);
    assert!(filter.angles(&state).iter().all(|x| x.is_nan()));

    assert_eq!(filter.update(&gains, &mut state, &gyro, &up), Flags::default());
    let before = filter.angles(&state)[0];
    let flags = filter.update(&gains, &mut state, &gyro, &Vector3::zeros());
    assert_eq!(flags, Flags::MEASUREMENT_MISSING);
    close(filter.angles(&state)[0], before + 0.005, 1e-15);
    assert_eq!(filter.update(&gains, &mut state, &gone, &up), Flags::DERIVATIVE_HELD);
    assert_eq!(filter.update(&gains, &mut state, &gone, &up), Flags::DERIVATIVE_MISSING);
    assert!(filter.hold(-1.0).is_err() && filter.gap_cap(0.0).is_err());
}

/// In `f32` the angles of a moving body are those in `f64` to 1e-5 rad.
#[test]
fn tilt_in_single_precision() {
    let (single, double) = (
        TiltFilter::new(pi::<f32>(1.0, 0.5), Axes::Flu),
        TiltFilter::new(pi::<f64>(1.0, 0.5), Axes::Flu),
    );
    let (few, many) = (gains(single.design(), 0.01), gains(double.design(), 0.01));
    let (mut a, mut b) = (TiltState::new(), TiltState::new());
    for n in 0..2000 {
        let t = 0.01 * f64::from(n);
        let gyro = Vector3::new(0.7 * t.sin(), 0.5 * (1.3 * t).cos(), 0.2);
        let force = Vector3::new((0.7 * t).sin(), t.cos(), 9.0);
        single.update(&few, &mut a, &gyro.map(f32::literal), &force.map(f32::literal));
        double.update(&many, &mut b, &gyro, &force);
        let error = single.angles(&a).map(f64::from) - double.angles(&b);
        assert!(error.amax() < 1e-5, "{n}: {error}");
    }
}

/// In single precision an angle that ran on over many turns would lose its resolution.
#[test]
fn many_turns_in_single_precision() {
    let filter = TiltFilter::new(first_order::<f32>(1.0), Axes::Flu);
    let gains = gains(filter.design(), 0.005_f32);
    let mut state = TiltState::new();
    let rate = 5.0 * std::f32::consts::TAU;
    let (mut largest, mut turn) = (0.0_f32, 0.0_f64);
    for sample in 0..60_000 {
        turn = (turn + 0.025).fract();
        let roll = turn * TAU;
        #[allow(clippy::cast_possible_truncation)]
        let (s, c) = (roll.sin() as f32, roll.cos() as f32);
        filter.update(&gains, &mut state, &Vector3::new(rate, 0.0, 0.0), &Vector3::new(0.0, s, c));
        let found = filter.angles(&state)[0];
        // The first measurement is taken for the state one step before: that error fades with tau = 1 s.
        if sample > 4000 {
            largest = largest.max((found.sin() * c - found.cos() * s).abs());
        }
    }
    assert!(largest < 1e-4, "{largest} rad after 1500 turns");
}
