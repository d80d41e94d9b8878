//! The gravity filter as a Python class.

use crate::arrays::{Precision, Scalar, Signal};
use crate::attitude_batch::{Bound, Runner};
use crate::attitude_family::{GravityFamily, SelfCalibratingFamily};
use crate::attitude_log::Log;
use crate::attitude_many::{Given, estimate_many};
use crate::attitude_session::{AnySession, Session, Signals, fill, quaternion, rows};
use crate::attitude_stream::{AttitudeEstimate, AttitudeStream, estimate, stream};
use crate::batch::checked_period;
use crate::errors::value_error;
use crate::gravity_offline::{Offline, smooth, velocities};
use crate::options::handling;
use crate::session::precision_of;
use compfilt_core::attitude::{
    GravityFilter as Core, HeadingRule, RestRule, SelfCalibratingFilter, Smoother,
};
use compfilt_core::nalgebra::Matrix3;
use compfilt_core::{Butterworth, Chain, Dt, Split};
use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::{PyAny, PyResult, Python, pyclass, pymethods};
use pyo3::types::{PyDict, PyDictMethods};
use pyo3::{Bound as Object, IntoPyObject};

/// Attitude from a gyro and an accelerometer: the vertical as a linear low-pass of the specific force in the frame that the gyro
/// turns.
///
///     x_i <- exp(-[w dt]x) x_i,  then one step of the linear filter with y = f - gyro_delay w x f,    up = x_0 / |x_0|
///
/// In that frame gravity stands still, and the motion's accelerations average out, the better since the force is not
/// normalised. With ``split=1`` the filter is a true low-pass. While the body rests, the gyro's bias is estimated. At the start the
/// filter is as fast as the time since then allows. Yaw is the gyro's, or slowly the magnetometer's where it is given.
///
/// Parameters
/// ----------
/// tau : float, optional
///     Time constant in seconds; omega0 = sqrt(2)/tau. 3 where it is left out, 5 if the filter calibrates itself.
/// order : int
///     Of the low-pass, 1 to 6.
/// split : int
///     Terms of the polynomial in the low-pass, 1 to order.
/// zeta : float, optional
///     Damping ratio, order 2 only; 0.5 where it is left out. Other orders have Butterworth poles.
/// self_calibrating : bool
///     Learn the gyro's bias and a matrix M of sensitivity errors (scale and cross-axis) from the motion: the rate is
///     w - bias - M w. The symmetric part of M converges; the skew part, a misalignment of both sensors, hardly does.
/// gyro_delay : float
///     How far in seconds the force is moved ahead, f - gyro_delay w x f: how much later the accelerometer's samples are than the
///     frame that the gyro turns. A property of the sensor, found by ``find_gyro_delay``; half a sample period where the gyro's
///     samples are instantaneous and not means over the interval. A self-calibrating filter learns the rest of it.
/// advance : float
///     How far in seconds the attitude is turned ahead by the last rate: the time that the sensors and the computation take.
/// calibration : array_like, shape (3, 3), optional
///     M at the start of a self-calibrating filter, from ``AttitudeEstimate.calibration`` of an earlier run.
/// rest_time, rest_rate, rest_force, rest_drift : float
///     A body rests that for rest_time (1.5 s) has been within rest_rate (2 deg/s, in rad/s) and rest_force (0.5 m/s^2) of the
///     low-passed gyro and accelerometer, while the latter drifted by less than rest_drift (0.1 m/s^2).
/// bias_limit : float
///     The largest bias of an axis in rad/s (2 deg/s): a faster turn is none.
/// heading_tau : float
///     Time constant in seconds of the heading (10), where there is a magnetometer.
/// acc_range : float, optional
///     The accelerometer's range in m/s^2: a sample with a component at it or beyond it is clipped, and counts as missing.
///
/// Raises
/// ------
/// ValueError
///     A parameter breaks its rule.
///
/// Notes
/// -----
/// At the time t after the start the poles are at -2/t at least. A sample of the accelerometer counts for 0.1 s at most, or for its
/// own time step where that is longer. After a time step of more than 1 s the vertical is sought anew, and the sample flagged
/// as restarted: the filter is for 1 Hz and above. The self-calibrating filter works in blocks of 0.1 s, learns from 3 s on,
/// with priors of 1 deg/s, 0.006 and 10 ms for bias, M and delay, and limits of bias_limit, 0.05 and 20 ms. Without acc_range
/// a single finite spike of the accelerometer is believed.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> acc = np.tile([0.0, 6.94, 6.94], (300, 1))
/// >>> estimate = cf.GravityFilter().estimate(np.full((300, 3), 0.001), acc, fs=100.0)
/// >>> abs(estimate.up[-1]).round(3)
/// array([0.   , 0.707, 0.707])
/// >>> bool(estimate.at_rest[-1]), estimate.gyro_bias[-1].round(6)
/// (True, array([0.001, 0.001, 0.001]))
#[pyclass(frozen, eq, module = "compfilt._core")]
#[derive(Clone, PartialEq)]
pub(crate) struct GravityFilter {
    #[pyo3(get)]
    tau: f64,
    #[pyo3(get)]
    order: usize,
    #[pyo3(get)]
    split: usize,
    /// The damping ratio at order 2, otherwise None.
    #[pyo3(get)]
    zeta: Option<f64>,
    #[pyo3(get)]
    self_calibrating: bool,
    #[pyo3(get)]
    gyro_delay: f64,
    /// How far the attitude is turned ahead, in s.
    #[pyo3(get)]
    advance: f64,
    /// The gyro's sensitivity errors at the start, or None.
    #[pyo3(get)]
    calibration: Option<[[f64; 3]; 3]>,
    #[pyo3(get)]
    rest_time: f64,
    #[pyo3(get)]
    rest_rate: f64,
    #[pyo3(get)]
    rest_force: f64,
    #[pyo3(get)]
    rest_drift: f64,
    #[pyo3(get)]
    bias_limit: f64,
    #[pyo3(get)]
    heading_tau: f64,
    #[pyo3(get)]
    acc_range: Option<f64>,
}

