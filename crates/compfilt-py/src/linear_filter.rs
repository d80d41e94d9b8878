//! The base of all linear filters: their methods on arrays. A design is a small subclass in a file of its own.

use crate::arrays::{Signal, check_not_transposed, check_same_shape, samples_and_channels};
use crate::design::{Design, Kind};
use crate::estimate::Estimate;
use crate::options::checked;
use crate::precision::with_precision;
use crate::session::{AnySession, Handling, Input, Results, Wanted, precision_of};
use crate::stream::Stream;
use numpy::{Complex64, PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

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
    pub(crate) fn with<C>(
        class: C,
        kind: Kind,
        split: Option<usize>,
    ) -> PyResult<PyClassInitializer<C>>
    where
        C: pyo3::PyClass<BaseType = Self>,
    {
        let base = Self { design: Design::new(kind, split)? };
        Ok(PyClassInitializer::from(base).add_subclass(class))
    }

    /// The filter as another library's system: `compfilt.interop` knows the libraries.
    fn converted<'py>(
        slf: &Bound<'py, Self>,
        into: &str,
        fs: Option<f64>,
        rule: &str,
        all_levels: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        crate::options::rule(rule)?;
        let py = slf.py();
        let keywords = PyDict::new(py);
        keywords.set_item("fs", fs)?;
        keywords.set_item("rule", rule)?;
        keywords.set_item("all_levels", all_levels)?;
        let interop = py.import("compfilt.interop")?;
        let system = interop.getattr("of_design")?.call((slf,), Some(&keywords))?;
        interop.call_method1(into, (system,))
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
        handling: Handling,
        wanted: &Wanted<'_, 'py>,
    ) -> PyResult<(Results<'py>, AnySession)> {
        design.check_delay(options.delay)?;
        let (_, channels) = samples_and_channels(&self.measurement)?;
        let precision = self.measurement.precision.with(self.derivative.precision);
        let mut session = AnySession::new(precision, design, options, self.fs, channels)?;
        let input =
            Input { measurement: &self.measurement, derivative: &self.derivative, t: self.t };
        let results = with_precision!(&mut session, session => {
            session.start(self.initial)?;
            session.process(py, &input, handling, wanted)?
        });
        Ok((results, session))
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
    ///     The absolute signal y, for example an angle in rad. Time is axis 0. NaN, infinite or masked: missing.
    /// derivative : array_like, shaped like measurement
    ///     The signal u: the M-th derivative of y, per s^M. One sample is the mean over the step that it ends.
    /// fs : float
    ///     Sample rate in Hz; the first step lasts 1/fs. Either this or t.
    /// t : array_like, shape (n,)
    ///     Times in seconds, not decreasing; the first step lasts 0, or from the time of a State.
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
    ///     Age of the measurement in seconds: it is compared with the estimate of that time. Refused where the loop would be
    ///     unstable; that limit holds for samples without long gaps.
    /// missing : {"coast", "raise"}
    ///     A missing measurement is predicted over; the next correction uses the gains for the whole time since.
    /// hold : float
    ///     For how many seconds a missing derivative keeps its last value; then it counts as 0.
    /// gap_cap : float, optional
    ///     The most seconds for which the one measurement after a gap counts. Meant for single gaps: where longer ones keep
    ///     coming, filters from order 2 on can become unstable with it.
    /// backwards : {"raise", "restart"}
    ///     What to do when t decreases.
    /// exact : bool
    ///     True keeps the order of the arithmetic: bit for bit that of a stream and of firmware. False permits another order
    ///     of the sums where that is faster: with fs, from 1024 samples on, for one channel or up to three in Fortran order,
    ///     without period, delay, gap_cap and "trapezoid", and not for the rate filter. In C order they are as fast in the
    ///     exact way. Parts of a channel are then filtered side by side. Level 0 differs by up to 1e-13 of its largest value
    ///     in float64 and 3e-5 in float32 for time constants of up to 1000 samples, ten times that for 10 000; the other
    ///     levels by some twenty times as much. Flags are the same. Stretches of some thousand samples with a missing one go
    ///     the exact way. Neither workers nor the processor change a bit.
    /// workers : int
    ///     Threads, as far as there are cores. Channels are shared out between them, in groups of eight that run side by
    ///     side in each thread, in C order in groups of a thousand as long as hardly a sample is missing: one thread then reads and
    ///     writes nearly as fast as several. With exact=False also the parts of one channel are shared out, half a million
    ///     bytes of each array at a time, among at most one thread for every 262 144 samples. Nothing is copied; each thread
    ///     needs less than 1 MB.
    /// out : ndarray, optional
    ///     Where to write the result: shape of measurement, dtype of the result.
    ///
    /// Returns
    /// -------
    /// ndarray, shaped like measurement
    ///     Level 0. float32 if both signals are, otherwise float64; in Fortran order if both signals are.
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
        workers: i64,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        let handling = Handling { exact, ..handling };
        let call = Call::new(measurement, derivative, fs, t, initial)?;
        let wanted = Wanted::Level0(out);
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
        workers: i64,
    ) -> PyResult<Estimate> {
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        let handling = Handling { exact, ..handling };
        let call = Call::new(measurement, derivative, fs, t, initial)?;
        let wanted = Wanted::Levels;
        let (results, session) = call.run(py, &self.design, &options, handling, &wanted)?;
        let state = with_precision!(&session, session => session.state());
        Estimate::new(py, &self.design, results, state)
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
        channels: Option<i64>,
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
        workers: i64,
    ) -> PyResult<Stream> {
        let (options, handling) =
            checked(rule, input, period, delay, missing, hold, gap_cap, backwards, workers)?;
        let channels = match channels {
            None => None,
            Some(channels) => Some(crate::options::count("channels", channels)?.get()),
        };
        let design = &slf.get().design;
        design.check_delay(options.delay)?;
        let precision = precision_of(dtype)?;
        let mut session = AnySession::new(precision, design, &options, fs, channels.unwrap_or(1))?;
        with_precision!(&mut session, session => session.start(initial))?;
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
        let design = design.clone();
        Ok(Stream { session, design, options, handling, channels, made_by, keywords })
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

    /// The filter as a ``scipy.signal.StateSpace``, from the measurement and the derivative to level 0.
    ///
    /// Parameters
    /// ----------
    /// fs : float, optional
    ///     Sample rate in Hz: the discrete filter, with ``dt = 1/fs``. None: the continuous one.
    /// rule : {"backward_euler", "matched"}
    ///     As in ``filter``; only with fs.
    /// all_levels : bool
    ///     Every level is an output, not only level 0.
    ///
    /// Returns
    /// -------
    /// scipy.signal.StateSpace
    ///     Two inputs: the measurement, the derivative. The states are the levels; in discrete time those before the sample,
    ///     so that an initial state is what ``initial`` is to ``filter``. Of a rate filter they are the rate minus the gyro's
    ///     and the integrated angular acceleration: ``initial=r`` is (0, r).
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     SciPy is not installed: the extra ``design``.
    /// ValueError
    ///     A parameter breaks its rule.
    ///
    /// Notes
    /// -----
    /// The matrices of a discrete system are those of the filter in float64; its output on samples differs from that of
    /// ``filter`` by rounding only.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> cf.PiForm(kp=2.0, ki=1.0).to_scipy().A
    /// array([[-2.,  1.],
    ///        [-1.,  0.]])
    /// >>> cf.FirstOrder(tau=1.0).to_scipy(fs=4.0).A
    /// array([[0.8]])
    #[pyo3(signature = (*, fs=None, rule="backward_euler", all_levels=false))]
    fn to_scipy<'py>(
        slf: &Bound<'py, Self>,
        fs: Option<f64>,
        rule: &str,
        all_levels: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        Self::converted(slf, "to_scipy", fs, rule, all_levels)
    }

    /// The filter as a ``control.StateSpace`` of python-control, with the names of inputs, outputs and states.
    ///
    /// Parameters
    /// ----------
    /// fs, rule, all_levels
    ///     As in ``to_scipy``.
    ///
    /// Returns
    /// -------
    /// control.StateSpace
    ///     As in ``to_scipy``.
    ///
    /// Raises
    /// ------
    /// ImportError
    ///     python-control is not installed.
    /// ValueError
    ///     A parameter breaks its rule.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> system = cf.ThirdOrder(tau=2.0).to_control()
    /// >>> print(*system.input_labels, "->", *system.output_labels)
    /// measurement derivative -> position
    /// >>> print(*system.state_labels)
    /// position velocity minus_bias
    #[pyo3(signature = (*, fs=None, rule="backward_euler", all_levels=false))]
    fn to_control<'py>(
        slf: &Bound<'py, Self>,
        fs: Option<f64>,
        rule: &str,
        all_levels: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        Self::converted(slf, "to_control", fs, rule, all_levels)
    }

    /// The numbers of the gains at the sample rate ``fs`` as a chip runs them, float32: what `compfilt export` writes.
    #[pyo3(signature = (fs, *, rule="backward_euler"))]
    fn _gains<'py>(&self, py: Python<'py>, fs: f64, rule: &str) -> PyResult<Bound<'py, PyDict>> {
        let rule = crate::options::rule(rule)?;
        let parts = PyDict::new(py);
        for (name, numbers) in self.design.parts_of_gains(fs, rule)? {
            parts.set_item(name, PyArray1::from_vec(py, numbers))?;
        }
        Ok(parts)
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
