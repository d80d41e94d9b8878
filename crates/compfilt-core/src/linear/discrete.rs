//! Gains at a sample period: backward Euler and matched poles.

use super::elapsed::placed;
use super::placement::{place, polynomial_from_roots};
use super::poles::poles;
use super::{Chain, Gains, Recurrence, State};
use crate::{Dt, Error, Number, Real, Rule};
use nalgebra::{Complex, SVector};

/// A design that has gains at every time step.
pub trait Discretise<T: Real, const N: usize>: Copy {
    /// The gains at one time step.
    type Gains: Recurrence<T, N>;

    /// Whether predictions without a correction between them count as one long step, which is stable for any sequence of
    /// gaps. It reproduces consistent input up to the second derivative; otherwise the poles are placed on the
    /// accumulated transition.
    const LONG_STEPS: bool;

    /// The gains at a checked time step: cannot fail. At `dt = 0` they are zero.
    fn gains(&self, dt: Dt<T>) -> Self::Gains;

    /// The wanted characteristic polynomial of the error over the time `tau`, in `w = z - 1`:
    /// `w^N + d_1 w^{N-1} + … + d_N`, as `d_1 … d_N`.
    fn characteristic(&self, tau: T) -> [T; N];

    /// The gains after one step of `time` for a measurement that counts for `cap` of it only: the poles are placed on the
    /// step's transition.
    fn capped(&self, time: Dt<T>, cap: T) -> [T; N] {
        placed(self, &Self::transition(&self.gains(time)), time.seconds(), cap)
    }

    /// The gains at the sample period `dt` in seconds.
    ///
    /// # Errors
    /// `dt` is not positive and finite, or a gain vanishes or overflows in the scalar type.
    fn at(&self, dt: T) -> Result<Self::Gains, Error> {
        let gains = self.gains(Dt::new(crate::error::positive("dt", dt)?)?);
        if gains.correction().iter().all(|l| l.is_finite() && *l != T::zero()) {
            Ok(gains)
        } else {
            Err(Error::new("dt", Rule::Representable))
        }
    }

    /// How the levels move over one step without input or correction: row by row.
    fn transition(gains: &Self::Gains) -> State<SVector<T, N>, N> {
        let mut rows = identity();
        gains.predict(&mut rows, SVector::zeros());
        rows
    }
}

/// The levels as combinations of themselves: the start of a transition.
pub(crate) fn identity<T: Real, const N: usize>() -> State<SVector<T, N>, N> {
    let levels = core::array::from_fn(|i| {
        SVector::from_fn(|row, _| if row == i { T::one() } else { T::zero() })
    });
    State { levels }
}

impl<T: Real, const N: usize, const M: usize> Discretise<T, N> for Chain<T, N, M> {
    type Gains = Gains<T, N, M>;

    // Placed poles say nothing about a sequence of gaps: short ones followed by long ones can diverge from order 3 on.
    const LONG_STEPS: bool = M <= 2;

    /// Backward Euler, `s = (1 - 1/z)/dt`: the discrete poles are exactly `1/(1 - p dt)`, the filter is stable
    /// for any sequence of time steps. Source: M. Wietzke's rule as it is used for the balancing cube.
    fn gains(&self, dt: Dt<T>) -> Self::Gains {
        self.over(dt.seconds())
    }

    fn characteristic(&self, tau: T) -> [T; N] {
        backward_euler_characteristic(self.coefficients(), tau)
    }
}

/// `g_N = dt k_N`, `g_i = dt (k_i + g_{i+1})`, `L_i = g_i / (1 + g_1)`.
#[inline(always)]
pub(crate) fn backward_euler<T: Number, const N: usize>(coefficients: &[T; N], dt: T) -> [T; N] {
    let (zero, one) = (T::literal(0.0), T::literal(1.0));
    let mut g = [zero; N];
    let mut above = zero;
    for (g, k) in g.iter_mut().zip(coefficients).rev() {
        above = dt * (*k + above);
        *g = above;
    }
    let scale = one / (one + above);
    for g in &mut g {
        *g *= scale;
    }
    g
}

/// `d_i = Σ_{j ≥ i} C(j, i) k_j tau^j / Σ_{j ≥ 0} k_j tau^j` with `k_0 = 1`: the polynomial with the roots
/// `w = p tau / (1 - p tau)`. All terms are positive, so nothing cancels.
pub(crate) fn backward_euler_characteristic<T: Real, const N: usize>(
    coefficients: &[T; N],
    tau: T,
) -> [T; N] {
    let mut d = [T::zero(); N];
    let mut norm = T::one();
    let mut power = T::one();
    // Row j of Pascal's triangle without its first entry, which is 1.
    let mut binomials = [T::zero(); N];
    for k in coefficients {
        let mut left = T::one();
        for binomial in &mut binomials {
            let here = *binomial;
            *binomial += left;
            left = here;
        }
        power *= tau;
        let term = *k * power;
        norm += term;
        for (d, binomial) in d.iter_mut().zip(&binomials) {
            *d += *binomial * term;
        }
    }
    d.map(|d| d / norm)
}

/// A [`Chain`] whose discrete poles are `exp(p dt)` and whose prediction is exact for an input that is
/// constant within the step.
///
/// Not safe when the time step varies by large factors while it is long against 1/|p|: with Butterworth poles order 3 can
/// diverge where `omega0 dt` alternates between 10.8 and 1.7, order 4 from `omega0 dt` ≈ 4.3, order 5 from 2.5. Prefer backward Euler there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(serialize = "T: serde::Serialize", deserialize = "T: serde::Deserialize<'de>"))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Matched<T: Real, const N: usize, const M: usize> {
    #[cfg_attr(feature = "serde", serde(with = "serde_big_array::BigArray"))]
    poles: [Complex<T>; N],
}

impl<T: Real, const N: usize, const M: usize> Matched<T, N, M> {
    pub(crate) fn new(chain: &Chain<T, N, M>) -> Self {
        Self { poles: poles(chain.coefficients()) }
    }
}

impl<T: Real, const N: usize, const M: usize> Discretise<T, N> for Matched<T, N, M> {
    type Gains = Gains<T, N, M>;

    // The exact prediction over a gap is that of one step of the same time.
    const LONG_STEPS: bool = false;

    fn gains(&self, dt: Dt<T>) -> Self::Gains {
        let dt = dt.seconds();
        let mut shifts = [T::zero(); N];
        let mut ramp = [T::zero(); N];
        let mut power = T::one();
        let mut distance = T::one();
        for (c, r) in shifts.iter_mut().zip(&mut ramp) {
            power = power * dt / distance;
            distance += T::one();
            *c = power;
            *r = power / distance;
        }
        let mut gains = Gains { shifts, ramp, correction: [T::zero(); N] };
        if let Some(correction) = place(&Self::transition(&gains), &self.characteristic(dt), dt) {
            gains.correction = correction;
        }
        gains
    }

    fn characteristic(&self, tau: T) -> [T; N] {
        polynomial_from_roots(self.poles.map(|pole| exp_m1(pole * tau)))
    }
}

/// `exp(z) - 1` without cancellation for small `z`.
fn exp_m1<T: Real>(z: Complex<T>) -> Complex<T> {
    let grown = z.re.exp();
    let half_sine = (z.im * T::literal(0.5)).sin();
    let re = z.re.exp_m1() * z.im.cos() - T::literal(2.0) * half_sine * half_sine;
    Complex::new(re, grown * z.im.sin())
}