/// 2 deg/s in rad/s.
const TWO_DEGREES: f64 = 0.034_906_585_039_886_59;
const SELF_CALIBRATING: &str = "self-calibrating gravity filter";
const TAU: f64 = 3.0;
const ZETA: f64 = 0.5;
const TAU_SELF_CALIBRATING: f64 = 5.0;

impl GravityFilter {
    fn design<T: Scalar, const N: usize>(&self) -> Result<Split<T, N>, compfilt_core::Error> {
        let omega0 = T::literal(2.0).sqrt() / T::literal(self.tau);
        let chain = match (self.zeta, N) {
            (Some(zeta), 2) => {
                let both = [T::literal(2.0 * zeta) * omega0, omega0 * omega0];
                Chain::new(std::array::from_fn(|i| both[i]))?
            }
            _ => Butterworth::<T, N>::new(omega0)?.chain(),
        };
        chain.split(self.split)
    }

    fn rest<T: Scalar>(&self) -> Result<RestRule<T>, compfilt_core::Error> {
        RestRule::default()
            .time(T::literal(self.rest_time))?
            .rate(T::literal(self.rest_rate))?
            .force(T::literal(self.rest_force))?
            .drift(T::literal(self.rest_drift))?
            .bias_limit(T::literal(self.bias_limit))
    }

    fn core<T: Scalar, const N: usize>(
        &self,
        hold: f64,
    ) -> Result<Core<T, N>, compfilt_core::Error> {
        let filter = Core::new(self.design::<T, N>()?)?
            .rest(self.rest()?)
            .heading(HeadingRule::new(T::literal(self.heading_tau))?)
            .delay(T::literal(self.gyro_delay))?
            .advance(T::literal(self.advance))?
            .hold(T::literal(hold))?;
        self.acc_range.map_or(Ok(filter), |range| filter.force_range(T::literal(range)))
    }

