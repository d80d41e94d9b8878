//! Mahony's complementary filters on the rotation group: explicit, passive and direct.

use super::held_rate::HeldRate;
use super::rotation::{Rotation, direction, horizontal};
use super::sensors::Sensors;
use crate::error::positive;
use crate::linear::{Discretise, Flags, Gains, Recurrence};
use crate::{Chain, Dt, Error, Real};
use nalgebra::Vector3;

/// How the measured directions become an innovation, and where the gyro turns the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MahonyForm {
    /// `ω = Σ v_i × v̂_i`: straight from the directions.
    Explicit,
    /// `ω = vee(½(R̃ - R̃ᵀ))` with `R̃ = R̂ᵀ R_y` and an attitude `R_y` rebuilt from the directions.
    Passive,
    /// The passive form's innovation, but the gyro turns the estimate through the rebuilt attitude: `R_y (Ω - b̂)`.
    Direct,
}

/// Attitude from a gyro, gravity and a magnetometer: a first-order or PI filter on the rotation group.
///
/// ```text
/// q⁻ = q ⊗ exp(½ dt (Ω - b̂)),    q = q⁻ ⊗ exp(½ L_1 ω),    b̂ = b̂ - L_2 ω
/// ```
///
/// `L_1`, `L_2` are the linear filter's gains at the sample period, so that small errors obey it. The measured directions are up
/// (the specific force) and north (the horizontal part of the magnetic field). In the explicit form the field does not tilt the
/// estimate, but by way of the bias it can; in the others a wrong heading changes how fast tilt is corrected, and in the direct
/// form it also turns the gyro's rate. With gravity alone all three forms have the same innovation, and yaw is the gyro's. The
/// direct form turns the gyro's rate through the measurement as it is, unfiltered: with accelerations it is far worse than the
/// others. From every attitude the estimate converges, but for the unstable equilibria at a turn of exactly 180°, where the
/// innovation vanishes. Source: R. Mahony, T. Hamel, J.-M. Pflimlin, 2008.
///
/// ```
/// use compfilt_core::attitude::{Mahony, MahonyForm, MahonyState};
/// use compfilt_core::nalgebra::Vector3;
/// use compfilt_core::{Discretise, PiForm};
/// let filter = Mahony::new(PiForm::new(1.0_f32, 0.1)?.chain(), MahonyForm::Explicit);
/// let gains = filter.design().at(0.01)?;
/// let mut state = MahonyState::new();
/// filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81), None);
/// assert_eq!(state.rotation.up(), Vector3::z());
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mahony<T, const N: usize> {
    design: Chain<T, N, 1>,
    form: MahonyForm,
    bias_limit: T,
    sensors: Sensors<T>,
}

/// A direction that is measured in body axes and known in world axes. Lengths do not matter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation<T> {
    /// Measured, body axes.
    pub body: Vector3<T>,
    /// Known, world axes.
    pub world: Vector3<T>,
    /// Its weight.
    pub weight: T,
}

/// The state of a [`Mahony`] filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MahonyState<T> {
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// The gyro's bias in rad/s.
    pub bias: Vector3<T>,
    /// The last rate.
    pub rate: HeldRate<T>,
    /// Seconds since the start, which shorten the filter's memory at the beginning; infinite where the attitude was given.
    pub age: T,
    /// Seconds since the last correction of the tilt.
    pub since_correction: T,
    /// Seconds since the last correction of the heading.
    pub since_heading: T,
    /// Whether there is an attitude.
    pub started: bool,
    /// Whether a magnetometer has set the heading.
    pub heading_known: bool,
}

impl<T: Real> MahonyState<T> {
    /// Waits for the first measurement.
    pub fn new() -> Self {
        Self {
            rotation: Rotation::identity(),
            bias: Vector3::zeros(),
            rate: HeldRate::new(),
            age: T::zero(),
            since_correction: T::zero(),
            since_heading: T::zero(),
            started: false,
            heading_known: false,
        }
    }

    /// Starts from a known attitude.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let age = T::one() / T::zero();
        Self { rotation, age, started: true, heading_known: true, ..Self::new() }
    }
}

impl<T: Real> Default for MahonyState<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// The measured directions of a sample: unit vectors, body axes.
#[derive(Clone, Copy)]
struct Directions<T> {
    up: Option<Vector3<T>>,
    field: Option<Vector3<T>>,
}

