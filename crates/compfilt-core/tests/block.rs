//! A block of samples as one affine map: the recurrence to 1e-13, wherever it is cut and however the parts are put together.

mod common;

use common::{Check, Kind, Noise, close, every_filter, gains, pi, third_order};
use compfilt_core::linear::{AffineMap, Runs, Transition};
use compfilt_core::nalgebra::SVector;
use compfilt_core::{Discretise, Real, Recurrence, State};

const SAMPLES: usize = 48;
const DT: f64 = 0.02;
const TOLERANCE: f64 = 1e-13;

/// Signals of size 1 and the state before them.
struct Block<const N: usize> {
    y: Vec<f64>,
    u: Vec<f64>,
    start: State<f64, N>,
}

impl<const N: usize> Block<N> {
    fn new(seed: u64) -> Self {
        let mut noise = Noise::new(seed);
        let (y, u) = (noise.values(SAMPLES), noise.values(SAMPLES));
        Self { y, u, start: State { levels: core::array::from_fn(|_| noise.value()) } }
    }

    /// The state after the samples before `end`, by the recurrence.
    fn recurrence<G: Recurrence<f64, N>>(&self, gains: &G, end: usize) -> State<f64, N> {
        let mut state = self.start;
        for (y, u) in self.y.iter().zip(&self.u).take(end) {
            gains.step(&mut state, *y, *u);
        }
        state
    }

    fn map<D: Discretise<f64, N>>(
        &self,
        gains: &D::Gains,
        range: core::ops::Range<usize>,
    ) -> AffineMap<f64, N> {
        AffineMap::of_block::<D>(gains, &self.y[range.clone()], &self.u[range])
    }
}

/// `TOLERANCE` in units of the largest number.
#[track_caller]
fn same<const N: usize>(kind: Kind, found: &State<f64, N>, wanted: &State<f64, N>) {
    let largest = wanted.levels.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (found, wanted) in found.levels.iter().zip(&wanted.levels) {
        let error = (found - wanted).abs() / largest;
        assert!(error <= TOLERANCE, "{}: {found} instead of {wanted}, {error:e}", kind.name);
    }
}

#[track_caller]
fn same_map<const N: usize>(kind: Kind, found: &AffineMap<f64, N>, wanted: &AffineMap<f64, N>) {
    let largest = wanted.matrix.amax().max(wanted.offset.amax()).max(1.0);
    let error = (found.matrix - wanted.matrix).amax().max((found.offset - wanted.offset).amax());
    assert!(error <= TOLERANCE * largest, "{}: {error:e}", kind.name);
}

struct EqualsTheRecurrence;

impl Check<f64> for EqualsTheRecurrence {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, DT);
        let block = Block::<N>::new(21);
        for end in [0, 1, 2, 7, SAMPLES] {
            let map = block.map::<D>(&gains, 0..end);
            same(kind, &map.apply(&block.start), &block.recurrence(&gains, end));
        }
    }
}

#[test]
fn a_block_is_the_recurrence() {
    every_filter(3.0, 0.5, &mut EqualsTheRecurrence);
}

struct CutAnywhere;

impl Check<f64> for CutAnywhere {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, DT);
        let block = Block::<N>::new(22);
        let whole = block.map::<D>(&gains, 0..SAMPLES);
        for cut in 0..=SAMPLES {
            let first = block.map::<D>(&gains, 0..cut);
            same_map(kind, &first.then(&block.map::<D>(&gains, cut..SAMPLES)), &whole);
        }
    }
}

#[test]
fn a_block_can_be_cut_anywhere() {
    every_filter(3.0, 0.5, &mut CutAnywhere);
}

struct Associative;

impl Check<f64> for Associative {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, DT);
        let block = Block::<N>::new(23);
        let [a, b, c] = [0..9, 9..30, 30..SAMPLES].map(|range| block.map::<D>(&gains, range));
        same_map(kind, &a.then(&b).then(&c), &a.then(&b.then(&c)));
        let identity = AffineMap::identity();
        assert_eq!(a.then(&identity), a, "{}", kind.name);
        assert_eq!(identity.then(&a), a, "{}", kind.name);
        assert_eq!(identity.apply(&block.start), block.start);
    }
}

#[test]
fn composition_is_associative() {
    every_filter(3.0, 0.5, &mut Associative);
}

/// One sample is `Transition::sample`, many without signals are a power of the transition.
struct Powers;

impl Check<f64> for Powers {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, DT);
        let step = Transition::of::<D>(&gains);
        let block = Block::<N>::new(24);
        let mut chained = AffineMap::identity();
        for (n, (y, u)) in block.y.iter().zip(&block.u).enumerate() {
            same_map(kind, &step.sample(*y, *u), &block.map::<D>(&gains, n..n + 1));
            chained = chained.then(&step.sample(*y, *u));
            let repeated = step.repeated(n + 1, chained.offset);
            same_map(kind, &repeated, &chained);
        }
        same(kind, &chained.apply(&block.start), &block.recurrence(&gains, SAMPLES));
        assert_eq!(step.repeated(0, SVector::zeros()), AffineMap::identity(), "{}", kind.name);
    }
}

