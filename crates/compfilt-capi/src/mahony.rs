//! Mahony's filters with a bias.

use crate::attitude::{Vectors, advance};
use crate::border::{Mirror, given_mut, is_bool};
use crate::parts::{HeldRate, Rotation};
use crate::sensors::Sensors;
use crate::status::Status;
use compfilt_core::attitude::{self, MahonyForm as Form, MahonyState as State};
use compfilt_core::{Gains, PiForm};

/// How the measured directions become an innovation, and where the gyro turns the estimate.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub enum MahonyForm {
    /// Straight from the directions.
    Explicit = 0,
    /// From an attitude that is rebuilt from the directions.
    Passive = 1,
    /// The same, and the gyro turns the estimate through the rebuilt attitude.
    Direct = 2,
}

/// The core's, with its gains.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Core {
    filter: attitude::Mahony<f32, 2>,
    gains: Gains<f32, 2, 1>,
}

/// Mahony's filter at one sample period: constant while it runs, and may lie in flash.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Mahony {
    /// kp in 1/s, ki in 1/s^2.
    pub coefficients: [f32; 2],
    /// A CompfiltMahonyForm.
    pub form: u8,
    /// The length in rad/s that the bias may have at most.
    pub bias_limit: f32,
    /// What is known of the sensors.
    pub sensors: Sensors,
    /// The sample period in s, and its power.
    pub shifts: [f32; 2],
    /// What a ramp of the input adds.
    pub ramp: [f32; 2],
    /// What the innovation is multiplied by: for the attitude, for the bias.
    pub correction: [f32; 2],
}

/// The state of Mahony's filter.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct MahonyState {
    /// The attitude.
    pub rotation: Rotation,
    /// The gyro's bias in rad/s.
    pub bias: [f32; 3],
    /// The last rate.
    pub rate: HeldRate,
    /// Seconds since the start.
    pub age: f32,
    /// Seconds since the last correction of the tilt.
    pub since_correction: f32,
    /// Seconds since the last correction of the heading.
    pub since_heading: f32,
    /// Whether there is an attitude.
    pub started: u8,
    /// Whether a magnetometer has set the heading.
    pub heading_known: u8,
}

// SAFETY: `Core` holds the same numbers in the same order, the last six in `Gains`; `form` is the only byte that not every value
// is good for, and has three.
unsafe impl Mirror for Mahony {
    type Core = Core;

    fn is_valid(&self) -> bool {
        self.form <= 2
    }
}

// SAFETY: the core's holds the same numbers in the same order; the two bytes are its only `bool`s.
unsafe impl Mirror for MahonyState {
    type Core = State<f32>;

    fn is_valid(&self) -> bool {
        is_bool(self.started) && is_bool(self.heading_known)
    }
}

/// Mahony's filter with the gains `kp` in 1/s and `ki` in 1/s^2, both positive, in one of the CompfiltMahonyForms, at the sample
/// period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_mahony(
    kp: f32,
    ki: f32,
    form: u8,
    dt: f32,
    filter: *mut Mahony,
) -> Status {
    // SAFETY: the caller's promise is the same.
    let place = unsafe { given_mut(filter) };
    place.and_then(|place| made(kp, ki, form, dt).map(|core| place.store(core))).into()
}

fn made(kp: f32, ki: f32, form: u8, dt: f32) -> Result<Core, Status> {
    let form = match form {
        0 => Form::Explicit,
        1 => Form::Passive,
        2 => Form::Direct,
        _ => return Err(Status::Parameter),
    };
    let design = PiForm::new(kp, ki)?;
    Ok(Core { filter: attitude::Mahony::new(design.chain(), form), gains: design.at(dt)? })
}

/// Starts Mahony's filter: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_mahony_start(state: *mut MahonyState) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { given_mut(state) }.map(|state| state.store(State::new())).into()
}

/// One sample: `gyro` in rad/s, `acc` and `mag` of any length, three numbers each, body axes. What is NaN or infinite is missing.
/// `mag` is NULL where there is no magnetometer; `flags` may be NULL. The attitude is `state->rotation`.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_mahony_update(
    filter: *const Mahony,
    state: *mut MahonyState,
    gyro: *const f32,
    acc: *const f32,
    mag: *const f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core, state: &mut _, (gyro, acc, mag): &Vectors| {
        core.filter.update(&core.gains, state, gyro, acc, mag.as_ref())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance((filter, state), (gyro, acc, mag), flags, work) }.into()
}
