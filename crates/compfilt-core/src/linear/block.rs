//! A block of samples as one affine map of the state.
//!
//! Over a block a linear filter is `x_end = A x_start + b`, `y = O x_start + (what the block's own samples add)`. This is
//! the one place that knows it; what filters parts of a log side by side composes these maps. It reorders sums, so it
//! equals the recurrence to rounding only and is asked for by name.

use super::{Discretise, Recurrence, State};
use crate::Real;
use nalgebra::{SMatrix, SVector};

/// One step as matrices: `x = A x + m y + n u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition<T: Real, const N: usize> {
    /// `A`: from the state before.
    pub state: SMatrix<T, N, N>,
    /// `m`: from the measurement.
    pub measurement: SVector<T, N>,
    /// `n`: from the input.
    pub input: SVector<T, N>,
}

impl<T: Real, const N: usize> Transition<T, N> {
    /// The matrices of a step with `gains`: the step itself, run on unit vectors.
    ///
    /// ```
    /// use compfilt_core::linear::Transition;
    /// use compfilt_core::{Chain, FirstOrder};
    /// let gains = FirstOrder::new(1.0_f64)?.at(0.25)?;
    /// let step = Transition::of::<Chain<f64, 1, 1>>(&gains);
    /// assert!((step.state[0] - 0.8).abs() < 1e-15 && (step.measurement[0] - 0.2).abs() < 1e-15);
    /// # Ok::<(), compfilt_core::Error>(())
    /// ```
    pub fn of<D: Discretise<T, N>>(gains: &D::Gains) -> Self {
        let mut rows = super::discrete::identity();
        gains.step(&mut rows, SVector::zeros(), SVector::zeros());
        Self {
            state: SMatrix::from_fn(|row, column| rows.levels[row][column]),
            measurement: Self::answer(gains, T::one(), T::zero()),
            input: Self::answer(gains, T::zero(), T::one()),
        }
    }

    fn answer<G: Recurrence<T, N>>(gains: &G, y: T, u: T) -> SVector<T, N> {
        let mut state = State::at_rest::<T>(T::zero());
        gains.step(&mut state, y, u);
        SVector::from(state.levels)
    }

    /// The map over one sample.
    pub fn sample(&self, y: T, u: T) -> AffineMap<T, N> {
        AffineMap { matrix: self.state, offset: self.measurement * y + self.input * u }
    }

    /// The map over `samples` equal steps to which their inputs add `offset`.
    pub fn repeated(&self, samples: usize, offset: SVector<T, N>) -> AffineMap<T, N> {
        AffineMap { matrix: self.power(samples), offset }
    }

    /// `A^samples` by squaring.
    fn power(&self, mut samples: usize) -> SMatrix<T, N, N> {
        let mut power = SMatrix::identity();
        let mut square = self.state;
        while samples > 0 {
            if samples % 2 == 1 {
                power *= square;
            }
            square *= square;
            samples /= 2;
        }
        power
    }
}

/// `x ↦ A x + b`: what a block of samples does to the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineMap<T: Real, const N: usize> {
    /// `A`.
    pub matrix: SMatrix<T, N, N>,
    /// `b`: the end state from a start at zero.
    pub offset: SVector<T, N>,
}

impl<T: Real, const N: usize> AffineMap<T, N> {
    /// The map of no samples.
    pub fn identity() -> Self {
        Self { matrix: SMatrix::identity(), offset: SVector::zeros() }
    }

    /// The map of a block of samples at one time step. Samples beyond the shorter slice are left out.
    ///
    /// ```
    /// use compfilt_core::linear::AffineMap;
    /// use compfilt_core::{Chain, PiForm, Recurrence, State};
    /// let gains = PiForm::new(2.0_f64, 1.0)?.at(0.1)?;
    /// let (y, u) = ([0.3, 0.1, -0.2], [1.0, 2.0, 0.5]);
    /// let map = AffineMap::of_block::<Chain<f64, 2, 1>>(&gains, &y, &u);
    ///
    /// let mut state = State { levels: [0.7, -0.1] };
    /// let end = map.apply(&state);
    /// for (y, u) in y.into_iter().zip(u) {
    ///     gains.step(&mut state, y, u);
    /// }
    /// assert!((end.levels[0] - state.levels[0]).abs() < 1e-15);
    /// # Ok::<(), compfilt_core::Error>(())
    /// ```
    pub fn of_block<D: Discretise<T, N>>(gains: &D::Gains, measurement: &[T], input: &[T]) -> Self {
        let mut state = State::at_rest::<T>(T::zero());
        let mut samples = 0;
        for (y, u) in measurement.iter().zip(input) {
            gains.step(&mut state, *y, *u);
            samples += 1;
        }
        Transition::of::<D>(gains).repeated(samples, SVector::from(state.levels))
    }

