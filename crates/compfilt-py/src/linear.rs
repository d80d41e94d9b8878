//! The linear filters as Python classes: one base with all methods, one small subclass a design.

use crate::arrays::{Signal, check_not_transposed, check_same_shape, samples_and_channels};
use crate::design::{Design, Kind, MAX_ORDER};
use crate::estimate::Estimate;
use crate::session::{AnySession, Input, Results, Wanted, precision_of, with_session};
use crate::stream::{Stream, checked, estimate};
use numpy::{Complex64, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple, PyType};

/// A linear complementary filter: the base of all designs, with their methods.
///
/// An absolute measurement y of level 0 passes a low-pass, a derivative u that is integrated M times passes the high-pass
/// that complements it to 1 at every frequency:
///
///     x_i' = x_{i+1} + [i = M-1] u + k_{i+1} (y - x_0),      i = 0 ... N-1,  x_N = 0
///
/// A design holds what a person wants, in seconds and rad/s; sample rate, scalar type and state belong to the calls.
/// Designs pickle and compare.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.FirstOrder(0.5) == cf.FirstOrder(0.5)
/// True
/// >>> isinstance(cf.FirstOrder(0.5), cf.LinearFilter)
/// True
#[pyclass(frozen, subclass, eq, module = "compfilt._core")]
#[derive(Clone, PartialEq)]
pub(crate) struct LinearFilter {
    pub(crate) design: Design,
}

impl LinearFilter {
    /// The Python object of a design's class.
    fn with<C>(class: C, kind: Kind, split: Option<usize>) -> PyResult<PyClassInitializer<C>>
    where
        C: pyo3::PyClass<BaseType = Self>,
    {
        let base = Self { design: Design::new(kind, split)? };
        Ok(PyClassInitializer::from(base).add_subclass(class))
    }
}

