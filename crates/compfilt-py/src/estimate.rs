//! The result of `estimate`: all levels, flags, counts and the state after the last sample.

use crate::design::Design;
use crate::session::Results;
use crate::state::State;
use compfilt_core::linear::Flags;
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// All that a filter knows after a run.
///
/// Attributes
/// ----------
/// levels : ndarray, shape (order, n) or (order, n, channels)
///     The state after every sample: the one array that is not time-first, so that ``levels[i]`` is a signal.
/// level_names : tuple of str
/// angle, position, velocity, acceleration, rate : ndarray, shaped like the measurement
///     Copies of the levels by name, as far as the filter has them.
/// bias : ndarray
///     The error of the derivative: minus the level that estimates it.
/// flags : ndarray of uint8, shaped like the measurement
///     A set of :class:`Flags` a sample.
/// counts : dict
///     How many samples carry each flag.
/// state : State
///     For ``initial=`` of the next call: the filter continues as if undisturbed.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> estimate = cf.ThirdOrder(1.0).estimate([1.0, 1.0], [0.0, 0.0], fs=10.0)
/// >>> estimate.level_names
/// ('position', 'velocity', 'minus_bias')
/// >>> estimate.position
/// array([1., 1.])
#[pyclass(frozen, module = "compfilt._core")]
pub(crate) struct Estimate {
    #[pyo3(get)]
    pub(crate) levels: Py<PyAny>,
    #[pyo3(get)]
    pub(crate) flags: Py<PyArrayDyn<u8>>,
    #[pyo3(get)]
    pub(crate) state: Py<State>,
    design: Design,
}

impl Estimate {
    pub(crate) fn new(
        py: Python<'_>,
        design: &Design,
        results: Results<'_>,
        state: State,
    ) -> PyResult<Self> {
        let missing = || PyValueError::new_err("the levels were not kept");
        Ok(Self {
            levels: results.levels.ok_or_else(missing)?.unbind(),
            flags: results.flags.ok_or_else(missing)?.unbind(),
            state: Py::new(py, state)?,
            design: design.clone(),
        })
    }

    fn level<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyAny>> {
        self.levels.bind(py).get_item(index)
    }

    fn named<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let names = self.design.level_names();
        let index = names.iter().position(|known| known == name).ok_or_else(|| {
            PyAttributeError::new_err(format!(
                "this filter has no {name}; its levels are {}",
                names.join(", ")
            ))
        })?;
        self.level(py, index)?.call_method0("copy")
    }
}

#[pymethods]
impl Estimate {
    #[getter]
    fn level_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.design.level_names())
    }

    #[getter]
    fn angle<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, "angle")
    }

    #[getter]
    fn rate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, "rate")
    }

    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, "position")
    }

    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, "velocity")
    }

    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.named(py, "acceleration")
    }

    #[getter]
    fn bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let index = self.design.bias_level().ok_or_else(|| {
            PyAttributeError::new_err(format!(
                "this filter does not estimate a bias; its levels are {}",
                self.design.level_names().join(", ")
            ))
        })?;
        self.level(py, index)?.neg()
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        counts(self.flags.bind(py))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let shape = self.levels.bind(py).getattr("shape")?;
        Ok(format!("Estimate(levels of shape {shape}: {})", self.design.level_names().join(", ")))
    }
}

/// Every flag with its name.
pub(crate) const FLAGS: [(&str, Flags); 8] = [
    ("measurement_missing", Flags::MEASUREMENT_MISSING),
    ("derivative_held", Flags::DERIVATIVE_HELD),
    ("derivative_missing", Flags::DERIVATIVE_MISSING),
    ("not_started", Flags::NOT_STARTED),
    ("restarted", Flags::RESTARTED),
    ("sensor_missing", Flags::SENSOR_MISSING),
    ("magnetometer_missing", Flags::MAGNETOMETER_MISSING),
    ("ambiguous", Flags::AMBIGUOUS),
];

/// How many samples carry each flag.
pub(crate) fn counts<'py>(flags: &Bound<'py, PyArrayDyn<u8>>) -> PyResult<Bound<'py, PyDict>> {
    let view = flags.readonly();
    let view = view.as_array();
    let counts = PyDict::new(flags.py());
    for (name, flag) in FLAGS {
        counts.set_item(name, view.iter().filter(|bits| **bits & flag.bits() != 0).count())?;
    }
    Ok(counts)
}
