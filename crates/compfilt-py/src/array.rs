//! The accelerometer array as a Python class.

use crate::array_input::{channels_of, matrices_of, noise_of, positions_of, readings};
use crate::arrays::{Precision, Scalar, Signal, check_vectors};
use crate::errors::value_error;
use crate::options::choice;
use crate::tilt::vector;
use compfilt_core::gravity::{
    Accelerometer, AccelerometerArray as Array, Extraction, Form, Quantity, Rate, SensorWeights,
    mean_rate,
};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use compfilt_core::{Error, Number};
use numpy::ndarray::{Array2, Array3, ArrayView2, ArrayView3, ArrayViewMut2, Axis};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

type Sensors<T> = Extraction<T, Vec<SensorWeights<T>>>;

/// An extraction in both scalar types, or why there is none.
type InBoth = Result<(Sensors<f32>, Sensors<f64>), Error>;

const ALL: [bool; 3] = [true; 3];

/// Gravity and the angular acceleration from accelerometers on a body that turns about a fixed pivot.
///
///     f_i = S_i (M r_i + s),    M = [w']x + [w]x^2
///
/// with the unknown angular acceleration w' and rate w, and the specific force of gravity s at the pivot. Of all weights that
/// are exact for every motion those with the least noise are taken (weighted least squares). Where a gyro's rate is given,
/// [w]x^2 r is subtracted and only w' and s are unknown: less noise, and three sensors that are not in line suffice, but an
/// error dw of the rate enters as about 2 w r dw. Sources: the balancing cube's (1.9)-(1.27); S. Trimpe, R. D'Andrea, 2010.
///
/// Parameters
/// ----------
/// positions : array_like, shape (s, 3)
///     From the pivot to each sensor in m, body axes.
/// rotations : array_like, shape (s, 3, 3), optional
///     From body to sensor axes, f_sensor = S f_body: orthogonal to within 1e-6. Body axes where it is left out.
/// channels : array_like of bool, shape (s, 3), optional
///     Which channels are used, sensor axes. All where it is left out; what the others read does not matter.
/// noise : float or array_like, shape (s,) or (s, 3), optional
///     Standard deviation of the channels, any one unit; 1 where it is left out.
/// form : {"aligned", "general"}, optional
///     How gravity is found where the rate is unknown: "aligned" solves each body axis by itself and needs channels that lie
///     along the body's axes, "general" solves all twelve unknowns. The same result; aligned where it applies.
///
/// Raises
/// ------
/// ValueError
///     A position is not finite, a rotation not orthogonal, a noise not positive, fewer than three channels are used; or
///     gravity along an axis is not given, or only with a condition above 1e6, even where the rate is known. If only the known
///     rate solves it, the array is built, and ``gravity`` without a rate raises.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import compfilt as cf
/// >>> array = cf.AccelerometerArray([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
/// >>> array.gravity(np.full((1, 4, 3), [0.0, 0.0, 9.81])).round(6) + 0.0
/// array([[0.  , 0.  , 9.81]])
/// >>> array.noise_gain
/// array([1., 1., 1.])
#[pyclass(frozen, eq, module = "compfilt._core")]
pub(crate) struct AccelerometerArray {
    array: Array<Vec<Accelerometer>>,
    gravity: InBoth,
    gravity_with_rate: InBoth,
}

impl PartialEq for AccelerometerArray {
    fn eq(&self, other: &Self) -> bool {
        self.array == other.array
    }
}

/// A scalar type that an extraction is kept in.
trait Kept: Scalar {
    fn of(both: &(Sensors<f32>, Sensors<f64>)) -> &Sensors<Self>;
}

impl Kept for f32 {
    fn of(both: &(Sensors<f32>, Sensors<f64>)) -> &Sensors<Self> {
        &both.0
    }
}

impl Kept for f64 {
    fn of(both: &(Sensors<f32>, Sensors<f64>)) -> &Sensors<Self> {
        &both.1
    }
}

fn extraction(
    array: &Array<Vec<Accelerometer>>,
    quantity: Quantity,
    rate: Rate,
    axes: [bool; 3],
) -> InBoth {
    let count = array.sensors().len();
    let mut matrices = vec![Matrix3::zeros(); count];
    let weights = vec![SensorWeights::none(); count];
    let double = array.extraction_in(quantity, rate, axes, &mut matrices, weights)?;
    let single = Extraction {
        weights: double.weights.iter().map(SensorWeights::cast).collect(),
        centripetal: double.centripetal.map(|centripetal| centripetal.map(f32::literal)),
    };
    Ok((single, double))
}

