//! The recurrence: a chain of `N` integrators, fed with the `M`-th derivative, corrected by the innovation.

use super::discrete::backward_euler;
use super::poles::{is_stable, poles};
use super::{Matched, Split};
use crate::error::positive;
use crate::{Change, Element, Error, Number, Real, Rule};
use nalgebra::Complex;

/// The state of a filter of order `N`: level 0 is the quantity wanted, level `i` stands for its `i`-th
/// derivative, and the levels from `M` on for minus the error of the input.
///
/// The levels are physical quantities that do not depend on the sample period: a filter can be
/// stopped, stored, resumed, and run at another rate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "E: serde::Serialize", deserialize = "E: serde::Deserialize<'de>"))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct State<E, const N: usize> {
    /// Level 0 first.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub levels: [E; N],
}

impl<E, const N: usize> State<E, N> {
    /// Level 0 at `level0`, the other levels at zero.
    pub fn at_rest<T>(level0: E) -> Self
    where
        E: Element<T>,
    {
        let mut levels = [E::neutral(); N];
        if let Some(first) = levels.first_mut() {
            *first = level0;
        }
        Self { levels }
    }
}

/// The arithmetic per sample: predict with the input, correct by the innovation, or both as one step.
///
/// Batch, stream, Python and firmware loop over these functions and over no others, so that they
/// give the same bits. None of them can fail, panic or allocate.
pub trait Recurrence<T: Number, const N: usize>: Copy {
    /// Moves the state on by the sample period with the input `u`: `x⁻ = Φ x + Γ u`.
    fn predict<E: Element<T>>(&self, state: &mut State<E, N>, u: E);

    /// The same with an input that moves on a straight line from `from` to `to` within the step.
    fn predict_ramp<E: Element<T>>(&self, state: &mut State<E, N>, from: E, to: E);

    /// Corrects a predicted state by the innovation `e = y - x⁻_0`: `x = x⁻ + L e`.
    #[inline(always)]
    fn correct<E: Element<T>>(&self, state: &mut State<E, N>, innovation: E) {
        correct_with(self.correction(), state, innovation);
    }

    /// Predicts like [`predict`](Self::predict) and returns the innovation of the measurement `y`.
    ///
    /// The innovation is `y - x⁻_0`, formed from the state before the prediction: what does not depend on that state is
    /// subtracted from `y` first, so that a loop over samples waits for fewer operations. It differs from the
    /// difference with the predicted level by rounding only.
    fn predict_and_compare<E: Element<T>>(&self, state: &mut State<E, N>, y: E, u: E) -> E;

    /// One sample: predict with `u`, correct by `y`. Returns level 0.
    ///
    /// ```
    /// use compfilt_core::{FirstOrder, Recurrence, State};
    /// let gains = FirstOrder::new(0.5_f32)?.at(0.01)?;
    /// let mut state = State::at_rest::<f32>(0.0);
    /// let angle = gains.step(&mut state, 0.1, 0.02);
    /// assert_eq!(angle, state.levels[0]);
    /// # Ok::<(), compfilt_core::Error>(())
    /// ```
    #[inline(always)]
    fn step<E: Element<T>>(&self, state: &mut State<E, N>, y: E, u: E) -> E {
        let innovation = self.predict_and_compare(state, y, u);
        self.correct(state, innovation);
        state.levels[0]
    }

    /// The gains `L` of the innovation.
    fn correction(&self) -> &[T; N];

    /// The sample period in seconds.
    fn dt(&self) -> T;
}

/// `x_i += L_i e`.
#[inline(always)]
pub(crate) fn correct_with<T: Number, E: Element<T>, const N: usize>(
    correction: &[T; N],
    state: &mut State<E, N>,
    innovation: E,
) {
    for (x, l) in state.levels.iter_mut().zip(correction) {
        *x = *x + innovation * *l;
    }
}

