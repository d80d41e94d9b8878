//! A Luenberger observer of a linear system in discrete time.

use crate::linear::Flags;
use crate::{Error, Real, Rule};
use nalgebra::{ComplexField, SMatrix, SVector};

/// `x̂(k+1) = A x̂(k) + B u(k) + L (y(k) - C x̂(k))`, with `N` states, `P` outputs and `M` inputs.
///
/// The error obeys `e(k+1) = (A - L C) e(k)`. The gain comes from a design in f64 (in Python `compfilt.design.luenberger`);
/// the steady-state Kalman filter is the same observer. Source: the balancing cube's §1.4.
///
/// ```
/// use compfilt_core::nalgebra::{Matrix1x2, Matrix2, Vector1, Vector2};
/// use compfilt_core::{Observer, ObserverState};
/// let a = Matrix2::new(1.0, 0.1, 0.0, 1.0_f64);
/// let (b, c, correction) = (Vector2::new(0.005, 0.1), Matrix1x2::new(1.0, 0.0), Vector2::new(0.5, 1.0));
/// let observer = Observer::new(a, b, c, a * correction, correction)?;
/// let mut state = ObserverState::new(Vector2::zeros());
/// let (filtered, _) = observer.correct(&mut state, &Vector1::new(1.0));
/// assert_eq!(filtered, Vector2::new(0.5, 1.0));
/// observer.predict(&mut state, &Vector1::new(0.0));
/// assert_eq!(state.x, Vector2::new(0.6, 1.0));
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer<T, const N: usize, const P: usize, const M: usize> {
    a: SMatrix<T, N, N>,
    b: SMatrix<T, N, M>,
    c: SMatrix<T, P, N>,
    l: SMatrix<T, N, P>,
    correction: SMatrix<T, N, P>,
}

/// The state of an [`Observer`] between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverState<T, const N: usize, const P: usize, const M: usize> {
    /// The estimate before the correction of the coming sample.
    pub x: SVector<T, N>,
    /// The innovation that the coming prediction takes into account: zero before a correction.
    pub innovation: SVector<T, P>,
    /// The last input, held where one is missing.
    pub input: SVector<T, M>,
}

impl<T: Real, const N: usize, const P: usize, const M: usize> ObserverState<T, N, P, M> {
    /// Starts from an estimate of the state at the first sample.
    pub fn new(x: SVector<T, N>) -> Self {
        Self { x, innovation: SVector::zeros(), input: SVector::zeros() }
    }
}

impl<T: Real, const N: usize, const P: usize, const M: usize> Observer<T, N, P, M> {
    /// The observer of the model `a`, `b`, `c` with the gain `l`, and the gain `correction` of the filtered estimate,
    /// `a · correction = l`.
    ///
    /// # Errors
    /// A matrix is not finite.
    pub fn new(
        a: SMatrix<T, N, N>,
        b: SMatrix<T, N, M>,
        c: SMatrix<T, P, N>,
        l: SMatrix<T, N, P>,
        correction: SMatrix<T, N, P>,
    ) -> Result<Self, Error> {
        let finite = |values: &[T]| values.iter().all(ComplexField::is_finite);
        for (name, values) in [
            ("a", a.as_slice()),
            ("b", b.as_slice()),
            ("c", c.as_slice()),
            ("l", l.as_slice()),
            ("correction", correction.as_slice()),
        ] {
            if !finite(values) {
                return Err(Error::new(name, Rule::Finite));
            }
        }
        Ok(Self { a, b, c, l, correction })
    }

