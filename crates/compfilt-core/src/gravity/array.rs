//! Gravity and the angular acceleration from several accelerometers on a body that turns about a fixed pivot.

use super::extraction::{Extraction, SensorWeights, centripetal};
use super::least_squares::{Channel, Information, Unknowns};
use crate::error::{BodyAxes, Failure, Quantity};
use crate::{Error, Real, Rule};
use nalgebra::{ComplexField, Matrix3, SMatrix, Vector3};

/// An accelerometer on the body: where it sits, how it is turned, which of its channels count and how noisy they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accelerometer {
    /// From the pivot in m, body axes.
    pub position: Vector3<f64>,
    /// From the body's axes to the sensor's: `f_sensor = S f_body`.
    pub rotation: Matrix3<f64>,
    /// Which channels are used, sensor axes.
    pub channels: [bool; 3],
    /// The standard deviation of each channel, sensor axes, in any one unit.
    pub noise: Vector3<f64>,
}

impl Accelerometer {
    /// Three channels along the body's axes, with a noise of 1 each.
    pub fn at(position: Vector3<f64>) -> Self {
        Self {
            position,
            rotation: Matrix3::identity(),
            channels: [true; 3],
            noise: Vector3::from_element(1.0),
        }
    }

    fn check(&self) -> Result<(), Error> {
        if !self.position.iter().all(ComplexField::is_finite) {
            return Err(Error::new("positions", Rule::Finite));
        }
        let rest = self.rotation * self.rotation.transpose() - Matrix3::identity();
        // Said so that NaN is refused as well.
        if !rest.iter().all(|part| part.abs() <= 1e-6) {
            return Err(Error::new("rotations", Rule::Orthogonal));
        }
        for (used, noise) in self.channels.iter().zip(self.noise.iter()) {
            if *used && !(*noise > 0.0 && noise.is_finite()) {
                return Err(Error::new("noise", Rule::Positive));
            }
        }
        Ok(())
    }

    /// The direction of a channel in body axes.
    fn direction(&self, axis: usize) -> Vector3<f64> {
        self.rotation.row(axis).transpose()
    }
}

/// Whether the body rate is known beside the accelerometers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// No: twelve unknowns.
    Unknown,
    /// Yes, from a gyro: six unknowns, and less noise. An error `δω` of it enters as about `2 ω r δω`.
    Known,
}

/// How gravity is told from the motion where the rate is unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Least squares in all twelve unknowns: any rotations.
    General,
    /// The four unknowns of each body axis by themselves, `Σ b r = 0`, `Σ b = 1` with the least `Σ b² σ²`: every channel
    /// must lie along an axis of the body.
    Aligned,
}

/// Accelerometers on a body that turns about a fixed pivot.
///
/// Sensor `i` at `r_i` reads `f_i = S_i (M r_i + s)` with `M = [ω̇]× + [ω]×²`. The specific force of gravity `s` at the pivot
/// and the angular acceleration `ω̇ = vee((M - Mᵀ)/2)` are linear in the readings; of all weights that are exact for every
/// motion, those with the least noise are taken (weighted least squares). With a known body rate `[ω]×² r_i` is subtracted and
/// only `ω̇` and `s` are unknown. Sources: the balancing cube's (1.9)-(1.27); S. Trimpe, R. D'Andrea, 2010.
///
/// `B` is an array of [`Accelerometer`]s, or anything that holds them.
///
/// ```
/// use compfilt_core::gravity::{Accelerometer, AccelerometerArray, Quantity, Rate};
/// use compfilt_core::nalgebra::Vector3;
/// let corners = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
/// let array = AccelerometerArray::new(corners.map(|r| Accelerometer::at(Vector3::from(r))))?;
/// let gravity = array.extraction(Quantity::Gravity, Rate::Unknown)?.cast::<f32>();
/// let s = gravity.step(&[Vector3::new(0.0, 0.0, 9.81_f32); 4], &Vector3::zeros());
/// assert!((s - Vector3::new(0.0, 0.0, 9.81)).norm() < 1e-5);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AccelerometerArray<B> {
    sensors: B,
    form: Form,
    /// The largest distance from the pivot: the unit of length of the unknowns.
    length: f64,
    /// The least noise of a channel in use: the unit of the noises.
    quietest: f64,
}

impl<B: AsRef<[Accelerometer]>> AccelerometerArray<B> {
    /// Takes the sensors; the aligned form where it applies.
    ///
    /// # Errors
    /// A position is not finite, a rotation not orthogonal, a noise not positive; fewer than three channels are used; gravity
    /// along an axis is not given even with a known body rate.
    pub fn new(sensors: B) -> Result<Self, Error> {
        let all = sensors.as_ref();
        all.iter().try_for_each(Accelerometer::check)?;
        if all.iter().flat_map(|sensor| sensor.channels).filter(|used| *used).count() < 3 {
            return Err(Error::new("channels", Rule::ThreeChannels));
        }
        let farthest = all.iter().map(|sensor| sensor.position.norm()).fold(0.0, f64::max);
        let length = if farthest > 0.0 { farthest } else { 1.0 };
        let array = Self { sensors, form: Form::General, length, quietest: 1.0 };
        let quietest =
            array.used().map(|(_, sensor, axis)| sensor.noise[axis]).fold(f64::INFINITY, f64::min);
        let array = Self { quietest, ..array };
        array.check(Quantity::Gravity, Rate::Known, [true; 3])?;
        let form = if array.is_aligned() { Form::Aligned } else { Form::General };
        Ok(Self { form, ..array })
    }

