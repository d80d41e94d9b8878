//! The contract of every linear filter, in `f32` and `f64`: consistent input is reproduced whatever the gains, the time steps and
//! the gaps; whole = chunked = resumed, and step = predict + correct = stream, bit for bit; finite in, finite out.

mod common;

use common::{
    Check, Kind, Motion, Noise, Path, Sample, all_bits, backward_euler_filters, bits, every_filter,
    gains, gappy_samples, noisy_samples, run,
};
use compfilt_core::linear::{Flags, Input, Stream, StreamState};
use compfilt_core::{Discretise, Real, Recurrence, State};
use proptest::prelude::{ProptestConfig, Strategy, prop};
use proptest::proptest;

fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(32) }
}

/// Poles from 0.01 to 100 rad/s.
fn rates() -> impl Strategy<Value = f64> {
    (-2.0..2.0).prop_map(|exponent| 10f64.powf(exponent))
}

/// One step of a motion.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Seconds.
    dt: f64,
    /// The derivative.
    u: f64,
    /// Whether the measurement is there.
    measured: bool,
}

/// Time steps from 0.1 ms to 10 s in any order, three measurements in four.
fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = (-4.0..1.0, -1.0..1.0, prop::bool::weighted(0.75));
    let step = step.prop_map(|(exponent, u, measured)| Step { dt: 10f64.powf(exponent), u, measured });
    prop::collection::vec(step, 1..60)
}

// ------------------------------------------------------------------------------------------- consistent input is reproduced

/// Feeds a motion and the derivative that belongs to it.
struct Reproduces<'a> {
    rate: f64,
    steps: &'a [Step],
    start: [f64; 3],
}

impl Reproduces<'_> {
    /// From order 3 on, matched poles ask for time steps that do not vary by large factors while they are long.
    fn step_of<T: Real>(&self, kind: Kind, order: usize, step: &Step) -> T {
        let delicate = kind.motion == Motion::Exact && order > 2;
        T::literal(if delicate { (1.0 + step.dt.log10() / 8.0) * 0.1 / self.rate } else { step.dt })
    }
}

impl<T: Real> Check<T> for Reproduces<'_> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let below = self.start.iter().take(kind.derivative_order);
        let mut path = Path::new(kind.motion, below.map(|x| T::literal(*x)).collect());
        let mut levels = [T::zero(); N];
        levels[..kind.derivative_order].copy_from_slice(&path.levels);
        let mut state = StreamState::from_levels(levels);
        let stream = Stream::new(design);
        for (n, step) in self.steps.iter().enumerate() {
            let (dt, u) = (self.step_of(kind, N, step), T::literal(step.u));
            let y = path.advance(dt, u);
            let measured = if step.measured { y } else { T::NAN };
            stream.update(&gains(&design, dt), &mut state, measured, u, &mut ());
            let error = (state.level0() - y).abs() / path.sizes[0];
            let bound = T::default_epsilon() * rounding::<T>(n, N);
            assert!(error <= bound, "{}, sample {n}: {error:e} above {bound:e}", kind.name);
        }
    }
}

/// How many units of rounding the output may be off after `n` samples.
fn rounding<T: Real>(n: usize, order: usize) -> T {
    let _ = order;
    let n = u32::try_from(n).expect("few samples");
    T::literal(8.0 + 4.0 * f64::from(n))
}

/// The trapezoid reproduces a rate that is linear between the samples.
struct ReproducesLinearRate<'a>(Reproduces<'a>);

