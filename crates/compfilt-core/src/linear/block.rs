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

/// `L` runs of `B` samples each, one after the other in the log, to be filtered side by side.
///
/// The filter's own steps go through every run from a state of zero. With the powers of `A^B` their ends give the state
/// before each run, and what that state adds to the samples of its run is `B` rows of numbers, known beforehand.
///
/// ```
/// use compfilt_core::linear::Runs;
/// use compfilt_core::{Chain, FirstOrder, Recurrence, State};
/// let gains = FirstOrder::new(1.0_f64)?.at(0.25)?;
/// let runs = Runs::<f64, 1, 2, 8>::of::<Chain<f64, 1, 1>>(&gains);
///
/// let (mut state, mut from_zero) = (State { levels: [7.0] }, State { levels: [0.0] });
/// for (sample, y) in [3.0, 5.0].into_iter().enumerate() {
///     gains.step(&mut state, y, 0.0);
///     gains.step(&mut from_zero, y, 0.0);
///     let added = 7.0 * runs.from_start()[0][sample][0];
///     assert!((from_zero.levels[0] + added - state.levels[0]).abs() < 1e-15);
/// }
///
/// // 0.8 a sample: three runs of two samples.
/// assert!((runs.powers()[0][0][3] - 0.8_f64.powi(6)).abs() < 1e-15);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runs<T: Real, const N: usize, const B: usize, const L: usize> {
    from_start: [[[T; N]; B]; N],
    powers: [[[T; L]; N]; N],
    all: Motion<T, N>,
}

impl<T: Real, const N: usize, const B: usize, const L: usize> Runs<T, N, B, L> {
    /// The runs of a filter with `gains`.
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
        Self { from_start: Self::without_signals(gains), powers, all }
    }

    /// The step itself, run on unit vectors.
    fn without_signals<G: Recurrence<T, N>>(gains: &G) -> [[[T; N]; B]; N] {
        let mut from_start = [[[T::zero(); N]; B]; N];
        let mut rows = super::discrete::identity();
        for sample in 0..B {
            gains.step(&mut rows, SVector::zeros(), SVector::zeros());
            for (from_start, row) in from_start.iter_mut().zip(&rows.levels) {
                from_start[sample] = (*row).into();
            }
        }
        from_start
    }

    /// What each level of the state before a run adds to a level of a sample: level by level, sample by sample.
    pub fn from_start(&self) -> &[[[T; N]; B]; N] {
        &self.from_start
    }

    /// The first `L` powers of `A^B`, from the power 0 on: row by row, column by column, power by power.
    pub fn powers(&self) -> &[[[T; L]; N]; N] {
        &self.powers
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
