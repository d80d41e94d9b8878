//! Unit quaternions, and turns by small rotation vectors without a trigonometric function.

use crate::Real;
use nalgebra::{Matrix3, Vector3};

/// A unit quaternion `w + x i + y j + z k`, from body to world: `v_world = q v_body q*`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<T> {
    /// The scalar part.
    pub w: T,
    /// The vector part.
    pub v: Vector3<T>,
}

impl<T: Real> Rotation<T> {
    /// No rotation.
    pub fn identity() -> Self {
        Self { w: T::one(), v: Vector3::zeros() }
    }

    /// Of a quaternion that is not zero; its length does not matter. `None` if it has no direction.
    pub fn new(w: T, v: Vector3<T>) -> Option<Self> {
        let largest = w.abs().max(v.amax());
        if !(largest > T::zero() && largest.is_finite()) {
            return None;
        }
        // The squares of very small or large parts would vanish or overflow.
        let (w, v) = (w / largest, v / largest);
        let length = (w * w + v.norm_squared()).sqrt();
        Some(Self { w: w / length, v: v / length })
    }

    /// The smallest turn with which the body's unit vector `up` points up in the world. Straight down, where that is not
    /// unique, it turns about the body's x.
    pub fn from_up(up: &Vector3<T>) -> Self {
        // q ∝ (1 + up·e_z, up × e_z), and not -0.
        Self::new(T::one() + up.z, Vector3::new(up.y, T::zero() - up.x, T::zero()))
            .unwrap_or(Self { w: T::zero(), v: Vector3::x() })
    }

    /// Of the world's unit vectors east, north and up as the body sees them.
    pub fn from_axes(east: &Vector3<T>, north: &Vector3<T>, up: &Vector3<T>) -> Self {
        let trace = east.x + north.y + up.z;
        let (x, y, z) = (up.y - north.z, east.z - up.x, north.x - east.y);
        let (xy, xz, yz) = (north.x + east.y, up.x + east.z, up.y + north.z);
        let square = |axis: T| T::one() + axis + axis - trace;
        // Four times the quaternion times its largest part, which is never small.
        let candidates = [
            (T::one() + trace, T::one() + trace, Vector3::new(x, y, z)),
            (square(east.x), x, Vector3::new(square(east.x), xy, xz)),
            (square(north.y), y, Vector3::new(xy, square(north.y), yz)),
            (square(up.z), z, Vector3::new(xz, yz, square(up.z))),
        ];
        let (_, w, v) = candidates.into_iter().fold(
            (T::zero(), T::one(), Vector3::zeros()),
            |best, candidate| {
                if candidate.0 > best.0 { candidate } else { best }
            },
        );
        Self::new(w, v).unwrap_or(Self::identity())
    }