    /// The same array by another form.
    ///
    /// # Errors
    /// `Aligned` is asked for, but a channel does not lie along an axis of the body.
    pub fn with_form(self, form: Form) -> Result<Self, Error> {
        if form == Form::Aligned && !self.is_aligned() {
            return Err(Error::new("form", Rule::Aligned));
        }
        Ok(Self { form, ..self })
    }

    /// The form where the rate is unknown.
    pub fn form(&self) -> Form {
        self.form
    }

    /// The sensors.
    pub fn sensors(&self) -> &[Accelerometer] {
        self.sensors.as_ref()
    }

    /// The standard deviation of a quantity about or along each body axis, in units of the channels' noise; infinite where
    /// the geometry does not give it.
    pub fn noise_gain(&self, quantity: Quantity, rate: Rate) -> Vector3<f64> {
        Vector3::from([0, 1, 2].map(|row| self.noise(quantity, rate, row).unwrap_or(f64::INFINITY)))
    }

    /// How to compute the quantity, with `weights` as the place to put it; rows of axes that are not asked for stay zero.
    ///
    /// # Errors
    /// The geometry does not give the quantity along an axis of `axes`.
    pub fn extraction_in<W: AsRef<[SensorWeights<f64>]> + AsMut<[SensorWeights<f64>]>>(
        &self,
        quantity: Quantity,
        rate: Rate,
        axes: [bool; 3],
        matrices: &mut [Matrix3<f64>],
        mut weights: W,
    ) -> Result<Extraction<f64, W>, Error> {
        self.check(quantity, rate, axes)?;
        for (row, _) in axes.iter().enumerate().filter(|(_, asked)| **asked) {
            for (problem, wanted) in self.problems(quantity, rate, row) {
                if let Some(information) = Information::of(self.channels(problem)) {
                    information.weigh(&self.channels(problem), &wanted, matrices, row);
                }
            }
        }
        let mut sum = SMatrix::<f64, 3, 6>::zeros();
        for ((weights, sensor), matrix) in
            weights.as_mut().iter_mut().zip(self.sensors()).zip(matrices)
        {
            *weights = SensorWeights { matrix: *matrix, used: sensor.channels };
            sum += *matrix * sensor.rotation * centripetal(&sensor.position);
        }
        Ok(Extraction { weights, centripetal: (rate == Rate::Known).then_some(sum) })
    }

    fn is_aligned(&self) -> bool {
        self.used().all(|(_, sensor, axis)| {
            sensor.direction(axis).iter().filter(|part| part.abs() > 1e-12).count() == 1
        })
    }

    fn used(&self) -> impl Iterator<Item = (usize, &Accelerometer, usize)> + Clone {
        self.sensors().iter().enumerate().flat_map(|(index, sensor)| {
            let used = (0..3).filter(|axis| sensor.channels[*axis]);
            used.map(move |axis| (index, sensor, axis))
        })
    }

    /// Whether the geometry gives a quantity along all of `axes`; the error names those along which it does not.
    fn check(&self, quantity: Quantity, rate: Rate, axes: [bool; 3]) -> Result<(), Error> {
        let mut failed = [false; 3];
        let mut first = None;
        for (row, failed) in failed.iter_mut().enumerate().filter(|(row, _)| axes[*row]) {
            if let Err(failure) = self.noise(quantity, rate, row) {
                *failed = true;
                first = first.or(Some((row, failure)));
            }
        }
        let Some((row, failure)) = first else { return Ok(()) };
        let along = |sensor: &Accelerometer, channel| sensor.direction(channel)[row].abs();
        let seen = self.used().any(|(_, sensor, channel)| along(sensor, channel) > 1e-12);
        let failure = if quantity == Quantity::Gravity && !seen {
            Failure::Unseen
        } else if rate == Rate::Unknown && self.noise(quantity, Rate::Known, row).is_ok() {
            Failure::NeedsRate
        } else {
            failure
        };
        Err(Error::new("positions", Rule::Gives(quantity, BodyAxes(failed), failure)))
    }

