//! The contract of every linear filter, in `f32` and `f64`: consistent input is reproduced whatever the gains, the time steps and
//! the gaps; whole = chunked = resumed, and step = predict + correct = stream, bit for bit; finite in, finite out.

mod common;

use common::{
    Check, Kind, Motion, Noise, Path, Sample, all_bits, backward_euler_filters, bits, every_filter,
    forgives, gains, gappy_samples, noisy_samples, run,
};
use compfilt_core::linear::{Flags, Input, Stream, StreamState};
use compfilt_core::nalgebra::ComplexField;
use compfilt_core::{Discretise, Number, Real, Recurrence, State};
use proptest::prelude::{ProptestConfig, Strategy, prop};
use proptest::proptest;

fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() }
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
    let step =
        step.prop_map(|(exponent, u, measured)| Step { dt: 10f64.powf(exponent), u, measured });
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
    /// A jump of the time step by a large factor multiplies rounding errors at high orders, where no measurement holds the
    /// upper levels, and from order 3 on with matched poles: there the steps lie between 0.02 and 0.2 of 1/rate.
    fn step_of<T: Real>(&self, step: &Step, delicate: bool) -> T {
        T::literal(if delicate { 0.126 * step.dt.powf(0.2) / self.rate } else { step.dt })
    }

    fn run<T: Real, D: Discretise<T, N>, const N: usize>(&self, kind: Kind, design: D, gaps: bool) {
        let delicate = (gaps && N > 1)
            || (kind.motion == Motion::Exact && N > 2)
            || !forgives::<T, N>(self.rate, 10.0);
        let below = self.start.iter().take(kind.derivative_order);
        let mut path = Path::new(kind.motion, below.map(|x| T::literal(*x)).collect());
        let mut levels = [T::zero(); N];
        levels[..kind.derivative_order].copy_from_slice(&path.levels);
        let mut state = StreamState::from_levels(levels);
        let stream = Stream::new(design);
        for (n, step) in self.steps.iter().enumerate() {
            let (dt, u) = (self.step_of(step, delicate), T::literal(step.u));
            let y = path.advance(dt, u);
            let measured = if step.measured || !gaps { y } else { T::NAN };
            stream.update(&gains(&design, dt), &mut state, measured, u, &mut ());
            within_rounding::<T>(kind, n, state.level0() - y, path.sizes[0]);
        }
    }
}

impl<T: Real> Check<T> for Reproduces<'_> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        self.run(kind, design, false);
        self.run(kind, design, true);
    }
}

/// `error` after `n` samples is a few units of rounding a sample of `size`, the sum of the sizes of all that was added up.
fn within_rounding<T: Real>(kind: Kind, n: usize, error: T, size: T) {
    let n = u32::try_from(n).expect("few samples");
    let units = (error.abs() / (size * T::default_epsilon())).to_f64();
    let allowed = 16.0 + f64::from(n);
    assert!(units <= allowed, "{}, sample {n}: {units} units, allowed {allowed}", kind.name);
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
            let (dt, u): (T, T) = (self.0.step_of(step, N > 1), T::literal(step.u));
            let from = before.replace(u).unwrap_or(u);
            let half = dt * T::literal(0.5);
            y += half * (from + u);
            size += half * (from.abs() + u.abs());
            let measured = if step.measured { y } else { T::NAN };
            stream.update(&gains(&design, dt), &mut state, measured, u, &mut ());
            within_rounding::<T>(kind, n, state.level0() - y, size);
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

/// The same samples by `step`, by its two halves, by `predict` and `correct`, and through a stream.
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
            predict_and_correct_is_a_step(kind, &gains, &stepped, sample);
            let output = gains.step(&mut stepped, sample.y, sample.u);
            let innovation = gains.predict_and_compare(&mut halves, sample.y, sample.u);
            gains.correct(&mut halves, innovation);
            assert!(stream.is_plain_step(&streamed));
            let flags = stream.update(&gains, &mut streamed, sample.y, sample.u, &mut ());

            assert_eq!(flags, Flags::default());
            let wanted = all_bits(&stepped.levels);
            assert_eq!(bits(output), wanted[0], "{}", kind.name);
            assert_eq!(all_bits(&halves.levels), wanted, "{}", kind.name);
            assert_eq!(all_bits(&streamed.levels.levels), wanted, "{}", kind.name);
        }
    }
}

