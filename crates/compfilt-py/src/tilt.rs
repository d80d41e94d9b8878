//! Gravity to angles, body rates to angle rates, and the tilt filter.

use crate::arrays::{Precision, Scalar, Signal, check_all_finite, check_vectors, columns};
use crate::batch::{Options, Steps, sampled_gains};
use crate::design::{Design, Visitor};
use crate::errors::value_error;
use crate::estimate::counts;
use crate::linear::LinearFilter;
use crate::options::{choice, handling, rule};
use crate::session::{Handling, precision_of};
use crate::state::{Numbers, State};
use compfilt_core::gravity::{Axes, Rates, TiltFilter as Filter, TiltState, angle_rates, tilt};
use compfilt_core::linear::{Flags, Input};
use compfilt_core::nalgebra::{Vector2, Vector3};
use compfilt_core::{Discretise, Dt, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2, ArrayViewMut3, Zip};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

fn axes_of(axes: &str) -> PyResult<Axes> {
    choice("axes", axes, &[("flu", Axes::Flu), ("frd", Axes::Frd), ("cube", Axes::Cube)])
}

/// The angles in rad of the specific force: roll and pitch, or the cube's phi2 and phi3.
///
///     flu    phi = atan2(f_y, f_z)     theta = atan2(-f_x, sqrt(f_y^2 + f_z^2))
///     frd    phi = atan2(-f_y, -f_z)   theta = atan2(f_x, sqrt(f_y^2 + f_z^2))
///     cube   phi2 = atan2(-s_3, sqrt(s_1^2 + s_2^2))   phi3 = atan2(s_2, -s_1)
///
/// Parameters
/// ----------
/// acc : array_like, shape (n, 3)
///     Specific force in body axes, up to its length: what an accelerometer at rest reads.
/// axes : {"flu", "frd", "cube"}
///     Forward-left-up, forward-right-down (aircraft), or the balancing cube's.
///
/// Returns
/// -------
/// ndarray, shape (n, 2)
///     NaN where the force is not finite or has no length.
///
/// Raises
/// ------
/// ValueError
///     acc does not have the shape (n, 3), or axes is unknown.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> cf.tilt([[0.0, 6.94, 6.94]]).round(4)
/// array([[0.7854, 0.    ]])
#[pyfunction]
#[pyo3(name = "tilt", signature = (acc, *, axes="flu"))]
pub(crate) fn tilt_of<'py>(
    py: Python<'py>,
    acc: &Bound<'py, PyAny>,
    axes: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let axes = axes_of(axes)?;
    let acc = Signal::new(acc, "acc")?;
    check_vectors(&acc)?;
    match acc.precision {
        Precision::Single => tilt_array::<f32>(py, &acc, axes),
        Precision::Double => tilt_array::<f64>(py, &acc, axes),
    }
}

fn tilt_array<'py, T: Scalar>(
    py: Python<'py>,
    acc: &Signal<'py>,
    axes: Axes,
) -> PyResult<Bound<'py, PyAny>> {
    let acc = acc.typed::<T>()?;
    let acc = columns(&acc)?;
    let out = PyArray2::<T>::zeros(py, [acc.nrows(), 2], false);
    Zip::from(out.readwrite().as_array_mut().rows_mut()).and(acc.rows()).for_each(|mut out, f| {
        let angles = tilt(axes, &vector(f)).unwrap_or(Vector2::new(T::NAN, T::NAN));
        out[0] = angles[0];
        out[1] = angles[1];
    });
    Ok(out.into_any())
}

