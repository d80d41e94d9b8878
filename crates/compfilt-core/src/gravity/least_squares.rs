//! The best linear unbiased weights of channels for a quantity that they see mixed with others.

use crate::error::Failure;
use nalgebra::{ComplexField, Matrix3, SMatrix, SVector};

/// The most unknowns of a problem: nine of the motion, three of gravity. Smaller problems leave columns at zero.
const UNKNOWNS: usize = 12;

/// One value for each unknown.
pub(super) type Unknowns = SVector<f64, UNKNOWNS>;

type Square = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

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

/// A quantity's part along a direction that no channel sees is rounding below this part of it.
const HIDDEN: f64 = 1e-8;

/// What a set of channels knows of the unknowns: the singular values and vectors of its weighted responses.
pub(super) struct Information {
    singular_values: Unknowns,
    /// Right singular vectors, one a column.
    vectors: Square,
    largest: f64,
}

impl Information {
    /// `None` if nothing is seen.
    pub(super) fn of(channels: impl Iterator<Item = Channel>) -> Option<Self> {
        let mut triangle = Square::zeros();
        for channel in channels {
            absorb(&mut triangle, channel.response / channel.noise);
        }
        let (singular_values, vectors) = decompose(triangle);
        let largest = singular_values.max();
        (largest > 0.0 && largest.is_finite()).then_some(Self { singular_values, vectors, largest })
    }

    /// The standard deviation of the best estimate of `wanted · unknowns`.
    ///
    /// # Errors
    /// The channels do not give it.
    pub(super) fn noise(&self, wanted: &Unknowns) -> Result<f64, Failure> {
        let mut variance = 0.0;
        for (part, size) in self.parts(wanted) {
            if size > RANK * self.largest {
                variance += (part / size) * (part / size);
            } else if part.abs() > HIDDEN * wanted.norm() {
                return Err(Failure::Ambiguous);
            }
        }
        Ok(variance.sqrt())
    }

    /// How much more noise the best estimate has than the channels together could have, at most.
    ///
    /// # Errors
    /// The channels do not give it, or the condition is above 1e6.
    pub(super) fn check_condition(&self, wanted: &Unknowns) -> Result<(), Failure> {
        let condition = self.noise(wanted)? * self.largest / wanted.norm();
        if condition <= WORST_CONDITION { Ok(()) } else { Err(Failure::IllConditioned) }
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
        for ((part, size), vector) in self.parts(wanted).zip(self.vectors.column_iter()) {
            if size > RANK * self.largest {
                solution += vector * (part / (size * size));
            }
        }
        solution
    }

    fn parts(&self, wanted: &Unknowns) -> impl Iterator<Item = (f64, f64)> {
        let parts = self.vectors.tr_mul(wanted);
        let sizes = self.singular_values;
        (0..UNKNOWNS).map(move |i| (parts[i], sizes[i]))
    }
}

/// Rotates a row into an upper triangle `R`, so that `RᵀR` grows by its square.
fn absorb(triangle: &mut Square, mut row: Unknowns) {
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

/// Singular values and right singular vectors by one-sided Jacobi rotations: accurate to rounding of the largest, which a
/// decision about rank needs. (nalgebra's own decomposition was tried: its noise gains were wrong by up to 4 %.)
fn decompose(mut columns: Square) -> (Unknowns, Square) {
    let mut vectors = Square::identity();
    // A dozen sweeps suffice; the bound is for what is not finite.
    for _ in 0..60 {
        let mut at_rest = true;
        for p in 0..UNKNOWNS {
            for q in p + 1..UNKNOWNS {
                let product = columns.column(p).dot(&columns.column(q));
                let (one, other) =
                    (columns.column(p).norm_squared(), columns.column(q).norm_squared());
                if product.abs() > f64::EPSILON * (one * other).sqrt() {
                    at_rest = false;
                    let zeta = (other - one) / (2.0 * product);
                    let tangent = 1.0_f64.copysign(zeta) / (zeta.abs() + 1.0.hypot(zeta));
                    rotate(&mut columns, p, q, tangent);
                    rotate(&mut vectors, p, q, tangent);
                }
            }
        }
        if at_rest {
            break;
        }
    }
    (Unknowns::from_fn(|i, _| columns.column(i).norm()), vectors)
}

fn rotate(columns: &mut Square, p: usize, q: usize, tangent: f64) {
    let cosine = 1.0 / 1.0.hypot(tangent);
    let sine = cosine * tangent;
    for row in 0..UNKNOWNS {
        let (one, other) = (columns[(row, p)], columns[(row, q)]);
        columns[(row, p)] = cosine * one - sine * other;
        columns[(row, q)] = sine * one + cosine * other;
    }
}
