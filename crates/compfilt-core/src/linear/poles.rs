//! The roots of `s^N + k_1 s^{N-1} + … + k_N`.

use crate::Real;
use nalgebra::{Complex, ComplexField};

/// Whether all roots lie in the left half plane, by Routh's scheme.
pub(crate) fn is_stable<T: Real, const N: usize>(coefficients: &[T; N]) -> bool {
    // Two rows of the scheme; the upper one lacks its first entry, which is kept apart as `lead`.
    let mut upper = [T::zero(); N];
    let mut lower = [T::zero(); N];
    let mut lead = T::one();
    for (i, k) in coefficients.iter().enumerate() {
        let row = if i % 2 == 0 { &mut lower } else { &mut upper };
        row[i / 2] = *k;
    }
    for _ in 0..N {
        let [first, ..] = lower[..] else { return false };
        if !(first > T::zero() && first.is_finite()) {
            return false;
        }
        let mut shifted = [T::zero(); N];
        shifted[..N - 1].copy_from_slice(&lower[1..]);
        for (entry, right) in upper.iter_mut().zip(&shifted) {
            *entry -= lead / first * *right;
        }
        lower = core::mem::replace(&mut upper, shifted);
        lead = first;
    }
    true
}

/// The roots of `s^N + k_1 s^{N-1} + … + k_N`, conjugate pairs side by side.
///
/// One root of multiplicity `N` and orders up to 2 come from closed forms; the rest from the simultaneous
/// iteration of Ehrlich and Aberth.
pub fn poles<T: Real, const N: usize>(coefficients: &[T; N]) -> [Complex<T>; N] {
    // In units of the geometric mean of the roots, all coefficients are of moderate size.
    let unit = geometric_mean(coefficients);
    let mut normalised = *coefficients;
    let mut scale = T::one();
    for k in &mut normalised {
        scale /= unit;
        *k *= scale;
    }
    let roots = multiple(&normalised)
        .or_else(|| quadratic(&normalised))
        .unwrap_or_else(|| ehrlich_aberth(&normalised));
    roots.map(|root| root * unit)
}

fn geometric_mean<T: Real, const N: usize>(coefficients: &[T; N]) -> T {
    let last = coefficients.last().copied().unwrap_or(T::one());
    #[allow(clippy::cast_precision_loss)] // The order is a small number.
    let exponent = T::literal(1.0 / N as f64);
    if N == 1 { last } else { last.powf(exponent) }
}

/// `(s - p)^N`, if the coefficients are those to rounding.
fn multiple<T: Real, const N: usize>(coefficients: &[T; N]) -> Option<[Complex<T>; N]> {
    #[allow(clippy::cast_precision_loss)]
    let order = T::literal(N as f64);
    let root = -*coefficients.first()? / order;
    let rebuilt = super::placement::polynomial_from_roots([real(root); N]);
    let tolerance = T::default_epsilon() * T::literal(8.0) * order;
    let same =
        rebuilt.iter().zip(coefficients).all(|(a, b)| (*a - *b).abs() <= tolerance * b.abs());
    same.then_some([real(root); N])
}

fn quadratic<T: Real, const N: usize>(coefficients: &[T; N]) -> Option<[Complex<T>; N]> {
    let &[k1, k2] = coefficients.as_slice() else { return None };
    let half = k1 * T::literal(-0.5);
    let discriminant = half * half - k2;
    let (first, second) = if discriminant < T::zero() {
        let imaginary = (-discriminant).sqrt();
        (Complex::new(half, imaginary), Complex::new(half, -imaginary))
    } else {
        // The larger root without cancellation, the smaller by the product of both.
        let large = half - discriminant.sqrt();
        (real(k2 / large), real(large))
    };
    let mut roots = [first; N];
    *roots.last_mut()? = second;
    Some(roots)
}

