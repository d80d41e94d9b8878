//! The host that emulates the board: a file there, and the end of the run. Semihosting, as debuggers speak it.

use core::arch::asm;

const OPEN: usize = 0x01;
const WRITE: usize = 0x05;
const EXIT: usize = 0x18;

const BINARY_FOR_WRITING: usize = 5;
const STOPPED_AS_PLANNED: usize = 0x20026;
const STOPPED_BY_AN_ERROR: usize = 0x20023;

/// # Safety
/// `argument` is what the operation asks for.
unsafe fn call(operation: usize, argument: usize) -> usize {
    let result;
    // SAFETY: the debugger answers in r0 and touches nothing else but what the argument points to.
    unsafe { asm!("bkpt 0xab", inlateout("r0") operation => result, in("r1") argument) };
    result
}

/// A file of the host.
pub struct File(usize);

impl File {
    /// The file `name`, which ends with a zero, emptied.
    pub fn create(name: &[u8]) -> Option<Self> {
        let argument = [name.as_ptr() as usize, BINARY_FOR_WRITING, name.len() - 1];
        // SAFETY: address, mode and length of a name.
        let handle = unsafe { call(OPEN, argument.as_ptr() as usize) };
        (handle != usize::MAX).then_some(Self(handle))
    }

    /// Adds to the file; whether all of it was written.
    pub fn write(&self, bytes: &[u8]) -> bool {
        let argument = [self.0, bytes.as_ptr() as usize, bytes.len()];
        // SAFETY: handle, address and length; the answer is what was left over.
        unsafe { call(WRITE, argument.as_ptr() as usize) == 0 }
    }
}

/// The end of the run: exit status 0 or 1.
pub fn exit(success: bool) -> ! {
    let reason = if success { STOPPED_AS_PLANNED } else { STOPPED_BY_AN_ERROR };
    loop {
        // SAFETY: the operation takes the reason itself.
        unsafe { call(EXIT, reason) };
    }
}
