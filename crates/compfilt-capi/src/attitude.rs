//! What the attitude filters do at the border: a sample with three sensors, and the attitude turned ahead.

use crate::border::{Mirror, given, given_mut, store_flags, vector};
use crate::status::Status;
use compfilt_core::Flags;
use compfilt_core::attitude::Rotation;
use compfilt_core::nalgebra::Vector3;

/// Three numbers each: gyro, accelerometer, magnetometer or NULL.
pub(crate) type Sample = (*const f32, *const f32, *const f32);

/// The same, read.
pub(crate) type Vectors = (Vector3<f32>, Vector3<f32>, Option<Vector3<f32>>);

/// Moves a state on by `work`, and stores its flags.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the others.
pub(crate) unsafe fn advance<F: Mirror, S: Mirror>(
    (filter, state): (*const F, *mut S),
    (gyro, acc, mag): Sample,
    flags: *mut u8,
    work: impl FnOnce(&F::Core, &mut S::Core, &Vectors) -> Flags,
) -> Result<(), Status> {
    // SAFETY: the caller's promise is the same.
    let (filter, state, vectors) = unsafe {
        (given(filter)?, given_mut(state)?, (vector(gyro)?, vector(acc)?, vector(mag).ok()))
    };
    let raised = work(filter.core()?, state.core_mut()?, &vectors);
    // SAFETY: the caller's promise is the same.
    unsafe { store_flags(flags, raised) };
    Ok(())
}

/// Stores the quaternion that `attitude` tells.
///
/// # Safety
/// The pointers are NULL, or point to what they say; `quaternion` to four numbers that nobody else uses.
pub(crate) unsafe fn store_attitude<F: Mirror, S: Mirror>(
    (filter, state): (*const F, *const S),
    quaternion: *mut f32,
    attitude: impl FnOnce(&F::Core, &S::Core) -> Option<Rotation<f32>>,
) -> Result<(), Status> {
    // SAFETY: the caller's promise is the same.
    let (filter, state, place) =
        unsafe { (given(filter)?, given(state)?, given_mut(quaternion.cast::<[f32; 4]>())?) };
    let rotation = attitude(filter.core()?, state.core()?).ok_or(Status::NotStarted)?;
    let [x, y, z] = rotation.v.into();
    *place = [rotation.w, x, y, z];
    Ok(())
}
