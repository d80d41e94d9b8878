//! Frequency response of the low branch and of the high branch.

use super::placement::{scaled_departure, solve};
use super::{Discretise, Recurrence, State};
use crate::Real;
use nalgebra::Complex;

/// The two branches at one frequency. Their sum is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrequencyResponse<T> {
    /// From the measurement to level 0.
    pub low: Complex<T>,
    /// From the integrated input to level 0.
    pub high: Complex<T>,
}

/// The continuous pair of the coefficients `k_1 … k_N` at `omega` in rad/s: the terms of `B(jω)` below degree `split` (the
/// order, for a chain), and the others, over `B(jω)`.
pub fn continuous_response<T: Real, const N: usize>(
    coefficients: &[T; N],
    split: usize,
    omega: T,
) -> FrequencyResponse<T> {
    // In powers of s/unit, with k_i/unit^i: for large frequencies the plain powers overflow.
    let unit = omega.abs().max(T::one());
    let s = Complex::new(T::zero(), omega / unit);
    let (mut coefficients, mut scale) = (*coefficients, T::one());
    for k in &mut coefficients {
        scale /= unit;
        *k *= scale;
    }
    let mut power = real(T::one());
    let mut low = real(T::zero());
    let mut high = real(T::zero());
    // Degree 0 has the coefficient k_N, degree N - 1 has k_1, degree N has 1.
    for (degree, k) in coefficients.iter().rev().enumerate() {
        let term = power * *k;
        if degree < split {
            low += term;
        } else {
            high += term;
        }
        power *= s;
    }
    high += power;
    let sum = low + high;
    FrequencyResponse { low: low / sum, high: high / sum }
}

/// The discrete pair at `omega` in rad/s with `gains`: the high branch is the response to the input integrated by the
/// filter's own prediction, without any correction, so that both sum to 1 for every rule.
pub fn discrete_response<T: Real, D: Discretise<T, N>, const N: usize>(
    gains: &D::Gains,
    omega: T,
) -> FrequencyResponse<T> {
    let phase = omega * gains.dt();
    let half_sine = (phase * T::literal(0.5)).sin();
    // w = z - 1 without cancellation.
    let w = Complex::new(T::literal(-2.0) * half_sine * half_sine, phase.sin());
    branches::<T, D, N>(gains, w)
        .unwrap_or(FrequencyResponse { low: real(T::one()), high: real(T::zero()) })
}

/// `None` where the open loop has no response: at zero frequency.
fn branches<T: Real, D: Discretise<T, N>, const N: usize>(
    gains: &D::Gains,
    w: Complex<T>,
) -> Option<FrequencyResponse<T>> {
    let mut predicted_correction = State { levels: *gains.correction() };
    gains.predict(&mut predicted_correction, T::zero());
    let predicted_correction = scaled(predicted_correction, gains.dt());

    // (z I - Φ) v = Φ L, low = (v_0 + L_0)/(1 + v_0).
    let first_gain = *gains.correction().first()?;
    let open = open_loop::<T, D, N>(gains, w);
    let v = *solve(open, predicted_correction.map(real))?.first()?;
    let sum = v + real(T::one());
    let low = (v + real(first_gain)) / sum;

    // The closed loop's answer to an input over the open loop's is the same for every input, by the matrix inversion
    // lemma; as a quotient it would be 0/0 where the open loop has a zero (matched, Nyquist frequency).
    let high = real(T::one() - first_gain) / sum;
    (finite(low) && finite(high)).then_some(FrequencyResponse { low, high })
}

/// `z I - Φ`, the levels in powers of the sample period, so that all are of one size.
fn open_loop<T: Real, D: Discretise<T, N>, const N: usize>(
    gains: &D::Gains,
    w: Complex<T>,
) -> [[Complex<T>; N]; N] {
    let mut matrix =
        scaled_departure(&D::transition(gains), gains.dt()).map(|row| row.map(|nu| real(-nu)));
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += w;
    }
    matrix
}

/// Levels in powers of the sample period.
fn scaled<T: Real, const N: usize>(state: State<T, N>, dt: T) -> [T; N] {
    let mut scale = T::one();
    state.levels.map(|level| {
        let value = level * scale;
        scale *= dt;
        value
    })
}

fn real<T: Real>(re: T) -> Complex<T> {
    Complex::new(re, T::zero())
}

fn finite<T: Real>(z: Complex<T>) -> bool {
    z.re.is_finite() && z.im.is_finite()
}
