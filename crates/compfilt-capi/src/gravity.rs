//! The gravity filter of order 2, and the design that it shares with the self-calibrating one.

use crate::attitude::{Vectors, advance, store_attitude};
use crate::border::{Mirror, given, given_mut, is_bool};
use crate::parts::{Heading, HeldRate, Rest, Rotation};
use crate::sensors::{HeadingRule, RestRule, Sensors};
use crate::status::Status;
use compfilt_core::Error;
use compfilt_core::attitude::{self, GravityFilter, GravityState as State};
use compfilt_core::linear::SplitGains;

/// What a person wants of a gravity filter: `compfilt_gravity_defaults` fills it, then change what you like.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct GravityDesign {
    /// The time constant in s: 3, or 5 for the self-calibrating filter.
    pub tau: f32,
    /// The damping ratio: 0.5.
    pub zeta: f32,
    /// How much later in s the accelerometer's samples are than the frame that the gyro turns: 0.
    pub gyro_delay: f32,
    /// How far in s the attitude is turned ahead: 0.
    pub advance: f32,
    /// How long in s a missing gyro is bridged by the last sample: 0.1.
    pub hold: f32,
    /// The accelerometer's range in m/s^2: a component at it or beyond it is clipped, and counts as missing. 0: not known.
    pub acc_range: f32,
    /// How long in s a body must be still to count as resting: 1.5.
    pub rest_time: f32,
    /// How far in rad/s the gyro may be from its low-pass then: 2 deg/s.
    pub rest_rate: f32,
    /// How far in m/s^2 the accelerometer may be from its low-pass then: 0.5.
    pub rest_force: f32,
    /// How far in m/s^2 the low-passed accelerometer may drift in a rest: 0.1.
    pub rest_drift: f32,
    /// The largest bias of an axis in rad/s: 2 deg/s.
    pub bias_limit: f32,
    /// The time constant of the heading in s: 10.
    pub heading_tau: f32,
}

const TWO_DEGREES: f32 = 0.034_906_585;

impl GravityDesign {
    pub(crate) fn rest(&self) -> Result<attitude::RestRule<f32>, Error> {
        attitude::RestRule::default()
            .time(self.rest_time)?
            .rate(self.rest_rate)?
            .force(self.rest_force)?
            .drift(self.rest_drift)?
            .bias_limit(self.bias_limit)
    }

    pub(crate) fn heading(&self) -> Result<attitude::HeadingRule<f32>, Error> {
        attitude::HeadingRule::new(self.heading_tau)
    }

    fn core(&self, dt: f32) -> Result<Core, Error> {
        let mut filter = GravityFilter::second_order(self.tau, self.zeta)?
            .rest(self.rest()?)
            .heading(self.heading()?)
            .delay(self.gyro_delay)?
            .advance(self.advance)?
            .hold(self.hold)?;
        if self.acc_range != 0.0 {
            filter = filter.force_range(self.acc_range)?;
        }
        Ok(Core { filter, gains: filter.at(dt)? })
    }
}

/// The core's, with its gains.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Core {
    filter: GravityFilter<f32, 2>,
    gains: SplitGains<f32, 2>,
}

/// What a gravity filter has beside its gains.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct GravitySettings {
    /// k_1, k_2 in 1/s, 1/s^2.
    pub coefficients: [f32; 2],
    /// How many of the polynomial's terms are in the low-pass.
    pub split: usize,
    /// When the body rests.
    pub rest: RestRule,
    /// How the heading follows the magnetometer.
    pub heading: HeadingRule,
    /// What is known of the sensors.
    pub sensors: Sensors,
    /// The most seconds for which one sample of the accelerometer counts.
    pub cap: f32,
    /// How long in s the start lasts.
    pub start: f32,
}

/// The gains of a gravity filter.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct GravityGains {
    /// The sample period in s.
    pub dt: f32,
    /// Half of it.
    pub half_dt: f32,
    /// Of level 1 to the levels above it.
    pub feedback: [f32; 2],
    /// What level 1 is multiplied by.
    pub damping: f32,
    /// What the innovation is multiplied by.
    pub correction: [f32; 2],
}

