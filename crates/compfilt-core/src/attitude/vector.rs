//! Three components side by side.

use crate::{Change, Element, Number};
use core::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};
use nalgebra::Vector3;

/// A vector in the arithmetic of a step.
///
/// It holds nalgebra's vector, which the interface speaks. Its operators are its own because nalgebra's are not always inlined,
/// and what is not inlined is compiled for the oldest processor when recordings are filtered side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vector<T>(pub(super) Vector3<T>);

impl<T: Number> Vector<T> {
    #[inline(always)]
    pub(super) fn new(x: T, y: T, z: T) -> Self {
        Self(Vector3::from_array_storage(nalgebra::ArrayStorage([[x, y, z]])))
    }

    #[inline(always)]
    pub(super) fn zero() -> Self {
        let zero = T::literal(0.0);
        Self::new(zero, zero, zero)
    }

    #[inline(always)]
    pub(super) fn parts(&self) -> [T; 3] {
        self.0.data.0[0]
    }

    #[inline(always)]
    pub(super) fn dot(&self, other: &Self) -> T {
        let ([a, b, c], [x, y, z]) = (self.parts(), other.parts());
        a * x + b * y + c * z
    }

    #[inline(always)]
    pub(super) fn square(&self) -> T {
        self.dot(self)
    }

    #[inline(always)]
    pub(super) fn cross(&self, other: &Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.parts(), other.parts());
        Self::new(b * z - c * y, c * x - a * z, a * y - b * x)
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (yes.parts(), no.parts());
        Self::new(T::choose(mask, a, x), T::choose(mask, b, y), T::choose(mask, c, z))
    }

    /// The sum of the components' magnitudes: rounded it is still no smaller than any of them.
    #[inline(always)]
    pub(super) fn extent(&self) -> T {
        let [x, y, z] = self.parts();
        x.magnitude() + y.magnitude() + z.magnitude()
    }

    /// Whether every component is nearer to zero than `bound`: false for what is not a number.
    #[inline(always)]
    pub(super) fn is_within(&self, bound: T) -> T::Mask {
        use crate::Mask;
        // One comparison says it of nearly every sample.
        if self.extent().less(bound).all() {
            return T::Mask::same(true);
        }
        let [x, y, z] = self.parts();
        x.magnitude().less(bound) & y.magnitude().less(bound) & z.magnitude().less(bound)
    }

    /// The largest component's magnitude; anything where a component is not a number.
    #[inline(always)]
    pub(super) fn largest(&self) -> T {
        let [x, y, z] = self.parts();
        x.magnitude().or_more(y.magnitude()).or_more(z.magnitude())
    }

    #[inline(always)]
    pub(super) fn is_finite(&self) -> T::Mask {
        let [x, y, z] = self.parts();
        x.is_number() & y.is_number() & z.is_number()
    }

    /// The unit vector along it, and where it has a direction.
    #[inline(always)]
    pub(super) fn direction(&self) -> (Self, T::Mask) {
        use crate::Mask;
        let square = self.square();
        // The squares of smaller and larger vectors may vanish or overflow.
        let common = T::literal(1e-30).less(square) & square.less(T::literal(1e30));
        if common.all() {
            return (*self * square.reciprocal_root(), T::Mask::same(true));
        }
        self.direction_of_any(common)
    }

    #[cold]
    #[inline(never)]
    fn direction_of_any(self, common: T::Mask) -> (Self, T::Mask) {
        let largest = self.largest();
        let there = T::literal(0.0).less(largest) & self.is_finite();
        let scale = T::choose(there & !common, largest, T::literal(1.0));
        let [x, y, z] = self.parts();
        let scaled = Self::new(x / scale, y / scale, z / scale);
        (scaled * scaled.square().reciprocal_root(), there)
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Vector<U> {
        let [x, y, z] = self.parts();
        Vector::new(change.number(x), change.number(y), change.number(z))
    }
}

impl<T: Number> Add for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.parts(), other.parts());
        Self::new(a + x, b + y, c + z)
    }
}

impl<T: Number> Sub for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.parts(), other.parts());
        Self::new(a - x, b - y, c - z)
    }
}

impl<T: Number> Mul<T> for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        let [x, y, z] = self.parts();
        Self::new(x * factor, y * factor, z * factor)
    }
}

impl<T: Number> Neg for Vector<T> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let [x, y, z] = self.parts();
        Self::new(-x, -y, -z)
    }
}

impl<T: Number> AddAssign for Vector<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Number> SubAssign for Vector<T> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<T: Number> Element<T> for Vector<T> {
    #[inline(always)]
    fn neutral() -> Self {
        Self::zero()
    }
}