/// The arguments of one call on arrays.
struct Call<'a, 'py> {
    measurement: Signal<'py>,
    derivative: Signal<'py>,
    t: Option<&'a Bound<'py, PyAny>>,
    fs: Option<f64>,
    initial: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> Call<'a, 'py> {
    fn new(
        measurement: &Bound<'py, PyAny>,
        derivative: &Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&'a Bound<'py, PyAny>>,
        initial: Option<&'a Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let measurement = Signal::new(measurement, "measurement")?;
        let derivative = Signal::new(derivative, "derivative")?;
        if fs.is_some() == t.is_some() {
            return Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them"));
        }
        check_same_shape(&measurement, &derivative)?;
        check_not_transposed(&measurement)?;
        Ok(Self { measurement, derivative, t, fs, initial })
    }

    fn run(
        &self,
        py: Python<'py>,
        design: &Design,
        options: &crate::batch::Options,
        handling: crate::session::Handling,
        wanted: &Wanted<'_, 'py>,
    ) -> PyResult<(Results<'py>, crate::state::State)> {
        design.check_delay(options.delay)?;
        let (_, channels) = samples_and_channels(&self.measurement)?;
        let precision = self.measurement.precision.with(self.derivative.precision);
        let mut session = AnySession::new(precision, design, options, self.fs, channels)?;
        let input =
            Input { measurement: &self.measurement, derivative: &self.derivative, t: self.t };
        with_session!(&mut session, session => {
            session.start(self.initial)?;
            let results = session.process(py, &input, handling, wanted)?;
            Ok((results, session.state()))
        })
    }
}

#[pymethods]
impl LinearFilter {
    /// The coefficients k_1 ... k_N of s^N + k_1 s^(N-1) + ... + k_N, in 1/s, 1/s^2, ....
    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.design.coefficients::<f64>()?)
    }

    /// The order N: the number of integrators and of levels.
    #[getter]
    fn order(&self) -> usize {
        self.design.order
    }

    /// The derivative order M: which derivative of level 0 the second signal is.
    #[getter]
    fn derivative_order(&self) -> usize {
        self.design.derivative_order
    }

    /// The number of terms of the polynomial in the low-pass; the order, unless chosen otherwise.
    #[getter]
    fn split(&self) -> usize {
        self.design.split
    }

    /// The names of the levels.
    #[getter]
    fn level_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.design.level_names())
    }

    /// The roots of s^N + k_1 s^(N-1) + ... + k_N in rad/s, complex, slowest first.
    #[getter]
    fn poles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
        let poles = self.design.poles()?;
        Ok(PyArray1::from_iter(py, poles.iter().map(|pole| Complex64::new(pole.re, pole.im))))
    }

    /// Fuses two arrays: the measurement through the low-pass, the derivative through the high-pass.
    ///
    /// Each sample predicts, x- = Phi x + Gamma u, and corrects by the innovation, x = x- + L (y - x-_0); by backward Euler
    /// the discrete poles are 1/(1 - p dt).
    ///
    /// Parameters
    /// ----------
    /// measurement : array_like, shape (n,) or (n, channels)
    ///     The absolute signal y, for example an angle in rad. Time is axis 0. NaN or infinite: missing.
    /// derivative : array_like, shaped like measurement
    ///     The signal u: the M-th derivative of y, per s^M. One sample is the mean over the step that it ends.
    /// fs : float
    ///     Sample rate in Hz; the first step lasts 1/fs. Either this or t.
    /// t : array_like, shape (n,)
    ///     Times in seconds, not decreasing; the first step lasts 0.
    /// initial : float, array_like or State, optional
    ///     The state before the first sample: level 0 (the others 0), all levels, or a State. None takes the first
    ///     measurement; the output before it is NaN.
    /// rule : {"backward_euler", "matched"}
    ///     "matched" puts the discrete poles at exp(p dt) and predicts exactly; it needs split = order.
    /// input : {"sample", "trapezoid"}
    ///     "trapezoid" takes u on a straight line between samples: for instantaneous samples.
    /// period : float, optional
    ///     Wraps the innovation: 2 pi for an angle in rad that may cross +-180 degrees. The output runs on.
    /// delay : float
    ///     Age of the measurement in seconds: it is compared with the estimate of that time.
    /// missing : {"coast", "raise"}
    ///     A missing measurement is predicted over; the next correction uses the gains for the whole time since.
    /// hold : float
    ///     For how many seconds a missing derivative keeps its last value; then it counts as 0.
    /// gap_cap : float, optional
    ///     The most seconds for which the one measurement after a gap counts.
    /// backwards : {"raise", "restart"}
    ///     What to do when t decreases.
    /// exact : bool
    ///     True keeps the order of the arithmetic, bit for bit that of a stream and of firmware. False permits another
    ///     order of the sums where that is faster; at present none is used.
    /// workers : int
    ///     Threads; the channels are shared out between them.
    /// out : ndarray, optional
    ///     Where to write the result: shape of measurement, dtype of the result.
    ///
    /// Returns
    /// -------
    /// ndarray, shaped like measurement
    ///     Level 0. float32 if both signals are, otherwise float64.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A parameter breaks its rule, or shapes do not fit.
    /// TypeError
    ///     A signal does not hold real numbers.
    ///
    /// Notes
    /// -----
    /// The GIL is released meanwhile: do not change the inputs from another thread.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> t = np.arange(200) / 100
    /// >>> angle = cf.FirstOrder(tau=0.5).filter(np.sin(t), np.cos(t), fs=100.0)
    /// >>> bool(abs(angle - np.sin(t)).max() < 0.01)
    /// True
    #[pyo3(signature = (
        measurement, derivative, *, fs=None, t=None, initial=None, rule="backward_euler", input="sample", period=None,
        delay=0.0, missing="coast", hold=0.1, gap_cap=None, backwards="raise", exact=true, workers=1, out=None
    ))]
    #[allow(clippy::too_many_arguments)]
    fn filter<'py>(
        &self,
        py: Python<'py>,
        measurement: &Bound<'py, PyAny>,
        derivative: &Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Bound<'py, PyAny>>,
        initial: Option<&Bound<'py, PyAny>>,
        rule: &str,
        input: &str,
        period: Option<f64>,
        delay: f64,
        missing: &str,
        hold: f64,
        gap_cap: Option<f64>,
        backwards: &str,
        exact: bool,
        workers: usize,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let _ = exact;
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        let call = Call::new(measurement, derivative, fs, t, initial)?;
        let wanted = Wanted { level0: Some(out), levels: false };
        let (results, _) = call.run(py, &self.design, &options, handling, &wanted)?;
        Ok(results.level0.unwrap_or_else(|| py.None().into_bound(py)))
    }

    /// Like ``filter``, with all levels, flags, counts and the state after the last sample.
    ///
    /// Parameters as in ``filter``, without ``out``.
    ///
    /// Returns
    /// -------
    /// Estimate
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> gyro = np.full(4000, 0.02)                  # at rest, with a bias of 0.02 rad/s
    /// >>> estimate = cf.PiForm(kp=2.0, ki=1.0).estimate(np.zeros(4000), gyro, fs=100.0)
    /// >>> round(float(estimate.bias[-1]), 6)
    /// 0.02
    #[pyo3(signature = (
        measurement, derivative, *, fs=None, t=None, initial=None, rule="backward_euler", input="sample", period=None,
        delay=0.0, missing="coast", hold=0.1, gap_cap=None, backwards="raise", exact=true, workers=1
    ))]
    #[allow(clippy::too_many_arguments)]
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        measurement: &Bound<'py, PyAny>,
        derivative: &Bound<'py, PyAny>,
        fs: Option<f64>,
        t: Option<&Bound<'py, PyAny>>,
        initial: Option<&Bound<'py, PyAny>>,
        rule: &str,
        input: &str,
        period: Option<f64>,
        delay: f64,
        missing: &str,
        hold: f64,
        gap_cap: Option<f64>,
        backwards: &str,
        exact: bool,
        workers: usize,
    ) -> PyResult<Estimate> {
        let _ = exact;
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        let call = Call::new(measurement, derivative, fs, t, initial)?;
        let wanted = Wanted { level0: None, levels: true };
        let (results, state) = call.run(py, &self.design, &options, handling, &wanted)?;
        estimate(py, &self.design, results, state)
    }

    /// A filter that carries its state: for samples and blocks as they come.
    ///
    /// Parameters
    /// ----------
    /// fs : float, optional
    ///     Sample rate in Hz. Without it every call brings dt or t.
    /// channels : int, optional
    ///     Samples are arrays of this length, blocks have the shape (n, channels). None: scalars and (n,).
    /// dtype : dtype
    ///     float64 or float32: the scalar type in which the filter runs.
    ///
    /// The others as in ``filter``.
    ///
    /// Returns
    /// -------
    /// Stream
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> stream = cf.ThirdOrder(tau=2.0).stream(initial=0.0)
    /// >>> for _ in range(40):
    /// ...     position = stream.predict(0.1, dt=0.005)    # an accelerometer at 200 Hz
    /// >>> position = stream.correct(0.002)                # a position at 5 Hz
    #[pyo3(signature = (
        *, fs=None, channels=None, dtype=None, initial=None, rule="backward_euler", input="sample", period=None,
        delay=0.0, missing="coast", hold=0.1, gap_cap=None, backwards="raise", workers=1
    ))]
    #[allow(clippy::too_many_arguments)]
    fn stream<'py>(
        slf: &Bound<'py, Self>,
        py: Python<'py>,
        fs: Option<f64>,
        channels: Option<usize>,
        dtype: Option<&Bound<'py, PyAny>>,
        initial: Option<&Bound<'py, PyAny>>,
        rule: &str,
        input: &str,
        period: Option<f64>,
        delay: f64,
        missing: &str,
        hold: f64,
        gap_cap: Option<f64>,
        backwards: &str,
        workers: usize,
    ) -> PyResult<Stream> {
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        if channels == Some(0) {
            return Err(PyValueError::new_err("channels must be 1 or more"));
        }
        let design = &slf.get().design;
        design.check_delay(options.delay)?;
        let precision = precision_of(dtype)?;
        let mut session = AnySession::new(precision, design, &options, fs, channels.unwrap_or(1))?;
        with_session!(&mut session, session => session.start(initial))?;
        let keywords = PyDict::new(py);
        keywords.set_item("fs", fs)?;
        keywords.set_item("channels", channels)?;
        keywords.set_item("dtype", precision.name())?;
        keywords.set_item("rule", rule)?;
        keywords.set_item("input", input)?;
        keywords.set_item("period", period)?;
        keywords.set_item("delay", delay)?;
        keywords.set_item("missing", missing)?;
        keywords.set_item("hold", hold)?;
        keywords.set_item("gap_cap", gap_cap)?;
        keywords.set_item("backwards", backwards)?;
        keywords.set_item("workers", workers)?;
        let made_by = slf.clone().into_any().unbind();
        let keywords = keywords.into_any().unbind();
        Ok(Stream::make(session, design.clone(), options, handling, channels, made_by, keywords))
    }

    /// The complex response of the low branch (from the measurement) and of the high branch (from the integrated
    /// derivative) at the angular frequencies ``omega``. They sum to 1.
    ///
    /// Parameters
    /// ----------
    /// omega : array_like
    ///     Angular frequencies in rad/s.
    /// fs : float, optional
    ///     Sample rate in Hz: the response of the discrete filter, whose high branch is the response to the derivative
    ///     integrated by the filter's own prediction. None: the continuous one.
    /// rule : {"backward_euler", "matched"}
    ///
    /// Returns
    /// -------
    /// low, high : ndarray of complex128, shaped like omega
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> low, high = cf.FirstOrder(tau=0.5).frequency_response([2.0])
    /// >>> print(low.round(3), high.round(3))
    /// [0.5-0.5j] [0.5+0.5j]
    #[pyo3(signature = (omega, *, fs=None, rule="backward_euler"))]
    fn frequency_response<'py>(
        &self,
        py: Python<'py>,
        omega: &Bound<'py, PyAny>,
        fs: Option<f64>,
        rule: &str,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let rule = crate::options::rule(rule)?;
        let signal = Signal::new(omega, "omega")?;
        let shape = signal.shape().to_vec();
        let array = signal.typed::<f64>()?;
        let omega: Vec<f64> = array.as_array().iter().copied().collect();
        if let Some(value) = omega.iter().find(|value| !value.is_finite()) {
            return Err(PyValueError::new_err(format!("omega must be finite, got {value}")));
        }
        let pairs = match fs {
            None => self.design.continuous_response(&omega)?,
            Some(fs) => self.design.discrete_response(rule, fs, &omega)?,
        };
        let low = PyArray1::from_iter(py, pairs.iter().map(|p| Complex64::new(p.low.re, p.low.im)));
        let high =
            PyArray1::from_iter(py, pairs.iter().map(|p| Complex64::new(p.high.re, p.high.im)));
        Ok((low.reshape(shape.clone())?.into_any(), high.reshape(shape)?.into_any()))
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        format!("{:?}", self.design).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let class = slf.get_type();
        let design = &slf.get().design;
        let split = (design.split != design.order).then_some(design.split);
        let (maker, arguments) = match &design.kind {
            Kind::FirstOrder { tau }
            | Kind::ThirdOrder { tau }
            | Kind::SecondOrderInertial { tau }
            | Kind::Rate { tau } => (class.into_any(), (*tau,).into_pyobject(py)?),
            Kind::PiForm { kp, ki } => (class.into_any(), (*kp, *ki).into_pyobject(py)?),
            Kind::Butterworth { omega0, order, q } => {
                (class.into_any(), (*omega0, *order, *q, split).into_pyobject(py)?)
            }
            Kind::ThirdOrderGains { k1, k2, k3 } => {
                (class.getattr("from_gains")?, (*k1, *k2, *k3).into_pyobject(py)?)
            }
            Kind::ThirdOrderButterworth { omega0 }
            | Kind::SecondOrderInertialButterworth { omega0 } => {
                (class.getattr("butterworth")?, (*omega0,).into_pyobject(py)?)
            }
            Kind::Chain { coefficients, derivative_order } => (
                class.into_any(),
                (coefficients.clone(), *derivative_order, split).into_pyobject(py)?,
            ),
        };
        Ok((maker, arguments).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let split = if self.design.split == self.design.order {
            String::new()
        } else {
            format!(", split={}", self.design.split)
        };
        match &self.design.kind {
            Kind::FirstOrder { tau } => format!("FirstOrder(tau={tau:?})"),
            Kind::PiForm { kp, ki } => format!("PiForm(kp={kp:?}, ki={ki:?})"),
            Kind::Butterworth { omega0, order, q } => {
                format!("Butterworth(omega0={omega0:?}, order={order}, q={q:?}{split})")
            }
            Kind::ThirdOrder { tau } => format!("ThirdOrder(tau={tau:?})"),
            Kind::ThirdOrderGains { k1, k2, k3 } => {
                format!("ThirdOrder.from_gains(k1={k1:?}, k2={k2:?}, k3={k3:?})")
            }
            Kind::ThirdOrderButterworth { omega0 } => {
                format!("ThirdOrder.butterworth(omega0={omega0:?})")
            }
            Kind::SecondOrderInertial { tau } => format!("SecondOrderInertial(tau={tau:?})"),
            Kind::SecondOrderInertialButterworth { omega0 } => {
                format!("SecondOrderInertial.butterworth(omega0={omega0:?})")
            }
            Kind::Chain { coefficients, derivative_order } => format!(
                "Chain(coefficients={coefficients:?}, derivative_order={derivative_order}{split})"
            ),
            Kind::Rate { tau } => format!("RateFilter(tau={tau:?})"),
        }
    }
}