impl<T: Real> Check<T> for ReproducesLinearRate<'_> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        if kind.derivative_order != 1 || kind.motion == Motion::Change {
            return;
        }
        let mut levels = [T::zero(); N];
        levels[0] = T::literal(self.0.start[0]);
        let (mut y, mut size) = (levels[0], levels[0].abs());
        let mut state = StreamState::from_levels(levels);
        let stream = Stream::new(design).input(Input::Trapezoid);
        let mut before = None;
        for (n, step) in self.0.steps.iter().enumerate() {
            let (dt, u): (T, T) = (self.0.step_of(kind, N, step), T::literal(step.u));
            let from = before.replace(u).unwrap_or(u);
            let half = dt * T::literal(0.5);
            y += half * (from + u);
            size += half * (from.abs() + u.abs());
            let measured = if step.measured { y } else { T::NAN };
            stream.update(&gains(&design, dt), &mut state, measured, u, &mut ());
            let error = (state.level0() - y).abs() / size;
            let bound = T::default_epsilon() * rounding::<T>(n, N);
            assert!(error <= bound, "{}, sample {n}: {error:e} above {bound:e}", kind.name);
        }
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn consistent_input_is_reproduced(
        rate in rates(), shape in 0.0..1.0, steps in steps(), start in prop::array::uniform3(-1.0..1.0),
    ) {
        let mut check = Reproduces { rate, steps: &steps, start };
        every_filter::<f64>(rate, shape, &mut check);
        every_filter::<f32>(f32::literal(rate), f32::literal(shape), &mut check);
    }

    #[test]
    fn a_linear_rate_is_reproduced_by_the_trapezoid(
        rate in rates(), shape in 0.0..1.0, steps in steps(), start in prop::array::uniform3(-1.0..1.0),
    ) {
        let mut check = ReproducesLinearRate(Reproduces { rate, steps: &steps, start });
        every_filter::<f64>(rate, shape, &mut check);
        every_filter::<f32>(f32::literal(rate), f32::literal(shape), &mut check);
    }
}

// ---------------------------------------------------------------------------------------------------------- bit for bit

/// Cuts a log with gaps anywhere and goes on from a copy of the state.
struct Resumes(usize);

impl<T: Real> Check<T> for Resumes {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let samples = gappy_samples(3, 80, 0.02);
        for input in [Input::Sample, Input::Trapezoid] {
            let stream = Stream::new(design).input(input);
            let whole = run(&stream, &mut StreamState::new(), &samples);

            let mut state = StreamState::new();
            let mut resumed = run(&stream, &mut state, &samples[..self.0]);
            let mut copy = StreamState { levels: State { levels: state.levels.levels }, ..state };
            run(&stream, &mut state, &samples[self.0..]);
            resumed.extend(run(&stream, &mut copy, &samples[self.0..]));

            assert_eq!(all_bits(&whole), all_bits(&resumed), "{} cut at {}", kind.name, self.0);
            assert_eq!(all_bits(&state.levels.levels), all_bits(&copy.levels.levels));
        }
    }
}

/// Filters in chunks of one length.
struct Chunks(usize);

impl<T: Real> Check<T> for Chunks {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let samples = gappy_samples(4, 80, 0.02);
        let stream = Stream::new(design);
        let whole = run(&stream, &mut StreamState::new(), &samples);
        let mut state = StreamState::new();
        let pieces = samples.chunks(self.0).flat_map(|chunk| run(&stream, &mut state, chunk));
        assert_eq!(all_bits(&whole), all_bits(&pieces.collect::<Vec<_>>()), "{}", kind.name);
    }
}

/// The same samples by `step`, by `predict` and `correct`, and through a stream.
struct StepsAlike;

impl<T: Real> Check<T> for StepsAlike {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let start = [T::literal(0.3); N];
        let mut stepped = State { levels: start };
        let mut halves = stepped;
        let mut streamed = StreamState::from_levels(start);
        let stream = Stream::new(design);
        for sample in noisy_samples::<T>(5, 100, 0.02) {
            let gains = gains(&design, sample.dt);
            let output = gains.step(&mut stepped, sample.y, sample.u);
            gains.predict(&mut halves, sample.u);
            gains.correct(&mut halves, sample.y - halves.levels[0]);
            assert!(stream.is_plain(&streamed));
            let flags = stream.update(&gains, &mut streamed, sample.y, sample.u, &mut ());

            assert_eq!(flags, Flags::default());
            assert_eq!(bits(output), bits(stepped.levels[0]), "{}", kind.name);
            assert_eq!(all_bits(&halves.levels), all_bits(&stepped.levels), "{}", kind.name);
            assert_eq!(
                all_bits(&streamed.levels.levels),
                all_bits(&stepped.levels),
                "{}",
                kind.name
            );
        }
    }
}

