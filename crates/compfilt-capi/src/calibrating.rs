//! The gravity filter that learns the gyro's bias and sensitivity, and the delay between the sensors.

use crate::attitude::{Vectors, advance, store_attitude};
use crate::border::{Mirror, given, given_mut, is_bool};
use crate::gravity::GravityDesign;
use crate::parts::{Heading, HeldRate, Rest, Rotation};
use crate::sensors::{HeadingRule, RestRule, Sensors};
use crate::status::Status;
use compfilt_core::attitude::{SelfCalibratingFilter, SelfCalibrationState};
use compfilt_core::{Dt, Error};

/// The core's, with its sample period.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Core {
    filter: SelfCalibratingFilter<f32>,
    dt: f32,
}

/// A self-calibrating gravity filter at one sample period: constant while it runs, and may lie in flash.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Calibrating {
    /// In rad/s.
    pub omega0: f32,
    /// The damping ratio.
    pub zeta: f32,
    /// When the body rests.
    pub rest: RestRule,
    /// How the heading follows the magnetometer.
    pub heading: HeadingRule,
    /// What is known of the sensors.
    pub sensors: Sensors,
    /// The length of a block in s.
    pub block: f32,
    /// Prior standard deviations of the bias in rad/s, of the matrix, and of the delay in s.
    pub prior: [f32; 3],
    /// What matrix and delay may be at most; the bias has the rest's limit.
    pub limits: [f32; 2],
    /// How fast knowledge of the bias gets old, in rad/s per root s.
    pub bias_walk: f32,
    /// The variance density that the velocity's innovations are taken to have.
    pub noise: f32,
    /// Seconds after the start from which on parameters are learnt.
    pub learn_after: f32,
    /// The sensitivity errors that are known before, column by column.
    pub known: [[f32; 3]; 3],
    /// The sample period in s.
    pub dt: f32,
}

/// How the filter depends on one parameter.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Slope {
    /// Of the low-passed force.
    pub mean: [f32; 3],
    /// Of its velocity.
    pub velocity: [f32; 3],
    /// The information gathered so far.
    pub information: f32,
}

/// What a block of samples adds up to.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Block {
    /// The force in the gyro's frame, times time.
    pub force: [f32; 3],
    /// What it would be more by for each second that it is moved ahead, times time.
    pub ahead: [f32; 3],
    /// How long there was a force.
    pub force_time: f32,
    /// How the frame turns with each parameter.
    pub turned: [[f32; 3]; 12],
    /// Seconds.
    pub time: f32,
}

/// The state of a self-calibrating gravity filter.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct CalibratingState {
    /// From body to the gyro's frame.
    pub frame: Rotation,
    /// The low-passed specific force in that frame, m/s^2.
    pub mean: [f32; 3],
    /// Its velocity.
    pub velocity: [f32; 3],
    /// The attitude.
    pub rotation: Rotation,
    /// What was learnt of the sensitivity errors, column by column, to be added to those known before.
    pub matrix: [[f32; 3]; 3],
    /// What was learnt of the delay in s.
    pub delay: f32,
    /// Rest, and the gyro's bias.
    pub rest: Rest,
    /// How the filter depends on its parameters: the bias, the matrix row by row, the delay.
    pub slopes: [Slope; 13],
    /// The block under way.
    pub block: Block,
    /// The last rate.
    pub rate: HeldRate,
    /// The heading's filter.
    pub heading: Heading,
    /// Seconds since the start.
    pub age: f32,
    /// Whether there is an attitude.
    pub started: u8,
    /// Whether the first block is over.
    pub settled: u8,
    /// Whether the body rests.
    pub resting: u8,
}

// SAFETY: `Core` holds the same numbers in the same order, and nothing but numbers.
unsafe impl Mirror for Calibrating {
    type Core = Core;

    fn is_valid(&self) -> bool {
        true
    }
}

// SAFETY: the core's holds the same numbers in the same order; the bytes are its only `bool`s.
unsafe impl Mirror for CalibratingState {
    type Core = SelfCalibrationState<f32>;

    fn is_valid(&self) -> bool {
        let flags = is_bool(self.started) && is_bool(self.settled) && is_bool(self.resting);
        flags && self.rest.is_valid() && self.heading.is_valid()
    }
}

/// The self-calibrating gravity filter of a design, at the sample period `dt` in s.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the filter, nobody changes the design.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_calibrating(
    design: *const GravityDesign,
    dt: f32,
    filter: *mut Calibrating,
) -> Status {
    // SAFETY: the caller's promise is the same.
    let both = unsafe { (given(design), given_mut(filter)) };
    let (Ok(design), Ok(place)) = both else { return Status::Null };
    if dt.is_nan() || dt <= 0.0 {
        return Status::SamplePeriod;
    }
    made(design, dt).map(|core| place.store(core)).map_err(Status::from).into()
}

fn made(design: &GravityDesign, dt: f32) -> Result<Core, Error> {
    let mut filter = SelfCalibratingFilter::new(design.tau, design.zeta)?
        .rest(design.rest()?)
        .heading(design.heading()?)
        .delay(design.gyro_delay)?
        .advance(design.advance)?
        .hold(design.hold)?;
    if design.acc_range != 0.0 {
        filter = filter.force_range(design.acc_range)?;
    }
    Ok(Core { filter, dt: Dt::new(dt)?.seconds() })
}

/// Starts a self-calibrating gravity filter: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_calibrating_start(state: *mut CalibratingState) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { given_mut(state) }.map(|state| state.store(SelfCalibrationState::new())).into()
}

/// One sample: as for `compfilt_gravity_update`.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_calibrating_update(
    filter: *const Calibrating,
    state: *mut CalibratingState,
    gyro: *const f32,
    acc: *const f32,
    mag: *const f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core, state: &mut _, (gyro, acc, mag): &Vectors| {
        core.filter.step(core.dt, state, gyro, acc, mag.as_ref())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance((filter, state), (gyro, acc, mag), flags, work) }.into()
}

/// The attitude turned ahead by the design's `advance`: the quaternion w, x, y, z from body to world.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `quaternion` to four numbers that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_calibrating_attitude(
    filter: *const Calibrating,
    state: *const CalibratingState,
    quaternion: *mut f32,
) -> Status {
    let attitude = |core: &Core, state: &_| Some(core.filter.attitude(state)?.0);
    // SAFETY: the caller's promise is the same.
    unsafe { store_attitude((filter, state), quaternion, attitude) }.into()
}
