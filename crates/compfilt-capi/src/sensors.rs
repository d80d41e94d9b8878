//! What the attitude filters know of their sensors, and when a body rests: as in the core, field by field.

/// What a filter knows of its sensors.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Sensors {
    /// How far in s the specific force is moved ahead.
    pub delay: f32,
    /// How far in s the attitude is turned ahead.
    pub advance: f32,
    /// How long in s a missing gyro is bridged.
    pub hold: f32,
    /// A time step in s after which the vertical is sought anew.
    pub gap: f32,
    /// What an accelerometer's component stays below in m/s^2.
    pub force_range: f32,
}

/// When a body counts as resting.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RestRule {
    /// The memory of the low-passes in s.
    pub memory: f32,
    /// How long in s a body must be still.
    pub time: f32,
    /// How far in rad/s the gyro may be from its low-pass.
    pub rate: f32,
    /// How far in m/s^2 the accelerometer may be from its low-pass.
    pub force: f32,
    /// How far in m/s^2 the low-passed accelerometer may drift in a rest.
    pub drift: f32,
    /// The largest bias in rad/s on an axis.
    pub bias_limit: f32,
    /// The memory of the bias in s.
    pub bias_memory: f32,
}

/// How the heading follows the magnetometer.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct HeadingRule {
    /// The time constant in s.
    pub tau: f32,
}
