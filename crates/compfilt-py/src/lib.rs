//! `compfilt._core`: arrays in, arrays out. Checks, loops and threads; no mathematics.
//!
//! | file | idea |
//! | --- | --- |
//! | `arrays` | the only input checks: dtypes, shapes, times, missing values |
//! | `batch` | the only loops |
//! | `session` | a filter at work on Python's arrays |
//! | `design` | from a run-time order to the core's types |
//! | `state`, `memory` | what is stored between samples |
//! | `errors`, `options` | errors and keywords, once |
//! | the rest | one wrapper a family |
#![forbid(unsafe_code)]

mod arrays;
mod batch;
mod convert;
mod design;
mod errors;
mod estimate;
mod linear;
mod memory;
mod options;
mod session;
mod state;
mod stream;
mod tilt;

/// The compiled part of compfilt.
#[pyo3::pymodule(gil_used = false)]
mod _core {
    #[pymodule_export]
    use crate::convert::{alpha_to_tau, tau_to_alpha};
    #[pymodule_export]
    use crate::estimate::Estimate;
    #[pymodule_export]
    use crate::linear::{
        Butterworth, Chain, FirstOrder, LinearFilter, PiForm, RateFilter, SecondOrderInertial,
        ThirdOrder,
    };
    #[pymodule_export]
    use crate::state::State;
    #[pymodule_export]
    use crate::stream::{_stream, Stream};
    #[pymodule_export]
    use crate::tilt::{TiltEstimate, TiltFilter, TiltStream, angle_rates_of, tilt_of};

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