/// The rates in rad/s of the two angles from the body rates.
///
///     flu, frd   phi' = p + tan(theta) (q sin(phi) + r cos(phi))      theta' = q cos(phi) - r sin(phi)
///     cube       phi2' = s3 u1 + c3 u2      phi3' = u3 + (s2 s3/c2) u2 - (s2 c3/c2) u1
///
/// Singular at theta (or phi2) = +-90 degrees; there the cosine's size is taken as 0.001 at least.
///
/// Parameters
/// ----------
/// angles : array_like, shape (n, 2)
///     Roll and pitch (or phi2 and phi3) in rad.
/// gyr : array_like, shape (n, 3)
///     Body rates in rad/s.
/// axes : {"flu", "frd", "cube"}
///
/// Returns
/// -------
/// ndarray, shape (n, 2)
///
/// Raises
/// ------
/// ValueError
///     The shapes do not fit, or axes is unknown.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> cf.angle_rates([[0.0, np.pi / 4]], [[0.0, 0.0, 1.0]]).round(6)
/// array([[1., 0.]])
#[pyfunction]
#[pyo3(name = "angle_rates", signature = (angles, gyr, *, axes="flu"))]
pub(crate) fn angle_rates_of<'py>(
    py: Python<'py>,
    angles: &Bound<'py, PyAny>,
    gyr: &Bound<'py, PyAny>,
    axes: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let axes = axes_of(axes)?;
    let angles = Signal::new(angles, "angles")?;
    let gyr = Signal::new(gyr, "gyr")?;
    let samples = check_vectors(&gyr)?;
    if *angles.shape() != [samples, 2] {
        return Err(PyValueError::new_err(format!(
            "angles must have the shape ({samples}, 2), got {:?}",
            angles.shape()
        )));
    }
    match angles.precision.with(gyr.precision) {
        Precision::Single => rates_array::<f32>(py, &angles, &gyr, axes),
        Precision::Double => rates_array::<f64>(py, &angles, &gyr, axes),
    }
}

fn rates_array<'py, T: Scalar>(
    py: Python<'py>,
    angles: &Signal<'py>,
    gyr: &Signal<'py>,
    axes: Axes,
) -> PyResult<Bound<'py, PyAny>> {
    let (angles, gyr) = (angles.typed::<T>()?, gyr.typed::<T>()?);
    let (angles, gyr) = (columns(&angles)?, columns(&gyr)?);
    let out = PyArray2::<T>::zeros(py, [gyr.nrows(), 2], false);
    Zip::from(out.readwrite().as_array_mut().rows_mut())
        .and(angles.rows())
        .and(gyr.rows())
        .for_each(|mut out, angles, gyr| {
            let rates = angle_rates(axes, &Vector2::new(angles[0], angles[1]), &vector(gyr));
            out[0] = rates[0];
            out[1] = rates[1];
        });
    Ok(out.into_any())
}

fn vector<T: Scalar>(row: numpy::ndarray::ArrayView1<'_, T>) -> Vector3<T> {
    Vector3::new(row[0], row[1], row[2])
}

/// A block of samples of a tilt filter, and where the results go.
struct Block<'a, T> {
    gyr: ArrayView2<'a, T>,
    acc: ArrayView2<'a, T>,
    steps: Steps<'a, T>,
    angles: ArrayViewMut2<'a, T>,
    /// `(order, samples, 2)`.
    levels: Option<ArrayViewMut3<'a, T>>,
    flags: ArrayViewMut1<'a, u8>,
}

/// A tilt filter of any order, bound to its state.
trait Runner<T: Scalar>: Send + Sync {
    fn order(&self) -> usize;
    fn block(&mut self, block: Block<'_, T>);
    fn update(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, dt: Option<Dt<T>>) -> Vector2<T>;
    fn store(&self) -> Vec<Numbers>;
    fn restore(&mut self, numbers: &[Numbers]) -> bool;
    fn reset(&mut self, angles: Option<Vector2<T>>);
}

struct Bound2<T: Scalar, D: Discretise<T, N>, const N: usize> {
    filter: Filter<T, D>,
    sampled: Option<D::Gains>,
    gains: D::Gains,
    state: TiltState<T, N>,
}

impl<T: Scalar, D: Discretise<T, N>, const N: usize> Bound2<T, D, N> {
    fn follow(&mut self, dt: T) {
        if self.gains.dt() != dt
            && let Ok(dt) = Dt::new(dt)
        {
            self.gains = self.filter.design().gains(dt);
        }
    }

    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>) -> Flags {
        self.filter.update(&self.gains, &mut self.state, gyr, acc)
    }
}