/// A complementary filter as an observer on a chain of `N` integrators whose input is the `M`-th
/// derivative of level 0: the continuous coefficients `k_1 … k_N`, checked.
///
/// ```text
/// LP(s) = (k_1 s^{N-1} + … + k_N) / (s^N + k_1 s^{N-1} + … + k_N),   HP(s) = s^N / (the same)
/// ```
///
/// ```
/// use compfilt_core::Chain;
/// // A position filter on acceleration, with a triple pole at -2 rad/s.
/// let chain = Chain::<f64, 3, 2>::new([6.0, 12.0, 8.0])?;
/// assert!(chain.poles().iter().all(|pole| (pole.re + 2.0).abs() < 1e-12));
/// assert!(Chain::<f64, 3, 2>::new([1.0, 1.0, 2.0]).is_err()); // unstable: k_1 k_2 < k_3
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "T: serde::Serialize", deserialize = "T: serde::Deserialize<'de>"))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Chain<T, const N: usize, const M: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    coefficients: [T; N],
}

impl<T: Real, const N: usize, const M: usize> Chain<T, N, M> {
    /// The chain with the coefficients `k_1 … k_N`, in 1/s, 1/s², ….
    ///
    /// # Errors
    /// A coefficient is not positive and finite, or the polynomial `s^N + k_1 s^{N-1} + … + k_N` has
    /// a root outside the left half plane.
    pub fn new(coefficients: [T; N]) -> Result<Self, Error> {
        const { assert!(M >= 1 && M <= N, "the input drives one of the levels") };
        for k in coefficients {
            positive("coefficients", k)?;
        }
        if is_stable(&coefficients) {
            Ok(Self { coefficients })
        } else {
            Err(Error::new("coefficients", Rule::Stable))
        }
    }

    /// A chain whose stability its design guarantees: only what may vanish or overflow is checked.
    pub(crate) fn of_design(parameter: &'static str, coefficients: [T; N]) -> Result<Self, Error> {
        const { assert!(M >= 1 && M <= N, "the input drives one of the levels") };
        let representable = |k: &T| k.is_finite() && *k > nalgebra::zero();
        if coefficients.iter().all(representable) {
            Ok(Self { coefficients })
        } else {
            Err(Error::new(parameter, Rule::Representable))
        }
    }

    /// `k_1 … k_N`.
    pub fn coefficients(&self) -> &[T; N] {
        &self.coefficients
    }

    /// The roots of `s^N + k_1 s^{N-1} + … + k_N` in rad/s.
    pub fn poles(&self) -> [Complex<T>; N] {
        poles(&self.coefficients)
    }

    /// The same chain with matched poles, `z = exp(p dt)`, instead of backward Euler.
    pub fn matched(&self) -> Matched<T, N, M> {
        Matched::new(self)
    }
}

impl<T: Number, const N: usize, const M: usize> Chain<T, N, M> {
    pub(crate) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Chain<U, N, M> {
        Chain { coefficients: each(&self.coefficients, change) }
    }

    /// The gains of the innovation over the time `dt`, not checked.
    #[inline(always)]
    pub(crate) fn correction(&self, dt: T) -> [T; N] {
        backward_euler(&self.coefficients, dt)
    }

    /// The gains over the time `dt` by backward Euler, not checked.
    #[inline(always)]
    pub(crate) fn over(&self, dt: T) -> Gains<T, N, M> {
        let mut shifts = [dt; N];
        let mut power = T::literal(1.0);
        for shift in &mut shifts {
            power *= dt;
            *shift = power;
        }
        let mut ramp = shifts;
        for weight in &mut ramp {
            *weight *= T::literal(0.5);
        }
        Gains { shifts, ramp, correction: self.correction(dt) }
    }
}

/// The same numbers in another type.
pub(crate) fn each<T: Number, U: Number, const N: usize>(
    numbers: &[T; N],
    change: &mut impl Change<T, U>,
) -> [U; N] {
    numbers.map(|number| change.number(number))
}

impl<T: Real, const N: usize> Chain<T, N, 1> {
    /// The same poles with only the terms below degree `split` in the low-pass.
    ///
    /// # Errors
    /// `split` is 0 or above the order.
    pub fn split(&self, split: usize) -> Result<Split<T, N>, Error> {
        Split::new(self, split)
    }
}