/// First order, by its time constant: LP(s) = 1/(tau s + 1), HP(s) = tau s/(tau s + 1), k_1 = 1/tau.
///
/// The classical angle filter: at a fixed rate phi = alpha (phi + dt omega) + (1 - alpha) phi_acc with
/// alpha = tau/(tau + dt). A constant bias b of the derivative leaves the error tau b.
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     tau is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.FirstOrder(tau=0.5).filter([1.0, 1.0], [0.0, 0.0], fs=2.0, initial=0.0)
/// array([0.5 , 0.75])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct FirstOrder {
    /// The time constant in seconds.
    #[pyo3(get)]
    tau: f64,
}

#[pymethods]
impl FirstOrder {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { tau }, Kind::FirstOrder { tau }, None)
    }
}

/// Second order in PI form: LP(s) = (kp s + ki)/(s^2 + kp s + ki), HP(s) = s^2/(the same).
///
/// Level 1 rests at minus the bias of the derivative, so that a constant bias leaves no error. Source: E. Iontchev,
/// R. Miletiev, L. Hristov, equations (11) to (13).
///
/// Parameters
/// ----------
/// kp : float
///     Proportional gain in 1/s, positive.
/// ki : float
///     Integral gain in 1/s^2, positive.
///
/// Raises
/// ------
/// ValueError
///     A gain is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.PiForm(kp=20.0, ki=10.0).coefficients
/// (20.0, 10.0)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct PiForm {
    /// Proportional gain in 1/s.
    #[pyo3(get)]
    kp: f64,
    /// Integral gain in 1/s^2.
    #[pyo3(get)]
    ki: f64,
}