impl<T: Real, const N: usize> Mahony<T, N> {
    /// The filter with the gains of a linear design: first order for the proportional form, PI or Butterworth for the one that
    /// estimates the gyro's bias.
    pub fn new(design: Chain<T, N, 1>, form: MahonyForm) -> Self {
        const { assert!(N <= 2, "Mahony's filters have an attitude and a bias") };
        Self { design, form, bias_limit: T::literal(0.1), sensors: Sensors::new() }
    }

    /// The length in rad/s that the bias may have at most; 0.1 where it is not set.
    ///
    /// # Errors
    /// `bias_limit` is not positive and finite.
    pub fn bias_limit(self, bias_limit: T) -> Result<Self, Error> {
        Ok(Self { bias_limit: positive("bias_limit", bias_limit)?, ..self })
    }

    /// How long in seconds a missing gyro sample is bridged by the last one; 0.1 where it is not set.
    ///
    /// # Errors
    /// `hold` is negative or not finite.
    pub fn hold(self, hold: T) -> Result<Self, Error> {
        Ok(Self { sensors: self.sensors.hold(hold)?, ..self })
    }

    /// The accelerometer's range in m/s²: a sample with a component at it or beyond it is clipped, and counts as missing.
    ///
    /// # Errors
    /// `force_range` is not positive and finite.
    pub fn force_range(self, force_range: T) -> Result<Self, Error> {
        Ok(Self { sensors: self.sensors.force_range(force_range)?, ..self })
    }

    /// The linear design.
    pub fn design(&self) -> &Chain<T, N, 1> {
        &self.design
    }

    /// One sample with the `gains` of its time step: `gyro` in rad/s, `specific_force` and `magnetic_field` of any length, body
    /// axes. What is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    pub fn update(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> Flags {
        let dt = gains.dt();
        let (rate, mut flags) = state.rate.take(gyro, dt, self.sensors.hold);
        // A gyro that has been missing for long stands still, whatever its bias is.
        let rate = if flags.contains(Flags::DERIVATIVE_MISSING) { state.bias } else { rate };
        let there = self.sensors.has_direction(specific_force);
        let up = direction(specific_force).filter(|_| there);
        if up.is_none() {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        // A field along the vertical has no heading.
        let vertical = up.unwrap_or(state.rotation.up());
        let field = magnetic_field
            .and_then(direction)
            .filter(|field| horizontal(field, &vertical).is_some());
        if magnetic_field.is_some() && field.is_none() {
            flags |= Flags::MAGNETOMETER_MISSING;
        }
        let measured = Directions { up, field };
        if !state.started {
            return flags | begin(state, measured);
        }
        let heading = measured.field.filter(|_| state.heading_known);
        self.predict(state, &rate, dt, Directions { field: heading, ..measured });
        if let Some(field) = field.filter(|_| !state.heading_known) {
            turn_to_north(state, &field);
        }
        let (innovation, more) = self.innovation(&state.rotation, measured);
        if let Some(innovation) = innovation {
            // About the vertical the magnetometer speaks, about the others gravity: each for the time since it last did.
            let up = state.rotation.up();
            let yaw = up * up.dot(&innovation);
            if measured.up.is_some() {
                let since = core::mem::replace(&mut state.since_correction, T::zero());
                self.correct(gains, state, &(innovation - yaw), since);
            }
            if field.is_some() {
                let since = core::mem::replace(&mut state.since_heading, T::zero());
                self.correct(gains, state, &yaw, since);
            }
        }
        flags | more | restart_if_lost(state)
    }