    fn calibrating<T: Scalar>(
        &self,
        hold: f64,
    ) -> Result<SelfCalibratingFilter<T>, compfilt_core::Error> {
        let zeta = T::literal(self.zeta.unwrap_or(ZETA));
        let filter = SelfCalibratingFilter::new(T::literal(self.tau), zeta)?
            .rest(self.rest()?)
            .heading(HeadingRule::new(T::literal(self.heading_tau))?)
            .delay(T::literal(self.gyro_delay))?
            .advance(T::literal(self.advance))?
            .hold(T::literal(hold))?;
        self.acc_range.map_or(Ok(filter), |range| filter.force_range(T::literal(range)))
    }

    fn self_calibrating_filter<T: Scalar>(
        &self,
        hold: f64,
        fs: Option<f64>,
    ) -> PyResult<Bound<SelfCalibratingFamily, T>> {
        let known = self.calibration.unwrap_or_default();
        let known = Matrix3::from_fn(|row, column| T::literal(known[row][column]));
        let filter = self.calibrating::<T>(hold).map_err(renamed)?.calibrated(known);
        let sampled =
            fs.map(|fs| Dt::from_rate(T::literal(fs))).transpose().map_err(value_error)?;
        Ok(Bound::new(filter, sampled))
    }

    fn bind_calibrating<T: Scalar>(&self, hold: f64, fs: Option<f64>) -> PyResult<Session<T>> {
        let runner = Box::new(self.self_calibrating_filter::<T>(hold, fs)?);
        Ok(Session { runner, fs, time: None, kind: SELF_CALIBRATING.to_owned() })
    }

    fn plain_filter<T: Scalar, const N: usize>(
        &self,
        hold: f64,
        fs: Option<f64>,
    ) -> PyResult<Bound<GravityFamily<N>, T>> {
        let filter = self.core::<T, N>(hold).map_err(renamed)?;
        let sampled = checked_period::<T, _, N>(filter.design(), fs)?;
        Ok(Bound::new(filter, sampled))
    }

    fn bind<T: Scalar, const N: usize>(&self, hold: f64, fs: Option<f64>) -> PyResult<Session<T>> {
        let runner = Box::new(self.plain_filter::<T, N>(hold, fs)?);
        Ok(Session { runner, fs, time: None, kind: format!("gravity filter of order {N}") })
    }

    fn of_order<T: Scalar>(&self, hold: f64, fs: Option<f64>) -> PyResult<Session<T>> {
        if self.self_calibrating {
            return self.bind_calibrating(hold, fs);
        }
        match self.order {
            1 => self.bind::<T, 1>(hold, fs),
            2 => self.bind::<T, 2>(hold, fs),
            3 => self.bind::<T, 3>(hold, fs),
            4 => self.bind::<T, 4>(hold, fs),
            5 => self.bind::<T, 5>(hold, fs),
            _ => self.bind::<T, 6>(hold, fs),
        }
    }

    fn session(&self, precision: Precision, hold: f64, fs: Option<f64>) -> PyResult<AnySession> {
        Ok(match precision {
            Precision::Single => AnySession::Single(self.of_order(hold, fs)?),
            Precision::Double => AnySession::Double(self.of_order(hold, fs)?),
        })
    }
}

fn three_by_three(object: &Object<'_, PyAny>) -> PyResult<[[f64; 3]; 3]> {
    let signal = Signal::new(object, "calibration")?;
    let values = signal.typed::<f64>()?;
    let values: Vec<f64> = values.as_array().iter().copied().collect();
    if *signal.shape() != [3, 3] {
        let shape = signal.shape();
        return Err(PyValueError::new_err(format!(
            "calibration must have the shape (3, 3), got {shape:?}"
        )));
    }
    Ok(std::array::from_fn(|row| std::array::from_fn(|column| values[3 * row + column])))
}

/// The core's names of parameters are Rust's.
fn renamed(error: compfilt_core::Error) -> pyo3::PyErr {
    let name = match error.parameter() {
        "time" => "rest_time",
        "rate" => "rest_rate",
        "force" => "rest_force",
        "drift" => "rest_drift",
        "delay" => "gyro_delay",
        "force_range" => "acc_range",
        "omega0" | "coefficients" | "design" => "tau",
        name => name,
    };
    let message = error.to_string();
    PyValueError::new_err(message.replacen(error.parameter(), name, 1))
}