#[pymethods]
impl PiForm {
    #[new]
    fn new(kp: f64, ki: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { kp, ki }, Kind::PiForm { kp, ki }, None)
    }
}

/// Butterworth poles at omega0: k_i = a_i omega0^i with the coefficients of the normalised Butterworth polynomial.
///
/// Order 2 with a quality factor has k_1 = sqrt(2) omega0/q, k_2 = omega0^2; with q other than 1 the poles are no
/// Butterworth poles any more, although the source keeps the name. The high-pass is maximally flat; the low-pass of
/// split = order is not (order 2 peaks by 2.09 dB). Source: Y.-H. Jeon 2015, equations (8) to (19).
///
/// Parameters
/// ----------
/// omega0 : float
///     Radius of the poles in rad/s, positive.
/// order : int
///     1 to 6.
/// q : float
///     Quality factor, for order 2 only.
/// split : int, optional
///     The low-pass takes the terms of the polynomial below this degree: the order (default) gives the steepest
///     high-pass, 1 the steepest low-pass, a true Butterworth one without zeros. A constant bias of the derivative
///     leaves no error exactly when split >= 2.
///
/// Raises
/// ------
/// ValueError
///     A parameter breaks its rule.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.Butterworth(omega0=1.0, order=2).poles.round(3)
/// array([-0.707+0.707j, -0.707-0.707j])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct Butterworth {
    /// Radius of the poles in rad/s.
    #[pyo3(get)]
    omega0: f64,
    /// Quality factor; 1 for orders other than 2.
    #[pyo3(get)]
    q: f64,
}