/// The loop: every row through the core's step.
fn run<T: Scalar>(
    sensors: &Sensors<T>,
    acc: ArrayView3<'_, T>,
    gyr: Option<ArrayView2<'_, T>>,
    columns: &[usize],
    mut out: ArrayViewMut2<'_, T>,
) {
    let mut forces = vec![Vector3::zeros(); sensors.weights.len()];
    let mut rate = Vector3::zeros();
    for (row, acc) in acc.outer_iter().enumerate() {
        for (force, reading) in forces.iter_mut().zip(acc.outer_iter()) {
            *force = vector(reading);
        }
        if let Some(gyr) = gyr {
            rate = vector(gyr.row(row));
        }
        let result = sensors.step(&forces, &rate);
        for (place, column) in columns.iter().enumerate() {
            out[(row, place)] = result[*column];
        }
    }
}

fn gain(py: Python<'_>, values: Vector3<f64>) -> Bound<'_, PyArray1<f64>> {
    PyArray1::from_iter(py, values.iter().copied())
}

fn extract<'py, T: Kept>(
    py: Python<'py>,
    both: &InBoth,
    acc: &Signal<'py>,
    gyr: Option<&Signal<'py>>,
    columns: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let sensors = T::of(both.as_ref().map_err(|error| value_error(*error))?);
    let acc = acc.typed::<T>()?;
    let acc = readings(&acc)?;
    let gyr = gyr.map(Signal::typed::<T>).transpose()?;
    let gyr = gyr.as_ref().map(crate::arrays::columns).transpose()?;
    let out = PyArray2::<T>::zeros(py, [acc.len_of(Axis(0)), columns.len()], false);
    {
        let mut out = out.readwrite();
        let out = out.as_array_mut();
        py.detach(|| run(sensors, acc, gyr, columns, out));
    }
    Ok(out.into_any())
}

impl AccelerometerArray {
    /// Checks the signals and extracts in their precision.
    fn signals<'py>(
        &self,
        acc: &Bound<'py, PyAny>,
        gyr: Option<&Bound<'py, PyAny>>,
        columns: &[usize],
        extraction: impl FnOnce(Rate) -> InBoth,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = acc.py();
        let acc = self.sensor_signal(acc, "acc")?;
        let gyr = gyr.map(|gyr| Signal::new(gyr, "gyr")).transpose()?;
        let mut precision = acc.precision;
        if let Some(gyr) = &gyr {
            let (samples, rates) = (acc.shape()[0], check_vectors(gyr)?);
            if samples != rates {
                return Err(PyValueError::new_err(format!(
                    "acc and gyr must have the same number of samples, got {samples} and {rates}"
                )));
            }
            precision = precision.with(gyr.precision);
        }
        let both = extraction(if gyr.is_some() { Rate::Known } else { Rate::Unknown });
        match precision {
            Precision::Single => extract::<f32>(py, &both, &acc, gyr.as_ref(), columns),
            Precision::Double => extract::<f64>(py, &both, &acc, gyr.as_ref(), columns),
        }
    }

    /// A signal with three values for each sensor.
    fn sensor_signal<'py>(
        &self,
        object: &Bound<'py, PyAny>,
        name: &'static str,
    ) -> PyResult<Signal<'py>> {
        let signal = Signal::new(object, name)?;
        let sensors = self.array.sensors().len();
        match *signal.shape() {
            [_, count, 3] if count == sensors => Ok(signal),
            ref shape => Err(PyValueError::new_err(format!(
                "{name} must have the shape (samples, {sensors}, 3), a row of sensor axes for each sensor, got {shape:?}"
            ))),
        }
    }

    fn mean<'py, T: Scalar>(
        &self,
        py: Python<'py>,
        gyr: &Signal<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rotations: Vec<Matrix3<T>> =
            self.array.sensors().iter().map(|sensor| sensor.rotation.map(T::literal)).collect();
        let gyr = gyr.typed::<T>()?;
        let gyr = readings(&gyr)?;
        let out = PyArray2::<T>::zeros(py, [gyr.len_of(Axis(0)), 3], false);
        let mut rates = vec![Vector3::zeros(); rotations.len()];
        for (reading, mut out) in gyr.outer_iter().zip(out.readwrite().as_array_mut().rows_mut()) {
            for (rate, reading) in rates.iter_mut().zip(reading.outer_iter()) {
                *rate = vector(reading);
            }
            let (mean, _) = mean_rate(&rotations, &rates);
            out.iter_mut().zip(mean.iter()).for_each(|(out, value)| *out = *value);
        }
        Ok(out.into_any())
    }
}

