//! The rate filter: the balancing cube's equation (30) literally, its drift, and the pair that does not drift.

mod common;

use common::{Noise, bits, close, gains, settle};
use compfilt_core::linear::{Flags, Input, RateInputs, RateState, Stream, StreamState};
use compfilt_core::{RateFilter, Recurrence, State};

const DT: f64 = 0.01;
const HOLD: f64 = 0.1;

fn filter() -> RateFilter<f64> {
    RateFilter::new(0.5).expect("a time constant")
}

/// `ω_n = α (ω_{n-1} + γ_n - γ_{n-1}) + (1-α) (a_{n-1} + T α̇_n)`.
#[test]
fn it_is_equation_30() {
    let gains = filter().at(DT).expect("gains");
    let alpha = 0.5 / (0.5 + DT);
    let mut state = RateState::new(0.2);
    let (mut rate, mut before, mut integral) = (0.2, 0.2, 0.2);
    let mut noise = Noise::new(51);
    for _ in 0..500 {
        let (gyro, acceleration): (f64, f64) = (noise.value(), noise.value());
        rate = alpha * (rate + gyro - before) + (1.0 - alpha) * (integral + DT * acceleration);
        integral += DT * acceleration;
        before = gyro;
        close(gains.update(&mut state, gyro, acceleration), rate, 1e-14);
        close(state.inputs.integral, integral, 1e-14);
    }
}

/// A rate that both sensors agree on comes out as it is, at any time steps.
#[test]
fn a_consistent_rate_is_reproduced() {
    let mut state = RateState::new(0.2);
    let (mut rate, mut noise) = (0.2, Noise::new(52));
    for n in 0..500 {
        let dt = 10f64.powi(n % 5 - 3);
        let acceleration: f64 = noise.value();
        rate += dt * acceleration;
        close(gains(&filter(), dt).update(&mut state, rate, acceleration), rate, 1e-12);
    }
}

/// A bias of the angular acceleration drifts through the low-pass; the drift-free pair keeps `tau` times it.
#[test]
fn the_open_loop_integral_drifts() {
    let bias = 0.1;
    let rate_gains = filter().at(DT).expect("gains");
    let mut state = RateState::new(0.0);
    for _ in 0..10_000 {
        rate_gains.update(&mut state, 0.0, bias);
    }
    // A ramp of slope `bias` behind a lag of `tau`.
    close(state.rate.levels[0], bias * (100.0 - 0.5), 1e-9);

    let pair = filter().drift_free();
    let mut state = State::at_rest::<f64>(0.0);
    close(settle(&pair.at(DT).expect("gains"), &mut state, (0.0, bias), 10_000), 0.5 * bias, 1e-12);
}

/// A bias of the gyro is high-passed away.
#[test]
fn a_bias_of_the_gyro_is_forgotten() {
    let gains = filter().at(DT).expect("gains");
    let mut state = RateState::new(0.0);
    close(gains.update(&mut state, 1.0, 0.0), 0.5 / 0.51, 1e-15);
    for _ in 0..3000 {
        gains.update(&mut state, 1.0, 0.0);
    }
    close(state.rate.levels[0], 0.0, 1e-12);
}

/// `update` is the recurrence on the converted signals, bit for bit; a ramp changes nothing.
#[test]
fn update_is_the_recurrence() {
    let gains = filter().at(DT).expect("gains");
    let mut state = RateState::new(0.2);
    let mut inputs = RateInputs::new(0.2);
    let mut levels = State::at_rest::<f64>(0.2);
    let mut ramped = StreamState::from_levels([0.2]);
    let stream = Stream::new(filter()).input(Input::Trapezoid);
    let mut noise = Noise::new(53);
    for _ in 0..200 {
        let (gyro, acceleration) = (noise.value(), noise.value());
        let rate = gains.update(&mut state, gyro, acceleration);
        let (y, u, flags) = inputs.prepare(gyro, acceleration, DT, HOLD);
        assert_eq!(flags, Flags::default());
        assert_eq!(bits(gains.step(&mut levels, y, u)), bits(rate));
        stream.update(&gains, &mut ramped, y, u, &mut ());
        close(ramped.level0(), rate, 1e-14);
        assert_eq!(state.inputs.gyro.to_bits(), inputs.gyro.to_bits());
    }
}

/// A missing gyro sample is taken to have moved with the angular acceleration; the next one takes it from there.
#[test]
fn a_missing_gyro_sample_is_bridged() {
    let mut inputs = RateInputs::new(1.0);
    let (y, u, flags) = inputs.prepare(f64::NAN, 2.0, DT, HOLD);
    assert_eq!(flags, Flags::MEASUREMENT_MISSING);
    close(y, 1.02, 1e-15);
    close(u, 0.02, 1e-15);
    let (y, u, flags) = inputs.prepare(1.5, 2.0, DT, HOLD);
    assert_eq!(flags, Flags::default());
    close(y, 1.04, 1e-15);
    close(u, 0.48, 1e-15);
}

/// A missing angular acceleration is held, then zero.
#[test]
fn a_missing_acceleration_is_held() {
    let mut inputs = RateInputs::new(0.0);
    inputs.prepare(0.0, 2.0, DT, 0.015);
    let (y, _, flags) = inputs.prepare(0.0, f64::NAN, DT, 0.015);
    assert_eq!(flags, Flags::DERIVATIVE_HELD);
    close(y, 0.04, 1e-15);
    let (y, _, flags) = inputs.prepare(0.0, f64::INFINITY, DT, 0.015);
    assert_eq!(flags, Flags::DERIVATIVE_MISSING);
    close(y, 0.04, 1e-15);
}

/// Without a start the first gyro sample is the start of both; before it the integral is NaN.
#[test]
fn the_first_gyro_sample_starts() {
    let mut inputs = RateInputs::new(f64::NAN);
    let (y, _, flags) = inputs.prepare(f64::NAN, 1.0, DT, HOLD);
    assert!(y.is_nan() && flags == Flags::MEASUREMENT_MISSING);
    let (y, u, flags) = inputs.prepare(0.7, 1.0, DT, HOLD);
    assert_eq!(flags, Flags::default());
    close(y, 0.71, 1e-15);
    close(u, 0.0, 0.0);
}

/// An integral that overflows starts anew from the gyro and says so.
#[test]
fn an_overflowed_integral_restarts() {
    let mut inputs = RateInputs::new(0.2);
    inputs.integral = f64::MAX;
    let (y, u, flags) = inputs.prepare(0.7, f64::MAX, 10.0, HOLD);
    assert_eq!(flags, Flags::RESTARTED);
    assert_eq!((bits(y), bits(u)), (bits(0.7), bits(0.0)));
    close(inputs.integral, 0.7, 0.0);
    let (y, _, flags) = inputs.prepare(0.7, 1.0, DT, HOLD);
    assert_eq!(flags, Flags::default());
    close(y, 0.71, 1e-15);
}
