//! The same poles shared out otherwise: low-pass and high-pass of one polynomial, cut at any degree.

use super::chain::each;
use super::discrete::backward_euler_characteristic;
use super::poles::poles;
use super::{Chain, Discretise, Recurrence, State};
use crate::{Change, Dt, Element, Error, Number, Real, Rule};
use nalgebra::Complex;

/// The complementary pair of the polynomial `B(s) = Σ a_i s^i` (`a_N = 1`) that gives the low-pass the terms of degree
/// below `split` and the high-pass the others.
///
/// `split = N` is the [`Chain`]; `split = 1` is the steepest low-pass, `a_0/B`, without a zero. It is realised so that
/// every state but level 0 rests at zero on consistent input:
///
/// ```text
/// ẋ_0 = x_1 + u + [split = N] a_{N-1} e
/// ẋ_i = x_{i+1} - [N-i ≥ split] a_{N-i} x_1 + [N-1-i < split] a_{N-1-i} e,   i ≥ 1
/// ```
///
/// A constant bias of the input leaves no error exactly when `split ≥ 2`. Backward Euler only.
///
/// ```
/// use compfilt_core::{Butterworth, Discretise, Recurrence, State};
/// let gains = Butterworth::<f32, 2>::new(0.5)?.split(1)?.at(0.01)?;
/// let mut state = State::at_rest::<f32>(0.3);
/// assert_eq!(gains.step(&mut state, 0.3, 0.0), 0.3); // consistent input is reproduced
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
pub struct Split<T, const N: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    coefficients: [T; N],
    split: usize,
}

impl<T: Real, const N: usize> Split<T, N> {
    pub(crate) fn new(chain: &Chain<T, N, 1>, split: usize) -> Result<Self, Error> {
        if (1..=N).contains(&split) {
            Ok(Self { coefficients: *chain.coefficients(), split })
        } else {
            Err(Error::new("split", Rule::AtMostOrder))
        }
    }

    /// `k_1 … k_N`, where `k_i = a_{N-i}`.
    pub fn coefficients(&self) -> &[T; N] {
        &self.coefficients
    }

    /// The roots of `B(s)` in rad/s.
    pub fn poles(&self) -> [Complex<T>; N] {
        poles(&self.coefficients)
    }
}

impl<T: Number, const N: usize> Split<T, N> {
    /// The number of terms in the low-pass.
    #[inline(always)]
    pub fn split(&self) -> usize {
        self.split
    }

    /// The same filter with every coefficient at least that of `(s + speed)^N`: for the start of a low-pass of order 1 or 2.
    #[inline(always)]
    pub(crate) fn at_least(&self, speed: T) -> Self {
        let mut critical = T::literal(1.0);
        let mut coefficients = self.coefficients;
        for (i, own) in coefficients.iter_mut().enumerate() {
            #[allow(clippy::cast_precision_loss)] // The order is a small number.
            let factor = (N - i) as f64 / (i + 1) as f64;
            critical *= speed * T::literal(factor);
            *own = own.or_more(critical);
        }
        Self { coefficients, ..*self }
    }

    /// The gains over the time `dt`, not checked.
    #[inline(always)]
    pub(crate) fn over(&self, dt: T) -> SplitGains<T, N> {
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let mut gains = SplitGains {
            dt,
            half_dt: dt * T::literal(0.5),
            feedback: [zero; N],
            damping: one,
            correction: [zero; N],
        };
        // q_i = [1 ≤ i ≤ N - split] dt k_i + dt q_{i+1}
        let mut above = zero;
        for i in (1..N).rev() {
            let own = if i <= N - self.split { self.coefficients[i - 1] } else { zero };
            above = dt * (own + above);
            gains.feedback[i] = above;
        }
        gains.damping = one / (one + above);
        // g = (I - dt F)^{-1} dt κ by the prediction itself, then L = g / (1 + g_0).
        let mut g = State { levels: [zero; N] };
        for i in N - self.split..N {
            g.levels[i] = dt * self.coefficients[i];
        }
        gains.predict(&mut g, zero);
        let scale = one / (one + g.levels[0]);
        for (correction, g) in gains.correction.iter_mut().zip(&g.levels) {
            *correction = *g * scale;
        }
        gains
    }

    pub(crate) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Split<U, N> {
        Split { coefficients: each(&self.coefficients, change), split: self.split }
    }
}

impl<T: Real, const N: usize> Discretise<T, N> for Split<T, N> {
    type Gains = SplitGains<T, N>;

    const LONG_STEPS: bool = true;

    fn gains(&self, dt: Dt<T>) -> Self::Gains {
        self.over(dt.seconds())
    }