impl<T, D, const N: usize> Runner<T> for Bound2<T, D, N>
where
    T: Scalar,
    D: Discretise<T, N> + Send + Sync,
    D::Gains: Send + Sync,
{
    fn order(&self) -> usize {
        N
    }

    fn block(&mut self, mut block: Block<'_, T>) {
        if let (Steps::Uniform, Some(gains)) = (block.steps, self.sampled) {
            self.gains = gains;
        }
        for row in 0..block.gyr.nrows() {
            if let Steps::Each(steps) = block.steps {
                if steps[row].is_finite() {
                    self.follow(steps[row]);
                } else {
                    self.state = TiltState::new();
                    self.follow(T::zero());
                }
            }
            let flags = self.sample(&vector(block.gyr.row(row)), &vector(block.acc.row(row)));
            let angles = self.filter.angles(&self.state);
            block.angles[(row, 0)] = angles[0];
            block.angles[(row, 1)] = angles[1];
            if let Some(levels) = &mut block.levels {
                for (angle, state) in self.state.angles.iter().enumerate() {
                    for (level, x) in state.levels.levels.iter().enumerate() {
                        levels[(level, row, angle)] = *x;
                    }
                }
            }
            block.flags[row] = flags.bits();
        }
    }

    fn update(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, dt: Option<Dt<T>>) -> Vector2<T> {
        match (dt, self.sampled) {
            (Some(dt), _) => self.follow(dt.seconds()),
            (None, Some(gains)) => self.gains = gains,
            (None, None) => {}
        }
        self.sample(gyr, acc);
        self.filter.angles(&self.state)
    }

    fn store(&self) -> Vec<Numbers> {
        let numbers = |state| {
            let mut numbers = Numbers::new();
            numbers.put_stream(state);
            numbers
        };
        self.state.angles.iter().map(numbers).collect()
    }

    fn restore(&mut self, numbers: &[Numbers]) -> bool {
        for (state, numbers) in self.state.angles.iter_mut().zip(numbers) {
            let mut reader = numbers.reader();
            let Some(stored) = reader.take_stream() else { return false };
            if !reader.is_empty() {
                return false;
            }
            *state = stored;
        }
        true
    }

    fn reset(&mut self, angles: Option<Vector2<T>>) {
        self.state = TiltState::new();
        if let Some(angles) = angles {
            for (state, angle) in self.state.angles.iter_mut().zip(angles.iter()) {
                state.start(*angle);
            }
        }
    }
}

/// The settings of a tilt filter, in float64.
#[derive(Clone, Copy, PartialEq)]
struct Settings {
    axes: Axes,
    /// The operating point of frozen rates.
    frozen: Option<[f64; 2]>,
}

struct Make<'a> {
    settings: Settings,
    options: &'a Options,
    fs: Option<f64>,
}

impl<T: Scalar> Visitor<T> for Make<'_> {
    type Output = PyResult<Box<dyn Runner<T>>>;

    fn visit<D, const N: usize>(self, design: D) -> Self::Output
    where
        D: Discretise<T, N> + Send + Sync + 'static,
        D::Gains: Send + Sync,
    {
        let mut filter = Filter::new(design, self.settings.axes)
            .hold(T::literal(self.options.hold))
            .map_err(value_error)?;
        if let Some(cap) = self.options.gap_cap {
            filter = filter.gap_cap(T::literal(cap)).map_err(value_error)?;
        }
        if let Some([first, second]) = self.settings.frozen {
            let at = Vector2::new(T::literal(first), T::literal(second));
            filter = filter.rates(Rates::Frozen(at));
        }
        let sampled = match self.fs {
            None => None,
            Some(fs) => Some(sampled_gains::<T, D, N>(&design, fs)?),
        };
        let zero = Dt::new(T::zero()).map_err(value_error)?;
        let gains = sampled.unwrap_or_else(|| design.gains(zero));
        Ok(Box::new(Bound2 { filter, sampled, gains, state: TiltState::new() }))
    }
}

/// A tilt filter at work in one scalar type.
struct Session<T: Scalar> {
    runner: Box<dyn Runner<T>>,
    fs: Option<f64>,
    time: Option<f64>,
}

enum AnySession {
    Single(Session<f32>),
    Double(Session<f64>),
}

macro_rules! with_tilt {
    ($any:expr, $session:ident => $body:expr) => {
        match $any {
            AnySession::Single($session) => $body,
            AnySession::Double($session) => $body,
        }
    };
}

/// The arrays of one call.
struct Signals<'a, 'py> {
    gyr: Signal<'py>,
    acc: Signal<'py>,
    t: Option<&'a Bound<'py, PyAny>>,
}