#[pymethods]
impl GravityFilter {
    #[new]
    #[pyo3(signature = (
        tau=None, *, order=2, split=1, zeta=None, self_calibrating=false, gyro_delay=0.0, advance=0.0, calibration=None, rest_time=1.5, rest_rate=0.034_906_585_039_886_59,
        rest_force=0.5, rest_drift=0.1, bias_limit=0.034_906_585_039_886_59, heading_tau=10.0, acc_range=None
    ))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        tau: Option<f64>,
        order: i64,
        split: i64,
        zeta: Option<f64>,
        self_calibrating: bool,
        gyro_delay: f64,
        advance: f64,
        calibration: Option<&Object<'_, PyAny>>,
        rest_time: f64,
        rest_rate: f64,
        rest_force: f64,
        rest_drift: f64,
        bias_limit: f64,
        heading_tau: f64,
        acc_range: Option<f64>,
    ) -> PyResult<Self> {
        let order = crate::design::small("order", order)?;
        let split = crate::design::small("split", split)?;
        let tau = tau.unwrap_or(if self_calibrating { TAU_SELF_CALIBRATING } else { TAU });
        if !(tau > 0.0 && tau.is_finite()) {
            return Err(PyValueError::new_err("tau must be positive and finite"));
        }
        if zeta.is_some_and(|zeta| !(zeta > 0.0 && zeta.is_finite())) {
            return Err(PyValueError::new_err("zeta must be positive and finite"));
        }
        if zeta.is_some() && order != 2 {
            return Err(PyValueError::new_err(
                "zeta goes with order=2: other orders have Butterworth poles",
            ));
        }
        if self_calibrating && (order, split) != (2, 1) {
            return Err(PyValueError::new_err("self_calibrating goes with order=2 and split=1"));
        }
        let calibration = calibration.map(three_by_three).transpose()?;
        if calibration.is_some() && !self_calibrating {
            return Err(PyValueError::new_err("calibration goes with self_calibrating=True"));
        }
        if !calibration.is_none_or(|rows| rows.iter().flatten().all(|part| part.abs() < 0.5)) {
            return Err(PyValueError::new_err(
                "calibration must be nine numbers below 0.5: parts of the rate",
            ));
        }
        let zeta = (order == 2).then(|| zeta.unwrap_or(ZETA));
        let filter = Self {
            tau,
            order,
            split,
            zeta,
            self_calibrating,
            gyro_delay: gyro_delay + 0.0,
            advance: advance + 0.0,
            calibration,
            rest_time,
            rest_rate,
            rest_force,
            rest_drift,
            bias_limit,
            heading_tau,
            acc_range,
        };
        // What the core refuses is refused here.
        filter.session(Precision::Double, 0.0, None)?;
        Ok(filter)
    }

    /// Filters arrays.
    ///
    /// Parameters
    /// ----------
    /// gyr : array_like, shape (n, 3)
    ///     Body rates in rad/s. A row with NaN or infinity is missing: the last one is held.
    /// acc : array_like, shape (n, 3)
    ///     Specific force in body axes, m/s^2. A row with NaN or infinity, of zeros, or clipped: missing.
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
    /// >>> estimate = cf.GravityFilter().estimate(gyr, np.tile([0.0, 0.0, 9.81], (100, 1)), fs=100.0)
    /// >>> round(float(2 * np.arctan2(estimate.quaternion[-1, 3], estimate.quaternion[-1, 0])), 6)
    /// 0.1
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, mag=None, initial=None, missing="coast", hold=0.1, backwards="raise"
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        gyr: &Object<'py, PyAny>,
        acc: &Object<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Object<'py, PyAny>>,
        mag: Option<&Object<'py, PyAny>>,
        initial: Option<&Object<'py, PyAny>>,
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
    /// >>> estimates = cf.GravityFilter().estimate_many(gyr, acc, fs=100.0)
    /// >>> [estimate.quaternion.shape for estimate in estimates]
    /// [(5, 4), (9, 4)]
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, mag=None, initial=None, missing="coast", hold=0.1, backwards="raise", workers=1
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate_many<'py>(
        &self,
        py: Python<'py>,
        gyr: &Object<'py, PyAny>,
        acc: &Object<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Object<'py, PyAny>>,
        mag: Option<&Object<'py, PyAny>>,
        initial: Option<&Object<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
        workers: i64,
    ) -> PyResult<Vec<AttitudeEstimate>> {
        let handling = handling(missing, backwards, workers)?;
        let session = |precision| self.session(precision, hold, fs);
        estimate_many(py, session, &Given { gyr, acc, mag, t, initial, fs }, handling)
    }

    /// The offline, zero-phase answer: better than ``estimate``, but it needs the whole log.
    ///
    /// A self-calibrating forward pass finds bias, sensitivity and delay; a strapdown with these averages the force in the gyro's
    /// frame; a second-order low-pass smooths that forward and backward. The heading is the gyro's, or follows the magnetometer
    /// as online. Bias and sensitivity are those at the end of the log: cut a log over which they change. A filter that does not
    /// calibrate itself is replaced by one that does, with that one's tau and zeta.
    ///
    /// Parameters
    /// ----------
    /// gyr, acc, fs, t, mag, missing, hold, backwards
    ///     As in ``estimate``. The arithmetic is in float64; the results are float32 where all signals are.
    /// initial : sequence of 4 floats, optional
    ///     A quaternion whose heading the first sample takes over.
    ///
    /// Returns
    /// -------
    /// AttitudeEstimate
    ///     ``flags``, ``at_rest`` and ``state`` are the forward pass's (not started is taken back where the attitude is known in
    ///     hindsight), ``gyro_bias`` is constant.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> acc = np.tile([0.0, 6.94, 6.94], (300, 1)) + np.random.default_rng(0).normal(size=(300, 3))
    /// >>> cf.GravityFilter().smooth(np.zeros((300, 3)), acc, fs=100.0).up[0].round(1) + 0.0
    /// array([0. , 0.7, 0.7])
    #[pyo3(signature = (
        gyr, acc, *, fs=None, t=None, mag=None, initial=None, missing="coast", hold=0.1, backwards="raise"
    ))]
    #[allow(clippy::too_many_arguments)]
    fn smooth<'py>(
        &self,
        py: Python<'py>,
        gyr: &Object<'py, PyAny>,
        acc: &Object<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Object<'py, PyAny>>,
        mag: Option<&Object<'py, PyAny>>,
        initial: Option<&Object<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
    ) -> PyResult<AttitudeEstimate> {
        let handling = handling(missing, backwards, 1)?;
        let signals = Signals::new(gyr, acc, mag, t)?;
        let usual = (TAU_SELF_CALIBRATING, Some(ZETA));
        let (tau, zeta) = if self.self_calibrating { (self.tau, self.zeta) } else { usual };
        let learning = Self { tau, self_calibrating: true, zeta, ..self.clone() };
        let mut filter = learning.self_calibrating_filter::<f64>(hold, fs)?;
        let heading = HeadingRule::new(self.heading_tau).map_err(renamed)?;
        let smoother = Smoother::new(tau).map_err(renamed)?;
        let initial = initial.map(quaternion).transpose()?;
        filter.reset(initial);
        let offline = Offline { smoother, heading, initial };
        let work = |log: Log<'_, f64>| smooth(&mut filter, &offline, log);
        let (mut arrays, time) = fill(py, &signals, handling, fs, None, work)?;
        arrays.delay = filter.delay();
        arrays.calibration = filter.calibration().map(|matrix| rows(py, &matrix));
        if let Precision::Single = signals.precision() {
            arrays.narrow()?;
        }
        let session =
            Session { runner: Box::new(filter), fs, time, kind: SELF_CALIBRATING.to_owned() };
        AttitudeEstimate::new(py, arrays, session.state())
    }

    /// Level 1 after every sample, (n, 3): what the search for the delay looks at.
    #[pyo3(signature = (gyr, acc, *, fs))]
    fn _velocity<'py>(
        &self,
        py: Python<'py>,
        gyr: &Object<'py, PyAny>,
        acc: &Object<'py, PyAny>,
        fs: f64,
    ) -> PyResult<Object<'py, PyArray2<f64>>> {
        let handling = handling("coast", "raise", 1)?;
        let signals = Signals::new(gyr, acc, None, None)?;
        let mut filter = self.plain_filter::<f64, 2>(0.1, Some(fs))?;
        let mut velocity = None;
        let work = |log: Log<'_, f64>| velocity = Some(velocities(&mut filter, log));
        fill(py, &signals, handling, Some(fs), None, work)?;
        Ok(PyArray2::from_owned_array(py, velocity.unwrap_or_default()))
    }

    /// A filter that carries its state: for samples and blocks as they come. Keywords as in ``estimate``, and dtype: float64 or
    /// float32. Returns an :class:`AttitudeStream`.
    #[pyo3(signature = (*, fs=None, dtype=None, initial=None, missing="coast", hold=0.1, backwards="raise"))]
    #[allow(clippy::too_many_arguments)]
    fn stream<'py>(
        slf: &Object<'py, Self>,
        fs: Option<f64>,
        dtype: Option<&Object<'py, PyAny>>,
        initial: Option<&Object<'py, PyAny>>,
        missing: &str,
        hold: f64,
        backwards: &str,
    ) -> PyResult<AttitudeStream> {
        let handling = handling(missing, backwards, 1)?;
        let precision = precision_of(dtype)?;
        let session = slf.get().session(precision, hold, fs)?;
        let keywords = PyDict::new(slf.py());
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

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, PyAny>> {
        let keywords = PyDict::new(py);
        keywords.set_item("order", self.order)?;
        keywords.set_item("split", self.split)?;
        keywords.set_item("zeta", self.zeta)?;
        keywords.set_item("self_calibrating", self.self_calibrating)?;
        keywords.set_item("gyro_delay", self.gyro_delay)?;
        keywords.set_item("advance", self.advance)?;
        keywords.set_item("calibration", self.calibration)?;
        keywords.set_item("rest_time", self.rest_time)?;
        keywords.set_item("rest_rate", self.rest_rate)?;
        keywords.set_item("rest_force", self.rest_force)?;
        keywords.set_item("rest_drift", self.rest_drift)?;
        keywords.set_item("bias_limit", self.bias_limit)?;
        keywords.set_item("heading_tau", self.heading_tau)?;
        keywords.set_item("acc_range", self.acc_range)?;
        Ok(((self.tau,), keywords).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let Self { tau, order, split, .. } = self;
        let mut parts = vec![format!("GravityFilter(tau={tau:?}, order={order}, split={split}")];
        if let Some(zeta) = self.zeta {
            parts.push(format!("zeta={zeta:?}"));
        }
        if self.self_calibrating {
            parts.push("self_calibrating=True".to_owned());
        }
        let settings = [
            ("gyro_delay", self.gyro_delay, 0.0),
            ("advance", self.advance, 0.0),
            ("rest_time", self.rest_time, 1.5),
            ("rest_rate", self.rest_rate, TWO_DEGREES),
            ("rest_force", self.rest_force, 0.5),
            ("rest_drift", self.rest_drift, 0.1),
            ("bias_limit", self.bias_limit, TWO_DEGREES),
            ("heading_tau", self.heading_tau, 10.0),
        ];
        for (name, value, usual) in settings {
            if value.to_bits() != usual.to_bits() {
                parts.push(format!("{name}={value:?}"));
            }
        }
        if let Some(rows) = self.calibration {
            parts.push(format!("calibration={rows:?}"));
        }
        if let Some(range) = self.acc_range {
            parts.push(format!("acc_range={range:?}"));
        }
        parts.join(", ") + ")"
    }
}