    /// The noise of a quantity along one axis, or why the geometry does not give it.
    fn noise(&self, quantity: Quantity, rate: Rate, row: usize) -> Result<f64, Failure> {
        let mut variance = 0.0;
        for (problem, wanted) in self.problems(quantity, rate, row) {
            // The geometry alone must carry it, whatever the noises are.
            let equal = self.channels(problem).map(|channel| Channel { noise: 1.0, ..channel });
            Information::of(equal).ok_or(Failure::Unseen)?.check_condition(&wanted)?;
            let information = Information::of(self.channels(problem)).ok_or(Failure::Unseen)?;
            // Noises so different that the sums cannot hold them.
            let noise = information.noise(&wanted).map_err(|_| Failure::IllConditioned)?;
            variance += noise * noise;
        }
        Ok(variance.sqrt() * self.quietest)
    }

    /// The least-squares problems whose answers add up to a quantity.
    fn problems(
        &self,
        quantity: Quantity,
        rate: Rate,
        row: usize,
    ) -> impl Iterator<Item = (Problem, Unknowns)> {
        let (next, last) = ((row + 1) % 3, (row + 2) % 3);
        let unit = |index: usize, size: f64| {
            let mut wanted = Unknowns::zeros();
            wanted[index] = size;
            wanted
        };
        // ω̇_x = (M_zy - M_yz)/2 and so on round; lengths are in units of the largest.
        let half = 0.5 / self.length;
        let pair = match (rate, self.form, quantity) {
            (Rate::Known, _, Quantity::Gravity) => {
                [Some((Problem::Known, unit(3 + row, 1.0))), None]
            }
            (Rate::Known, _, Quantity::AngularAcceleration) => {
                [Some((Problem::Known, unit(row, 1.0 / self.length))), None]
            }
            (Rate::Unknown, Form::General, Quantity::Gravity) => {
                [Some((Problem::General, unit(9 + row, 1.0))), None]
            }
            (Rate::Unknown, Form::General, Quantity::AngularAcceleration) => {
                let wanted = unit(3 * last + next, half) - unit(3 * next + last, half);
                [Some((Problem::General, wanted)), None]
            }
            (Rate::Unknown, Form::Aligned, Quantity::Gravity) => {
                [Some((Problem::Axis(row), unit(3, 1.0))), None]
            }
            (Rate::Unknown, Form::Aligned, Quantity::AngularAcceleration) => [
                Some((Problem::Axis(last), unit(next, half))),
                Some((Problem::Axis(next), unit(last, -half))),
            ],
        };
        pair.into_iter().flatten()
    }

    /// The channels of a problem, with what they see of its unknowns.
    fn channels(&self, problem: Problem) -> impl Iterator<Item = Channel> + Clone {
        let (length, quietest) = (self.length, self.quietest);
        self.used().filter_map(move |(index, sensor, axis)| {
            let (r, d) = (sensor.position / length, sensor.direction(axis));
            let mut response = Unknowns::zeros();
            match problem {
                Problem::Known => {
                    response.fixed_rows_mut::<3>(0).copy_from(&r.cross(&d));
                    response.fixed_rows_mut::<3>(3).copy_from(&d);
                }
                Problem::General => {
                    for row in 0..3 {
                        response.fixed_rows_mut::<3>(3 * row).copy_from(&(r * d[row]));
                    }
                    response.fixed_rows_mut::<3>(9).copy_from(&d);
                }
                Problem::Axis(row) if d[row].abs() > 0.5 => {
                    response.fixed_rows_mut::<3>(0).copy_from(&(r * d[row]));
                    response[3] = d[row];
                }
                Problem::Axis(_) => return None,
            }
            Some(Channel { sensor: index, axis, response, noise: sensor.noise[axis] / quietest })
        })
    }
}

/// Which unknowns there are.
#[derive(Clone, Copy)]
enum Problem {
    /// `ω̇` and `s`.
    Known,
    /// `M` row by row and `s`.
    General,
    /// One row of `M` and of `s`.
    Axis(usize),
}

impl<const S: usize> AccelerometerArray<[Accelerometer; S]> {
    /// How to compute the quantity, in f64; [`cast`](Extraction::cast) rounds it to f32.
    ///
    /// # Errors
    /// The geometry does not give the quantity along one of the axes.
    pub fn extraction(
        &self,
        quantity: Quantity,
        rate: Rate,
    ) -> Result<Extraction<f64, [SensorWeights<f64>; S]>, Error> {
        self.extraction_of(quantity, rate, [true; 3])
    }

    /// The same for some of the axes; the others come out as zero.
    ///
    /// # Errors
    /// The geometry does not give the quantity along one of these axes.
    pub fn extraction_of(
        &self,
        quantity: Quantity,
        rate: Rate,
        axes: [bool; 3],
    ) -> Result<Extraction<f64, [SensorWeights<f64>; S]>, Error> {
        let mut matrices = [Matrix3::zeros(); S];
        self.extraction_in(quantity, rate, axes, &mut matrices, [SensorWeights::none(); S])
    }

    /// The sensors' rotations, rounded to the scalar type: for [`mean_rate`](super::mean_rate).
    pub fn rotations<T: Real>(&self) -> [Matrix3<T>; S] {
        self.sensors.map(|sensor| sensor.rotation.map(T::literal))
    }
}