impl<'a, 'py> Signals<'a, 'py> {
    fn new(
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&'a Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let (gyr, acc) = (Signal::new(gyr, "gyr")?, Signal::new(acc, "acc")?);
        let (samples, other) = (check_vectors(&gyr)?, check_vectors(&acc)?);
        if samples != other {
            return Err(PyValueError::new_err(format!(
                "gyr and acc must have the same number of samples, got {samples} and {other}"
            )));
        }
        Ok(Self { gyr, acc, t })
    }
}

/// The arrays that a run of a tilt filter leaves.
struct Arrays<'py> {
    angles: Bound<'py, PyAny>,
    levels: Option<Bound<'py, PyAny>>,
    flags: Bound<'py, PyArrayDyn<u8>>,
}

impl<T: Scalar> Session<T> {
    fn new(
        design: &Design,
        settings: Settings,
        options: &Options,
        fs: Option<f64>,
    ) -> PyResult<Self> {
        let make = Make { settings, options, fs };
        Ok(Self { runner: design.with::<T, _>(options.rule, make)??, fs, time: None })
    }

    fn process<'py>(
        &mut self,
        py: Python<'py>,
        signals: &Signals<'_, 'py>,
        handling: Handling,
        keep_levels: bool,
    ) -> PyResult<Arrays<'py>> {
        let (gyr, acc) = (signals.gyr.typed::<T>()?, signals.acc.typed::<T>()?);
        let (gyr, acc) = (columns(&gyr)?, columns(&acc)?);
        let samples = gyr.nrows();
        let steps = self.steps(signals.t, samples, handling)?;
        if handling.raise_missing {
            check_all_finite(gyr, "gyr")?;
            check_all_finite(acc, "acc")?;
        }
        let angles = PyArray2::<T>::zeros(py, [samples, 2], false);
        let levels =
            keep_levels.then(|| PyArray3::<T>::zeros(py, [self.runner.order(), samples, 2], false));
        let flags = PyArray1::<u8>::zeros(py, [samples], false);
        {
            let mut angles = angles.readwrite();
            let mut levels = levels.as_ref().map(PyArrayMethods::readwrite);
            let mut flags = flags.readwrite();
            let block = Block {
                gyr,
                acc,
                steps: steps.as_deref().map_or(Steps::Uniform, Steps::Each),
                angles: angles.as_array_mut(),
                levels: levels.as_mut().map(|levels| levels.as_array_mut()),
                flags: flags.as_array_mut(),
            };
            let runner = &mut self.runner;
            py.detach(|| runner.block(block));
        }
        Ok(Arrays {
            angles: angles.into_any(),
            levels: levels.map(Bound::into_any),
            flags: flags.to_dyn().clone(),
        })
    }

    /// The time steps of a block; moves the time on.
    fn steps(
        &mut self,
        t: Option<&Bound<'_, PyAny>>,
        samples: usize,
        handling: Handling,
    ) -> PyResult<Option<Vec<T>>> {
        let (steps, time) =
            crate::session::steps::<T>(t, self.fs, self.time, samples, handling.backwards)?;
        self.time = time;
        Ok(steps)
    }

    fn state(&self) -> State {
        State {
            order: self.runner.order(),
            dtype: T::NAME.to_owned(),
            time: self.time,
            numbers: self.runner.store(),
        }
    }

    fn set_state(&mut self, state: &State) -> PyResult<()> {
        state.check(self.runner.order(), 2, T::NAME)?;
        if !self.runner.restore(&state.numbers) {
            return Err(PyValueError::new_err("the state belongs to another kind of filter"));
        }
        self.time = state.time;
        Ok(())
    }

    fn start(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let Some(initial) = initial else {
            self.runner.reset(None);
            self.time = None;
            return Ok(());
        };
        if let Ok(state) = initial.cast::<State>() {
            return self.set_state(state.get());
        }
        let signal = Signal::new(initial, "initial")?;
        let values = signal.typed::<f64>()?;
        let values: Vec<f64> = values.as_array().iter().copied().collect();
        match values[..] {
            [first, second] if first.is_finite() && second.is_finite() => {
                self.runner.reset(Some(Vector2::new(T::literal(first), T::literal(second))));
                self.time = None;
                Ok(())
            }
            _ => Err(PyValueError::new_err(
                "initial must be two finite angles in rad, or a State of this filter",
            )),
        }
    }
}