#[pymethods]
impl AccelerometerArray {
    #[new]
    #[pyo3(signature = (positions, rotations=None, channels=None, noise=None, *, form=None))]
    fn new(
        positions: &Bound<'_, PyAny>,
        rotations: Option<&Bound<'_, PyAny>>,
        channels: Option<&Bound<'_, PyAny>>,
        noise: Option<&Bound<'_, PyAny>>,
        form: Option<&str>,
    ) -> PyResult<Self> {
        let mut sensors: Vec<_> =
            positions_of(positions)?.into_iter().map(Accelerometer::at).collect();
        if let Some(rotations) = rotations {
            let matrices = matrices_of(rotations, sensors.len())?;
            sensors.iter_mut().zip(matrices).for_each(|(sensor, s)| sensor.rotation = s);
        }
        if let Some(channels) = channels {
            let used = channels_of(channels, sensors.len())?;
            sensors.iter_mut().zip(used).for_each(|(sensor, used)| sensor.channels = used);
        }
        if let Some(noise) = noise {
            let deviations = noise_of(noise, sensors.len())?;
            sensors.iter_mut().zip(deviations).for_each(|(sensor, noise)| sensor.noise = noise);
        }
        for sensor in &mut sensors {
            // What is not used has no noise to compare.
            for axis in (0..3).filter(|axis| !sensor.channels[*axis]) {
                sensor.noise[axis] = 1.0;
            }
        }
        let mut array = Array::new(sensors).map_err(value_error)?;
        if let Some(form) = form {
            let forms = [("aligned", Form::Aligned), ("general", Form::General)];
            array = array.with_form(choice("form", form, &forms)?).map_err(value_error)?;
        }
        let gravity = extraction(&array, Quantity::Gravity, Rate::Unknown, ALL);
        let gravity_with_rate = extraction(&array, Quantity::Gravity, Rate::Known, ALL);
        Ok(Self { array, gravity, gravity_with_rate })
    }

    /// The specific force of gravity at the pivot, body axes: +9.81 along up at rest.
    ///
    /// Parameters
    /// ----------
    /// acc : array_like, shape (n, s, 3)
    ///     Every sensor's reading in m/s^2, in its own axes. NaN in a channel in use makes the row NaN.
    /// gyr : array_like, shape (n, 3), optional
    ///     The body's rate in rad/s, body axes, where it is known.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, 3)
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The shapes do not fit, or this geometry needs gyr: the message names the axis.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> array = cf.AccelerometerArray([[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    /// >>> array.gravity(np.full((1, 3, 3), [0.0, 0.0, 9.81]), np.zeros((1, 3))).round(6) + 0.0
    /// array([[0.  , 0.  , 9.81]])
    #[pyo3(signature = (acc, gyr=None))]
    fn gravity<'py>(
        &self,
        acc: &Bound<'py, PyAny>,
        gyr: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.signals(acc, gyr, &[0, 1, 2], |rate| match rate {
            Rate::Unknown => self.gravity.clone(),
            Rate::Known => self.gravity_with_rate.clone(),
        })
    }

    /// The angular acceleration, body axes.
    ///
    /// Parameters
    /// ----------
    /// acc, gyr
    ///     As in ``gravity``.
    /// axes : str
    ///     Which axes, in this order: "xyz", or fewer where the geometry does not give all.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, len(axes))
    ///     In rad/s^2.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The shapes do not fit, or the geometry does not give an axis that is asked for.
    ///
    /// Examples
    /// --------
    /// >>> import numpy as np
    /// >>> import compfilt as cf
    /// >>> beam = cf.AccelerometerArray([[0.1, 0, 0], [0.2, 0, 0]])
    /// >>> acc = [[[0.0, 0.3, 9.81], [0.0, 0.6, 9.81]]]
    /// >>> beam.angular_acceleration(acc, np.zeros((1, 3)), axes="z").round(6)
    /// array([[3.]])
    #[pyo3(signature = (acc, gyr=None, *, axes="xyz"))]
    fn angular_acceleration<'py>(
        &self,
        acc: &Bound<'py, PyAny>,
        gyr: Option<&Bound<'py, PyAny>>,
        axes: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns: Vec<usize> = axes.chars().filter_map(|axis| "xyz".find(axis)).collect();
        let asked = [0, 1, 2].map(|axis| columns.contains(&axis));
        let distinct = asked.iter().filter(|asked| **asked).count();
        if columns.is_empty() || axes.chars().count() != distinct {
            return Err(PyValueError::new_err(format!(
                "axes must name some of x, y and z, each once, got \"{axes}\""
            )));
        }
        self.signals(acc, gyr, &columns, |rate| {
            extraction(&self.array, Quantity::AngularAcceleration, rate, asked)
        })
    }

    /// One body rate from a gyro at every sensor: the mean of S^T w_sensor.
    ///
    /// Parameters
    /// ----------
    /// gyr : array_like, shape (n, s, 3)
    ///     Every gyro's reading in rad/s, in its sensor's axes. One with NaN or infinity is left out of the mean.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n, 3)
    ///     In rad/s, body axes; NaN where no gyro is left.
    ///
    /// Examples
    /// --------
    /// >>> import compfilt as cf
    /// >>> array = cf.AccelerometerArray([[0, 0, 0], [0.1, 0, 0]])
    /// >>> array.body_rate([[[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]])
    /// array([[2., 0., 0.]])
    fn body_rate<'py>(&self, gyr: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = gyr.py();
        let gyr = self.sensor_signal(gyr, "gyr")?;
        match gyr.precision {
            Precision::Single => self.mean::<f32>(py, &gyr),
            Precision::Double => self.mean::<f64>(py, &gyr),
        }
    }