#[pymethods]
impl Butterworth {
    #[new]
    #[pyo3(signature = (omega0, order=2, q=1.0, split=None))]
    #[allow(clippy::float_cmp)] // 1 is the default, not a computed value.
    fn new(
        omega0: f64,
        order: usize,
        q: f64,
        split: Option<usize>,
    ) -> PyResult<PyClassInitializer<Self>> {
        if !(1..=MAX_ORDER).contains(&order) {
            return Err(PyValueError::new_err(format!(
                "order must lie between 1 and {MAX_ORDER}, got {order}"
            )));
        }
        if order != 2 && q != 1.0 {
            return Err(PyValueError::new_err("q must be 1 unless order is 2"));
        }
        let kind = Kind::Butterworth { omega0, order, q };
        LinearFilter::with(Self { omega0, q }, kind, split)
    }
}

/// Third order: position and acceleration give position, velocity and the bias of the acceleration.
///
///     x_0' = x_1 + k_1 e,   x_1' = x_2 + u + k_2 e,   x_2' = k_3 e,   e = y - x_0
///
/// ThirdOrder(tau) has a triple pole at -1/tau: k = 3/tau, 3/tau^2, 1/tau^3. By backward Euler the velocity is half a
/// sample late; with rule="matched" it is not. Source: the third-order figure of the Chinese note on the origin of K_P
/// and K_I, with the sign of the error mended.
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     A parameter is not positive and finite, or the gains are unstable.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.ThirdOrder(tau=2.0).coefficients
/// (1.5, 0.75, 0.125)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct ThirdOrder;

