//! The tilt filter as a Python class.

use crate::batch::Options;
use crate::linear_filter::LinearFilter;
use crate::options::{choice, handling, rule};
use crate::precision::with_precision;
use crate::session::precision_of;
use crate::tilt::axes_of;
use crate::tilt_batch::Settings;
use crate::tilt_session::{AnySession, Signals};
use crate::tilt_stream::{TiltEstimate, TiltStream};
use compfilt_core::linear::Input;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Roll and pitch (or the cube's phi2 and phi3) from a gyro and an accelerometer: one linear filter an angle.
///
/// The measurement is gravity's angle, the derivative the angle rate that the body rates make at the filter's own output
/// (``rates="output"``) or at a fixed pair of angles (``rates="frozen"``, with ``at``). Leaving the conversion out errs by
/// tau * yaw rate * sin(pitch) in a steady turn. Sources: E. Iontchev, R. Miletiev, L. Hristov, both structures; the
/// balancing cube's section 1.3.
///
/// Parameters
/// ----------
/// design : LinearFilter
///     Any design with derivative_order 1: FirstOrder, PiForm, Butterworth, Chain.
/// axes : {"flu", "frd", "cube"}
/// rates : {"output", "frozen"}
/// at : sequence of 2 floats, optional
///     The angles in rad for frozen rates; (0, 0) where it is left out.
///
/// Raises
/// ------
/// ValueError
///     A parameter breaks its rule.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> acc = np.tile([0.0, 0.0, 9.81], (100, 1))
/// >>> estimate = cf.TiltFilter(cf.PiForm(2.0, 0.5)).estimate(np.zeros((100, 3)), acc, fs=100.0)
/// >>> float(abs(estimate.angles).max())
/// 0.0
#[pyclass(frozen, eq, module = "compfilt._core")]
#[derive(Clone)]
pub(crate) struct TiltFilter {
    design: LinearFilter,
    object: std::sync::Arc<Py<PyAny>>,
    settings: Settings,
    axes: String,
}

impl PartialEq for TiltFilter {
    fn eq(&self, other: &Self) -> bool {
        self.design == other.design && self.settings == other.settings
    }
}

/// The options that make sense for angles: their period is the filter's own.
fn options(rule: &str, hold: f64, gap_cap: Option<f64>) -> PyResult<Options> {
    let input = Input::Sample;
    Ok(Options { rule: self::rule(rule)?, input, period: None, delay: 0.0, hold, gap_cap })
}

#[pymethods]
impl TiltFilter {
    #[new]
    #[pyo3(signature = (design, *, axes="flu", rates="output", at=None))]
    fn new(
        design: &Bound<'_, PyAny>,
        axes: &str,
        rates: &str,
        at: Option<[f64; 2]>,
    ) -> PyResult<Self> {
        let linear = design.cast::<LinearFilter>().map_err(|_| {
            PyTypeError::new_err("design must be a linear filter such as FirstOrder or PiForm")
        })?;
        let linear = linear.get().clone();
        if linear.design.derivative_order != 1 || linear.design.is_rate() {
            return Err(PyValueError::new_err(
                "design must fuse an angle with its rate: derivative_order 1, not the rate filter",
            ));
        }
        let is_frozen = choice("rates", rates, &[("output", false), ("frozen", true)])?;
        if at.is_some() && !is_frozen {
            return Err(PyValueError::new_err("at goes with rates=\"frozen\""));
        }
        let frozen = is_frozen.then(|| at.unwrap_or([0.0, 0.0]).map(|angle| angle + 0.0));
        if frozen.is_some_and(|angles| angles.iter().any(|angle| !angle.is_finite())) {
            return Err(PyValueError::new_err("at must be two finite angles in rad"));
        }
        let settings = Settings { axes: axes_of(axes)?, frozen };
        let object = std::sync::Arc::new(design.clone().unbind());
        Ok(Self { design: linear, object, settings, axes: axes.to_owned() })
    }

    /// The linear filter of both angles.
    #[getter]
    fn design(&self, py: Python<'_>) -> Py<PyAny> {
        self.object.clone_ref(py)
    }

    /// The body's axes.
    #[getter]
    fn axes(&self) -> &str {
        &self.axes
    }

    /// "output" or "frozen".
    #[getter]
    fn rates(&self) -> &'static str {
        if self.settings.frozen.is_some() { "frozen" } else { "output" }
    }

    /// The angles of frozen rates, or None.
    #[getter]
    fn at(&self) -> Option<(f64, f64)> {
        self.settings.frozen.map(|[first, second]| (first, second))
    }

    /// Filters two arrays.
    ///
    /// Parameters
    /// ----------
    /// gyr : array_like, shape (n, 3)
    ///     Body rates in rad/s. A row with NaN or infinity: the last angle rates are held.
    /// acc : array_like, shape (n, 3)
    ///     Specific force in body axes, m/s^2; only its direction counts. A row with NaN or infinity, or of zeros: missing.
    /// fs, t, rule, missing, hold, gap_cap, backwards
    ///     As in ``LinearFilter.filter``.
    /// initial : sequence of 2 floats or State, optional
    ///     The angles in rad before the first sample. None takes the first measurement.
    ///
    /// Returns
    /// -------
    /// TiltEstimate
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> acc = np.tile([0.0, 1.0, 1.0], (50, 1))
    /// >>> estimate = cf.TiltFilter(cf.FirstOrder(1.0)).estimate(np.zeros((50, 3)), acc, fs=100.0)
    /// >>> round(float(np.degrees(estimate.roll[-1])), 6)
    /// 45.0
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, initial=None, rule="backward_euler", missing="coast", hold=0.1, gap_cap=None,
        backwards="raise"
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Bound<'py, PyAny>>,
        initial: Option<&Bound<'py, PyAny>>,
        rule: &str,
        missing: &str,
        hold: f64,
        gap_cap: Option<f64>,
        backwards: &str,
    ) -> PyResult<TiltEstimate> {
        let handling = handling(missing, backwards, 1)?;
        let options = options(rule, hold, gap_cap)?;
        let signals = Signals::new(gyr, acc, t)?;
        if fs.is_some() == t.is_some() {
            return Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them"));
        }
        let precision = signals.gyr.precision.with(signals.acc.precision);
        let mut session =
            AnySession::new(precision, &self.design.design, self.settings, &options, fs)?;
        with_precision!(&mut session, session => {
            session.start(initial)?;
            let arrays = session.process(py, &signals, handling, true)?;
            TiltEstimate::new(py, &self.design.design, arrays, session.state())
        })
    }

    /// A tilt filter that carries its state: for samples and blocks as they come.
    ///
    /// Parameters
    /// ----------
    /// fs : float, optional
    ///     Sample rate in Hz. Without it every call brings dt or t.
    /// dtype : dtype
    ///     float64 or float32.
    ///
    /// The others as in ``estimate``.
    ///
    /// Returns
    /// -------
    /// TiltStream
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> stream = cf.TiltFilter(cf.FirstOrder(1.0)).stream(fs=100.0)
    /// >>> stream.update([0.0, 0.0, 0.0], [0.0, 0.0, 9.81])
    /// array([0., 0.])
    #[pyo3(signature = (
        *, fs=None, dtype=None, initial=None, rule="backward_euler", missing="coast", hold=0.1, gap_cap=None,
        backwards="raise"
    ))]
    #[allow(clippy::too_many_arguments)]
    fn stream<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        fs: Option<f64>,
        dtype: Option<&Bound<'py, PyAny>>,
        initial: Option<&Bound<'py, PyAny>>,
        rule: &str,
        missing: &str,
        hold: f64,
        gap_cap: Option<f64>,
        backwards: &str,
    ) -> PyResult<TiltStream> {
        let handling = handling(missing, backwards, 1)?;
        let this = slf.get();
        let options = options(rule, hold, gap_cap)?;
        let precision = precision_of(dtype)?;
        let mut session =
            AnySession::new(precision, &this.design.design, this.settings, &options, fs)?;
        with_precision!(&mut session, session => session.start(initial))?;
        let keywords = PyDict::new(py);
        keywords.set_item("fs", fs)?;
        keywords.set_item("dtype", precision.name())?;
        keywords.set_item("rule", rule)?;
        keywords.set_item("missing", missing)?;
        keywords.set_item("hold", hold)?;
        keywords.set_item("gap_cap", gap_cap)?;
        keywords.set_item("backwards", backwards)?;
        Ok(TiltStream {
            session,
            handling,
            design: this.design.design.clone(),
            made_by: slf.clone().unbind(),
            keywords: keywords.unbind(),
        })
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        format!("{:?}{:?}{}", self.design.design, self.settings.frozen, self.axes)
            .hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let keywords = PyDict::new(py);
        keywords.set_item("axes", &self.axes)?;
        keywords.set_item("rates", self.rates())?;
        keywords.set_item("at", self.at())?;
        let partial = py.import("functools")?.getattr("partial")?;
        let maker = partial.call((py.get_type::<Self>(),), Some(&keywords))?;
        Ok((maker, (self.design(py),)).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let frozen = self.settings.frozen.map_or(String::new(), |[first, second]| {
            format!(", rates='frozen', at=({first:?}, {second:?})")
        });
        Ok(format!("TiltFilter({}, axes='{}'{frozen})", self.object.bind(py).repr()?, self.axes))
    }
}