/// The gains of a [`Chain`] at one sample period.
///
/// Both rules predict with powers of one shift: `x⁻_i = x_i + c_{M-i} u + Σ_j c_j x_{i+j}`. Backward Euler has `c_j = dt^j`, matched poles `c_j = dt^j / j!`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "T: serde::Serialize", deserialize = "T: serde::Deserialize<'de>"))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Gains<T, const N: usize, const M: usize> {
    /// `c_1 … c_N`; the first is the sample period.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(crate) shifts: [T; N],
    /// What a ramp of the input by 1 within the step adds at distance 1 … N below level `M`.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(crate) ramp: [T; N],
    /// `L`.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    pub(crate) correction: [T; N],
}

impl<T, const N: usize, const M: usize> Gains<T, N, M> {
    /// Gains that were made elsewhere and are here as constants, in the order and meaning of the getters.
    ///
    /// ```
    /// use compfilt_core::{FirstOrder, Gains};
    /// const GAINS: Gains<f32, 1, 1> = Gains::from_parts([0.25], [0.125], [0.2]);
    /// assert_eq!(FirstOrder::new(1.0_f32)?.at(0.25)?, GAINS);
    /// # Ok::<(), compfilt_core::Error>(())
    /// ```
    pub const fn from_parts(shifts: [T; N], ramp: [T; N], correction: [T; N]) -> Self {
        Self { shifts, ramp, correction }
    }

    /// The powers of the shift, `c_1 … c_N`; the first is the sample period in seconds.
    pub const fn shifts(&self) -> &[T; N] {
        &self.shifts
    }

    /// What a ramp of the input by 1 within the step adds at distance 1 … N below level `M`.
    pub const fn ramp(&self) -> &[T; N] {
        &self.ramp
    }
}

impl<T: Number, const N: usize, const M: usize> Gains<T, N, M> {
    /// What the input adds to level `i`.
    #[inline(always)]
    fn driven<E: Element<T>>(&self, i: usize, u: E) -> Option<E> {
        let distance = M.checked_sub(i + 1)?;
        let c = self.shifts.get(distance)?;
        Some(u * *c)
    }

    /// What the levels above add to level `i`.
    #[inline(always)]
    fn moved<E: Element<T>>(&self, i: usize, state: &State<E, N>) -> Option<E> {
        // A plain loop: what lanes do within a closure is not inlined into their instruction set.
        let mut sum = None;
        for (x, c) in state.levels.get(i + 1..)?.iter().zip(&self.shifts) {
            let term = *x * *c;
            sum = Some(match sum {
                Some(sum) => sum + term,
                None => term,
            });
        }
        sum
    }
}

impl<T: Number, const N: usize, const M: usize> Recurrence<T, N> for Gains<T, N, M> {
    #[inline(always)]
    fn predict<E: Element<T>>(&self, state: &mut State<E, N>, u: E) {
        // From level 0 up, so that every level still finds the old values above it. The increments are
        // summed before they meet the level: one rounding at the level's own size.
        for i in 0..N {
            let increment = match (self.driven(i, u), self.moved(i, state)) {
                (Some(driven), Some(moved)) => driven + moved,
                (Some(alone), None) | (None, Some(alone)) => alone,
                (None, None) => continue,
            };
            state.levels[i] = state.levels[i] + increment;
        }
    }

    #[inline(always)]
    fn predict_and_compare<E: Element<T>>(&self, state: &mut State<E, N>, y: E, u: E) -> E {
        let moved = self.moved(0, state);
        let ahead = match self.driven(0, u) {
            Some(driven) => y - driven,
            None => y,
        };
        let rest = ahead - state.levels[0];
        self.predict(state, u);
        match moved {
            Some(moved) => rest - moved,
            None => rest,
        }
    }

    #[inline(always)]
    fn predict_ramp<E: Element<T>>(&self, state: &mut State<E, N>, from: E, to: E) {
        self.predict(state, from);
        let change = to - from;
        // Level M - 1 is the nearest below the input.
        for (x, weight) in state.levels[..M].iter_mut().rev().zip(&self.ramp) {
            *x = *x + change * *weight;
        }
    }

    fn correction(&self) -> &[T; N] {
        &self.correction
    }

    fn dt(&self) -> T {
        self.shifts[0]
    }
}