    /// The standard deviation of gravity along each axis, in units of the channels' noise, where the rate is unknown; infinite
    /// along an axis that is not given.
    #[getter]
    fn noise_gain<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        gain(py, self.array.noise_gain(Quantity::Gravity, Rate::Unknown))
    }

    /// The same where the rate is known exactly.
    #[getter]
    fn noise_gain_with_gyro<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        gain(py, self.array.noise_gain(Quantity::Gravity, Rate::Known))
    }

    /// The standard deviation of the angular acceleration about each axis in 1/m times the channels' noise, where the rate is
    /// unknown; infinite about an axis that is not given.
    #[getter]
    fn angular_acceleration_noise_gain<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        gain(py, self.array.noise_gain(Quantity::AngularAcceleration, Rate::Unknown))
    }

    /// The same where the rate is known exactly.
    #[getter]
    fn angular_acceleration_noise_gain_with_gyro<'py>(
        &self,
        py: Python<'py>,
    ) -> Bound<'py, PyArray1<f64>> {
        gain(py, self.array.noise_gain(Quantity::AngularAcceleration, Rate::Known))
    }

    /// From the pivot to each sensor in m, body axes, (s, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let sensors = self.array.sensors();
        let values = Array2::from_shape_fn((sensors.len(), 3), |(i, j)| sensors[i].position[j]);
        PyArray2::from_owned_array(py, values)
    }

    /// From body to sensor axes, (s, 3, 3).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray3<f64>> {
        let sensors = self.array.sensors();
        let values =
            Array3::from_shape_fn((sensors.len(), 3, 3), |(i, j, k)| sensors[i].rotation[(j, k)]);
        PyArray3::from_owned_array(py, values)
    }

    /// Which channels are used, sensor axes, (s, 3).
    #[getter]
    fn channels<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<bool>> {
        let sensors = self.array.sensors();
        let values = Array2::from_shape_fn((sensors.len(), 3), |(i, j)| sensors[i].channels[j]);
        PyArray2::from_owned_array(py, values)
    }

    /// The channels' standard deviations, sensor axes, (s, 3).
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let sensors = self.array.sensors();
        let values = Array2::from_shape_fn((sensors.len(), 3), |(i, j)| sensors[i].noise[j]);
        PyArray2::from_owned_array(py, values)
    }

    /// "aligned" or "general".
    #[getter]
    fn form(&self) -> &'static str {
        match self.array.form() {
            Form::Aligned => "aligned",
            Form::General => "general",
        }
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        format!("{:?}", self.array).hash(&mut hasher);
        hasher.finish()
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let keywords = PyDict::new(py);
        keywords.set_item("form", self.form())?;
        let arguments = (self.positions(py), self.rotations(py), self.channels(py), self.noise(py));
        Ok((arguments, keywords).into_pyobject(py)?.into_any())
    }

    fn __repr__(&self) -> String {
        let sensors = self.array.sensors();
        let channels = sensors.iter().flat_map(|sensor| sensor.channels).filter(|used| *used);
        format!(
            "AccelerometerArray({} sensors, {} channels, form='{}')",
            sensors.len(),
            channels.count(),
            self.form()
        )
    }
}
