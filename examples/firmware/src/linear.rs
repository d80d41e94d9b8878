//! The linear filters: an angle from the accelerometer and a rate from the gyro, about the body's x.

use crate::DT;
use crate::recording::{force, force_with_gaps, gyro, gyro_with_gaps};
use crate::report::Report;
use compfilt_core::linear::{RateState, Stream, StreamState};
use compfilt_core::{Butterworth, Discretise, FirstOrder, PiForm, RateFilter, State, ThirdOrder};
use core::hint::black_box;
use no_panic_probe as steps;

/// The measured angle in rad, near level, and the rate in rad/s.
fn angle_and_rate(n: usize) -> (f32, f32) {
    (force(n).y * 0.1, gyro(n).x)
}

fn with_gaps(n: usize) -> (f32, f32) {
    (force_with_gaps(n).y * 0.1, gyro_with_gaps(n).x)
}

/// A filter of order `$N` whose step is `$step`.
macro_rules! run {
    ($report:ident, $name:literal, $order:literal, $gains:expr, $step:path) => {{
        let gains = $gains.ok()?;
        // A call through a pointer that the compiler cannot see through: the step is compiled as it is anywhere else.
        $report.run(
            $name,
            black_box::<fn(&_, &mut _, f32, f32) -> f32>($step),
            State::<f32, $order>::at_rest::<f32>(0.0),
            angle_and_rate,
            |step, state, (angle, rate)| step(&gains, state, *angle, *rate),
            |state, _| state.levels,
        )?;
    }};
}

pub fn run(report: &Report) -> Option<()> {
    let butterworth = Butterworth::<f32, 2>::new(5.0).ok()?;
    run!(report, "first_order", 1, FirstOrder::new(0.5).ok()?.at(DT), steps::probe_first_order);
    run!(report, "pi", 2, PiForm::new(2.0, 0.5).ok()?.at(DT), steps::probe_pi);
    run!(report, "butterworth_2", 2, butterworth.at(DT), steps::probe_butterworth_2);
    run!(report, "split_2", 2, butterworth.split(1).ok()?.at(DT), steps::probe_split_2);
    run!(report, "third_order", 3, ThirdOrder::new(1.5).ok()?.at(DT), steps::probe_third_order);
    rate(report)?;
    stream(report)
}

/// The accelerometer stands for an angular acceleration.
fn rate(report: &Report) -> Option<()> {
    let gains = RateFilter::new(1.0).ok()?.at(DT).ok()?;
    report.run(
        "rate",
        black_box::<fn(&_, &mut _, f32, f32) -> f32>(steps::probe_rate),
        RateState::new(0.0),
        |n| (gyro(n).x, force(n).y),
        |step, state, (gyro, acceleration)| step(&gains, state, *gyro, *acceleration),
        |_, rate| [rate],
    )
}

/// The PI form with samples that are missing.
fn stream(report: &Report) -> Option<()> {
    let stream = Stream::new(PiForm::new(2.0, 0.5).ok()?.chain());
    let gains = stream.design().at(DT).ok()?;
    report.run(
        "stream_pi",
        black_box::<fn(&_, &_, &mut _, f32, f32) -> _>(steps::probe_stream_pi),
        StreamState::from_levels([0.0; 2]),
        with_gaps,
        |step, state, (angle, rate)| step(&stream, &gains, state, *angle, *rate),
        |state, flags| {
            let [angle, minus_bias] = state.levels.levels;
            [angle, minus_bias, f32::from(flags.bits())]
        },
    )
}