/// `at` gives what `gains` gives.
struct GainsAlike;

impl<T: Real> Check<T> for GainsAlike {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let dt = T::literal(0.013);
        let (checked, plain) = (design.at(dt).expect("gains"), gains(&design, dt));
        assert_eq!(all_bits(checked.correction()), all_bits(plain.correction()), "{}", kind.name);
        assert_eq!(bits(checked.dt()), bits(dt));
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn resumed_is_whole(rate in rates(), shape in 0.0..1.0, cut in 0_usize..=80) {
        every_filter::<f64>(rate, shape, &mut Resumes(cut));
        every_filter::<f32>(f32::literal(rate), f32::literal(shape), &mut Resumes(cut));
    }

    #[test]
    fn chunked_is_whole(rate in rates(), shape in 0.0..1.0, length in 1_usize..=81) {
        every_filter::<f64>(rate, shape, &mut Chunks(length));
        every_filter::<f32>(f32::literal(rate), f32::literal(shape), &mut Chunks(length));
    }

    #[test]
    fn a_step_is_a_prediction_and_a_correction(rate in rates(), shape in 0.0..1.0) {
        every_filter::<f64>(rate, shape, &mut StepsAlike);
        every_filter::<f32>(f32::literal(rate), f32::literal(shape), &mut StepsAlike);
    }
}

#[test]
fn gains_are_the_same_checked_or_not() {
    every_filter::<f64>(2.0, 0.5, &mut GainsAlike);
    every_filter::<f32>(2.0, 0.5, &mut GainsAlike);
}

// ------------------------------------------------------------------------------------------------- finite in, finite out

/// Wild samples at wild time steps; every third measurement may be missing.
struct StaysFinite<'a>(&'a [(f64, f64, f64)]);

impl<T: Real> Check<T> for StaysFinite<'_> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let mut stepped = State::at_rest::<T>(T::zero());
        let mut streamed = StreamState::from_levels([T::zero(); N]);
        for (n, (dt, y, u)) in self.0.iter().enumerate() {
            let (dt, y, u) = (T::literal(*dt), T::literal(*y), T::literal(*u));
            let gains = gains(&design, dt);
            gains.step(&mut stepped, y, u);
            let measured = if n % 3 == 1 { T::NAN } else { y };
            stream.update(&gains, &mut streamed, measured, u, &mut ());
            for x in stepped.levels.iter().chain(&streamed.levels.levels) {
                assert!(x.is_finite(), "{}, sample {n}: {x}", kind.name);
            }
        }
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn finite_in_finite_out(
        rate in rates(), shape in 0.0..1.0,
        samples in prop::collection::vec((0.0..1e3, -1e6..1e6, -1e6..1e6), 1..200),
    ) {
        backward_euler_filters::<f64>(rate, shape, &mut StaysFinite(&samples));
        backward_euler_filters::<f32>(f32::literal(rate), f32::literal(shape), &mut StaysFinite(&samples));
    }

    #[test]
    fn finite_at_steps_of_no_length_and_of_any_size(
        rate in rates(), shape in 0.0..1.0,
        samples in prop::collection::vec(
            (prop::sample::select(&[0.0, 1e-9, 1e-3, 1.0, 1e3]), -1e6..1e6, -1e6..1e6), 1..200),
    ) {
        backward_euler_filters::<f64>(rate, shape, &mut StaysFinite(&samples));
        backward_euler_filters::<f32>(f32::literal(rate), f32::literal(shape), &mut StaysFinite(&samples));
    }
}

// ------------------------------------------------------------------------------------------------------ f32 close to f64