impl AnySession {
    fn new(
        precision: Precision,
        design: &Design,
        settings: Settings,
        options: &Options,
        fs: Option<f64>,
    ) -> PyResult<Self> {
        Ok(match precision {
            Precision::Single => Self::Single(Session::new(design, settings, options, fs)?),
            Precision::Double => Self::Double(Session::new(design, settings, options, fs)?),
        })
    }
}

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

impl TiltFilter {
    fn options(&self, rule: &str, hold: f64, gap_cap: Option<f64>) -> PyResult<Options> {
        let input = Input::Sample;
        Ok(Options { rule: self::rule(rule)?, input, period: None, delay: 0.0, hold, gap_cap })
    }
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
        let frozen = is_frozen.then(|| at.unwrap_or([0.0, 0.0]));
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
        let options = self.options(rule, hold, gap_cap)?;
        let signals = Signals::new(gyr, acc, t)?;
        if fs.is_some() == t.is_some() {
            return Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them"));
        }
        let precision = signals.gyr.precision.with(signals.acc.precision);
        let mut session =
            AnySession::new(precision, &self.design.design, self.settings, &options, fs)?;
        with_tilt!(&mut session, session => {
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
        let options = this.options(rule, hold, gap_cap)?;
        let precision = precision_of(dtype)?;
        let mut session =
            AnySession::new(precision, &this.design.design, this.settings, &options, fs)?;
        with_tilt!(&mut session, session => session.start(initial))?;
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

/// All that a tilt filter knows after a run.
///
/// Attributes
/// ----------
/// angles : ndarray, shape (n, 2)
///     Roll and pitch (or phi2 and phi3) in rad, in their usual ranges; NaN before the first measurement.
/// levels : ndarray, shape (order, n, 2)
///     The levels of both filters; level 0 runs on without wrapping.
/// bias : ndarray, shape (n, 2)
///     The error of the angle rates in rad/s, where the design estimates one.
/// flags : ndarray of uint8, shape (n,)
///     A set of :class:`Flags` a sample.
/// counts : dict
///     How many samples carry each flag.
/// state : State
#[pyclass(frozen, module = "compfilt._core")]
pub(crate) struct TiltEstimate {
    #[pyo3(get)]
    angles: Py<PyAny>,
    #[pyo3(get)]
    levels: Py<PyAny>,
    #[pyo3(get)]
    flags: Py<PyArrayDyn<u8>>,
    #[pyo3(get)]
    state: Py<State>,
    bias_level: Option<usize>,
}

impl TiltEstimate {
    fn new(py: Python<'_>, design: &Design, arrays: Arrays<'_>, state: State) -> PyResult<Self> {
        let levels =
            arrays.levels.ok_or_else(|| PyValueError::new_err("the levels were not kept"))?;
        Ok(Self {
            angles: arrays.angles.unbind(),
            levels: levels.unbind(),
            flags: arrays.flags.unbind(),
            state: Py::new(py, state)?,
            bias_level: design.bias_level(),
        })
    }

    fn angle<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyAny>> {
        let columns = self.angles.bind(py).getattr("T")?;
        columns.get_item(index)?.call_method0("copy")
    }
}

#[pymethods]
impl TiltEstimate {
    /// Roll in rad, a copy; with the cube's axes phi2.
    #[getter]
    fn roll<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.angle(py, 0)
    }

    /// Pitch in rad, a copy; with the cube's axes phi3.
    #[getter]
    fn pitch<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.angle(py, 1)
    }

    #[getter]
    fn bias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let index = self.bias_level.ok_or_else(|| {
            pyo3::exceptions::PyAttributeError::new_err("this design does not estimate a bias")
        })?;
        self.levels.bind(py).get_item(index)?.neg()
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        counts(self.flags.bind(py))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("TiltEstimate(angles of shape {})", self.angles.bind(py).getattr("shape")?))
    }
}

/// A tilt filter at work: samples or blocks go in as they come, the state stays.
///
/// Examples
/// --------
/// >>> import compfilt as cf
/// >>> stream = cf.TiltFilter(cf.FirstOrder(1.0)).stream(fs=100.0)
/// >>> stream.process([[0.0, 0.0, 0.0]], [[0.0, 0.0, 9.81]])
/// array([[0., 0.]])
#[pyclass(module = "compfilt._core")]
pub(crate) struct TiltStream {
    session: AnySession,
    handling: Handling,
    design: Design,
    made_by: Py<TiltFilter>,
    keywords: Py<PyDict>,
}

