//! compfilt for firmware in C. The header is `python/compfilt/include/compfilt.h`, so that the Python package
//! has it; it is made from this crate.
//!
//! | file | idea |
//! | --- | --- |
//! | `border` | what may cross: pointers that are checked, structs of C that lie in memory as the core's do |
//! | `status` | what a function answers |
//! | `linear` | first order, PI, Butterworth of order 2, third order, and chains of these orders |
//! | `rate` | the rate filter |
//! | `tilt` | the tilt filter |
//! | `sensors`, `parts` | what the attitude filters are made of |
//! | `mahony`, `gravity`, `calibrating` | the attitude filters |
//! | `panic` | the handler of a chip |
//!
//! No mathematics: every function checks its pointers and calls the core, so that the bits are the core's. Nothing allocates,
//! and nothing panics. Unsafe code reads and writes through the caller's pointers, and nothing else.
#![no_std]
#![deny(unsafe_op_in_unsafe_fn, clippy::undocumented_unsafe_blocks)]
// The documentation is the header's: no Markdown.
#![allow(clippy::doc_markdown)]
// Every function says under "Safety" what its pointers must be.
#![allow(clippy::missing_safety_doc)]

#[cfg(test)]
extern crate std;

mod attitude;
mod border;
pub mod calibrating;
pub mod gravity;
#[cfg(test)]
mod layout;
pub mod linear;
pub mod mahony;
#[cfg(feature = "panic-handler")]
mod panic;
pub mod parts;
pub mod rate;
pub mod sensors;
pub mod status;
pub mod tilt;

/// The chapter's examples are tested here, where they do not go into a package.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/embedded.md")]
mod embedded {}
