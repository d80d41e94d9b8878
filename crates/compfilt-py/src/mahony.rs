//! Mahony's filters as a Python class.

use crate::arrays::{Precision, Scalar};
use crate::attitude_batch::Bound;
use crate::attitude_family::MahonyFamily;
use crate::attitude_many::{Given, estimate_many};
use crate::attitude_session::{AnySession, Session, Signals};
use crate::attitude_stream::{AttitudeEstimate, AttitudeStream, estimate, stream};
use crate::batch::checked_period;
use crate::errors::value_error;
use crate::linear_filter::LinearFilter;
use crate::options::{choice, handling};
use crate::session::precision_of;
use compfilt_core::Chain;
use compfilt_core::attitude::{Mahony as Core, MahonyForm};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Mahony's complementary filter on the rotation group: attitude from a gyro, gravity and a magnetometer.
///
///     q- = q * exp(dt (w - b) / 2),    q = q- * exp(L_1 e / 2),    b = b - L_2 e
///
/// with the linear filter's gains L at the time step, so that small errors obey it. The innovation e compares the measured up
/// (the specific force) and north (the magnetic field's horizontal part) with the estimate's. ``explicit`` sums the cross products
/// of the directions: the field does not tilt the estimate, but by way of the bias. ``passive`` rebuilds an attitude from them and compares that.
/// ``direct`` also lets the gyro turn the estimate through the rebuilt attitude, unfiltered: with accelerations it is far worse
/// than the others. With gravity alone all three have the same innovation, and yaw is the gyro's. The estimate converges from
/// everywhere but the unstable equilibria at a turn of exactly
/// 180 degrees. At the start the measurements are averaged until that takes longer than the filter's own memory. Source:
/// R. Mahony, T. Hamel, J.-M. Pflimlin, 2008.
///
/// Parameters
/// ----------
/// kp : float
///     Proportional gain in 1/s, positive.
/// ki : float
///     Integral gain in 1/s^2; 0 for a filter that does not estimate the gyro's bias.
/// form : {"explicit", "passive", "direct"}
/// bias_limit : float
///     The length in rad/s that the bias may have at most.
/// acc_range : float, optional
///     The accelerometer's range in m/s^2: a sample with a component at it or beyond it is clipped, and counts as missing.
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
/// >>> acc = np.tile([0.0, 6.94, 6.94], (100, 1))
/// >>> cf.Mahony(kp=1.0, ki=0.1).estimate(np.zeros((100, 3)), acc, fs=100.0).up[-1].round(4)
/// array([0.    , 0.7071, 0.7071])
#[pyclass(frozen, eq, module = "compfilt._core")]
#[derive(Clone, PartialEq)]
pub(crate) struct Mahony {
    /// The proportional gain in 1/s.
    #[pyo3(get)]
    kp: f64,
    /// The integral gain in 1/s^2.
    #[pyo3(get)]
    ki: f64,
    form: MahonyForm,
    /// The most that the bias may be, in rad/s.
    #[pyo3(get)]
    bias_limit: f64,
    /// The accelerometer's range in m/s^2, or None.
    #[pyo3(get)]
    acc_range: Option<f64>,
}

const FORMS: [(&str, MahonyForm); 3] = [
    ("explicit", MahonyForm::Explicit),
    ("passive", MahonyForm::Passive),
    ("direct", MahonyForm::Direct),
];

impl Mahony {
    fn bind<T: Scalar, const N: usize>(
        &self,
        coefficients: [f64; N],
        hold: f64,
        fs: Option<f64>,
    ) -> PyResult<Session<T>> {
        let design = Chain::new(coefficients.map(T::literal)).map_err(value_error)?;
        let mut filter = Core::new(design, self.form)
            .bias_limit(T::literal(self.bias_limit))
            .and_then(|filter| filter.hold(T::literal(hold)))
            .map_err(value_error)?;
        if let Some(range) = self.acc_range {
            filter = filter
                .force_range(T::literal(range))
                .map_err(|_| PyValueError::new_err("acc_range must be positive and finite"))?;
        }
        let sampled = checked_period::<T, _, N>(&design, fs)?;
        let runner = Box::new(Bound::<MahonyFamily<N>, T>::new(filter, sampled));
        Ok(Session { runner, fs, time: None, kind: format!("mahony of order {N}") })
    }

