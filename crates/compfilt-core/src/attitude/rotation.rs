//! Unit quaternions, and turns by small rotation vectors without a trigonometric function.

use super::vector::Vector;
use crate::{Change, Mask, Number, Real};
use nalgebra::{Matrix3, Vector3};

/// A unit quaternion `w + x i + y j + z k`, from body to world: `v_world = q v_body q*`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: nalgebra::Scalar + serde::Serialize",
        deserialize = "T: nalgebra::Scalar + serde::Deserialize<'de>"
    ))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Rotation<T> {
    /// The scalar part.
    pub w: T,
    /// The vector part.
    pub v: Vector3<T>,
}

impl<T: Real> Rotation<T> {
    /// Of a quaternion that is not zero; its length does not matter. `None` if it has no direction.
    pub fn new(w: T, v: Vector3<T>) -> Option<Self> {
        let (rotation, there) = Self::along(w, Vector(v));
        there.then_some(rotation)
    }

    /// The smallest turn with which the body's unit vector `up` points up in the world. Straight down, where that is not
    /// unique, it turns about the body's x.
    pub fn from_up(up: &Vector3<T>) -> Self {
        Self::upwards(Vector(*up))
    }

    /// Of the world's unit vectors east, north and up as the body sees them.
    pub fn from_axes(east: &Vector3<T>, north: &Vector3<T>, up: &Vector3<T>) -> Self {
        Self::of_axes(Vector(*east), Vector(*north), Vector(*up))
    }

    /// The matrix that takes body vectors to the world.
    pub fn matrix(&self) -> Matrix3<T> {
        Matrix3::from_columns(&self.axes().map(|axis| axis.0))
    }

    /// Whether all parts are finite.
    pub fn is_finite(&self) -> bool {
        self.is_number()
    }
}

impl<T: Number> Rotation<T> {
    #[inline(always)]
    pub(super) fn of(w: T, v: Vector<T>) -> Self {
        Self { w, v: v.0 }
    }

    /// No rotation.
    #[inline(always)]
    pub fn identity() -> Self {
        Self::of(T::literal(1.0), Vector::zero())
    }

