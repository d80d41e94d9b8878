//! `compfilt._core`: arrays in, arrays out. Checks, loops and threads; no mathematics.
//!
//! | file | idea |
//! | --- | --- |
//! | `arrays` | the checks of arrays: dtypes, shapes, times, missing values |
//! | `batch`, `tilt_batch`, `shares` | the loops over samples, and over workers |
//! | `session` | a filter at work on Python's arrays |
//! | `design` | from a run-time order to the core's types |
//! | `state`, `memory` | what is stored between samples |
//! | `errors`, `options` | errors and keywords, once |
//! | the rest | one wrapper a family |
// One line in simd.rs is allowed to.
#![deny(unsafe_code)]
// The documentation of the classes is Python's: numpy style, no Markdown.
#![allow(clippy::doc_markdown)]
// Array views are passed by value, as slices are.
#![allow(clippy::needless_pass_by_value)]

mod array;
mod array_input;
mod arrays;
mod attitude_batch;
mod attitude_family;
mod attitude_lanes;
mod attitude_log;
mod attitude_many;
mod attitude_octet;
mod attitude_session;
mod attitude_stream;
mod batch;
mod batch_blocks;
mod batch_lanes;
mod butterworth;
mod chain;
mod chunk_arrays;
mod convert;
mod design;
mod errors;
mod estimate;
mod first_order;
mod gains;
mod gravity_filter;
mod gravity_offline;
mod lanes;
mod lanes_columns;
mod lanes_rows;
mod layout;
mod linear_filter;
mod mahony;
mod memory;
mod observer;
mod observer_session;
mod observer_stream;
mod options;
mod pi;
mod precision;
mod prefetch;
mod rate;
mod relay;
mod runs;
mod second_order_inertial;
mod session;
mod shares;
mod simd;
mod simd_number;
mod square;
mod state;
mod stream;
mod third_order;
mod tilt;
mod tilt_batch;
mod tilt_filter;
mod tilt_session;
mod tilt_stream;

/// The compiled part of compfilt.
#[pyo3::pymodule(gil_used = false)]
mod _core {
    #[pymodule_export]
    use crate::array::AccelerometerArray;
    #[pymodule_export]
    use crate::attitude_stream::{AttitudeEstimate, AttitudeStream};
    #[pymodule_export]
    use crate::butterworth::Butterworth;
    #[pymodule_export]
    use crate::chain::Chain;
    #[pymodule_export]
    use crate::convert::{alpha_to_tau, tau_to_alpha};
    #[pymodule_export]
    use crate::estimate::Estimate;
    #[pymodule_export]
    use crate::first_order::FirstOrder;
    #[pymodule_export]
    use crate::gravity_filter::GravityFilter;
    #[pymodule_export]
    use crate::linear_filter::LinearFilter;
    #[pymodule_export]
    use crate::mahony::Mahony;
    #[pymodule_export]
    use crate::observer::Observer;
    #[pymodule_export]
    use crate::observer_stream::{ObserverEstimate, ObserverStream};
    #[pymodule_export]
    use crate::pi::PiForm;
    #[pymodule_export]
    use crate::rate::RateFilter;
    #[pymodule_export]
    use crate::second_order_inertial::SecondOrderInertial;
    #[pymodule_export]
    use crate::state::State;
    #[pymodule_export]
    use crate::stream::{_stream, Stream};
    #[pymodule_export]
    use crate::third_order::ThirdOrder;
    #[pymodule_export]
    use crate::tilt::{angle_rates_of, tilt_of};
    #[pymodule_export]
    use crate::tilt_filter::TiltFilter;
    #[pymodule_export]
    use crate::tilt_stream::{TiltEstimate, TiltStream};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        let flags: Vec<(&str, u8)> =
            crate::estimate::FLAGS.iter().map(|(name, flag)| (*name, flag.bits())).collect();
        module.add("_flags", flags)?;
        module.add("_debug_build", cfg!(debug_assertions))
    }
}
