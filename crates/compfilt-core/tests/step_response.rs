//! Closed forms in time: the first-order step, and what a constant or growing error of the input leaves behind.

mod common;

use common::{
    butterworth, close, first_order, gains, pi, second_order_inertial, settle, split, third_order,
    third_order_butterworth, with_q,
};
use compfilt_core::linear::{Input, Stream, StreamState};
use compfilt_core::{Discretise, Recurrence, State};

const DT: f64 = 0.01;
const BIAS: f64 = 0.2;

/// Level 0 and the rest after 100 s at rest at 0 with an input that is wrong by `BIAS`.
fn after_bias<D: Discretise<f64, N>, const N: usize>(design: D) -> [f64; N] {
    let mut state = State::at_rest::<f64>(0.0);
    settle(&gains(&design, DT), &mut state, (0.0, BIAS), 10_000);
    state.levels
}

/// The same with a bias that grows by `slope` a second.
fn after_ramp<D: Discretise<f64, N>, const N: usize>(design: D, slope: f64) -> [f64; N] {
    let gains = gains(&design, DT);
    let mut state = State::at_rest::<f64>(0.0);
    for n in 0..10_000 {
        gains.step(&mut state, 0.0, slope * DT * f64::from(n));
    }
    state.levels
}

#[test]
fn the_first_order_step_is_a_power() {
    for (tau, dt) in [(0.5, 0.01), (2.0, 0.1), (0.1, 1.0), (1e-3, 1.0)] {
        let gains = gains(&first_order(1.0 / tau), dt);
        let mut state = State::at_rest::<f64>(0.0);
        for n in 1..=300 {
            let found = gains.step(&mut state, 1.0, 0.0);
            close(found, 1.0 - (tau / (tau + dt)).powi(n), 1e-13);
        }
    }
}

/// Matched: the continuous step response at the samples.
#[test]
fn the_matched_first_order_step_is_exponential() {
    let gains = gains(&first_order(2.0).matched(), 0.1);
    let mut state = State::at_rest::<f64>(0.0);
    for n in 1..=100 {
        let found = gains.step(&mut state, 1.0, 0.0);
        close(found, 1.0 - (-0.2 * f64::from(n)).exp(), 1e-14);
    }
}

/// Two real poles: a matched filter decays at the samples as the continuous one does.
#[test]
fn the_matched_decay_is_the_continuous_one() {
    let chain = pi(2.0, 0.9);
    let dt: f64 = 0.05;
    let gains = gains(&chain.matched(), dt);
    for pole in chain.poles().map(|p| p.re) {
        // A state in the discrete eigenvector of one pole decays by exp(p dt) a step.
        let z = (pole * dt).exp();
        let mut state = State { levels: [1.0, (z / (1.0 - gains.correction()[0]) - 1.0) / dt] };
        for n in 1..=10 {
            let found = gains.step(&mut state, 0.0, 0.0);
            close(found, (pole * dt * f64::from(n)).exp(), 1e-9);
        }
    }
}

#[test]
fn first_order_keeps_tau_times_the_bias() {
    for tau in [0.1, 0.5, 3.0] {
        let [angle] = after_bias(first_order(1.0 / tau));
        close(angle, tau * BIAS, 1e-12);
        let [angle] = after_bias(first_order(1.0 / tau).matched());
        // Matched: T z/(1 - z) in place of tau.
        let z = (-DT / tau).exp();
        close(angle, DT * z / (1.0 - z) * BIAS, 1e-12);
    }
}

#[test]
fn pi_removes_the_bias_and_knows_it() {
    for chain in [pi(2.0, 0.5), with_q(2.0, 0.6)] {
        let [angle, estimate] = after_bias(chain);
        close(angle, 0.0, 1e-9);
        close(estimate, -BIAS, 1e-9);
        let [angle, estimate] = after_bias(chain.matched());
        close(angle, 0.0, 1e-9);
        close(estimate, -BIAS, 1e-9);
    }
}

#[test]
fn pi_keeps_the_slope_of_a_bias_over_k2() {
    let chain = pi(2.0, 0.5);
    let [angle, _] = after_ramp(chain, 0.01);
    close(angle, 0.01 / chain.coefficients()[1], 1e-9);
}

#[test]
fn third_order_removes_a_ramp_of_the_bias() {
    let [angle, estimate, slope] = after_ramp(butterworth::<f64, 3>(2.0).chain(), 0.01);
    close(angle, 0.0, 1e-9);
    close(slope, -0.01, 1e-9);
    close(estimate, -0.01 * DT * 9999.0, 1e-9);
}

#[test]
fn third_order_removes_the_bias_of_an_acceleration() {
    for chain in [third_order(2.0), third_order_butterworth(2.0)] {
        for [position, speed, estimate] in [after_bias(chain), after_bias(chain.matched())] {
            close(position, 0.0, 1e-9);
            // The predicted and corrected speed of a body at rest.
            close(speed, 0.0, 1e-9);
            close(estimate, -BIAS, 1e-9);
        }
    }
}

#[test]
fn second_order_inertial_keeps_the_bias_over_k2() {
    let chain = second_order_inertial(2.0);
    let [position, _] = after_bias(chain);
    close(position, BIAS / chain.coefficients()[1], 1e-9);
}

/// Split 1 leaves `a_1/a_0` of the bias, every other split none.
#[test]
fn only_split_one_keeps_a_bias() {
    let steep = split::<f64, 2>(2.0, 1);
    let [a1, a0] = *steep.coefficients();
    close(after_bias(steep)[0], a1 / a0 * BIAS, 1e-9);
    let steep = split::<f64, 4>(2.0, 1);
    let [.., a1, a0] = *steep.coefficients();
    close(after_bias(steep)[0], a1 / a0 * BIAS, 1e-9);
    for degree in 2..=4 {
        close(after_bias(split::<f64, 4>(2.0, degree))[0], 0.0, 1e-9);
    }
}

/// N = 2, split 1: the closed form of one step.
#[test]
fn split_one_of_two_step_by_step() {
    let design = split::<f64, 2>(3.0, 1);
    let [a1, a0] = *design.coefficients();
    let gains = gains(&design, DT);
    let mut state = State { levels: [0.3, -0.2] };
    let [mut x, mut z] = state.levels;
    for (y, u) in [(0.5, 1.0), (-0.3, 0.2), (0.1, -0.7), (0.9, 0.0)] {
        let predicted = z / (1.0 + a1 * DT);
        let x_predicted = x + DT * (u + predicted);
        let gain = DT * a0 / (1.0 + a1 * DT);
        let residual = (y - x_predicted) / (1.0 + DT * gain);
        x = x_predicted + DT * gain * residual;
        z = predicted + gain * residual;
        close(gains.step(&mut state, y, u), x, 1e-15);
        close(state.levels[1], z, 1e-15);
    }
}

/// Matched poles with an input on a straight line are exact for an acceleration that grows evenly: `y = t³/6`.
#[test]
fn matched_follows_a_linear_acceleration() {
    let stream = Stream::new(third_order(2.0).matched()).input(Input::Trapezoid);
    let gains = gains(stream.design(), 0.1);
    let mut state = StreamState::from_levels([0.0; 3]);
    state.input.renew(0.0);
    for n in 1..=100 {
        let t = 0.1 * f64::from(n);
        stream.update(&gains, &mut state, t * t * t / 6.0, t, &mut ());
        close(state.levels.levels[0], t * t * t / 6.0, 1e-12 * t * t * t);
        close(state.levels.levels[1], t * t / 2.0, 1e-11 * t * t);
        close(state.levels.levels[2], 0.0, 1e-10);
    }
}
