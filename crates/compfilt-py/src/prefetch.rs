//! Asks for memory before it is needed, so that a filter computes while it comes.

/// Bytes that memory hands out at once.
pub(crate) const LINE: usize = 64;

/// Asks for the line of `values[index]`, which may lie behind the end.
///
/// Into the second cache: the queue of the first is so short that asking there takes longer than not asking at all. Other
/// processors than x86-64 are left to themselves.
#[inline(always)]
#[allow(unsafe_code)]
pub(crate) fn ask_for<T>(values: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
        let address = values.as_ptr().wrapping_add(index);
        // SAFETY: it reads and writes nothing, and any address may be asked for, even one that is nobody's.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(address.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, index);
}

/// Asks for all lines from `values[start]` on that `count` numbers take.
#[inline(always)]
pub(crate) fn ask_for_all<T>(values: &[T], start: usize, count: usize) {
    for index in (start..start + count).step_by(LINE / size_of::<T>()) {
        ask_for(values, index);
    }
}