    fn session(&self, precision: Precision, hold: f64, fs: Option<f64>) -> PyResult<AnySession> {
        let (kp, ki) = (self.kp, self.ki);
        Ok(match (precision, ki > 0.0) {
            (Precision::Single, false) => AnySession::Single(self.bind([kp], hold, fs)?),
            (Precision::Single, true) => AnySession::Single(self.bind([kp, ki], hold, fs)?),
            (Precision::Double, false) => AnySession::Double(self.bind([kp], hold, fs)?),
            (Precision::Double, true) => AnySession::Double(self.bind([kp, ki], hold, fs)?),
        })
    }

    fn form_name(&self) -> &'static str {
        FORMS.iter().find(|(_, form)| *form == self.form).map_or("explicit", |(name, _)| name)
    }
}

#[pymethods]
impl Mahony {
    #[new]
    #[pyo3(signature = (kp, ki=0.0, form="explicit", *, bias_limit=0.1, acc_range=None))]
    fn new(
        kp: f64,
        ki: f64,
        form: &str,
        bias_limit: f64,
        acc_range: Option<f64>,
    ) -> PyResult<Self> {
        if !(kp > 0.0 && kp.is_finite()) {
            return Err(PyValueError::new_err("kp must be positive and finite"));
        }
        if !(ki >= 0.0 && ki.is_finite()) {
            return Err(PyValueError::new_err("ki must be finite and not negative"));
        }
        let filter =
            Self { kp, ki: ki + 0.0, form: choice("form", form, &FORMS)?, bias_limit, acc_range };
        // What the core refuses is refused here.
        filter.session(Precision::Double, 0.0, None)?;
        Ok(filter)
    }

    /// The filter with the gains of a linear design: FirstOrder, PiForm, or Butterworth and Chain of order 1 or 2.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> cf.Mahony.from_design(cf.PiForm(kp=1.0, ki=0.1))
    /// Mahony(kp=1.0, ki=0.1, form='explicit')
    #[staticmethod]
    #[pyo3(signature = (design, form="explicit", *, bias_limit=0.1, acc_range=None))]
    fn from_design(
        design: &pyo3::Bound<'_, PyAny>,
        form: &str,
        bias_limit: f64,
        acc_range: Option<f64>,
    ) -> PyResult<Self> {
        let linear = design.cast::<LinearFilter>().map_err(|_| {
            PyTypeError::new_err("design must be a linear filter such as FirstOrder or PiForm")
        })?;
        let coefficients: Vec<f64> = design.getattr("coefficients")?.extract()?;
        let design = &linear.get().design;
        let refused =
            design.derivative_order != 1 || design.is_rate() || design.split != design.order;
        match coefficients[..] {
            [kp] if !refused => Self::new(kp, 0.0, form, bias_limit, acc_range),
            [kp, ki] if !refused => Self::new(kp, ki, form, bias_limit, acc_range),
            _ => Err(PyValueError::new_err(
                "design must be a chain of order 1 or 2 with derivative_order 1 and no split",
            )),
        }
    }

