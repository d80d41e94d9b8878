//! From reset to `main`: the vector table, the floating point unit, the initial values of the memory.

use crate::host;
use core::arch::global_asm;

// Every exception ends the run: none is expected. The coprocessor must be on before the first Rust function saves its registers.
global_asm!(
    ".section .vectors, \"a\"
     .word stack_top
     .word reset
     .rept 14
     .word fault
     .endr

     .section .text.reset, \"ax\"
     .global reset
     .type reset, %function
     .thumb_func
     reset:",
    #[cfg(target_abi = "eabihf")]
    "    ldr r0, =0xe000ed88
         ldr r1, [r0]
         ldr r2, =0x00f00000
         orrs r1, r2
         str r1, [r0]
         dsb
         isb",
    "    ldr r0, =data_start
         ldr r1, =data_end
         ldr r2, =data_image
     1:  cmp r0, r1
         beq 2f
         ldr r3, [r2]
         str r3, [r0]
         adds r0, #4
         adds r2, #4
         b 1b
     2:  ldr r0, =bss_start
         ldr r1, =bss_end
         movs r2, #0
     3:  cmp r0, r1
         beq 4f
         str r2, [r0]
         adds r0, #4
         b 3b
     4:  bl {main}
         bl fault
         .ltorg",
    main = sym crate::main,
);

#[unsafe(no_mangle)]
extern "C" fn fault() -> ! {
    host::exit(false)
}