#[test]
fn powers_of_a_step() {
    every_filter(3.0, 0.5, &mut Powers);
}

/// Runs from zero and what each start adds give every level of every sample; powers give the starts; all runs together are a
/// power of the step.
struct SideBySide;

const RUN: usize = 6;
const RUNS: usize = SAMPLES / RUN;

impl Check<f64> for SideBySide {
    fn check<D: Discretise<f64, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let gains = gains(&design, DT);
        let runs = Runs::<f64, N, RUN, RUNS>::of::<D>(&gains);
        let block = Block::<N>::new(28);
        let mut ends = State { levels: [0.0; N] };
        for run in 0..RUNS {
            let first = run * RUN;
            let mut start = ends.levels;
            for (row, sum) in start.iter_mut().enumerate() {
                for (column, x) in block.start.levels.iter().enumerate() {
                    *sum += runs.powers()[row][column][run] * x;
                }
            }
            same(kind, &State { levels: start }, &block.recurrence(&gains, first));
            let mut from_zero = State { levels: [0.0; N] };
            for sample in 0..RUN {
                gains.step(&mut from_zero, block.y[first + sample], block.u[first + sample]);
                let levels = core::array::from_fn(|level| {
                    let added = runs.from_start()[level][sample].iter().zip(&start);
                    from_zero.levels[level] + added.map(|(weight, x)| weight * x).sum::<f64>()
                });
                same(kind, &State { levels }, &block.recurrence(&gains, first + sample + 1));
            }
            for sample in first..first + RUN {
                gains.step(&mut ends, block.y[sample], block.u[sample]);
            }
        }
        let wanted = block.recurrence(&gains, SAMPLES);
        let mut over_all = block.start.levels;
        runs.over_all(&mut over_all, &ends.levels);
        same(kind, &State { levels: over_all }, &wanted);
        let mut again = block.start.levels;
        runs.repeated(1).follow(&mut again, &ends.levels);
        same(kind, &State { levels: again }, &State { levels: over_all });
        let thrice = Transition::of::<D>(&gains).repeated(3 * SAMPLES, SVector::zeros());
        let mut without = block.start.levels;
        runs.repeated(3).follow(&mut without, &[0.0; N]);
        same(kind, &State { levels: without }, &thrice.apply(&block.start));
    }
}

#[test]
fn runs_side_by_side() {
    every_filter(3.0, 0.5, &mut SideBySide);
}

/// What lies beyond the shorter slice is left out.
#[test]
fn slices_of_different_length() {
    let chain = pi(2.0, 0.5);
    let gains = gains(&chain, DT);
    let block = Block::<2>::new(26);
    let map =
        AffineMap::of_block::<compfilt_core::Chain<f64, 2, 1>>(&gains, &block.y[..9], &block.u);
    assert_eq!(map, block.map::<compfilt_core::Chain<f64, 2, 1>>(&gains, 0..9));
}

/// In `f32` a block of 48 samples is the recurrence to 1e-5.
#[test]
fn a_block_in_single_precision() {
    let gains = gains(&third_order::<f32>(3.0), 0.02);
    let mut noise = Noise::new(27);
    let (y, u): (Vec<f32>, Vec<f32>) = (noise.values(SAMPLES), noise.values(SAMPLES));
    let map = AffineMap::of_block::<compfilt_core::Chain<f32, 3, 2>>(&gains, &y, &u);
    let mut state = State { levels: [0.3, -0.2, 0.1] };
    let end = map.apply(&state);
    for (y, u) in y.iter().zip(&u) {
        gains.step(&mut state, *y, *u);
    }
    for (found, wanted) in end.levels.iter().zip(&state.levels) {
        close(found.to_f64(), wanted.to_f64(), 1e-5);
    }
}

/// Thousands of blocks of a filter that remembers for a million samples: what a block takes away keeps its own precision.
#[test]
fn a_chain_of_blocks_of_a_slow_filter() {
    let chain = compfilt_core::FirstOrder::new(1e6_f64).expect("a time constant").chain();
    let gains = gains(&chain, 1.0);
    let runs = Runs::<f64, 1, 16, 8>::of::<compfilt_core::Chain<f64, 1, 1>>(&gains);
    // At rest at 1 the measurement puts back what the filter forgets.
    let mut end = State { levels: [0.0] };
    for _ in 0..16 * 8 {
        gains.step(&mut end, 1.0, 0.0);
    }
    let mut level = [1.0];
    for _ in 0..100_000 {
        runs.over_all(&mut level, &end.levels);
    }
    close(level[0], 1.0, 1e-14);
}