    /// "explicit", "passive" or "direct".
    #[getter]
    fn form(&self) -> &'static str {
        self.form_name()
    }

    /// Filters arrays.
    ///
    /// Parameters
    /// ----------
    /// gyr : array_like, shape (n, 3)
    ///     Body rates in rad/s. A row with NaN or infinity is missing: the last one is held.
    /// acc : array_like, shape (n, 3)
    ///     Specific force in body axes, m/s^2; only its direction counts. A row with NaN or infinity, of zeros, or clipped: missing.
    /// fs, t, missing, hold, backwards
    ///     As in ``LinearFilter.filter``.
    /// mag : array_like, shape (n, 3), optional
    ///     Magnetic field in body axes, any unit; only its horizontal direction counts.
    /// initial : sequence of 4 floats or State, optional
    ///     The quaternion before the first sample. None takes the first measurement.
    ///
    /// Returns
    /// -------
    /// AttitudeEstimate
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> gyr = np.tile([0.0, 0.0, 0.1], (100, 1))
    /// >>> estimate = cf.Mahony(kp=1.0).estimate(gyr, np.tile([0.0, 0.0, 9.81], (100, 1)), fs=100.0)
    /// >>> round(float(2 * np.arctan2(estimate.quaternion[-1, 3], estimate.quaternion[-1, 0])), 6)
    /// 0.099
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, mag=None, initial=None, missing="coast", hold=0.1, backwards="raise"
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        gyr: &pyo3::Bound<'py, PyAny>,
        acc: &pyo3::Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&pyo3::Bound<'py, PyAny>>,
        mag: Option<&pyo3::Bound<'py, PyAny>>,
        initial: Option<&pyo3::Bound<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
    ) -> PyResult<AttitudeEstimate> {
        let handling = handling(missing, backwards, 1)?;
        let signals = Signals::new(gyr, acc, mag, t)?;
        let session = |precision| self.session(precision, hold, fs);
        estimate(py, session, &signals, fs, initial, handling)
    }

    /// Many recordings in one call: the list of what ``estimate`` returns for each, the same bits, several times as fast.
    ///
    /// Recordings go side by side through the processor's vector registers, eight at a time, and over ``workers`` threads. They may
    /// have any lengths.
    ///
    /// Parameters
    /// ----------
    /// gyr, acc : sequence of array_like, each (n, 3)
    ///     Rates in rad/s and specific forces in m/s² of every recording, body axes. n may differ from recording to recording.
    /// fs : float, optional
    ///     Sample rate in Hz of all recordings. Give fs or t.
    /// t : sequence of array_like, each (n,), optional
    ///     Times in seconds of every recording.
    /// mag : sequence of array_like or None, optional
    ///     Magnetic fields of any length; None for a recording without.
    /// initial : sequence, optional
    ///     What ``estimate`` takes as initial, for every recording; None for one that starts with its first measurement.
    /// missing, hold, backwards
    ///     As in ``estimate``.
    /// workers : int
    ///     Threads; never more than the machine has cores.
    ///
    /// Returns
    /// -------
    /// list of AttitudeEstimate
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     As in ``estimate``, with the number of the recording; or the sequences differ in length.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf, numpy as np
    /// >>> gyr = [np.zeros((5, 3)), np.zeros((9, 3))]
    /// >>> acc = [np.tile([0.0, 0.0, 9.81], (len(rates), 1)) for rates in gyr]
    /// >>> estimates = cf.Mahony(1.0).estimate_many(gyr, acc, fs=100.0)
    /// >>> [estimate.quaternion.shape for estimate in estimates]
    /// [(5, 4), (9, 4)]
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, mag=None, initial=None, missing="coast", hold=0.1, backwards="raise", workers=1
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate_many<'py>(
        &self,
        py: Python<'py>,
        gyr: &pyo3::Bound<'py, PyAny>,
        acc: &pyo3::Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&pyo3::Bound<'py, PyAny>>,
        mag: Option<&pyo3::Bound<'py, PyAny>>,
        initial: Option<&pyo3::Bound<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
        workers: i64,
    ) -> PyResult<Vec<AttitudeEstimate>> {
        let handling = handling(missing, backwards, workers)?;
        let session = |precision| self.session(precision, hold, fs);
        estimate_many(py, session, &Given { gyr, acc, mag, t, initial, fs }, handling)
    }

    /// A filter that carries its state: for samples and blocks as they come. Keywords as in ``estimate``, and dtype: float64 or
    /// float32. Returns an :class:`AttitudeStream`.
    #[pyo3(signature = (*, fs=None, dtype=None, initial=None, missing="coast", hold=0.1, backwards="raise"))]
    #[allow(clippy::too_many_arguments)]
    fn stream<'py>(
        slf: &pyo3::Bound<'py, Self>,
        py: Python<'py>,
        fs: Option<f64>,
        dtype: Option<&pyo3::Bound<'py, PyAny>>,
        initial: Option<&pyo3::Bound<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
    ) -> PyResult<AttitudeStream> {
        let handling = handling(missing, backwards, 1)?;
        let precision = precision_of(dtype)?;
        let session = slf.get().session(precision, hold, fs)?;
        let keywords = PyDict::new(py);
        keywords.set_item("fs", fs)?;
        keywords.set_item("dtype", precision.name())?;
        keywords.set_item("missing", missing)?;
        keywords.set_item("hold", hold)?;
        keywords.set_item("backwards", backwards)?;
        stream(session, slf.as_any(), keywords, initial, handling)
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        self.__repr__().hash(&mut hasher);
        hasher.finish()
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<pyo3::Bound<'py, PyAny>> {
        let keywords = PyDict::new(py);
        keywords.set_item("bias_limit", self.bias_limit)?;
        keywords.set_item("acc_range", self.acc_range)?;
        let arguments = (self.kp, self.ki, self.form_name());
        Ok((arguments, keywords).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let limit = if self.bias_limit.to_bits() == 0.1_f64.to_bits() {
            String::new()
        } else {
            format!(", bias_limit={:?}", self.bias_limit)
        };
        let range = self.acc_range.map_or(String::new(), |range| format!(", acc_range={range:?}"));
        format!(
            "Mahony(kp={:?}, ki={:?}, form='{}'{limit}{range})",
            self.kp,
            self.ki,
            self.form_name()
        )
    }
}
