//! Measurements that arrive late: the ring of past estimates, consistent input, and how late is too late.

mod common;

use common::{
    Check, Kind, Noise, Path, butterworth, close, every_filter, first_order, gains, pi, split,
    third_order_butterworth,
};
use compfilt_core::linear::{Hindsight, History, Past, Stream, StreamState, longest_delay};
use compfilt_core::{Chain, Discretise, Number, Real, Recurrence, Rule, State};
use proptest::prelude::ProptestConfig;
use proptest::proptest;

fn ring<T: Real>(length: usize) -> Vec<Past<T>> {
    vec![Past { level0: T::zero(), dt: T::zero() }; length]
}

// ------------------------------------------------------------------------------------------------------------------ the ring

/// The same as a list of times and levels that only grows.
#[derive(Default)]
struct Polyline(Vec<(f64, f64)>);

impl Polyline {
    fn remember(&mut self, level0: f64, dt: f64) {
        let now = self.0.last().map_or(0.0, |last| last.0 + dt);
        self.0.push((now, level0));
    }

    /// Linear between the points, the oldest of the last `length` before them.
    fn recall(&self, delay: f64, length: usize) -> f64 {
        let kept = &self.0[self.0.len().saturating_sub(length)..];
        let then = kept[kept.len() - 1].0 - delay;
        let after = kept.partition_point(|point| point.0 <= then);
        match (after.checked_sub(1).map(|before| kept[before]), kept.get(after)) {
            (None, _) => kept[0].1,
            (Some(before), None) => before.1,
            (Some(before), Some(after)) => {
                before.1 + (after.1 - before.1) * (then - before.0) / (after.0 - before.0)
            }
        }
    }
}

impl Polyline {
    /// Of the last `length` points those back to the first as old as `delay`, newest first, and whether the last of all is
    /// among them; `None` where a point is as old as the delay to rounding.
    fn needed(&self, delay: f64, length: usize) -> Option<(Vec<f64>, bool)> {
        let now = self.0.last()?.0;
        let kept: Vec<_> = self.0.iter().rev().take(length).collect();
        if kept.iter().any(|point| (now - point.0 - delay).abs() < 1e-9) {
            return None;
        }
        let young = kept.iter().take_while(|point| now - point.0 < delay).count();
        let needed = kept.iter().take(young + 1).map(|point| point.1).collect();
        Some((needed, kept.len() == length && young + 1 >= length))
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_ring_is_a_polyline(
        length in 2_usize..12, delay in 0.001..0.3,
        points in proptest::collection::vec((-1.0..1.0, 0.001..0.1), 1..60),
    ) {
        let mut history = History::new(ring(length), delay).expect("a delay");
        let mut naive = Polyline::default();
        for (level0, dt) in points {
            history.remember(level0, dt);
            naive.remember(level0, dt);
            close(history.recall(level0), naive.recall(delay, length), 1e-10);

            let amended = level0 * 0.5;
            history.amend(amended);
            naive.0.last_mut().expect("a point").1 = amended;
            close(history.recall(amended), naive.recall(delay, length), 1e-10);

            if let Some((needed, short)) = naive.needed(delay, length) {
                let stored: Vec<_> = history.iter().map(|past| past.level0).collect();
                assert_eq!((stored, history.is_short()), (needed, short));
            }
        }
    }
}

#[test]
fn a_history_is_checked() {
    for delay in [f64::NAN, f64::INFINITY, -0.1] {
        let error = History::new(ring(4), delay).unwrap_err();
        assert_eq!((error.parameter(), error.rule()), ("delay", Rule::NotNegative));
    }
    for length in [0, 1] {
        let error = History::new(ring(length), 0.1).unwrap_err();
        assert_eq!((error.parameter(), error.rule()), ("delay", Rule::WithinHistory));
    }
    close(History::new(ring(2), 0.1).expect("a delay").delay(), 0.1, 0.0);
}

#[test]
fn a_history_begins_once_and_can_be_cleared() {
    let mut history = History::new(ring(5), 0.02).expect("a delay");
    close(history.recall(7.0), 7.0, 0.0);
    history.begin(1.0);
    history.begin(2.0);
    assert_eq!(history.iter().count(), 1);
    for n in 0..9 {
        history.remember(f64::from(n), 0.01);
    }
    close(history.recall(8.0), 6.0, 1e-12);
    assert_eq!(history.iter().count(), 3);
    assert!(!history.is_short());
    history.clear();
    assert_eq!(history.iter().count(), 0);
    close(history.recall(7.0), 7.0, 0.0);
}

/// Without a history a measurement belongs to now.
#[test]
fn no_history_recalls_the_present() {
    let mut nothing = ();
    nothing.begin(1.0);
    nothing.remember(1.0, 0.1);
    nothing.amend(1.0);
    close(nothing.recall(5.0), 5.0, 0.0);
}

// ---------------------------------------------------------------------------------------------------------- consistent input

/// A motion measured `0.05` s late and the derivative in time.
struct ReproducesLate;

impl<T: Real> Check<T> for ReproducesLate {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let dt = T::literal(0.01);
        let gains = gains(&design, dt);
        let stream = Stream::new(design);
        let mut history = History::new(ring(9), T::literal(0.05)).expect("a delay");
        let mut levels = [T::zero(); N];
        for (i, level) in levels.iter_mut().take(kind.derivative_order).enumerate() {
            *level = T::literal([0.3, -0.2, 0.1][i]);
        }
        let mut path = Path::new(kind.motion, levels[..kind.derivative_order].to_vec());
        let mut state = StreamState::from_levels(levels);
        let (mut noise, mut positions) = (Noise::new(41), Vec::new());
        for n in 0..400_usize {
            let u = noise.value();
            positions.push(path.advance(dt, u));
            let late = n.checked_sub(5).map_or(T::NAN, |then| positions[then]);
            stream.update(&gains, &mut state, late, u, &mut history);
            let error = ((state.level0() - positions[n]) / path.sizes[0]).abs();
            let allowed = T::default_epsilon() * T::literal(1000.0);
            assert!(error <= allowed, "{}, sample {n}: {error}", kind.name);
        }
    }
}

