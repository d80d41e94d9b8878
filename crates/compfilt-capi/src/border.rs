//! What may cross the border: pointers that are checked, and structs of C that lie in memory as the core's do.

use crate::status::Status;
use compfilt_core::Flags;
use compfilt_core::nalgebra::Vector3;

/// What stands behind a pointer.
///
/// # Safety
/// The pointer is NULL, or points to a `T` that nobody writes to during `'a`.
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Result<&'a T, Status> {
    // SAFETY: the caller's promise is the same.
    unsafe { pointer.as_ref() }.ok_or(Status::Null)
}

/// What stands behind a pointer, to be changed.
///
/// # Safety
/// The pointer is NULL, or points to a `T` that nobody else uses during `'a`.
pub(crate) unsafe fn given_mut<'a, T>(pointer: *mut T) -> Result<&'a mut T, Status> {
    // SAFETY: the caller's promise is the same.
    unsafe { pointer.as_mut() }.ok_or(Status::Null)
}

/// Three numbers.
///
/// # Safety
/// As [`given`], for an array of three.
pub(crate) unsafe fn vector(pointer: *const f32) -> Result<Vector3<f32>, Status> {
    // SAFETY: the caller's promise is the same.
    unsafe { given(pointer.cast::<[f32; 3]>()) }.map(|parts| Vector3::from(*parts))
}

/// Stores the flags where there is a place for them.
///
/// # Safety
/// The pointer is NULL, or points to a byte that nobody else uses.
pub(crate) unsafe fn store_flags(place: *mut u8, flags: Flags) {
    // SAFETY: the caller's promise is the same.
    if let Some(place) = unsafe { place.as_mut() } {
        *place = flags.bits();
    }
}

/// A struct of C that lies in memory as one of the core's: what C can see, and copy, and keep.
///
/// # Safety
/// Both have `repr(C)` and the same fields in the same order, but for bytes that stand for a `bool` or an `enum`.
/// `is_valid` says whether each of these bytes, and each number that the core indexes with, is one that the core's can have.
pub(crate) unsafe trait Mirror: Sized {
    /// The core's.
    type Core: Copy;

    /// Whether it may be taken for the core's.
    fn is_valid(&self) -> bool;

    /// Stops the build where the two differ in size or alignment.
    const SAME_LAYOUT: () = assert!(
        size_of::<Self>() == size_of::<Self::Core>()
            && align_of::<Self>() == align_of::<Self::Core>()
    );

    /// As the core's.
    fn core(&self) -> Result<&Self::Core, Status> {
        let () = Self::SAME_LAYOUT;
        if !self.is_valid() {
            return Err(Status::Struct);
        }
        // SAFETY: the same layout by the trait's promise, and what not every bit pattern is good for was checked.
        Ok(unsafe { &*core::ptr::from_ref(self).cast() })
    }

    /// As the core's, to be changed.
    fn core_mut(&mut self) -> Result<&mut Self::Core, Status> {
        let () = Self::SAME_LAYOUT;
        if !self.is_valid() {
            return Err(Status::Struct);
        }
        // SAFETY: as in `core`; what the core stores is valid for C, whose bytes may be anything.
        Ok(unsafe { &mut *core::ptr::from_mut(self).cast() })
    }

    /// Takes over the core's, whatever was here before.
    fn store(&mut self, core: Self::Core) {
        let () = Self::SAME_LAYOUT;
        // SAFETY: the same layout by the trait's promise; nothing of what was here is read.
        unsafe { core::ptr::from_mut(self).cast::<Self::Core>().write(core) }
    }
}

/// Whether a byte stands for a `bool`.
pub(crate) fn is_bool(byte: u8) -> bool {
    byte <= 1
}
