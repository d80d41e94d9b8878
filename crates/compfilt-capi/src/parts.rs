//! What the states of the attitude filters are made of: as in the core, field by field.

use crate::border::is_bool;

/// A unit quaternion w + x i + y j + z k, from body to world: x east, y north, z up.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Rotation {
    /// The scalar part.
    pub w: f32,
    /// The vector part.
    pub v: [f32; 3],
}

/// The last rate.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct HeldRate {
    /// In rad/s.
    pub value: [f32; 3],
    /// Seconds since it came.
    pub age: f32,
}

/// Whether the body rests, and the gyro's bias.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Rest {
    /// The gyro's bias in rad/s.
    pub bias: [f32; 3],
    /// The low-passed gyro in rad/s.
    pub gyro: [f32; 3],
    /// The low-passed accelerometer in m/s^2.
    pub force: [f32; 3],
    /// Where that was when the body last was not still.
    pub anchor: [f32; 3],
    /// How long in s the low-passes have been running, at most their memory.
    pub age: f32,
    /// How long in s the body has been still, at most the time that makes a rest.
    pub still: f32,
    /// How long in s it has rested in all, at most the bias's memory.
    pub rested: f32,
    /// Whether the low-passes have begun.
    pub begun: u8,
}

/// What is known of the heading.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Heading {
    /// Seconds since the first field.
    pub age: f32,
    /// Seconds since the last.
    pub since: f32,
    /// Whether a field has set the heading.
    pub known: u8,
}

impl Rest {
    pub(crate) fn is_valid(&self) -> bool {
        is_bool(self.begun)
    }
}

impl Heading {
    pub(crate) fn is_valid(&self) -> bool {
        is_bool(self.known)
    }
}
