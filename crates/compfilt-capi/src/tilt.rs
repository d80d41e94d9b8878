//! The tilt filter: two angles from gravity and a gyro.

use crate::border::{Mirror, given, given_mut, store_flags, vector};
use crate::linear::{Core, Filter1, Filter2, State1, State2, Stored};
use crate::status::Status;
use compfilt_core::gravity::{Axes as CoreAxes, TiltFilter, TiltState};
use compfilt_core::{Chain, Discretise, Gains, StreamState};

/// The body's axes, with the two angles that gravity gives in them.
#[derive(Clone, Copy, Debug)]
#[repr(u8)]
pub enum Axes {
    /// Forward, left, up: roll about x, pitch about y, nose down positive.
    Flu = 0,
    /// Forward, right, down: roll about x, pitch about y, nose up positive.
    Frd = 1,
    /// The balancing cube's phi_2 and phi_3.
    Cube = 2,
}

/// The state of a tilt filter of order 1: a linear filter's for each angle.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct TiltState1 {
    /// Roll and pitch, or phi_2 and phi_3.
    pub angles: [State1; 2],
}

/// The state of a tilt filter of order 2: a linear filter's for each angle. Level 1 is minus the bias of the angle's rate.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct TiltState2 {
    /// Roll and pitch, or phi_2 and phi_3.
    pub angles: [State2; 2],
}

fn core_axes(axes: u8) -> Result<CoreAxes, Status> {
    match axes {
        0 => Ok(CoreAxes::Flu),
        1 => Ok(CoreAxes::Frd),
        2 => Ok(CoreAxes::Cube),
        _ => Err(Status::Parameter),
    }
}

/// Two filters that wait for the first measurement.
fn waiting<S: Stored<N> + Copy, const N: usize>(nothing: S) -> [S; 2] {
    let mut state = nothing;
    state.save(&StreamState::new());
    [state; 2]
}

fn load<S: Stored<N>, const N: usize>(angles: &[S; 2]) -> Result<TiltState<f32, N>, Status> {
    let [first, second] = angles;
    Ok(TiltState { angles: [first.load()?, second.load()?] })
}

/// Moves both angles on by a sample.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
unsafe fn advance<F, S, const N: usize>(
    (filter, axes): (*const F, u8),
    angles: Result<&mut [S; 2], Status>,
    (gyro, acc): (*const f32, *const f32),
    flags: *mut u8,
) -> Result<(), Status>
where
    F: Mirror<Core = Core<N, 1>>,
    S: Stored<N>,
    Chain<f32, N, 1>: Discretise<f32, N, Gains = Gains<f32, N, 1>>,
{
    // SAFETY: the caller's promise is the same.
    let (filter, gyro, acc) = unsafe { (given(filter)?.core()?, vector(gyro)?, vector(acc)?) };
    let (places, axes) = (angles?, core_axes(axes)?);
    let mut state = load(places)?;
    let raised = TiltFilter::of(filter.stream, axes).update(&filter.gains, &mut state, &gyro, &acc);
    for (place, angle) in places.iter_mut().zip(&state.angles) {
        place.save(angle);
    }
    // SAFETY: the caller's promise is the same.
    unsafe { store_flags(flags, raised) };
    Ok(())
}

/// Stores the angles in their usual ranges.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `place` to two numbers that nobody else uses.
unsafe fn store_angles<F, S, const N: usize>(
    (filter, axes): (*const F, u8),
    angles: Result<&[S; 2], Status>,
    place: *mut f32,
) -> Result<(), Status>
where
    F: Mirror<Core = Core<N, 1>>,
    S: Stored<N>,
    Chain<f32, N, 1>: Discretise<f32, N, Gains = Gains<f32, N, 1>>,
{
    // SAFETY: the caller's promise is the same.
    let (filter, place) = unsafe { (given(filter)?.core()?, given_mut(place.cast::<[f32; 2]>())?) };
    let (state, axes) = (load(angles?)?, core_axes(axes)?);
    if !state.angles.iter().all(|angle| angle.started) {
        return Err(Status::NotStarted);
    }
    *place = TiltFilter::of(filter.stream, axes).angles(&state).into();
    Ok(())
}

/// Starts a tilt filter of order 1: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_start_1(state: *mut TiltState1) -> Status {
    // SAFETY: the caller's promise is the same.
    let state = unsafe { given_mut(state) };
    state.map(|state| state.angles = waiting(State1::NOTHING)).into()
}

/// One sample of a tilt filter of order 1: `gyro` in rad/s, `acc` of any length, three numbers each, body axes. What is NaN or
/// infinite is missing. `filter` is made as for `compfilt_update_1`, with the angle's period or without; `axes` is one of the
/// CompfiltAxes; `flags` may be NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_update_1(
    filter: *const Filter1,
    axes: u8,
    state: *mut TiltState1,
    gyro: *const f32,
    acc: *const f32,
    flags: *mut u8,
) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe {
        let angles = given_mut(state).map(|state| &mut state.angles);
        advance((filter, axes), angles, (gyro, acc), flags)
    }
    .into()
}

/// The two angles in rad in their usual ranges: roll within pi and pitch within pi/2 to both sides, or phi_2 within pi/2 and phi_3
/// within pi.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `angles` to two numbers that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_angles_1(
    filter: *const Filter1,
    axes: u8,
    state: *const TiltState1,
    angles: *mut f32,
) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe {
        let both = given(state).map(|state| &state.angles);
        store_angles((filter, axes), both, angles)
    }
    .into()
}

/// Starts a tilt filter of order 2: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_start_2(state: *mut TiltState2) -> Status {
    // SAFETY: the caller's promise is the same.
    let state = unsafe { given_mut(state) };
    state.map(|state| state.angles = waiting(State2::NOTHING)).into()
}

/// One sample of a tilt filter of order 2: `gyro` in rad/s, `acc` of any length, three numbers each, body axes. What is NaN or
/// infinite is missing. `filter` is made as for `compfilt_update_2`, with the angle's period or without; `axes` is one of the
/// CompfiltAxes; `flags` may be NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_update_2(
    filter: *const Filter2,
    axes: u8,
    state: *mut TiltState2,
    gyro: *const f32,
    acc: *const f32,
    flags: *mut u8,
) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe {
        let angles = given_mut(state).map(|state| &mut state.angles);
        advance((filter, axes), angles, (gyro, acc), flags)
    }
    .into()
}

/// The two angles in rad in their usual ranges: roll within pi and pitch within pi/2 to both sides, or phi_2 within pi/2 and phi_3
/// within pi.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `angles` to two numbers that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_tilt_angles_2(
    filter: *const Filter2,
    axes: u8,
    state: *const TiltState2,
    angles: *mut f32,
) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe {
        let both = given(state).map(|state| &state.angles);
        store_angles((filter, axes), both, angles)
    }
    .into()
}