#[test]
fn late_consistent_input_is_reproduced() {
    every_filter::<f64>(1.0, 0.5, &mut ReproducesLate);
    every_filter::<f32>(1.0, 0.5, &mut ReproducesLate);
}

/// Noise at uneven time steps, some of it missing: the innovation is taken against the corrected estimates of the past.
#[test]
fn a_late_measurement_meets_the_corrected_past() {
    let chain = pi(2.0, 0.5);
    let (stream, delay) = (Stream::new(chain), 0.043);
    let mut history = History::new(ring(64), delay).expect("a delay");
    let mut state = StreamState::from_levels([0.0; 2]);
    let mut naive = Polyline::default();
    naive.remember(0.0, 0.0);
    let mut levels = State { levels: [0.0; 2] };
    for sample in common::noisy_samples::<f64>(45, 300, 0.02) {
        let gains = gains(&chain, sample.dt);
        stream.update(&gains, &mut state, sample.y, sample.u, &mut history);

        gains.predict(&mut levels, sample.u);
        naive.remember(levels.levels[0], sample.dt);
        gains.correct(&mut levels, sample.y - naive.recall(delay, usize::MAX));
        naive.0.last_mut().expect("a point").1 = levels.levels[0];
        close(state.level0(), levels.levels[0], 1e-12);
    }
}

/// A delay of zero is no delay.
#[test]
fn no_delay_is_the_plain_filter() {
    let chain = pi(2.0, 0.5);
    let gains = gains(&chain, 0.01);
    let stream = Stream::new(chain);
    let mut history = History::new(ring(4), 0.0).expect("a delay");
    let (mut late, mut plain) = (StreamState::new(), StreamState::new());
    let mut noise = Noise::new(43);
    for _ in 0..200 {
        let (y, u) = (noise.value(), noise.value());
        stream.update(&gains, &mut late, y, u, &mut history);
        stream.update(&gains, &mut plain, y, u, &mut ());
        close(late.level0(), plain.level0(), 1e-14);
    }
}