fn three<T: Scalar>(value: &Bound<'_, PyAny>, name: &'static str) -> PyResult<Vector3<T>> {
    let signal = Signal::new(value, name)?;
    if *signal.shape() != [3] {
        return Err(PyValueError::new_err(format!(
            "{name} must be three numbers, got the shape {:?}",
            signal.shape()
        )));
    }
    let array = signal.typed::<T>()?;
    let view = array.as_array();
    Ok(Vector3::new(view[0], view[1], view[2]))
}

fn update<'py, T: Scalar>(
    py: Python<'py>,
    session: &mut Session<T>,
    handling: Handling,
    gyr: &Bound<'py, PyAny>,
    acc: &Bound<'py, PyAny>,
    dt: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let dt = crate::session::step::<T>(session.fs, dt)?;
    let (gyr, acc) = (three::<T>(gyr, "gyr")?, three::<T>(acc, "acc")?);
    if handling.raise_missing && !gyr.iter().chain(acc.iter()).all(|x| x.is_finite()) {
        return Err(PyValueError::new_err(
            "gyr or acc is missing (NaN or infinite), and missing is \"raise\"",
        ));
    }
    let angles = session.runner.update(&gyr, &acc, dt);
    Ok(PyArray1::from_iter(py, angles.iter().copied()).into_any())
}

#[pymethods]
impl TiltStream {
    /// One sample: gyr in rad/s and acc in m/s^2, three numbers each; dt in seconds where the stream has no fs. Returns the
    /// two angles in rad.
    #[pyo3(signature = (gyr, acc, dt=None))]
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        dt: Option<f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let handling = self.handling;
        with_tilt!(&mut self.session, session => update(py, session, handling, gyr, acc, dt))
    }

    /// A block of samples, (n, 3) each; the state is carried on. Returns the angles, (n, 2).
    #[pyo3(signature = (gyr, acc, t=None))]
    fn process<'py>(
        &mut self,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let signals = Signals::new(gyr, acc, t)?;
        let handling = self.handling;
        let arrays = with_tilt!(&mut self.session, session => session.process(py, &signals, handling, false))?;
        Ok(arrays.angles)
    }

    /// A block of samples like ``process``, with all levels, flags and counts. Returns a :class:`TiltEstimate`.
    #[pyo3(signature = (gyr, acc, t=None))]
    fn estimate<'py>(
        &mut self,
        py: Python<'py>,
        gyr: &Bound<'py, PyAny>,
        acc: &Bound<'py, PyAny>,
        t: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<TiltEstimate> {
        let signals = Signals::new(gyr, acc, t)?;
        let handling = self.handling;
        let (arrays, state) = with_tilt!(&mut self.session, session => {
            (session.process(py, &signals, handling, true)?, session.state())
        });
        TiltEstimate::new(py, &self.design, arrays, state)
    }

    /// Forgets the state: waits for the first measurement, or starts from ``initial`` as in ``estimate``.
    #[pyo3(signature = (initial=None))]
    fn reset(&mut self, initial: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        with_tilt!(&mut self.session, session => session.start(initial))
    }

    /// The state between two samples; set it to continue from there.
    #[getter]
    fn state(&self) -> State {
        with_tilt!(&self.session, session => session.state())
    }

    #[setter]
    fn set_state(&mut self, state: &Bound<'_, State>) -> PyResult<()> {
        with_tilt!(&mut self.session, session => session.set_state(state.get()))
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(other) = other.cast::<Self>() else { return Ok(false) };
        let Ok(other) = other.try_borrow() else { return Ok(false) };
        Ok(self.made_by.get() == other.made_by.get()
            && self.keywords.bind(py).eq(other.keywords.bind(py))?
            && self.state() == other.state())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let restore = py.import("compfilt._core")?.getattr("_stream")?;
        let arguments = (&self.made_by, &self.keywords, self.state());
        Ok((restore, arguments).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!(
            "{}.stream(**{})",
            self.made_by.bind(py).repr()?,
            self.keywords.bind(py).repr()?
        ))
    }
}