    fn model(&self) -> ObserverModel<'_, T> {
        ObserverModel {
            a: self.a.as_slice(),
            b: self.b.as_slice(),
            c: self.c.as_slice(),
            l: self.l.as_slice(),
            correction: self.correction.as_slice(),
        }
    }

    /// Takes a measurement: returns the filtered estimate `x̂ + correction (y - C x̂)`. A component that is not finite is
    /// missing and corrects nothing.
    pub fn correct(
        &self,
        state: &mut ObserverState<T, N, P, M>,
        y: &SVector<T, P>,
    ) -> (SVector<T, N>, Flags) {
        let flags = self.model().innovate(
            state.x.as_slice(),
            y.as_slice(),
            state.innovation.as_mut_slice(),
        );
        let mut filtered = SVector::<T, N>::zeros();
        let innovation = state.innovation.as_slice();
        self.model().filter(state.x.as_slice(), innovation, filtered.as_mut_slice());
        (filtered, flags)
    }

    /// Goes on to the next sample with the input `u` and the innovation of the last correction, if there was one. A component
    /// that is not finite is missing: the last one is held. A state that overflows starts anew from zero.
    pub fn predict(&self, state: &mut ObserverState<T, N, P, M>, u: &SVector<T, M>) -> Flags {
        let mut next = SVector::<T, N>::zeros();
        self.model().advance(
            state.x.as_mut_slice(),
            state.innovation.as_mut_slice(),
            state.input.as_mut_slice(),
            u.as_slice(),
            next.as_mut_slice(),
        )
    }
}

/// The arithmetic of an observer whose sizes are known at run time only: matrices column by column.
///
/// The slices must fit each other: `a` N×N, `b` N×M, `c` P×N, `l` and `correction` N×P.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // The names are the equation's.
pub struct ObserverModel<'a, T> {
    pub a: &'a [T],
    pub b: &'a [T],
    pub c: &'a [T],
    pub l: &'a [T],
    pub correction: &'a [T],
}

impl<T: Real> ObserverModel<'_, T> {
    /// `innovation = y - C x`, zero where `y` is missing.
    pub fn innovate(&self, x: &[T], y: &[T], innovation: &mut [T]) -> Flags {
        innovation.fill(T::zero());
        multiply_add(innovation, self.c, x);
        let mut flags = Flags::default();
        for (innovation, y) in innovation.iter_mut().zip(y) {
            *innovation = *y - *innovation;
            if !innovation.is_finite() {
                *innovation = T::zero();
                flags |= Flags::MEASUREMENT_MISSING;
            }
        }
        flags
    }

    /// `filtered = x + correction · innovation`.
    pub fn filter(&self, x: &[T], innovation: &[T], filtered: &mut [T]) {
        filtered.fill(T::zero());
        multiply_add(filtered, self.correction, innovation);
        for (filtered, x) in filtered.iter_mut().zip(x) {
            *filtered = *x + *filtered;
        }
    }

    /// `x = A x + B u + L innovation`, by way of `next`; the innovation is used up.
    pub fn advance(
        &self,
        x: &mut [T],
        innovation: &mut [T],
        input: &mut [T],
        u: &[T],
        next: &mut [T],
    ) -> Flags {
        let mut flags = Flags::default();
        for (input, u) in input.iter_mut().zip(u) {
            if u.is_finite() {
                *input = *u;
            } else {
                flags |= Flags::DERIVATIVE_HELD;
            }
        }
        next.fill(T::zero());
        multiply_add(next, self.a, x);
        multiply_add(next, self.b, input);
        multiply_add(next, self.l, innovation);
        innovation.fill(T::zero());
        if !next.iter().all(ComplexField::is_finite) {
            next.fill(T::zero());
            flags |= Flags::RESTARTED;
        }
        for (x, next) in x.iter_mut().zip(next) {
            *x = *next;
        }
        flags
    }
}

/// `sum += matrix · x`, column by column from the first.
fn multiply_add<T: Real>(sum: &mut [T], matrix: &[T], x: &[T]) {
    let rows = sum.len().max(1);
    for (column, x) in matrix.chunks_exact(rows).zip(x) {
        for (sum, part) in sum.iter_mut().zip(column) {
            *sum += *part * *x;
        }
    }
}