/// A gravity filter at one sample period: constant while it runs, and may lie in flash.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Gravity {
    /// What it has beside its gains.
    pub filter: GravitySettings,
    /// Its gains.
    pub gains: GravityGains,
}

/// The state of a gravity filter.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct GravityState {
    /// The low-passed specific force in m/s^2, body axes, and its slope.
    pub levels: [[f32; 3]; 2],
    /// The attitude.
    pub rotation: Rotation,
    /// Rest, and the gyro's bias.
    pub rest: Rest,
    /// The last rate.
    pub rate: HeldRate,
    /// The heading's filter.
    pub heading: Heading,
    /// Seconds since the start.
    pub age: f32,
    /// Seconds since the last correction.
    pub since_correction: f32,
    /// Whether there is an attitude.
    pub started: u8,
    /// Whether the body rests.
    pub resting: u8,
}

// SAFETY: `Core` holds the same numbers in the same order and in the same structs. The core counts
// with `split` only; here it is one of the two that order 2 has.
unsafe impl Mirror for Gravity {
    type Core = Core;

    fn is_valid(&self) -> bool {
        (1..=2).contains(&self.filter.split)
    }
}

// SAFETY: the core's holds the same numbers in the same order; the bytes are its only `bool`s.
unsafe impl Mirror for GravityState {
    type Core = State<f32, 2>;

    fn is_valid(&self) -> bool {
        let flags = is_bool(self.started) && is_bool(self.resting);
        flags && self.rest.is_valid() && self.heading.is_valid()
    }
}

/// Fills a design with the defaults of the gravity filter. For `compfilt_calibrating` set `tau` to 5.
///
/// # Safety
/// `design` is NULL, or points to a design that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_gravity_defaults(design: *mut GravityDesign) -> Status {
    let usual = GravityDesign {
        tau: 3.0,
        zeta: 0.5,
        gyro_delay: 0.0,
        advance: 0.0,
        hold: 0.1,
        acc_range: 0.0,
        rest_time: 1.5,
        rest_rate: TWO_DEGREES,
        rest_force: 0.5,
        rest_drift: 0.1,
        bias_limit: TWO_DEGREES,
        heading_tau: 10.0,
    };
    // SAFETY: the caller's promise is the same.
    unsafe { given_mut(design) }.map(|design| *design = usual).into()
}

/// The gravity filter of a design, at the sample period `dt` in s.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the filter, nobody changes the design.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_gravity(
    design: *const GravityDesign,
    dt: f32,
    filter: *mut Gravity,
) -> Status {
    // SAFETY: the caller's promise is the same.
    let both = unsafe { (given(design), given_mut(filter)) };
    let (Ok(design), Ok(place)) = both else { return Status::Null };
    design.core(dt).map(|core| place.store(core)).map_err(Status::from).into()
}

/// Starts a gravity filter: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_gravity_start(state: *mut GravityState) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { given_mut(state) }.map(|state| state.store(State::new())).into()
}

/// One sample: `gyro` in rad/s, `acc` in m/s^2, `mag` of any length, three numbers each, body axes. What is NaN or infinite is
/// missing. `mag` is NULL where there is no magnetometer; `flags` may be NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_gravity_update(
    filter: *const Gravity,
    state: *mut GravityState,
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

/// The attitude turned ahead by the design's `advance`: the quaternion w, x, y, z from body to world.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `quaternion` to four numbers that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_gravity_attitude(
    filter: *const Gravity,
    state: *const GravityState,
    quaternion: *mut f32,
) -> Status {
    let attitude = |core: &Core, state: &_| Some(core.filter.attitude(state)?.0);
    // SAFETY: the caller's promise is the same.
    unsafe { store_attitude((filter, state), quaternion, attitude) }.into()
}