    /// The product `self ⊗ other`.
    #[inline(always)]
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let (v, u) = (Vector(self.v), Vector(other.v));
        Self::of(self.w * other.w - v.dot(&u), u * self.w + v * other.w + v.cross(&u))
    }

    /// The inverse rotation.
    #[inline(always)]
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self::of(self.w, -Vector(self.v))
    }

    /// `|q|²`.
    #[inline(always)]
    pub(super) fn square(&self) -> T {
        self.w * self.w + Vector(self.v).square()
    }

    /// One step towards unit length, `q (3 - |q|²)/2`: exact to rounding where the length is near 1.
    #[inline(always)]
    #[must_use]
    pub fn renormalised(&self) -> Self {
        self.scaled(T::literal(1.5) - T::literal(0.5) * self.square())
    }

    #[inline(always)]
    pub(super) fn scaled(&self, factor: T) -> Self {
        Self::of(self.w * factor, Vector(self.v) * factor)
    }

    /// The turn by the rotation vector `turn` in rad.
    #[inline(always)]
    pub fn of_turn(turn: &Vector3<T>) -> Self {
        let turn = Vector(*turn);
        let small = turn.square().at_most(T::literal(0.0625));
        if small.all() {
            return of_small_turn(turn);
        }
        // Part by part: where a call stores its result, the small turn would be stored as well.
        let Self { w, v } = of_large_turn(turn);
        Self { w, v }
    }

    /// The same attitude after a turn by the rotation vector `turn` in rad, body axes.
    #[inline(always)]
    #[must_use]
    pub fn turned(&self, turn: &Vector3<T>) -> Self {
        self.times(&Self::of_turn(turn)).renormalised()
    }

    /// A body vector in world axes.
    #[inline(always)]
    pub fn to_world(&self, body: &Vector3<T>) -> Vector3<T> {
        let (v, body) = (Vector(self.v), Vector(*body));
        let cross = v.cross(&body);
        let twice = cross + cross;
        (body + twice * self.w + v.cross(&twice)).0
    }

    /// A world vector in body axes.
    #[inline(always)]
    pub fn to_body(&self, world: &Vector3<T>) -> Vector3<T> {
        self.inverse().to_world(world)
    }

    /// The world's up in body axes.
    #[inline(always)]
    pub fn up(&self) -> Vector3<T> {
        let (w, [x, y, z]) = (self.w, Vector(self.v).parts());
        let two = T::literal(2.0);
        Vector::new(two * (x * z - w * y), two * (y * z + w * x), w * w + z * z - x * x - y * y).0
    }

    /// The world's north in body axes.
    #[inline(always)]
    pub(super) fn north(&self) -> Vector<T> {
        let (w, [x, y, z]) = (self.w, Vector(self.v).parts());
        let two = T::literal(2.0);
        Vector::new(two * (x * y + w * z), w * w + y * y - x * x - z * z, two * (y * z - w * x))
    }

    /// The body's axes in the world: the columns of the matrix.
    #[inline(always)]
    pub(super) fn axes(&self) -> [Vector<T>; 3] {
        let (w, [x, y, z]) = (self.w, Vector(self.v).parts());
        let (one, two) = (T::literal(1.0), T::literal(2.0));
        let (xx, yy, zz) = (two * x * x, two * y * y, two * z * z);
        let (xy, xz, yz) = (two * x * y, two * x * z, two * y * z);
        let (wx, wy, wz) = (two * w * x, two * w * y, two * w * z);
        [
            Vector::new(one - (yy + zz), xy + wz, xz - wy),
            Vector::new(xy - wz, one - (xx + zz), yz + wx),
            Vector::new(xz + wy, yz - wx, one - (xx + yy)),
        ]
    }

    /// The attitude after the smallest turn with which the body's unit vector `up` points up in the world, and where that is
    /// unique: `up` is not opposite to the world's.
    #[inline(always)]
    pub(super) fn levelled(&self, up: Vector<T>) -> (Self, T::Mask) {
        let estimated = Vector(self.up());
        // From v to v̂: (1 + v·v̂, v × v̂), of the length √(2 + 2 v·v̂).
        let turn = Self::of(T::literal(1.0) + up.dot(&estimated), up.cross(&estimated));
        let levelled = self.times(&turn);
        let square = levelled.square();
        // Nearer to opposite than this, only rounding says which way.
        let unique = T::literal(16.0 * T::EPSILON).less(square);
        (levelled.scaled(square.reciprocal_root()), unique)
    }

    /// The same for every `up`: straight down it turns over about an axis across the body's x, or y where that is vertical.
    #[inline(always)]
    pub(super) fn upright(&self, up: Vector<T>) -> Self {
        let (levelled, unique) = self.levelled(up);
        if unique.all() {
            return levelled;
        }
        let [x, y, z] = up.parts();
        Self::choose(unique, levelled, self.turned_over(x, y, z))
    }

    /// `up` part by part: as a vector it would have to be stored for the call, even where there is none.
    #[cold]
    #[inline(never)]
    fn turned_over(self, x: T, y: T, z: T) -> Self {
        let up = Vector::new(x, y, z);
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let steep = T::literal(0.9).less(x.magnitude());
        let axis = Vector::new(T::choose(steep, zero, one), T::choose(steep, one, zero), zero);
        let (axis, there) = axis.cross(&up).direction();
        let axis = Vector::choose(there, axis, Vector::new(zero, zero, one));
        self.times(&Self::of(zero, axis)).renormalised()
    }

    /// Of a quaternion of any length, and where it has a direction.
    #[inline(always)]
    pub(super) fn along(w: T, v: Vector<T>) -> (Self, T::Mask) {
        let largest = w.magnitude().or_more(v.largest());
        let there = T::literal(0.0).less(largest) & w.is_number() & v.is_finite();
        // The squares of very small or large parts would vanish or overflow.
        let [x, y, z] = v.parts();
        let scaled = Self::of(w / largest, Vector::new(x / largest, y / largest, z / largest));
        (scaled.scaled(scaled.square().reciprocal_root()), there)
    }

    #[inline(always)]
    pub(super) fn upwards(up: Vector<T>) -> Self {
        // q ∝ (1 + up·e_z, up × e_z), and not -0.
        let ([x, y, z], zero) = (up.parts(), T::literal(0.0));
        let (rotation, there) = Self::along(T::literal(1.0) + z, Vector::new(y, zero - x, zero));
        let over = Self::of(zero, Vector::new(T::literal(1.0), zero, zero));
        Self::choose(there, rotation, over)
    }

    #[inline(always)]
    pub(super) fn of_axes(east: Vector<T>, north: Vector<T>, up: Vector<T>) -> Self {
        let (east, north, up) = (east.parts(), north.parts(), up.parts());
        let one = T::literal(1.0);
        let trace = east[0] + north[1] + up[2];
        let (x, y, z) = (up[1] - north[2], east[2] - up[0], north[0] - east[1]);
        let (xy, xz, yz) = (north[0] + east[1], up[0] + east[2], up[1] + north[2]);
        let [xx, yy, zz] = [east[0], north[1], up[2]].map(|axis| one + axis + axis - trace);
        // Four times the quaternion times its largest part, which is never small.
        let mut best = one + trace;
        let (mut w, mut v) = (best, Vector::new(x, y, z));
        let others = [
            (xx, x, Vector::new(xx, xy, xz)),
            (yy, y, Vector::new(xy, yy, yz)),
            (zz, z, Vector::new(xz, yz, zz)),
        ];
        for (size, other_w, other_v) in others {
            let larger = best.less(size);
            best = T::choose(larger, size, best);
            (w, v) = (T::choose(larger, other_w, w), Vector::choose(larger, other_v, v));
        }
        let (rotation, there) = Self::along(w, v);
        Self::choose(there, rotation, Self::identity())
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    pub(super) fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self::of(T::choose(mask, yes.w, no.w), Vector::choose(mask, Vector(yes.v), Vector(no.v)))
    }

    #[inline(always)]
    pub(super) fn is_number(&self) -> T::Mask {
        self.w.is_number() & Vector(self.v).is_finite()
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Rotation<U> {
        Rotation { w: change.number(self.w), v: Vector(self.v).each(change).0 }
    }
}

