//! The balancing cube: angles and rates from six inertial sensors, as one pipeline.

use super::{
    Accelerometer, AccelerometerArray, Extraction, Quantity, Rate, SensorWeights, TiltFilter,
    TiltState, mean_rate,
};
use crate::linear::{Discretise, Flags};
use crate::{Error, Real};
use nalgebra::{Matrix3, Vector2, Vector3};

/// The state estimation of a cube that balances on a corner: body rate, wheel rate, and the angles φ2, φ3.
///
/// ```text
/// u_K = mean of S_iᵀ ω_i        u_R = u_K + ψ̇        s = Σ W_i f_i        (φ2, φ3) = tilt filter(u_K, s)
/// ```
///
/// `S` sensors, each a gyro and an accelerometer with the same axes; the tilt filter is made with
/// [`Axes::Cube`](super::Axes::Cube). Source: the balancing cube's §1.1-1.3.
///
/// ```
/// use compfilt_core::gravity::{Accelerometer, AccelerometerArray, Axes, Cube, Rate, TiltFilter, TiltState};
/// use compfilt_core::nalgebra::Vector3;
/// use compfilt_core::{Discretise, FirstOrder};
/// let corners = [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0], [0.0, 0.15, 0.0], [0.0, 0.0, 0.15]];
/// let array = AccelerometerArray::new(corners.map(|r| Accelerometer::at(Vector3::from(r))))?;
/// let cube = Cube::new(&array, Rate::Unknown, TiltFilter::new(FirstOrder::new(1.0_f32)?.chain(), Axes::Cube))?;
/// let gains = cube.tilt.design().at(0.001)?;
/// let mut state = TiltState::new();
/// let forces = [Vector3::new(-9.81, 0.0, 0.0); 4];
/// let sample = cube.update(&gains, &mut state, &[Vector3::zeros(); 4], &forces, &Vector3::zeros());
/// assert!(sample.angles.norm() < 1e-6);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cube<T, D, const S: usize> {
    /// The sensors' rotations.
    pub rotations: [Matrix3<T>; S],
    /// How gravity is computed from the accelerometers.
    pub gravity: Extraction<T, [SensorWeights<T>; S]>,
    /// The filter of both angles.
    pub tilt: TiltFilter<T, D>,
}

/// What a [`Cube`] knows after a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubeSample<T> {
    /// φ2 and φ3 in rad.
    pub angles: Vector2<T>,
    /// The body's rate `u_K` in rad/s.
    pub body_rate: Vector3<T>,
    /// The wheels' absolute rates `u_R` in rad/s.
    pub wheel_rate: Vector3<T>,
    /// The specific force of gravity at the pivot in m/s².
    pub gravity: Vector3<T>,
    /// What happened to the sample.
    pub flags: Flags,
}

impl<T: Real, D: Copy, const S: usize> Cube<T, D, S> {
    /// The pipeline for an array; with [`Rate::Known`] the gyros' mean goes into the extraction of gravity.
    ///
    /// # Errors
    /// The array does not give gravity in this form.
    pub fn new(
        array: &AccelerometerArray<[Accelerometer; S]>,
        rate: Rate,
        tilt: TiltFilter<T, D>,
    ) -> Result<Self, Error> {
        let gravity = array.extraction(Quantity::Gravity, rate)?.cast();
        Ok(Self { rotations: array.rotations(), gravity, tilt })
    }

    /// One sample with the `gains` of its time step: `gyros` in rad/s and `forces` in m/s², each in its sensor's axes;
    /// `wheels` in rad/s, the wheels' rates relative to the body.
    ///
    /// A gyro that is not finite is left out of the mean and flagged; a used accelerometer that is not finite makes gravity
    /// missing, and the angles coast.
    pub fn update<const N: usize>(
        &self,
        gains: &D::Gains,
        state: &mut TiltState<T, N>,
        gyros: &[Vector3<T>; S],
        forces: &[Vector3<T>; S],
        wheels: &Vector3<T>,
    ) -> CubeSample<T>
    where
        D: Discretise<T, N>,
    {
        let (body_rate, complete) = mean_rate(&self.rotations, gyros);
        let gravity = self.gravity.step(forces, &body_rate);
        let mut flags = self.tilt.update(gains, state, &body_rate, &gravity);
        if !complete {
            flags |= Flags::SENSOR_MISSING;
        }
        let angles = self.tilt.angles(state);
        CubeSample { angles, body_rate, wheel_rate: body_rate + wheels, gravity, flags }
    }
}
