//! The handler of panics, of which there are none: `make firmware-c` looks for them in the library.

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