#[pymethods]
impl ThirdOrder {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self, Kind::ThirdOrder { tau }, None)
    }

    /// The gains themselves, in 1/s, 1/s^2, 1/s^3; stable if k1 k2 > k3.
    #[classmethod]
    fn from_gains(class: &Bound<'_, PyType>, k1: f64, k2: f64, k3: f64) -> PyResult<Py<Self>> {
        let kind = Kind::ThirdOrderGains { k1, k2, k3 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }

    /// Butterworth poles at omega0 in rad/s: k = 2 omega0, 2 omega0^2, omega0^3.
    #[classmethod]
    fn butterworth(class: &Bound<'_, PyType>, omega0: f64) -> PyResult<Py<Self>> {
        let kind = Kind::ThirdOrderButterworth { omega0 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }
}

/// Second order, inertial: position and acceleration give position and velocity.
///
///     x_0' = x_1 + k_1 e,   x_1' = u + k_2 e,   e = y - x_0
///
/// SecondOrderInertial(tau) is critically damped: k = 2/tau, 1/tau^2. A constant bias b of the acceleration leaves the
/// position error b/k_2.
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     A parameter is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.SecondOrderInertial(tau=0.5).coefficients
/// (4.0, 4.0)
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct SecondOrderInertial;

#[pymethods]
impl SecondOrderInertial {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self, Kind::SecondOrderInertial { tau }, None)
    }

    /// Butterworth poles at omega0 in rad/s: k = sqrt(2) omega0, omega0^2.
    #[classmethod]
    fn butterworth(class: &Bound<'_, PyType>, omega0: f64) -> PyResult<Py<Self>> {
        let kind = Kind::SecondOrderInertialButterworth { omega0 };
        Py::new(class.py(), LinearFilter::with(Self, kind, None)?)
    }
}