    /// This map, then `later`.
    #[must_use]
    pub fn then(&self, later: &Self) -> Self {
        Self {
            matrix: later.matrix * self.matrix,
            offset: later.matrix * self.offset + later.offset,
        }
    }

    /// The state after the block.
    pub fn apply(&self, state: &State<T, N>) -> State<T, N> {
        let end = self.matrix * SVector::from(state.levels) + self.offset;
        State { levels: end.into() }
    }
}

/// How level 0 of `B` samples in a row depends on the state before and on the samples:
/// `y_b = O_b x + Σ_{a ≤ b} (h_y[b-a] y_a + h_u[b-a] u_a)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockResponse<T: Real, const N: usize, const B: usize> {
    /// `O`, row by row.
    pub from_state: [SVector<T, N>; B],
    /// `h_y`: the response of level 0 to one measurement of 1.
    pub from_measurement: [T; B],
    /// `h_u`: the response of level 0 to one input of 1.
    pub from_input: [T; B],
}

impl<T: Real, const N: usize, const B: usize> BlockResponse<T, N, B> {
    /// The responses of a filter with `gains`: the step itself, run on unit vectors and impulses.
    pub fn of<D: Discretise<T, N>>(gains: &D::Gains) -> Self {
        let mut rows = super::discrete::identity();
        Self {
            from_state: core::array::from_fn(|_| {
                gains.step(&mut rows, SVector::zeros(), SVector::zeros())
            }),
            from_measurement: Self::impulse(gains, T::one(), T::zero()),
            from_input: Self::impulse(gains, T::zero(), T::one()),
        }
    }

    fn impulse<G: Recurrence<T, N>>(gains: &G, y: T, u: T) -> [T; B] {
        let mut state = State::at_rest::<T>(T::zero());
        core::array::from_fn(|b| {
            if b == 0 {
                gains.step(&mut state, y, u)
            } else {
                gains.step(&mut state, T::zero(), T::zero())
            }
        })
    }
}

/// `L` runs of `B` samples each, one after the other in the log, to be filtered side by side.
///
/// What every sample adds to the end of its run is a weight: `2 N` scalar products a run, which know nothing of each other,
/// give the end of each run from a start at zero. With the powers of `A^B` they give the state before each run, and the
/// filter's own steps do the rest.
///
/// ```
/// use compfilt_core::linear::Runs;
/// use compfilt_core::{Chain, FirstOrder, Recurrence, State};
/// let gains = FirstOrder::new(1.0_f64)?.at(0.25)?;
/// let runs = Runs::<f64, 1, 2, 8>::of::<Chain<f64, 1, 1>>(&gains);
///
/// let mut state = State::at_rest::<f64>(0.0);
/// gains.step(&mut state, 3.0, 0.0);
/// gains.step(&mut state, 5.0, 0.0);
/// let [from_first, from_second] = runs.from_measurement()[0];
/// assert!((3.0 * from_first + 5.0 * from_second - state.levels[0]).abs() < 1e-15);
///
/// // 0.8 a sample: three runs of two samples.
/// assert!((runs.powers()[0][0][3] - 0.8_f64.powi(6)).abs() < 1e-15);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runs<T: Real, const N: usize, const B: usize, const L: usize> {
    measurement: [[T; B]; N],
    input: [[T; B]; N],
    powers: [[[T; L]; N]; N],
    /// `A^B`.
    one: SMatrix<T, N, N>,
    all: Motion<T, N>,
}

impl<T: Real, const N: usize, const B: usize, const L: usize> Runs<T, N, B, L> {
    /// The runs of a filter with `gains`: the weights are the step itself, run on impulses.
    pub fn of<D: Discretise<T, N>>(gains: &D::Gains) -> Self {
        let one = Motion::of::<D>(gains).repeated(B);
        let mut powers = [[[T::zero(); L]; N]; N];
        let mut all = Motion::none();
        for run in 0..L {
            let power = all.matrix();
            for (row, powers) in powers.iter_mut().enumerate() {
                for (column, powers) in powers.iter_mut().enumerate() {
                    powers[run] = power[(row, column)];
                }
            }
            all = all.then(&one);
        }
        Self {
            measurement: Self::weights(gains, T::one(), T::zero()),
            input: Self::weights(gains, T::zero(), T::one()),
            powers,
            one: one.matrix(),
            all,
        }
    }

