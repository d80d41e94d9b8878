//! The one place where errors become Python's.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// The core's errors name the parameter and the rule already.
pub(crate) fn value_error(error: compfilt_core::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}
