//! What the gravity filters know of their sensors: how long a gyro is held, what is clipped, which signal is late.

use super::vector::Vector;
use crate::error::positive;
use crate::{Change, Error, Mask, Number, Real, Rule};

/// No accelerometer reads this in m/s².
pub(super) const STRONGEST: f64 = 1e6;

/// The properties of a gyro and an accelerometer, and what to do where one is missing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub(super) struct Sensors<T> {
    pub(super) delay: T,
    pub(super) advance: T,
    pub(super) hold: T,
    /// A time step in s after which the vertical is sought anew.
    pub(super) gap: T,
    /// What an accelerometer's component stays below in m/s².
    pub(super) force_range: T,
}

impl<T: Number> Sensors<T> {
    /// Whether a sample of the accelerometer in m/s² is there: of a size that is one, and not clipped.
    #[inline(always)]
    pub(super) fn is_there(&self, force: Vector<T>) -> T::Mask {
        let (extent, zero) = (force.extent(), T::literal(0.0));
        // One comparison with the range says it of nearly every sample.
        if (zero.less(extent) & extent.less(self.force_range)).all() {
            return T::Mask::same(true);
        }
        zero.less(extent) & force.is_within(self.force_range)
    }

    /// The force as it will be when its delay is over.
    #[inline(always)]
    pub(super) fn moved(&self, force: Vector<T>, rate: Vector<T>) -> Vector<T> {
        if is_zero(self.delay) {
            return force;
        }
        force - rate.cross(&force) * self.delay
    }

    /// Whether the attitude is turned ahead at all.
    #[inline(always)]
    pub(super) fn advances(&self) -> bool {
        !is_zero(self.advance)
    }

    #[inline(always)]
    pub(super) fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Sensors<U> {
        Sensors {
            delay: change.number(self.delay),
            advance: change.number(self.advance),
            hold: change.number(self.hold),
            gap: change.number(self.gap),
            force_range: change.number(self.force_range),
        }
    }
}

impl<T: Real> Sensors<T> {
    /// Of sensors whose forces stay below `strongest`.
    pub(super) fn new(strongest: T) -> Self {
        let (hold, gap) = (T::literal(0.1), T::one());
        Self { delay: T::zero(), advance: T::zero(), hold, gap, force_range: strongest }
    }

    pub(super) fn delay(self, delay: T) -> Result<Self, Error> {
        Ok(Self { delay: finite("delay", delay)?, ..self })
    }

    pub(super) fn advance(self, advance: T) -> Result<Self, Error> {
        Ok(Self { advance: finite("advance", advance)?, ..self })
    }

    pub(super) fn hold(self, hold: T) -> Result<Self, Error> {
        if hold.is_finite() && hold >= T::zero() {
            Ok(Self { hold, ..self })
        } else {
            Err(Error::new("hold", Rule::NotNegative))
        }
    }

    pub(super) fn force_range(self, force_range: T) -> Result<Self, Error> {
        let range = positive("force_range", force_range)?;
        Ok(Self { force_range: self.force_range.or_less(range), ..self })
    }
}

#[inline(always)]
fn is_zero<T: Number>(number: T) -> bool {
    number.magnitude().at_most(T::literal(0.0)).all()
}

fn finite<T: Real>(parameter: &'static str, value: T) -> Result<T, Error> {
    if value.is_finite() { Ok(value) } else { Err(Error::new(parameter, Rule::Finite)) }
}

/// The settings of the sensors as a filter's own, where the filter keeps them in `sensors`.
macro_rules! sensor_settings {
    () => {
        /// How far in s the specific force is moved ahead, `f - delay ω × f`: how much later the accelerometer's samples are
        /// than the frame that the gyro turns. A property of the sensor; half a sample period where the gyro's samples are
        /// instantaneous.
        ///
        /// # Errors
        /// `delay` is not finite.
        pub fn delay(self, delay: T) -> Result<Self, $crate::Error> {
            Ok(Self { sensors: self.sensors.delay(delay)?, ..self })
        }

        /// How far in s the attitude is turned ahead by the last rate: the time that the sensors and the computation take.
        ///
        /// # Errors
        /// `advance` is not finite.
        pub fn advance(self, advance: T) -> Result<Self, $crate::Error> {
            Ok(Self { sensors: self.sensors.advance(advance)?, ..self })
        }

        /// How long in s a missing gyro sample is bridged by the last one; 0.1 where it is not set.
        ///
        /// # Errors
        /// `hold` is negative or not finite.
        pub fn hold(self, hold: T) -> Result<Self, $crate::Error> {
            Ok(Self { sensors: self.sensors.hold(hold)?, ..self })
        }

        /// The accelerometer's range in m/s²: a sample with a component at it or beyond it is clipped, and counts as missing.
        ///
        /// # Errors
        /// `force_range` is not positive and finite.
        pub fn force_range(self, force_range: T) -> Result<Self, $crate::Error> {
            Ok(Self { sensors: self.sensors.force_range(force_range)?, ..self })
        }

        /// When the body counts as resting.
        #[must_use]
        pub fn rest(self, rest: $crate::attitude::RestRule<T>) -> Self {
            Self { rest, ..self }
        }

        /// How the heading follows the magnetometer.
        #[must_use]
        pub fn heading(self, heading: $crate::attitude::HeadingRule<T>) -> Self {
            Self { heading, ..self }
        }
    };
}
pub(super) use sensor_settings;