    /// The gains of a step of `cap`: placed poles would ask for negative gains, because the levels decay by themselves.
    fn capped(&self, _: Dt<T>, cap: T) -> [T; N] {
        Dt::new(cap).map_or([T::zero(); N], |cap| *self.gains(cap).correction())
    }

    fn characteristic(&self, tau: T) -> [T; N] {
        backward_euler_characteristic(&self.coefficients, tau)
    }
}

/// The gains of a [`Split`] at one sample period.
///
/// The prediction solves `(I - dt F) x⁻ = x + dt B u`, where the feedback from level 1 makes
/// `x⁻_i = p_i - q_i x⁻_1`: `p` is the plain chain's, `q` depends on the gains only.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "T: serde::Serialize", deserialize = "T: serde::Deserialize<'de>"))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct SplitGains<T, const N: usize> {
    dt: T,
    half_dt: T,
    /// `q`.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    feedback: [T; N],
    /// `1/(1 + q_1)`.
    damping: T,
    /// `L`.
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    correction: [T; N],
}

impl<T, const N: usize> SplitGains<T, N> {
    /// Gains that were made elsewhere and are here as constants, in the order and meaning of the getters.
    pub const fn from_parts(
        dt: T,
        half_dt: T,
        feedback: [T; N],
        damping: T,
        correction: [T; N],
    ) -> Self {
        Self { dt, half_dt, feedback, damping, correction }
    }

    /// Half the sample period in seconds.
    pub const fn half_dt(&self) -> &T {
        &self.half_dt
    }

    /// How level 1 feeds back to the levels above it, `q`.
    pub const fn feedback(&self) -> &[T; N] {
        &self.feedback
    }

    /// What level 1 is multiplied by in a step, `1/(1 + q_1)`.
    pub const fn damping(&self) -> &T {
        &self.damping
    }
}

impl<T: Number, const N: usize> SplitGains<T, N> {
    /// Where they can be used.
    #[inline(always)]
    pub(crate) fn is_finite(&self) -> T::Mask {
        let mut finite = self.damping.is_number();
        for correction in &self.correction {
            finite = finite & correction.is_number();
        }
        finite
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let mut chosen = Self {
            dt: T::choose(mask, yes.dt, no.dt),
            half_dt: T::choose(mask, yes.half_dt, no.half_dt),
            damping: T::choose(mask, yes.damping, no.damping),
            ..*no
        };
        for (i, chosen) in chosen.feedback.iter_mut().enumerate() {
            *chosen = T::choose(mask, yes.feedback[i], *chosen);
        }
        for (i, chosen) in chosen.correction.iter_mut().enumerate() {
            *chosen = T::choose(mask, yes.correction[i], *chosen);
        }
        chosen
    }

    /// Predicts the levels from 1 on and returns what level 1 adds to level 0.
    #[inline(always)]
    fn decay<E: Element<T>>(&self, state: &mut State<E, N>) -> Option<E> {
        let (_, others) = state.levels.split_first_mut()?;
        let mut above: Option<E> = None;
        for p in others.iter_mut().rev() {
            if let Some(above) = above {
                *p = *p + above * self.dt;
            }
            above = Some(*p);
        }
        let (first, higher) = others.split_first_mut()?;
        *first = *first * self.damping;
        for (p, q) in higher.iter_mut().zip(self.feedback.iter().skip(2)) {
            *p = *p - *first * *q;
        }
        Some(*first * self.dt)
    }
}

impl<T: Number, const N: usize> Recurrence<T, N> for SplitGains<T, N> {
    #[inline(always)]
    fn predict<E: Element<T>>(&self, state: &mut State<E, N>, u: E) {
        let driven = u * self.dt;
        let increment = match self.decay(state) {
            Some(moved) => driven + moved,
            None => driven,
        };
        state.levels[0] = state.levels[0] + increment;
    }

    #[inline(always)]
    fn predict_and_compare<E: Element<T>>(&self, state: &mut State<E, N>, y: E, u: E) -> E {
        let driven = u * self.dt;
        let rest = (y - driven) - state.levels[0];
        let moved = self.decay(state);
        // Matches instead of closures: what lanes do within a closure is not inlined into their instruction set.
        let Some(moved) = moved else {
            state.levels[0] = state.levels[0] + driven;
            return rest;
        };
        state.levels[0] = state.levels[0] + (driven + moved);
        rest - moved
    }

    #[inline(always)]
    fn predict_ramp<E: Element<T>>(&self, state: &mut State<E, N>, from: E, to: E) {
        self.predict(state, from);
        if let Some(level0) = state.levels.first_mut() {
            *level0 = *level0 + (to - from) * self.half_dt;
        }
    }

    fn correction(&self) -> &[T; N] {
        &self.correction
    }

    fn dt(&self) -> T {
        self.dt
    }
}
