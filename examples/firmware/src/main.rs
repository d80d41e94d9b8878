//! Every filter on a microcontroller, 1000 samples a second: what comes out, to the bit, and what it costs.
//!
//! `make firmware` runs it on emulated boards and compares with Python.
#![no_std]
#![no_main]

mod attitude;
mod host;
mod linear;
mod meter;
mod recording;
mod report;
mod sensors;
mod start;

use report::Report;

/// The sample period in s.
const DT: f32 = 0.001;

extern "C" fn main() {
    host::exit(every_filter().is_some());
}

/// `None` where a design is refused or the report cannot be written.
fn every_filter() -> Option<()> {
    let report = Report::new(b"report\0")?;
    linear::run(&report)?;
    sensors::run(&report)?;
    attitude::run(&report)
}