fn ehrlich_aberth<T: Real, const N: usize>(coefficients: &[T; N]) -> [Complex<T>; N] {
    let mut roots = start(coefficients);
    for _ in 0..200 {
        let mut largest = T::zero();
        for i in 0..N {
            let here = roots[i];
            let newton = newton_step(coefficients, here);
            let mut repulsion = real(T::zero());
            for (j, other) in roots.iter().enumerate() {
                if j != i {
                    repulsion += real(T::one()) / (here - *other);
                }
            }
            let step = newton / (real(T::one()) - newton * repulsion);
            if step.re.is_finite() && step.im.is_finite() {
                roots[i] = here - step;
                largest = largest.max(size(step) / size(here));
            }
        }
        if largest <= T::default_epsilon() {
            break;
        }
    }
    pair(roots)
}

/// Points around the circle on which the roots lie on average, turned so that none is real or mirrored.
fn start<T: Real, const N: usize>(coefficients: &[T; N]) -> [Complex<T>; N] {
    let radius =
        T::one() + coefficients.iter().fold(T::zero(), |m, k| m.max(*k)) * T::literal(1e-3);
    core::array::from_fn(|i| {
        #[allow(clippy::cast_precision_loss)]
        let angle = T::literal((i as f64 * core::f64::consts::TAU + 0.7) / N as f64);
        Complex::new(radius * angle.cos(), radius * angle.sin())
    })
}

/// p(s)/p'(s) by Horner's scheme.
fn newton_step<T: Real, const N: usize>(coefficients: &[T; N], s: Complex<T>) -> Complex<T> {
    let mut value = real(T::one());
    let mut slope = real(T::zero());
    for k in coefficients {
        slope = slope * s + value;
        value = value * s + real(*k);
    }
    value / slope
}

/// Makes the set closed under conjugation again. From the root furthest from the real axis on: it and the one nearest to
/// its mirror image become exact mirror images, or real if they are so to rounding; nearest to its own, it becomes real.
fn pair<T: Real, const N: usize>(mut roots: [Complex<T>; N]) -> [Complex<T>; N] {
    let mut done = 0;
    while done < N {
        bring_forward(&mut roots[done..], |root| -root.im.abs());
        let root = roots[done];
        let own = root.im.abs() * T::literal(2.0);
        let others = &mut roots[done + 1..];
        bring_forward(others, |other| size(*other - root.conj()));
        match others.first_mut() {
            Some(other) if size(*other - root.conj()) < own => {
                let re = (root.re + other.re) * T::literal(0.5);
                let im = (root.im.abs() + other.im.abs()) * T::literal(0.5);
                let exact = im > T::default_epsilon().sqrt() * re.abs();
                let upper = Complex::new(re, if exact { im } else { T::zero() });
                *other = upper.conj();
                roots[done] = upper;
                done += 2;
            }
            _ => {
                roots[done].im = T::zero();
                done += 1;
            }
        }
    }
    sort(&mut roots);
    roots
}

/// Exchanges the first root with the one of the least `key`.
fn bring_forward<T: Real>(roots: &mut [Complex<T>], key: impl Fn(&Complex<T>) -> T) {
    for j in 1..roots.len() {
        if key(&roots[j]) < key(&roots[0]) {
            roots.swap(0, j);
        }
    }
}

/// Slowest first, pairs side by side with the positive imaginary part first.
fn sort<T: Real>(roots: &mut [Complex<T>]) {
    let before =
        |a: &Complex<T>, b: &Complex<T>| (-a.re, a.im.abs(), -a.im) < (-b.re, b.im.abs(), -b.im);
    for i in 1..roots.len() {
        for j in (1..=i).rev() {
            if before(&roots[j], &roots[j - 1]) {
                roots.swap(j, j - 1);
            }
        }
    }
}

fn real<T: Real>(re: T) -> Complex<T> {
    Complex::new(re, T::zero())
}

fn size<T: Real>(z: Complex<T>) -> T {
    ComplexField::modulus(z)
}