/// Collects what every filter makes of noise of size 1 at 100 Hz.
#[derive(Default)]
struct Outputs(Vec<(&'static str, Vec<f64>)>);

impl<T: Real> Check<T> for Outputs {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, T::literal(0.01));
        let mut state = State::at_rest::<T>(T::zero());
        let mut noise = Noise::new(9);
        let outputs = (0..3000).map(|_| {
            let (y, u) = (noise.value(), noise.value());
            gains.step(&mut state, y, u).to_f64()
        });
        self.0.push((kind.name, outputs.collect()));
    }
}

/// The output in `f32` is within 1e-5 of that in `f64`, relative to its largest value: 2 rad/s at 100 Hz, signals of size 1.
#[test]
fn single_precision_is_close_to_double() {
    let (mut single, mut double) = (Outputs::default(), Outputs::default());
    every_filter::<f32>(2.0, 0.5, &mut single);
    every_filter::<f64>(2.0, 0.5, &mut double);
    for ((name, single), (_, double)) in single.0.iter().zip(&double.0) {
        let largest = double.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let error = single.iter().zip(double).fold(0.0, |m: f64, (s, d)| m.max((s - d).abs()));
        println!("{name}: {:e}", error / largest);
        assert!(error <= 1e-5 * largest, "{name}: {:e}", error / largest);
    }
}

// ------------------------------------------------------------------------------------------------------ reset and restart

/// A used state that is started again runs as a fresh one.
struct StartsAgain;

impl<T: Real> Check<T> for StartsAgain {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let clean = noisy_samples::<T>(6, 30, 0.02);
        let mut used = StreamState::new();
        run(&stream, &mut used, &gappy_samples(7, 77, 0.02));
        used.start(T::literal(0.25));
        let mut levels = [T::zero(); N];
        levels[0] = T::literal(0.25);
        let fresh = run(&stream, &mut StreamState::from_levels(levels), &clean);
        assert_eq!(all_bits(&run(&stream, &mut used, &clean)), all_bits(&fresh), "{}", kind.name);
    }
}

/// The first measurement starts a filter: before it the output is NaN, at it the filter rests there.
struct StartsAtTheFirstMeasurement;

impl<T: Real> Check<T> for StartsAtTheFirstMeasurement {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let gains = gains(&design, T::literal(0.01));
        let mut state = StreamState::new();
        let waiting = stream.update(&gains, &mut state, T::NAN, T::one(), &mut ());
        assert_eq!(waiting, Flags::NOT_STARTED | Flags::MEASUREMENT_MISSING, "{}", kind.name);
        assert!(!state.level0().is_finite() && !stream.is_plain(&state));
        let started = stream.update(&gains, &mut state, T::literal(0.7), T::zero(), &mut ());
        assert_eq!(started, Flags::default());
        assert_eq!(bits(state.level0()), bits(T::literal(0.7)), "{}", kind.name);
    }
}

/// A state that has overflowed starts anew from the measurement and says so.
struct RestartsAfterOverflow;

impl<T: Real> Check<T> for RestartsAfterOverflow {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let stream = Stream::new(design);
        let gains = gains(&design, T::literal(0.01));
        let mut state = StreamState::from_levels([T::one() / T::zero(); N]);
        let flags = stream.update(&gains, &mut state, T::literal(0.7), T::one(), &mut ());
        assert_eq!(flags, Flags::RESTARTED, "{}", kind.name);
        assert_eq!(state.levels, State::at_rest::<T>(T::literal(0.7)), "{}", kind.name);
        assert!(stream.is_plain(&state));
    }
}

#[test]
fn a_filter_can_be_started_again() {
    every_filter::<f64>(2.0, 0.5, &mut StartsAgain);
    every_filter::<f32>(2.0, 0.5, &mut StartsAgain);
}

#[test]
fn the_first_measurement_starts_a_filter() {
    every_filter::<f64>(2.0, 0.5, &mut StartsAtTheFirstMeasurement);
    every_filter::<f32>(2.0, 0.5, &mut StartsAtTheFirstMeasurement);
}

#[test]
fn an_overflowed_state_restarts() {
    every_filter::<f64>(2.0, 0.5, &mut RestartsAfterOverflow);
    every_filter::<f32>(2.0, 0.5, &mut RestartsAfterOverflow);
}
