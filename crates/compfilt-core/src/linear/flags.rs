//! What happened to a sample.

use core::ops::{BitOr, BitOrAssign};

/// What happened to a sample; a set of bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Flags(u8);

impl Flags {
    /// The measurement was missing: the sample is predicted only.
    pub const MEASUREMENT_MISSING: Self = Self(1);
    /// The derivative was missing: the last one was held.
    pub const DERIVATIVE_HELD: Self = Self(2);
    /// The derivative has been missing for longer than it is held: it counted as zero.
    pub const DERIVATIVE_MISSING: Self = Self(4);
    /// No measurement has come yet: the output is NaN.
    pub const NOT_STARTED: Self = Self(8);
    /// The state had overflowed and was started anew from the measurement.
    pub const RESTARTED: Self = Self(16);
    /// A sensor of several was missing: its part was left out.
    pub const SENSOR_MISSING: Self = Self(32);
    /// The magnetometer was missing: yaw was predicted only.
    pub const MAGNETOMETER_MISSING: Self = Self(64);
    /// The measured direction is opposite to the estimated one: which way to turn is not known.
    pub const AMBIGUOUS: Self = Self(128);

    /// The set as bits.
    pub fn bits(self) -> u8 {
        self.0
    }

    /// Whether all of `others` are set.
    pub fn contains(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }
}

impl BitOr for Flags {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Flags {
    fn bitor_assign(&mut self, other: Self) {
        *self = *self | other;
    }
}
