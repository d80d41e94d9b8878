//! Butterworth poles of any order, and of order 2 with a quality factor.

use super::{Chain, Split, chain_design};
use crate::error::positive;
use crate::{Error, Real, Rule};

/// The complementary filter whose poles are those of a Butterworth filter of order `N` at `omega0` in rad/s.
///
/// `k_i = a_i omega0^i` with the coefficients `a_i` of the normalised Butterworth polynomial. The high-pass is
/// maximally flat; the low-pass, which has zeros, is not (order 2 peaks by 2.09 dB): see [`split`](Self::split) for
/// one without zeros. Source: Y.-H. Jeon 2015, equations (8) to (13).
///
/// ```
/// use compfilt_core::Butterworth;
/// let chain = Butterworth::<f64, 2>::new(10.0)?.chain();
/// assert!((chain.coefficients()[0] - 200f64.sqrt()).abs() < 1e-13);
/// assert!((chain.coefficients()[1] - 100.0).abs() < 1e-13);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Butterworth<T, const N: usize> {
    chain: Chain<T, N, 1>,
}

impl<T: Real, const N: usize> Butterworth<T, N> {
    /// Butterworth poles at `omega0` in rad/s.
    ///
    /// # Errors
    /// `omega0` is not positive and finite, or one of its powers up to `N` is not representable.
    pub fn new(omega0: T) -> Result<Self, Error> {
        let coefficients = butterworth_coefficients(positive("omega0", omega0)?);
        Ok(Self { chain: Chain::of_design("omega0", coefficients)? })
    }

    /// The same poles with only the terms below degree `split` in the low-pass: `split = 1` gives the true
    /// Butterworth low-pass without zeros, at the price of a slower high-pass.
    ///
    /// # Errors
    /// `split` is 0 or above `N`.
    pub fn split(&self, split: usize) -> Result<Split<T, N>, Error> {
        self.chain.split(split)
    }
}

impl<T: Real> Butterworth<T, 2> {
    /// Order 2 with the quality factor `q`: `k_1 = √2 omega0 / q`, `k_2 = omega0²`.
    ///
    /// `q = 1` is Butterworth; with any other the poles are no Butterworth poles any more, although the source
    /// keeps the name. Source: Y.-H. Jeon 2015, equations (14) and (15); its equation (16) contradicts them.
    ///
    /// # Errors
    /// `omega0` or `q` is not positive and finite, or a coefficient is not representable.
    pub fn with_q(omega0: T, q: T) -> Result<Self, Error> {
        let [k1, k2] = butterworth_coefficients(positive("omega0", omega0)?);
        let coefficients = [k1 / positive("q", q)?, k2];
        if coefficients[0].is_finite() && coefficients[0] > T::zero() {
            Ok(Self { chain: Chain::of_design("omega0", coefficients)? })
        } else {
            Err(Error::new("q", Rule::Representable))
        }
    }
}

/// `a_i omega0^i`, `a_i = Π_{j=1}^{i} cos((j-1) γ)/sin(j γ)`, `γ = π/(2N)`.
pub(crate) fn butterworth_coefficients<T: Real, const N: usize>(omega0: T) -> [T; N] {
    #[allow(clippy::cast_precision_loss)] // The order is a small number.
    let gamma = T::frac_pi_2() / T::literal(N as f64);
    let mut below = T::zero();
    let mut product = T::one();
    core::array::from_fn(|_| {
        let angle = below + gamma;
        product *= below.cos() / angle.sin() * omega0;
        below = angle;
        product
    })
}

chain_design!(Butterworth<T, N>, N, 1);
