//! The one place where errors become Python's.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::pyclass::boolean_struct::False;
use pyo3::{Bound, PyClass, PyErr, PyRef, PyRefMut, PyResult};

/// The core's errors name the parameter and the rule already.
pub(crate) fn value_error(error: compfilt_core::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A stream for a call that moves it on: no other call may be at work on it.
pub(crate) fn alone<'py, S: PyClass<Frozen = False>>(
    stream: &Bound<'py, S>,
) -> PyResult<PyRefMut<'py, S>> {
    stream.try_borrow_mut().map_err(|_| at_work())
}

/// A stream for a call that looks at it: no other call may be moving it on.
pub(crate) fn beside<'py, S: PyClass>(stream: &Bound<'py, S>) -> PyResult<PyRef<'py, S>> {
    stream.try_borrow().map_err(|_| at_work())
}

/// Python has a lock or not: two threads in one stream are refused, not serialised, since samples in an order that nobody
/// chose are as wrong as torn ones.
fn at_work() -> PyErr {
    PyRuntimeError::new_err(
        "this stream is at work in another call: a stream takes one call at a time, so give each thread its own",
    )
}
