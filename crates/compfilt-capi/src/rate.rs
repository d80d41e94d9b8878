//! The rate filter: a gyro and an angular acceleration.

use crate::border::{Mirror, given, given_mut};
use crate::linear::Filter1;
use crate::status::Status;
use compfilt_core::Gains;
use compfilt_core::linear::{RateGains, RateState as Core};

/// The state of a rate filter, whose gains are those of a first-order filter with the same time constant.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RateState {
    /// The estimated rate in rad/s.
    pub levels: [f32; 1],
    /// The last gyro sample in rad/s.
    pub gyro: f32,
    /// The integrated angular acceleration in rad/s.
    pub integral: f32,
    /// Not used: a place of the core's.
    pub value: f32,
    /// Not used: a place of the core's.
    pub age: f32,
}

// SAFETY: the core's holds the same numbers in the same order; every bit pattern is a number.
unsafe impl Mirror for RateState {
    type Core = Core<f32>;

    fn is_valid(&self) -> bool {
        true
    }
}

/// Starts a rate filter at `rate` in rad/s, which the gyro is taken to have read. A NaN or infinite rate is refused.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_rate_start(state: *mut RateState, rate: f32) -> Status {
    // SAFETY: the caller's promise is the same.
    let Ok(state) = (unsafe { given_mut(state) }) else { return Status::Null };
    if !rate.is_finite() {
        return Status::Sample;
    }
    state.store(Core::new(rate));
    Status::Ok
}

/// One sample: `gyro` in rad/s, `angular_acceleration` in rad/s^2. Where one of them is NaN or infinite, the answer says so and
/// the state stays as it is. Where the filter itself overflows it starts anew at the gyro's rate. `filter` is made by `compfilt_first_order`.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state, nobody changes the filter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_rate_update(
    filter: *const Filter1,
    state: *mut RateState,
    gyro: f32,
    angular_acceleration: f32,
) -> Status {
    // SAFETY: the caller's promise is the same.
    let both = unsafe { (given(filter), given_mut(state)) };
    let (Ok(filter), Ok(state)) = both else { return Status::Null };
    if !(gyro.is_finite() && angular_acceleration.is_finite()) {
        return Status::Sample;
    }
    let gains = Gains::from_parts(filter.shifts, filter.ramp, filter.correction);
    let updated = state.core_mut().map(|state| {
        RateGains::from_parts(gains).update(state, gyro, angular_acceleration);
        if !state.rate.levels[0].is_finite() {
            *state = Core::new(gyro);
        }
    });
    updated.into()
}