/// Cosine and sine of half the angle by their series: to rounding up to a quarter of a radian.
#[inline(always)]
fn of_small_turn<T: Number>(turn: Vector<T>) -> Rotation<T> {
    let t = T::literal;
    let s = turn.square();
    let sine = (t(1.0 / 185_794_560.0) * s - t(1.0 / 645_120.0)) * s + t(1.0 / 3_840.0);
    let sine = (sine * s - t(1.0 / 48.0)) * s + t(0.5);
    let cosine = (t(1.0 / 10_321_920.0) * s - t(1.0 / 46_080.0)) * s + t(1.0 / 384.0);
    let cosine = (cosine * s - t(1.0 / 8.0)) * s + t(1.0);
    Rotation::of(cosine, turn * sine)
}

/// Halved until it is small, then doubled as often; what overflows is no turn.
#[cold]
#[inline(never)]
fn of_large_turn<T: Number>(turn: Vector<T>) -> Rotation<T> {
    let t = T::literal;
    let (mut turn, mut halvings) = (turn, t(0.0));
    for _ in 0..64 {
        let large = t(0.0625).less(turn.square());
        if !large.any() {
            break;
        }
        turn = turn * T::choose(large, t(0.5), t(1.0));
        halvings += T::choose(large, t(1.0), t(0.0));
    }
    let mut rotation = of_small_turn(turn);
    for _ in 0..64 {
        let halved = t(0.5).less(halvings);
        if !halved.any() {
            break;
        }
        let doubled = rotation.times(&rotation).renormalised();
        rotation = Rotation::choose(halved, doubled, rotation);
        halvings += t(-1.0);
    }
    rotation
}

/// The horizontal part of `field` as a unit vector, and where it has one.
#[inline(always)]
pub(super) fn horizontal<T: Number>(field: Vector<T>, up: Vector<T>) -> (Vector<T>, T::Mask) {
    let level = field - up * field.dot(&up);
    // A field along the vertical has no horizontal direction but rounding.
    let there = T::literal(1e-6).less(level.square());
    let (north, has_direction) = level.direction();
    (north, there & has_direction)
}