    /// The product `self ⊗ other`.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        Self {
            w: self.w * other.w - self.v.dot(&other.v),
            v: other.v * self.w + self.v * other.w + self.v.cross(&other.v),
        }
    }

    /// The inverse rotation.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { w: self.w, v: -self.v }
    }

    /// One step towards unit length, `q (3 - |q|²)/2`: exact to rounding where the length is near 1.
    #[must_use]
    pub fn renormalised(&self) -> Self {
        let half = T::literal(0.5);
        let factor = half * (T::literal(3.0) - (self.w * self.w + self.v.norm_squared()));
        Self { w: self.w * factor, v: self.v * factor }
    }

    /// The turn by the rotation vector `turn` in rad.
    pub fn of_turn(turn: &Vector3<T>) -> Self {
        let mut turn = *turn;
        let mut halvings = 0;
        // More than a quarter of a radian is taken in halves; what overflows is no turn.
        while turn.norm_squared() > T::literal(0.0625) && halvings < 64 {
            turn *= T::literal(0.5);
            halvings += 1;
        }
        let h = half_tangent(&turn);
        let scale = T::one() / (T::one() + h.norm_squared()).sqrt();
        let mut rotation = Self { w: scale, v: h * scale };
        for _ in 0..halvings {
            rotation = rotation.times(&rotation).renormalised();
        }
        rotation
    }

    /// The same attitude after a turn by the rotation vector `turn` in rad, body axes.
    #[must_use]
    pub fn turned(&self, turn: &Vector3<T>) -> Self {
        self.times(&Self::of_turn(turn)).renormalised()
    }

    /// The attitude after the smallest turn with which the body's unit vector `up` points up in the world; `None` where `up`
    /// is opposite to that, and the turn not unique.
    pub fn levelled(&self, up: &Vector3<T>) -> Option<Self> {
        let estimated = self.up();
        // From v to v̂: (1 + v·v̂, v × v̂).
        let turn = Self::new(T::one() + up.dot(&estimated), up.cross(&estimated))?;
        Some(self.times(&turn))
    }

    /// The same for every `up`: straight down it turns over about an axis across the body's x, or y where that is vertical.
    #[must_use]
    pub fn upright(&self, up: &Vector3<T>) -> Self {
        self.levelled(up).unwrap_or_else(|| {
            let across = |axis: Vector3<T>| direction(&axis.cross(up));
            let steep = up.x.abs() > T::literal(0.9);
            let axis = across(if steep { Vector3::y() } else { Vector3::x() });
            self.times(&Self { w: T::zero(), v: axis.unwrap_or(Vector3::z()) })
        })
    }

    /// A body vector in world axes.
    pub fn to_world(&self, body: &Vector3<T>) -> Vector3<T> {
        let cross = self.v.cross(body);
        let twice = cross + cross;
        body + twice * self.w + self.v.cross(&twice)
    }

    /// A world vector in body axes.
    pub fn to_body(&self, world: &Vector3<T>) -> Vector3<T> {
        self.inverse().to_world(world)
    }

    /// The world's up in body axes.
    pub fn up(&self) -> Vector3<T> {
        let (w, v) = (self.w, self.v);
        let two = T::literal(2.0);
        Vector3::new(
            two * (v.x * v.z - w * v.y),
            two * (v.y * v.z + w * v.x),
            w * w + v.z * v.z - v.x * v.x - v.y * v.y,
        )
    }

    /// The matrix that takes body vectors to the world.
    pub fn matrix(&self) -> Matrix3<T> {
        Matrix3::from_columns(&[
            self.to_world(&Vector3::x()),
            self.to_world(&Vector3::y()),
            self.to_world(&Vector3::z()),
        ])
    }

    /// Whether all parts are finite.
    pub fn is_finite(&self) -> bool {
        self.w.is_finite() && self.v.iter().all(nalgebra::ComplexField::is_finite)
    }
}

/// `tan(|turn|/2)` along `turn`, by its series: to 1e-11 of itself up to a quarter of a radian.
pub(super) fn half_tangent<T: Real>(turn: &Vector3<T>) -> Vector3<T> {
    let square = turn.norm_squared();
    let series = [31.0 / 725_760.0, 17.0 / 40_320.0, 1.0 / 240.0, 1.0 / 24.0, 0.5];
    let factor = series.iter().fold(T::zero(), |sum, term| sum * square + T::literal(*term));
    turn * factor
}

/// The unit vector along `v`, or `None` where it has no direction.
pub(super) fn direction<T: Real>(v: &Vector3<T>) -> Option<Vector3<T>> {
    let largest = v.amax();
    if !(largest > T::zero() && v.iter().all(nalgebra::ComplexField::is_finite)) {
        return None;
    }
    // The squares of very small or large vectors would vanish or overflow.
    let v = v / largest;
    Some(v / v.norm_squared().sqrt())
}

/// The horizontal part of `field`, as a unit vector.
pub(super) fn horizontal<T: Real>(field: &Vector3<T>, up: &Vector3<T>) -> Option<Vector3<T>> {
    let level = field - up * field.dot(up);
    // A field along the vertical has no horizontal direction but rounding.
    if level.norm_squared() > T::literal(1e-6) { direction(&level) } else { None }
}
