//! What a function answers.

use compfilt_core::Error;

/// What a function answers. Where it is not OK, nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
#[must_use]
pub enum Status {
    /// Done.
    Ok = 0,
    /// A pointer is NULL that must not be.
    Null = 1,
    /// A parameter breaks its rule: most must be positive and finite.
    Parameter = 2,
    /// The sample period is not positive and finite, or so small or large that a gain vanishes or overflows.
    SamplePeriod = 3,
    /// A struct was not made by a function of this library, or has been overwritten.
    Struct = 4,
    /// A sample that must be there is NaN or infinite.
    Sample = 5,
    /// The filter has not started: no measurement has come yet.
    NotStarted = 6,
}

/// What happened to a sample: the bits of a set of flags.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub enum Flag {
    /// The measurement was missing, so the sample is predicted only.
    MeasurementMissing = 1,
    /// The derivative or the gyro was missing, and the last one was held.
    DerivativeHeld = 2,
    /// It has been missing for longer than it is held, and counted as zero.
    DerivativeMissing = 4,
    /// No measurement has come yet.
    NotStarted = 8,
    /// The state had overflowed, or there was a gap, and the filter was started anew.
    Restarted = 16,
    /// The magnetometer was missing, so the heading was predicted only.
    MagnetometerMissing = 64,
    /// The measured direction is opposite to the estimated one.
    Ambiguous = 128,
}

impl From<Result<(), Self>> for Status {
    fn from(result: Result<(), Self>) -> Self {
        match result {
            Ok(()) => Self::Ok,
            Err(status) => status,
        }
    }
}

impl From<Error> for Status {
    fn from(error: Error) -> Self {
        if error.parameter() == "dt" { Self::SamplePeriod } else { Self::Parameter }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use compfilt_core::Flags;

    #[test]
    fn flags_are_the_cores() {
        let pairs = [
            (Flag::MeasurementMissing, Flags::MEASUREMENT_MISSING),
            (Flag::DerivativeHeld, Flags::DERIVATIVE_HELD),
            (Flag::DerivativeMissing, Flags::DERIVATIVE_MISSING),
            (Flag::NotStarted, Flags::NOT_STARTED),
            (Flag::Restarted, Flags::RESTARTED),
            (Flag::MagnetometerMissing, Flags::MAGNETOMETER_MISSING),
            (Flag::Ambiguous, Flags::AMBIGUOUS),
        ];
        for (bit, flag) in pairs {
            assert_eq!(bit as u8, flag.bits());
        }
    }
}
