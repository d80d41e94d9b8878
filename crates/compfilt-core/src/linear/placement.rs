//! Gains from wanted poles, for a prediction over any time: Ackermann's formula in `w = z - 1`.

use super::State;
use crate::Real;
use nalgebra::{Complex, ComplexField, SVector};

/// `d_1 … d_N` of `Π (w - w_i) = w^N + d_1 w^{N-1} + … + d_N`, the roots real or in conjugate pairs.
pub(crate) fn polynomial_from_roots<T: Real, const N: usize>(roots: [Complex<T>; N]) -> [T; N] {
    let mut d = [Complex::new(T::zero(), T::zero()); N];
    for root in roots {
        let mut lower = Complex::new(T::one(), T::zero());
        for d in &mut d {
            let here = *d;
            *d -= root * lower;
            lower = here;
        }
    }
    d.map(|d| d.re)
}

/// The gains `L` with which the error's transition `(I - L C) Φ` over a step has the characteristic polynomial
/// `d`; `Φ` row by row, `C` the first level. `None` if level 0 does not see all levels (a step of no length).
///
/// With `ν = Φ - I`: `L = q(ν) z`, where `q(w) = w^N + d_1 w^{N-1} + …` and `z` solves `C Φ ν^j z = [j = N-1]`.
/// The levels are scaled by powers of the elapsed time `tau`, so that all numbers are of the size of 1.
pub(crate) fn place<T: Real, const N: usize>(
    transition: &State<SVector<T, N>, N>,
    d: &[T; N],
    tau: T,
) -> Option<[T; N]> {
    if tau <= T::zero() {
        return None;
    }
    let nu = scaled_departure(transition, tau);
    let mut rows = [[T::zero(); N]; N];
    let mut row = observed(&nu);
    for target in &mut rows {
        *target = row;
        row = times(&row, &nu);
    }
    let mut last = [T::zero(); N];
    *last.last_mut()? = T::one();
    let z = solve(rows, last)?;
    let mut gains = z;
    for d in d {
        gains = add_scaled(apply(&nu, &gains), *d, &z);
    }
    let mut scale = T::one();
    for gain in &mut gains {
        *gain *= scale;
        scale /= tau;
    }
    gains.iter().all(ComplexField::is_finite).then_some(gains)
}

type Square<T, const N: usize> = [[T; N]; N];

/// `ν_ij tau^{i-j}`: the transition without the identity, in levels of one unit.
pub(crate) fn scaled_departure<T: Real, const N: usize>(
    transition: &State<SVector<T, N>, N>,
    tau: T,
) -> Square<T, N> {
    let mut nu = [[T::zero(); N]; N];
    let mut row_scale = T::one();
    for (i, (target, row)) in nu.iter_mut().zip(&transition.levels).enumerate() {
        let mut scale = row_scale;
        for (j, (entry, value)) in target.iter_mut().zip(row.iter()).enumerate() {
            let departure = if i == j { *value - T::one() } else { *value };
            *entry = departure * scale;
            scale /= tau;
        }
        row_scale *= tau;
    }
    nu
}

/// `C Φ = C (I + ν)`.
fn observed<T: Real, const N: usize>(nu: &Square<T, N>) -> [T; N] {
    let mut row = nu.first().copied().unwrap_or([T::zero(); N]);
    if let Some(first) = row.first_mut() {
        *first += T::one();
    }
    row
}

fn times<T: Real, const N: usize>(row: &[T; N], matrix: &Square<T, N>) -> [T; N] {
    let mut product = [T::zero(); N];
    for (factor, line) in row.iter().zip(matrix) {
        product = add_scaled(product, *factor, line);
    }
    product
}

fn apply<T: Real, const N: usize>(matrix: &Square<T, N>, vector: &[T; N]) -> [T; N] {
    let mut product = [T::zero(); N];
    for (target, line) in product.iter_mut().zip(matrix) {
        for (entry, factor) in line.iter().zip(vector) {
            *target += *entry * *factor;
        }
    }
    product
}

fn add_scaled<T: Real, const N: usize>(mut to: [T; N], factor: T, vector: &[T; N]) -> [T; N] {
    for (target, value) in to.iter_mut().zip(vector) {
        *target += factor * *value;
    }
    to
}

/// Gauss's elimination with row exchange. Own code, since this runs after a gap inside a filter, where
/// nothing may panic; nalgebra's decompositions check their indices.
pub(crate) fn solve<S: ComplexField + Copy, const N: usize>(
    mut rows: [[S; N]; N],
    mut right: [S; N],
) -> Option<[S; N]> {
    for column in 0..N {
        let (mut pivot, mut largest) = (column, rows[column][column].modulus());
        for (candidate, row) in rows.iter().enumerate().skip(column + 1) {
            let size = row[column].modulus();
            if size > largest {
                (pivot, largest) = (candidate, size);
            }
        }
        // Not every compiler sees that it is, and one that does not would look, and panic.
        let pivot = pivot.min(N - 1);
        rows.swap(column, pivot);
        right.swap(column, pivot);
        if rows[column][column].is_zero() {
            return None;
        }
        for below in column + 1..N {
            let factor = rows[below][column] / rows[column][column];
            let pivot_row = rows[column];
            for (entry, value) in rows[below].iter_mut().zip(&pivot_row) {
                *entry -= factor * *value;
            }
            let pivot_right = right[column];
            right[below] -= factor * pivot_right;
        }
    }
    for column in (0..N).rev() {
        right[column] /= rows[column][column];
        for above in 0..column {
            let known = right[column];
            right[above] -= rows[above][column] * known;
        }
    }
    Some(right)
}
