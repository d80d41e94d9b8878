//! Gravity to two angles, and body rates to their rates.

use crate::Real;
use nalgebra::{Vector2, Vector3};

/// The body's axes, with the two angles that gravity gives in them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axes {
    /// Forward, left, up: roll about x, pitch about y, nose down positive. At rest the accelerometer reads +g on z.
    Flu,
    /// Forward, right, down (aircraft): roll about x, pitch about y, nose up positive. At rest it reads -g on z.
    Frd,
    /// The balancing cube's: `s = |g| (-c2 c3, c2 s3, -s2)` with the angles φ2, φ3.
    Cube,
}

impl Axes {
    /// Which of the two angles has its singularity at ±90°: pitch, or φ2.
    pub(crate) fn singular(self) -> usize {
        match self {
            Axes::Flu | Axes::Frd => 1,
            Axes::Cube => 0,
        }
    }
}

/// The angles in rad of the specific force `f`, up to its length: (roll, pitch), or (φ2, φ3).
///
/// ```text
/// flu    φ = atan2(f_y, f_z)      θ = atan2(-f_x, √(f_y² + f_z²))
/// frd    φ = atan2(-f_y, -f_z)    θ = atan2( f_x, √(f_y² + f_z²))
/// cube   φ2 = atan2(-s_3, √(s_1² + s_2²))    φ3 = atan2(s_2, -s_1)
/// ```
///
/// `None` if `f` is not finite or has no length. Sources: E. Iontchev et al., equations (6) and (7); the balancing cube's
/// (1.7), (1.8), where φ3 is printed with `k_3` in the denominator for `k_1`.
///
/// ```
/// use compfilt_core::gravity::{Axes, tilt};
/// use compfilt_core::nalgebra::Vector3;
/// let angles = tilt(Axes::Flu, &Vector3::new(0.0, 6.9367, 6.9367_f64)).unwrap();
/// assert!((angles[0].to_degrees() - 45.0).abs() < 1e-12 && angles[1] == 0.0);
/// ```
pub fn tilt<T: Real>(axes: Axes, f: &Vector3<T>) -> Option<Vector2<T>> {
    let largest = f.x.abs().max(f.y.abs()).max(f.z.abs());
    if !(f.x.is_finite() && f.y.is_finite() && f.z.is_finite()) || largest == T::zero() {
        return None;
    }
    // The squares of very small or large forces would vanish or overflow.
    let f = f / largest;
    let length = |a: T, b: T| (a * a + b * b).sqrt();
    // Not -0, whose angle would be -0 or -π.
    let minus = |a: T| T::zero() - a;
    Some(match axes {
        Axes::Flu => Vector2::new(f.y.atan2(f.z), minus(f.x).atan2(length(f.y, f.z))),
        Axes::Frd => Vector2::new(minus(f.y).atan2(minus(f.z)), f.x.atan2(length(f.y, f.z))),
        Axes::Cube => Vector2::new(minus(f.z).atan2(length(f.x, f.y)), f.y.atan2(minus(f.x))),
    })
}

/// The rates in rad/s of the two angles from the body rates `gyro` in rad/s.
///
/// ```text
/// flu, frd   φ̇ = p + tan θ (q sin φ + r cos φ)                        θ̇ = q cos φ - r sin φ
/// cube       φ̇2 = s3 u1 + c3 u2      φ̇3 = u3 + (s2 s3/c2) u2 - (s2 c3/c2) u1
/// ```
///
/// Singular where θ, or φ2, is ±90°: there the cosine's size is taken as 0.001 at least, so that the rates stay finite.
/// Sources: the conversion that E. Iontchev et al. ask for; the balancing cube's (1.31).
pub fn angle_rates<T: Real>(axes: Axes, angles: &Vector2<T>, gyro: &Vector3<T>) -> Vector2<T> {
    let (s0, c0) = angles[0].sin_cos();
    let (s1, c1) = angles[1].sin_cos();
    match axes {
        Axes::Flu | Axes::Frd => {
            let turned = gyro.y * s0 + gyro.z * c0;
            Vector2::new(gyro.x + s1 / away_from_zero(c1) * turned, gyro.y * c0 - gyro.z * s0)
        }
        Axes::Cube => {
            let turned = gyro.y * s1 - gyro.x * c1;
            Vector2::new(gyro.x * s1 + gyro.y * c1, gyro.z + s0 / away_from_zero(c0) * turned)
        }
    }
}

fn away_from_zero<T: Real>(cosine: T) -> T {
    cosine.abs().max(T::literal(1e-3)).copysign(cosine)
}