/// Without compensation a delay of a moving body shows; with it, it does not.
#[test]
fn compensation_removes_the_lag() {
    let chain = first_order(2.0);
    let (gains, stream) = (gains(&chain, 0.01), Stream::new(chain));
    let mut history = History::new(ring(16), 0.1).expect("a delay");
    let (mut with, mut without) = (StreamState::new(), StreamState::new());
    for n in 0..2000 {
        let y = 0.01 * f64::from(n) - 0.1;
        stream.update(&gains, &mut with, y, 1.0, &mut history);
        stream.update(&gains, &mut without, y, 1.0, &mut ());
    }
    close(with.level0(), 19.99, 1e-6);
    close(without.level0(), 19.89, 1e-6);
}

// ------------------------------------------------------------------------------------------------------------ the longest one

/// The largest level 0 in the last tenth of a run from 1 with measurements of 0 that are `delay` late, over that in the
/// tenth before it.
fn growth<D: Discretise<f64, N>, const N: usize>(design: D, delay: f64, duration: f64) -> f64 {
    let dt = delay / 200.0;
    let gains = gains(&design, dt);
    let stream = Stream::new(design);
    let mut history = History::new(ring(210), delay).expect("a delay");
    let mut levels = [0.0; N];
    levels[0] = 1.0;
    let mut state = StreamState::from_levels(levels);
    let (mut before, mut last) = (0.0f64, 0.0f64);
    let mut time = 0.0;
    while time < duration {
        stream.update(&gains, &mut state, 0.0, 0.0, &mut history);
        time += dt;
        if time > 0.9 * duration {
            last = last.max(state.level0().abs());
        } else if time > 0.8 * duration {
            before = before.max(state.level0().abs());
        }
    }
    last / before
}

#[track_caller]
fn stable_up_to<D: Discretise<f64, N>, const N: usize>(design: D, longest: f64, duration: f64) {
    let (shorter, longer) =
        (growth(design, 0.9 * longest, duration), growth(design, 1.1 * longest, duration));
    assert!(shorter < 0.9, "grows by {shorter} at 0.9 of {longest} s");
    assert!(longer > 1.1, "grows by {longer} at 1.1 of {longest} s");
}

#[test]
fn the_first_order_bears_a_quarter_turn() {
    for tau in [0.1, 0.5, 20.0] {
        let chain = first_order(1.0 / tau);
        let longest = longest_delay(chain.coefficients(), chain.coefficients().len());
        close(longest, std::f64::consts::FRAC_PI_2 * tau, 1e-6 * tau);
        stable_up_to(chain, longest, 100.0 * tau);
    }
}

/// `k_1 s + k_2` over `s²`: the crossover and its phase in closed form.
#[test]
fn the_longest_delay_of_the_second_order() {
    for chain in [pi(1.0, 0.4), pi(3.0, 0.2), butterworth::<f64, 2>(2.0).chain()] {
        let [k1, k2] = *chain.coefficients();
        let square = k1 * k1;
        let crossover = f64::midpoint(square, square.hypot(2.0 * k2)).sqrt();
        let longest = longest_delay(chain.coefficients(), chain.coefficients().len());
        close(longest, (k1 * crossover / k2).atan() / crossover, 1e-9);
        stable_up_to(chain, longest, 200.0 * longest);
    }
}

#[test]
fn the_longest_delay_of_the_third_order() {
    let chain = third_order_butterworth(2.0);
    let alike = Chain::<f64, 3, 1>::new(*chain.coefficients()).expect("stable");
    let longest = longest_delay(alike.coefficients(), alike.coefficients().len());
    stable_up_to(chain, longest, 300.0 * longest);
    stable_up_to(alike, longest, 300.0 * longest);
}

#[test]
fn the_longest_delay_of_a_split() {
    let design = split::<f64, 2>(2.0, 1);
    let longest = longest_delay(design.coefficients(), design.split());
    stable_up_to(design, longest, 200.0 * longest);
}

/// Scaling time scales the delay, in both scalar types.
#[test]
fn the_longest_delay_scales_with_time() {
    let once = longest_delay(split::<f64, 3>(1.0, 3).coefficients(), 3);
    for rate in [1e-3, 10.0, 1e3] {
        close(longest_delay(split::<f64, 3>(rate, 3).coefficients(), 3) * rate, once, 1e-9);
        let single = longest_delay(split::<f32, 3>(f32::literal(rate), 3).coefficients(), 3);
        close(f64::from(single) * rate, once, 1e-4);
    }
}
