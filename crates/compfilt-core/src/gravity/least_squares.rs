//! The best linear unbiased weights of channels for a quantity that they see mixed with others.

use crate::error::Failure;
use nalgebra::{ComplexField, Matrix3, SMatrix, SVD, SVector};

/// The most unknowns of a problem: nine of the motion, three of gravity. Smaller problems leave columns at zero.
const UNKNOWNS: usize = 12;

/// One value for each unknown.
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;

/// A reading that is a linear function of the unknowns.
pub(super) struct Channel {
    pub(super) sensor: usize,
    pub(super) axis: usize,
    /// The reading is the product of this with the unknowns, plus noise.
    pub(super) response: Unknowns,
    /// The noise's standard deviation.
    pub(super) noise: f64,
}

/// A condition from which on a quantity counts as not given.
const WORST_CONDITION: f64 = 1e6;

/// Singular values below this part of the largest are rounding.
const RANK: f64 = 1e-12;

/// What a set of channels knows of the unknowns: the singular values and vectors of its weighted responses.
pub(super) struct Information {
    singular_values: Unknowns,
    vectors_t: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    largest: f64,
}

impl Information {
    /// `None` if the decomposition does not converge or nothing is seen.
    pub(super) fn of(channels: impl Iterator<Item = Channel>) -> Option<Self> {
        let mut triangle = SMatrix::zeros();
        for channel in channels {
            absorb(&mut triangle, channel.response / channel.noise);
        }
        let svd = SVD::try_new(triangle, false, true, f64::EPSILON, 10_000)?;
        let largest = svd.singular_values.max();
        Some(Self { singular_values: svd.singular_values, vectors_t: svd.v_t?, largest })
            .filter(|_| largest > 0.0 && largest.is_finite())
    }

    /// The standard deviation of the best estimate of `wanted · unknowns`.
    ///
    /// # Errors
    /// The channels do not give it, or only with a noise of more than 1e6 times that of an average over all of them.
    pub(super) fn noise(&self, wanted: &Unknowns) -> Result<f64, Failure> {
        let (mut variance, mut hidden) = (0.0, 0.0);
        for (part, size) in self.parts(wanted) {
            // Below the resolution of f64 a size is zero, and so must the part be.
            let relative = (size / self.largest).max(1e-15);
            variance += (part / relative) * (part / relative);
            if relative < RANK {
                hidden = part.abs().max(hidden);
            }
        }
        let condition = variance.sqrt() / wanted.norm();
        if condition <= WORST_CONDITION {
            Ok(variance.sqrt() / self.largest)
        } else if hidden > 1e-6 * wanted.norm() {
            Err(Failure::Ambiguous)
        } else {
            Err(Failure::IllConditioned)
        }
    }

    /// Adds the weights of `wanted · unknowns` to `row` of the sensors' matrices.
    pub(super) fn weigh(
        &self,
        channels: &(impl Iterator<Item = Channel> + Clone),
        wanted: &Unknowns,
        weights: &mut [Matrix3<f64>],
        row: usize,
    ) {
        let mut rest = *wanted;
        // Each round leaves about condition² × rounding of the rest.
        for _ in 0..4 {
            let solution = self.solve(&rest);
            rest = *wanted;
            for channel in channels.clone() {
                let Some(weights) = weights.get_mut(channel.sensor) else { continue };
                let weight = &mut weights[(row, channel.axis)];
                *weight += channel.response.dot(&solution) / (channel.noise * channel.noise);
                rest -= channel.response * *weight;
            }
        }
    }

    /// The least solution `x` of `Aᵀ A x = wanted`, where `A` is the weighted responses.
    fn solve(&self, wanted: &Unknowns) -> Unknowns {
        let mut solution = Unknowns::zeros();
        for ((part, size), vector) in self.parts(wanted).zip(self.vectors_t.row_iter()) {
            if size > RANK * self.largest {
                solution += vector.transpose() * (part / (size * size));
            }
        }
        solution
    }

    fn parts(&self, wanted: &Unknowns) -> impl Iterator<Item = (f64, f64)> {
        let parts = self.vectors_t * wanted;
        let sizes = self.singular_values;
        (0..UNKNOWNS).map(move |i| (parts[i], sizes[i]))
    }
}

/// Rotates a row into an upper triangle `R`, so that `RᵀR` grows by its square.
fn absorb(triangle: &mut SMatrix<f64, UNKNOWNS, UNKNOWNS>, mut row: Unknowns) {
    for j in 0..UNKNOWNS {
        let length = ComplexField::hypot(triangle[(j, j)], row[j]);
        if length > 0.0 {
            let (cosine, sine) = (triangle[(j, j)] / length, row[j] / length);
            for k in j..UNKNOWNS {
                let (above, below) = (triangle[(j, k)], row[k]);
                triangle[(j, k)] = cosine * above + sine * below;
                row[k] = cosine * below - sine * above;
            }
        }
    }
}
