//! Mahony's filters as a Python class.

use crate::arrays::{Precision, Scalar};
use crate::attitude_batch::{Filter, Output};
use crate::attitude_session::{AnySession, Session, Signals};
use crate::attitude_stream::{AttitudeEstimate, AttitudeStream, estimate, stream};
use crate::batch::sampled_gains;
use crate::errors::value_error;
use crate::gravity_batch::unit;
use crate::linear_filter::LinearFilter;
use crate::options::{choice, handling};
use crate::session::precision_of;
use crate::state::Numbers;
use compfilt_core::attitude::{Mahony as Core, MahonyForm, MahonyState, Rotation};
use compfilt_core::linear::{Flags, Gains};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Chain, Discretise, Dt, Recurrence};
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

/// A filter bound to its state.
struct Bound<T: Scalar, const N: usize> {
    filter: Core<T, N>,
    sampled: Option<Gains<T, N, 1>>,
    gains: Gains<T, N, 1>,
    state: MahonyState<T>,
}

impl<T: Scalar, const N: usize> Filter<T> for Bound<T, N> {
    fn follow(&mut self, dt: Option<Dt<T>>) {
        match (dt, self.sampled) {
            (Some(dt), _) if self.gains.dt() != dt.seconds() => {
                self.gains = self.filter.design().gains(dt);
            }
            (None, Some(gains)) => self.gains = gains,
            _ => {}
        }
    }

    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, mag: Option<&Vector3<T>>) -> Flags {
        self.filter.update(&self.gains, &mut self.state, gyr, acc, mag)
    }

    fn output(&self) -> Option<Output<T>> {
        let MahonyState { rotation, bias, started, .. } = self.state;
        started.then(|| Output { rotation, up: rotation.up(), bias, at_rest: false })
    }

    fn store(&self) -> Numbers {
        let state = &self.state;
        let mut numbers = Numbers::new();
        numbers.put(&[state.rotation.w]);
        for vector in [state.rotation.v, state.bias, state.rate.value] {
            numbers.put(vector.as_slice());
        }
        numbers.put(&[state.rate.age, state.age, state.since_correction, state.since_heading]);
        numbers.put(&[state.started, state.heading_known].map(|flag| f64::from(u8::from(flag))));
        numbers
    }

    fn restore(&mut self, numbers: &Numbers) -> bool {
        let numbers: Vec<T> = numbers.values();
        let [
            w,
            x,
            y,
            z,
            bx,
            by,
            bz,
            rx,
            ry,
            rz,
            rate_age,
            age,
            since,
            since_heading,
            started,
            heading,
        ] = numbers[..]
        else {
            return false;
        };
        let Some(rotation) = unit(w, Vector3::new(x, y, z)) else { return false };
        let state = &mut self.state;
        state.rotation = rotation;
        state.since_heading = since_heading;
        state.bias = Vector3::new(bx, by, bz);
        state.rate.value = Vector3::new(rx, ry, rz);
        (state.rate.age, state.age, state.since_correction) = (rate_age, age, since);
        (state.started, state.heading_known) = (started != T::zero(), heading != T::zero());
        true
    }

    fn reset(&mut self, attitude: Option<Rotation<T>>) {
        self.state = attitude.map_or_else(MahonyState::new, MahonyState::from_rotation);
    }
}

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
        let sampled = fs.map(|fs| sampled_gains::<T, _, N>(&design, fs)).transpose()?;
        let zero = Dt::new(T::zero()).map_err(value_error)?;
        let gains = sampled.unwrap_or_else(|| design.gains(zero));
        let runner = Box::new(Bound { filter, sampled, gains, state: MahonyState::new() });
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