    /// What an impulse in each sample leaves at the end of its run.
    fn weights<G: Recurrence<T, N>>(gains: &G, y: T, u: T) -> [[T; B]; N] {
        let mut weights = [[T::zero(); B]; N];
        let mut state = State::at_rest::<T>(T::zero());
        for sample in (0..B).rev() {
            if sample + 1 == B {
                gains.step(&mut state, y, u);
            } else {
                gains.step(&mut state, T::zero(), T::zero());
            }
            for (weights, x) in weights.iter_mut().zip(&state.levels) {
                weights[sample] = *x;
            }
        }
        weights
    }

    /// For every level what a measurement of 1 adds to it by the end of the run, sample by sample.
    pub fn from_measurement(&self) -> &[[T; B]; N] {
        &self.measurement
    }

    /// The same of an input of 1.
    pub fn from_input(&self) -> &[[T; B]; N] {
        &self.input
    }

    /// The first `L` powers of `A^B`, from the power 0 on: row by row, column by column, power by power.
    pub fn powers(&self) -> &[[[T; L]; N]; N] {
        &self.powers
    }

    /// Moves the state on over one run, which adds `end`: the state after it from a start at zero.
    #[inline]
    pub fn over_one(&self, levels: &mut [T; N], end: &[T; N]) {
        *levels = (SVector::from(*end) + self.one * SVector::from(*levels)).into();
    }

    /// Moves the state on over all runs, which add `end`: the state after them from a start at zero.
    #[inline]
    pub fn over_all(&self, levels: &mut [T; N], end: &[T; N]) {
        self.all.follow(levels, end);
    }

    /// How all runs `times` times in a row move the state.
    pub fn repeated(&self, times: usize) -> Motion<T, N> {
        self.all.repeated(times)
    }
}

/// How steps without signals move the state, the prediction and what the corrections take away apart: `A = Φ - C`.
///
/// A slow filter takes little away in a step. In `A` alone that little would be rounded at the size of the state, and a chain
/// of blocks collects such errors for as long as the filter remembers. Over a time in which the filter forgets, on the other
/// hand, prediction and correction are large and cancel: then `Φ` is all of `A`, and `C` zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<T: Real, const N: usize> {
    predicted: SMatrix<T, N, N>,
    corrected: SMatrix<T, N, N>,
}

impl<T: Real, const N: usize> Motion<T, N> {
    fn none() -> Self {
        Self { predicted: SMatrix::identity(), corrected: SMatrix::zeros() }
    }

    /// One step: `C = L Φ_0`.
    fn of<D: Discretise<T, N>>(gains: &D::Gains) -> Self {
        let rows = D::transition(gains).levels;
        let predicted = SMatrix::from_fn(|row, column| rows[row][column]);
        let corrected =
            SMatrix::from_fn(|row, column| gains.correction()[row] * predicted[(0, column)]);
        Self { predicted, corrected }
    }

    /// `A`.
    fn matrix(&self) -> SMatrix<T, N, N> {
        self.predicted - self.corrected
    }

    /// This motion, then `later`.
    fn then(&self, later: &Self) -> Self {
        let corrected = later.predicted * self.corrected + later.corrected * self.matrix();
        let both = Self { predicted: later.predicted * self.predicted, corrected };
        if both.corrected[(0, 0)] < T::literal(0.5) {
            both
        } else {
            Self { predicted: later.matrix() * self.matrix(), corrected: SMatrix::zeros() }
        }
    }

    /// This motion so many times, by squaring.
    fn repeated(&self, mut times: usize) -> Self {
        let mut power = Self::none();
        let mut square = *self;
        while times > 0 {
            if times % 2 == 1 {
                power = power.then(&square);
            }
            square = square.then(&square);
            times /= 2;
        }
        power
    }

    /// Moves the state on over steps that add `end`: the state after them from a start at zero.
    #[inline]
    pub fn follow(&self, levels: &mut [T; N], end: &[T; N]) {
        let x = SVector::from(*levels);
        *levels = (self.predicted * x + (SVector::from(*end) - self.corrected * x)).into();
    }
}
