//! What a step costs: instructions by the system timer, stack by paint.

use core::arch::{asm, global_asm};
use core::mem::transmute_copy;
use core::ptr::{read_volatile, write_volatile};
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering::Relaxed};

const CONTROL: *mut u32 = 0xe000_e010 as *mut u32;
const RELOAD: *mut u32 = 0xe000_e014 as *mut u32;
const ENABLED_ON_PROCESSOR_CLOCK: u32 = 5;
const LARGEST: u32 = 0x00ff_ffff;

/// The function that `timed` calls, and how many ticks that took.
static FUNCTION: AtomicUsize = AtomicUsize::new(0);
static TICKS: AtomicU32 = AtomicU32::new(0);

// Calls a function of any signature with up to four words of arguments on the stack, and reads the timer right before and after
// it: a compiler would move what prepares the call to either side. `idle` is a function of one instruction.
global_asm!(
    ".section .text.timed, \"ax\"
     .global timed
     .type timed, %function
     .thumb_func
     timed:
         push {{r4, r5, r6, r7, lr}}
         ldr r4, [sp, #20]
         ldr r5, [sp, #24]
         ldr r6, [sp, #28]
         ldr r7, [sp, #32]
         push {{r4, r5, r6, r7}}
         ldr r4, =0xe000e018
         ldr r5, ={function}
         ldr r5, [r5]
         ldr r6, [r4]
         blx r5
         ldr r4, [r4]
         subs r6, r6, r4
         ldr r5, ={ticks}
         str r6, [r5]
         add sp, #16
         pop {{r4, r5, r6, r7, pc}}
         .ltorg

     .global idle
     .type idle, %function
     .thumb_func
     idle:
         bx lr",
    function = sym FUNCTION,
    ticks = sym TICKS,
);

unsafe extern "C" {
    fn timed();
    fn idle();
}

/// Counts the instructions of functions, from the first one to the return.
pub struct Meter {
    /// What is counted beside the function.
    overhead: u32,
}

impl Meter {
    /// Starts the timer, which counts down from its largest number over and over.
    pub fn start() -> Self {
        // SAFETY: the registers of the system timer, which nothing else uses.
        unsafe {
            write_volatile(RELOAD, LARGEST);
            write_volatile(CONTROL, ENABLED_ON_PROCESSOR_CLOCK);
        }
        let meter = Self { overhead: 0 };
        // SAFETY: it does nothing.
        let ((), one_more) =
            meter.instructions(idle as unsafe extern "C" fn(), |idle| unsafe { idle() });
        Self { overhead: one_more.saturating_sub(1) }
    }

    /// What `call` does with `function`, and how many instructions the function took.
    ///
    /// The emulator is told to let an instruction take 1024 ns; the timer ticks every 40 ns.
    pub fn instructions<F: Copy, O>(&self, function: F, call: impl FnOnce(F) -> O) -> (O, u32) {
        const { assert!(size_of::<F>() == size_of::<usize>(), "a pointer to a function") };
        // SAFETY: both are pointers to functions, and `timed` hands on whatever its arguments are.
        let timed = unsafe {
            FUNCTION.store(transmute_copy(&function), Relaxed);
            transmute_copy(&(timed as unsafe extern "C" fn()))
        };
        let output = call(timed);
        let ticks = TICKS.load(Relaxed) & LARGEST;
        (output, ((ticks * 40 + 512) >> 10).saturating_sub(self.overhead))
    }
}

/// How much of the stack is looked at, in words.
const DEPTH: usize = 2048;
/// What others than the step may take of it.
const OTHERS: usize = 64;
const PAINT: u32 = 0xa5a5_5a5a;

/// The deepest stack of a function so far.
pub struct Stack {
    words: usize,
}

impl Stack {
    /// Paints the memory below the stack.
    #[inline(never)]
    pub fn painted() -> Self {
        paint(stack_pointer(), DEPTH + OTHERS);
        Self { words: 0 }
    }

    /// Runs something, and looks how far down the paint is gone.
    #[inline(never)]
    pub fn measure(&mut self, run: impl FnOnce()) {
        let top = stack_pointer();
        paint(top, self.words + OTHERS);
        run();
        let mut deepest = DEPTH;
        // SAFETY: the stack has megabytes.
        while deepest > self.words && unsafe { read_volatile(top.wrapping_sub(deepest)) } == PAINT {
            deepest -= 1;
        }
        self.words = deepest;
    }

    /// In bytes, below the caller.
    pub fn bytes(&self) -> u32 {
        4 * self.words as u32
    }
}

#[inline(always)]
fn stack_pointer() -> *mut u32 {
    let pointer;
    // SAFETY: reads a register.
    unsafe { asm!("mov {}, sp", out(reg) pointer, options(nomem, nostack, preserves_flags)) };
    pointer
}

#[inline(always)]
fn paint(top: *mut u32, words: usize) {
    for depth in 1..=words {
        // SAFETY: the memory below the stack pointer belongs to nobody, and the stack has megabytes.
        unsafe { write_volatile(top.wrapping_sub(depth), PAINT) };
    }
}