    /// The same for any number of observed directions, by the explicit form: `ω = Σ k_i v_i × v̂_i`. The state must have been
    /// started from an attitude; an observation without a direction is left out and flagged.
    pub fn update_with(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        gyro: &Vector3<T>,
        observations: &[Observation<T>],
    ) -> Flags {
        let dt = gains.dt();
        let (rate, mut flags) = state.rate.take(gyro, dt, self.sensors.hold);
        // A gyro that has been missing for long stands still, whatever its bias is.
        let rate = if flags.contains(Flags::DERIVATIVE_MISSING) { state.bias } else { rate };
        if !state.started {
            return flags | Flags::NOT_STARTED;
        }
        self.predict(state, &rate, dt, Directions { up: None, field: None });
        let (mut innovation, mut any) = (Vector3::zeros(), false);
        for Observation { body, world, weight } in observations {
            if let (Some(body), Some(world), true) =
                (direction(body), direction(world), weight.is_finite())
            {
                innovation += body.cross(&state.rotation.to_body(&world)) * *weight;
                any = true;
            } else {
                flags |= Flags::SENSOR_MISSING;
            }
        }
        if any {
            let since = core::mem::replace(&mut state.since_correction, T::zero());
            self.correct(gains, state, &innovation, since);
        } else {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        flags | restart_if_lost(state)
    }

    fn predict(
        &self,
        state: &mut MahonyState<T>,
        rate: &Vector3<T>,
        dt: T,
        measured: Directions<T>,
    ) {
        let turn = (rate - state.bias) * dt;
        let predicted = state.rotation.turned(&turn);
        // The measurement is of the new attitude: what it rebuilds starts from the predicted one.
        state.rotation = match rebuilt(&predicted, measured) {
            Some(attitude) if self.form == MahonyForm::Direct => {
                Rotation::of_turn(&attitude.to_world(&turn)).times(&state.rotation).renormalised()
            }
            _ => predicted,
        };
        state.age += dt;
        state.since_correction += dt;
        state.since_heading += dt;
    }

    fn innovation(
        &self,
        rotation: &Rotation<T>,
        measured: Directions<T>,
    ) -> (Option<Vector3<T>>, Flags) {
        let up = rotation.up();
        let north = measured.field.and_then(|field| horizontal(&field, &up));
        let estimated = rotation.to_body(&Vector3::y());
        let is_opposite = |measured: Option<Vector3<T>>, estimated: &Vector3<T>| {
            measured.is_some_and(|measured| measured.dot(estimated) < T::literal(-0.999_999))
        };
        let opposite = is_opposite(measured.up, &up) || is_opposite(north, &estimated);
        let flags = if opposite { Flags::AMBIGUOUS } else { Flags::default() };
        if self.form != MahonyForm::Explicit
            && let Some(attitude) = rebuilt(rotation, measured)
        {
            // vee(½(R̃ - R̃ᵀ)) is sin(angle) along the axis: 2 w v of the quaternion.
            let turn = rotation.inverse().times(&attitude);
            return (Some((turn.v + turn.v) * turn.w), flags);
        }
        let tilt = measured.up.map(|measured| measured.cross(&up));
        let yaw = north.map(|north| north.cross(&estimated));
        let innovation = match (tilt, yaw) {
            (Some(tilt), Some(yaw)) => Some(tilt + yaw),
            (tilt, yaw) => tilt.or(yaw),
        };
        (innovation, flags)
    }

    /// Turns the attitude and moves the bias along an innovation that counts for the time `since`.
    fn correct(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        innovation: &Vector3<T>,
        since: T,
    ) {
        let mut correction = *gains.correction();
        if since != gains.dt()
            && let Ok(since) = Dt::new(since)
        {
            correction = *self.design.gains(since).correction();
        }
        // The mean of all so far, until that is longer than the filter's own memory.
        let mean = since / (state.age + gains.dt());
        let mut correction = correction.iter();
        if let Some(attitude) = correction.next() {
            let attitude = if mean > *attitude { mean } else { *attitude };
            state.rotation = state.rotation.turned(&(innovation * attitude));
        }
        if let Some(bias) = correction.next() {
            state.bias -= innovation * *bias;
            let size = state.bias.norm_squared().sqrt();
            if size > self.bias_limit {
                state.bias *= self.bias_limit / size;
            }
        }
    }
}

/// The attitude with the vertical `up` and the heading of the field, or with the smallest turn from `rotation` where there is
/// no field.
fn rebuilt<T: Real>(rotation: &Rotation<T>, measured: Directions<T>) -> Option<Rotation<T>> {
    let up = measured.up?;
    if let Some(north) = measured.field.and_then(|field| horizontal(&field, &up)) {
        return Some(Rotation::from_axes(&north.cross(&up), &north, &up));
    }
    rotation.levelled(&up)
}

fn begin<T: Real>(state: &mut MahonyState<T>, measured: Directions<T>) -> Flags {
    let Some(up) = measured.up else { return Flags::NOT_STARTED };
    state.rotation = Rotation::from_up(&up);
    state.started = true;
    if let Some(field) = measured.field {
        turn_to_north(state, &field);
    }
    Flags::default()
}

/// Turns about the vertical until the field's horizontal part points north.
fn turn_to_north<T: Real>(state: &mut MahonyState<T>, field: &Vector3<T>) {
    let up = state.rotation.up();
    if let Some(north) = horizontal(field, &up) {
        state.rotation = Rotation::from_axes(&north.cross(&up), &north, &up);
        state.heading_known = true;
    }
}

fn restart_if_lost<T: Real>(state: &mut MahonyState<T>) -> Flags {
    let finite =
        state.rotation.is_finite() && state.bias.iter().all(nalgebra::ComplexField::is_finite);
    if finite {
        return Flags::default();
    }
    *state = MahonyState::new();
    Flags::RESTARTED
}
