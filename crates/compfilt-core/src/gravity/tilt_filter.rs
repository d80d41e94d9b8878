//! Two angles from gravity and a gyro: two linear filters whose derivative depends on their own output.

use super::{Axes, angle_rates, tilt};
use crate::linear::{Discretise, Flags, Stream, StreamState};
use crate::{Error, Real};
use nalgebra::{Vector2, Vector3};

/// Where the body rates are turned into angle rates.
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
pub enum Rates<T> {
    /// At the filter's own last output: right at every attitude but the singular one.
    Output,
    /// Always at these two angles in rad: a linear filter, right near them.
    Frozen(Vector2<T>),
}

/// Roll and pitch (or the cube's φ2 and φ3) by one linear filter each: the measurement is gravity's angle, the derivative
/// the angle rate that the gyro's body rates make at the filter's own output.
///
/// Leaving that conversion out errs by `tau ψ̇ sin θ` in a steady turn. Both angles are kept within ±180°; pitch runs on
/// over ±90°: beyond it the other pair of angles of the same attitude, (φ + π, π - θ), is measured; see
/// [`angles`](Self::angles). Source: E. Iontchev, R. Miletiev, L. Hristov, both structures; the balancing cube's §1.3.
///
/// ```
/// use compfilt_core::gravity::{Axes, TiltFilter, TiltState};
/// use compfilt_core::nalgebra::Vector3;
/// use compfilt_core::{Discretise, PiForm};
/// let filter = TiltFilter::new(PiForm::new(2.0_f32, 0.5)?.chain(), Axes::Flu);
/// let gains = filter.design().at(0.01)?;
/// let mut state = TiltState::new();
/// filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81));
/// assert_eq!(filter.angles(&state).as_slice(), &[0.0, 0.0]);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: nalgebra::Scalar + serde::Serialize, D: serde::Serialize",
        deserialize = "T: nalgebra::Scalar + serde::Deserialize<'de>, D: serde::Deserialize<'de>"
    ))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TiltFilter<T, D> {
    stream: Stream<T, D>,
    axes: Axes,
    rates: Rates<T>,
}

impl<T: Real, D: Copy> TiltFilter<T, D> {
    /// The filter with the same design for both angles and rates at its own output.
    pub fn new(design: D, axes: Axes) -> Self {
        Self::of(Stream::new(design), axes)
    }

    /// The filter with the same stream for both angles, which it wraps as angles in rad, and rates at its own output.
    pub fn of(stream: Stream<T, D>, axes: Axes) -> Self {
        let mut filter = Self { stream, axes, rates: Rates::Output };
        // 2π is a positive number: the check cannot fail.
        if let Ok(stream) = filter.stream.period(T::two_pi()) {
            filter.stream = stream;
        }
        filter
    }

    /// Where the rates are turned.
    #[must_use]
    pub fn rates(self, rates: Rates<T>) -> Self {
        Self { rates, ..self }
    }

    /// How long in seconds a missing gyro sample is bridged by the last angle rate.
    ///
    /// # Errors
    /// `hold` is not finite or negative.
    pub fn hold(self, hold: T) -> Result<Self, Error> {
        Ok(Self { stream: self.stream.hold(hold)?, ..self })
    }

    /// The most time in seconds for which the one measurement after a gap counts.
    ///
    /// # Errors
    /// `gap_cap` is not positive and finite.
    pub fn gap_cap(self, gap_cap: T) -> Result<Self, Error> {
        Ok(Self { stream: self.stream.gap_cap(gap_cap)?, ..self })
    }

    /// The design of both angles.
    pub fn design(&self) -> &D {
        self.stream.design()
    }

    /// One sample with the `gains` of its time step: `gyro` in rad/s, `specific_force` in m/s² (its length does not
    /// matter), body axes. A sample with a component that is not finite is missing, and so is a force of no length.
    pub fn update<const N: usize>(
        &self,
        gains: &D::Gains,
        state: &mut TiltState<T, N>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
    ) -> Flags
    where
        D: Discretise<T, N>,
    {
        let missing = Vector2::new(T::NAN, T::NAN);
        let measured = tilt(self.axes, specific_force);
        let before = if state.started() { Some(state.raw()) } else { measured };
        let finite = gyro.iter().all(nalgebra::ComplexField::is_finite);
        let rates = match (self.rates, before) {
            (Rates::Frozen(angles), _) if finite => angle_rates(self.axes, &angles, gyro),
            (Rates::Output, Some(angles)) if finite => angle_rates(self.axes, &angles, gyro),
            _ => missing,
        };
        let measured = measured.map_or(missing, |angles| self.same_side(angles, before));
        let mut flags = Flags::default();
        for ((angle, y), u) in state.angles.iter_mut().zip(measured.iter()).zip(rates.iter()) {
            flags |= self.stream.update(gains, angle, *y, *u, &mut ());
            // Whole turns would cost the scalar type's resolution.
            angle.levels.levels[0] = wrap(angle.level0());
        }
        flags
    }

    /// Of the two pairs of angles of one attitude, the one on the side of the singularity where the filter is.
    fn same_side(&self, measured: Vector2<T>, before: Option<Vector2<T>>) -> Vector2<T> {
        let singular = self.axes.singular();
        match before {
            Some(angles) if angles[singular].cos() < T::zero() => {
                let mut other = measured;
                other[singular] = T::pi() - measured[singular];
                other[1 - singular] = measured[1 - singular] + T::pi();
                other
            }
            _ => measured,
        }
    }

    /// The two angles in their usual ranges: (roll in ±π, pitch in ±π/2), or (φ2 in ±π/2, φ3 in ±π). NaN before the
    /// first measurement.
    pub fn angles<const N: usize>(&self, state: &TiltState<T, N>) -> Vector2<T> {
        let singular = self.axes.singular();
        let mut angles = state.raw();
        if angles[singular].abs() > T::frac_pi_2() {
            angles[singular] = T::pi().copysign(angles[singular]) - angles[singular];
            angles[1 - singular] += T::pi();
        }
        angles[1 - singular] = wrap(angles[1 - singular]);
        angles
    }
}

/// Into [-π, π); exact where it already is.
fn wrap<T: Real>(angle: T) -> T {
    if angle >= -T::pi() && angle < T::pi() {
        angle
    } else {
        angle - T::two_pi() * (angle / T::two_pi() + T::literal(0.5)).floor()
    }
}

/// The state of a [`TiltFilter`]: a linear filter's for each angle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TiltState<T: Real, const N: usize> {
    /// Roll and pitch, or φ2 and φ3.
    pub angles: [StreamState<T, N>; 2],
}

impl<T: Real, const N: usize> TiltState<T, N> {
    /// Waits for the first measurement.
    pub fn new() -> Self {
        Self { angles: [StreamState::new(); 2] }
    }

    /// Starts from two known angles in rad.
    pub fn from_angles(angles: &Vector2<T>) -> Self {
        let mut state = Self::new();
        for (filter, angle) in state.angles.iter_mut().zip(angles.iter()) {
            filter.start(*angle);
        }
        state
    }

    fn started(&self) -> bool {
        self.angles.iter().all(|angle| angle.started)
    }

    /// Level 0 of both filters.
    pub fn raw(&self) -> Vector2<T> {
        Vector2::new(self.angles[0].level0(), self.angles[1].level0())
    }
}

impl<T: Real, const N: usize> Default for TiltState<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