/// `predict` moves the state as the step does, bit for bit, and `correct` by the difference agrees to rounding.
fn predict_and_correct_is_a_step<T: Real, G: Recurrence<T, N>, const N: usize>(
    kind: Kind,
    gains: &G,
    state: &State<T, N>,
    sample: Sample<T>,
) {
    let (mut predicted, mut compared, mut stepped) = (*state, *state, *state);
    gains.predict(&mut predicted, sample.u);
    let innovation = gains.predict_and_compare(&mut compared, sample.y, sample.u);
    assert_eq!(all_bits(&predicted.levels), all_bits(&compared.levels), "{}", kind.name);
    let difference = sample.y - predicted.levels[0];
    let size = T::one() + predicted.levels[0].abs() + sample.y.abs() + sample.u.abs();
    let tolerance = size * T::default_epsilon() * T::literal(4.0);
    assert!((innovation - difference).abs() <= tolerance, "{}", kind.name);

    gains.correct(&mut predicted, difference);
    gains.step(&mut stepped, sample.y, sample.u);
    for ((x, wanted), l) in predicted.levels.iter().zip(&stepped.levels).zip(gains.correction()) {
        let allowed = tolerance * l.abs() + wanted.abs() * T::default_epsilon();
        assert!((*x - *wanted).abs() <= allowed, "{}", kind.name);
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

/// Wild samples at wild time steps: through a stream, which starts anew if a state overflows, and where rounding errors
/// stay small also by bare steps and with every third measurement missing.
struct StaysFinite<'a> {
    rate: f64,
    samples: &'a [(f64, f64, f64)],
}

impl StaysFinite<'_> {
    fn stream<T: Real, D: Discretise<T, N>, const N: usize>(
        &self,
        kind: Kind,
        design: D,
        gaps: bool,
    ) {
        let stream = Stream::new(design);
        let mut state = StreamState::from_levels([T::zero(); N]);
        for (n, (dt, y, u)) in self.samples.iter().enumerate() {
            let y = if gaps && n % 3 == 1 { T::NAN } else { T::literal(*y) };
            let gains = gains(&design, T::literal(*dt));
            stream.update(&gains, &mut state, y, T::literal(*u), &mut ());
            all_finite(kind, n, &state.levels);
        }
    }

    fn steps<T: Real, D: Discretise<T, N>, const N: usize>(&self, kind: Kind, design: D) {
        let mut state = State::at_rest::<T>(T::zero());
        for (n, (dt, y, u)) in self.samples.iter().enumerate() {
            gains(&design, T::literal(*dt)).step(&mut state, T::literal(*y), T::literal(*u));
            all_finite(kind, n, &state);
        }
    }
}

fn all_finite<T: Real, const N: usize>(kind: Kind, n: usize, state: &State<T, N>) {
    let finite = state.levels.iter().all(ComplexField::is_finite);
    assert!(finite, "{}, sample {n}: {state:?}", kind.name);
}

impl<T: Real> Check<T> for StaysFinite<'_> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        self.stream(kind, design, false);
        if forgives::<T, N>(self.rate, 1e3) {
            self.steps(kind, design);
            self.stream(kind, design, true);
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
        let mut check = StaysFinite { rate, samples: &samples };
        backward_euler_filters::<f64>(rate, shape, &mut check);
        backward_euler_filters::<f32>(f32::literal(rate), f32::literal(shape), &mut check);
    }

    #[test]
    fn finite_at_steps_of_no_length_and_of_any_size(
        rate in rates(), shape in 0.0..1.0,
        samples in prop::collection::vec(
            (prop::sample::select(&[0.0, 1e-9, 1e-3, 1.0, 1e3]), -1e6..1e6, -1e6..1e6), 1..200),
    ) {
        let mut check = StaysFinite { rate, samples: &samples };
        backward_euler_filters::<f64>(rate, shape, &mut check);
        backward_euler_filters::<f32>(f32::literal(rate), f32::literal(shape), &mut check);
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
        assert!(!state.level0().is_finite() && !stream.is_plain_step(&state));
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
        assert!(stream.is_plain_step(&state));
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
