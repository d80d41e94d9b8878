#![doc = include_str!("../README.md")]
//!
//! # The map of the crate
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`linear`] | the chain of integrators with its gains, and every linear complementary filter as a design of it |
//! | [`attitude`] | filters on the rotation group |
//! | [`gravity`] | accelerometers to gravity, gravity to angles, body rates to angle rates, and the filters that fuse them |
//! | [`Observer`] | the estimate of a linear system's state from its outputs |
//! | [`Real`], [`Element`] | `f32` or `f64`; what may be filtered: a scalar, a lane of channels, a vector |
//! | [`Number`] | what a step is written in: `f32`, `f64`, or several of them side by side |
//! | [`Dt`], [`Error`] | a checked time step; which parameter broke which rule |
//!
//! # The rules of the crate
//!
//! * **Design → gains → state.** A design is what a person wants, in seconds and rad/s. At a sample period it becomes
//!   gains, checked once. State is what changes: `Copy`, in physical units that do not depend on the sample period.
//! * **One step.** [`Recurrence`] holds the arithmetic of a sample; everything else calls it.
//! * **The same bits everywhere.** Parameters are rounded to the scalar type once and everything after runs in it; no
//!   fused multiply-add, one order of summation, transcendental functions from `libm` on every platform.
//! * **Nothing fails after the design.** No allocation, no panic, no unsafe code.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod attitude;
mod dt;
mod element;
mod error;
pub mod gravity;
pub mod linear;
mod number;
mod observer;
mod real;

pub use dt::Dt;
pub use element::Element;
pub use error::{Error, Rule};
pub use gravity::{AccelerometerArray, Axes, Cube, TiltFilter, TiltState};
pub use linear::{
    Butterworth, Chain, Discretise, FirstOrder, Flags, Gains, History, Input, Matched, Past,
    PiForm, RateFilter, Recurrence, SecondOrderInertial, Split, State, Stream, StreamState,
    ThirdOrder,
};
pub use number::{Change, FlagSet, Mask, Number};
pub use observer::{Observer, ObserverModel, ObserverState};
pub use real::Real;

/// Vectors and complex numbers in the interface are nalgebra's.
pub use nalgebra;