/// Any complementary filter on a chain of integrators, by its coefficients k_1 ... k_N.
///
/// Parameters
/// ----------
/// coefficients : sequence of float
///     k_1 ... k_N of s^N + k_1 s^(N-1) + ... + k_N, positive; 1 to 6 of them. All roots must lie in the left half plane.
/// derivative_order : int
///     Which derivative of the measurement the second signal is.
/// split : int, optional
///     As in :class:`Butterworth`; only with derivative_order 1.
///
/// Raises
/// ------
/// ValueError
///     The filter would be unstable, or a parameter breaks its rule.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.Chain([3.0, 3.0, 1.0], derivative_order=2).poles.real.round(9)
/// array([-1., -1., -1.])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct Chain;

#[pymethods]
impl Chain {
    #[new]
    #[pyo3(signature = (coefficients, derivative_order=1, split=None))]
    fn new(
        coefficients: Vec<f64>,
        derivative_order: usize,
        split: Option<usize>,
    ) -> PyResult<PyClassInitializer<Self>> {
        if !(1..=MAX_ORDER).contains(&coefficients.len()) {
            return Err(PyValueError::new_err(format!(
                "coefficients must be 1 to {MAX_ORDER} numbers, got {}",
                coefficients.len()
            )));
        }
        LinearFilter::with(Self, Kind::Chain { coefficients, derivative_order }, split)
    }
}

/// The rate filter of the balancing cube: a gyro through the high-pass, an integrated angular acceleration through the
/// low-pass.
///
///     a_n = a_(n-1) + dt alpha_n
///     w_n = alpha (w_(n-1) + g_n - g_(n-1)) + (1 - alpha) a_n,   alpha = tau/(tau + dt)
///
/// ``filter(measurement=gyro, derivative=angular_acceleration)`` in rad/s and rad/s^2. The integral runs open loop: a bias
/// of the angular acceleration makes it drift, and the low-pass does not remove that; ``drift_free`` fuses the same
/// signals without drift. Source: the cube's note on complementary filters, equation (30).
///
/// Parameters
/// ----------
/// tau : float
///     Time constant in seconds, positive.
///
/// Raises
/// ------
/// ValueError
///     tau is not positive and finite.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.RateFilter(tau=1.0).filter([1.0], [0.0], fs=4.0, initial=0.0)
/// array([0.8])
#[pyclass(frozen, extends = LinearFilter, module = "compfilt._core")]
pub(crate) struct RateFilter {
    /// The time constant in seconds.
    #[pyo3(get)]
    tau: f64,
}

#[pymethods]
impl RateFilter {
    #[new]
    fn new(tau: f64) -> PyResult<PyClassInitializer<Self>> {
        LinearFilter::with(Self { tau }, Kind::Rate { tau }, None)
    }

    /// The pair that does not drift: FirstOrder(tau), whose measurement is the gyro and whose derivative is the angular
    /// acceleration.
    #[getter]
    fn drift_free(&self, py: Python<'_>) -> PyResult<Py<FirstOrder>> {
        Py::new(py, FirstOrder::new(self.tau)?)
    }
}
