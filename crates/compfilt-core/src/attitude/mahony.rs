//! Mahony's complementary filters on the rotation group: explicit, passive and direct.

use super::mahony_state::{Directions, MahonyState};
use super::rotation::{Rotation, horizontal};
use super::sensors::Sensors;
use super::vector::Vector;
use crate::error::positive;
use crate::linear::{Flags, Gains, Recurrence};
use crate::{Chain, Change, Error, FlagSet, Mask, Number, Real};
use nalgebra::Vector3;

/// How the measured directions become an innovation, and where the gyro turns the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
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
/// assert!((state.rotation.up() - Vector3::z()).norm() < 1e-6);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Mahony<T, const N: usize> {
    design: Chain<T, N, 1>,
    form: MahonyForm,
    bias_limit: T,
    sensors: Sensors<T>,
}

/// A direction that is measured in body axes and known in world axes. Lengths do not matter.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: nalgebra::Scalar + serde::Serialize",
        deserialize = "T: nalgebra::Scalar + serde::Deserialize<'de>"
    ))
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Observation<T> {
    /// Measured, body axes.
    pub body: Vector3<T>,
    /// Known, world axes.
    pub world: Vector3<T>,
    /// Its weight.
    pub weight: T,
}

impl<T: Real, const N: usize> Mahony<T, N> {
    /// The filter with the gains of a linear design: first order for the proportional form, PI or Butterworth for the one that
    /// estimates the gyro's bias.
    pub fn new(design: Chain<T, N, 1>, form: MahonyForm) -> Self {
        const { assert!(N <= 2, "Mahony's filters have an attitude and a bias") };
        Self {
            design,
            form,
            bias_limit: T::literal(0.1),
            sensors: Sensors::new(T::literal(f64::INFINITY)),
        }
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
}

impl<T: Number, const N: usize> Mahony<T, N> {
    /// The gains of recordings side by side: `dt` in seconds must be that of a [`Dt`](crate::Dt).
    #[inline(always)]
    pub fn over(&self, dt: T) -> Gains<T, N, 1> {
        self.design.over(dt)
    }

    /// One sample with the `gains` of its time step: `gyro` in rad/s, `specific_force` and `magnetic_field` of any length, body
    /// axes. What is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    #[inline(always)]
    pub fn update(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> T::Flags {
        let (dt, mut flags) = (gains.dt(), T::Flags::default());
        let rate = self.rate(state, gyro, dt, &mut flags);
        let measured = self.measured(state, specific_force, magnetic_field, &mut flags);
        let going = state.started;
        let begun = (!going.all()).then(|| state.begun(measured));
        self.predict(state, rate, dt, &measured);
        if measured.magnetometer && !state.heading_known.all() {
            *state = state.turned_north(measured.field, measured.has_field & !state.heading_known);
        }
        if (measured.has_up | measured.has_field).any() {
            let up = Vector(state.rotation.up());
            let innovation = self.innovation(&state.rotation, up, &measured, going, &mut flags);
            self.correct_both(gains, state, up, innovation, &measured);
        }
        if let Some(begun) = begun {
            *state = MahonyState::choose(going, *state, begun);
            flags.raise(Flags::NOT_STARTED, !state.started);
        }
        restart_if_lost(state, &mut flags);
        flags
    }

    /// The same for any number of observed directions, by the explicit form: `ω = Σ k_i v_i × v̂_i`. The state must have been
    /// started from an attitude; an observation without a direction is left out and flagged.
    pub fn update_with(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        gyro: &Vector3<T>,
        observations: &[Observation<T>],
    ) -> T::Flags {
        let (dt, mut flags) = (gains.dt(), T::Flags::default());
        let rate = self.rate(state, gyro, dt, &mut flags);
        let before = *state;
        let none = T::Mask::same(false);
        let (up, field) = (Vector::zero(), Vector::zero());
        let measured = Directions { up, has_up: none, field, has_field: none, magnetometer: false };
        self.predict(state, rate, dt, &measured);
        let (mut innovation, mut any) = (Vector::zero(), none);
        for Observation { body, world, weight } in observations {
            let (body, has_body) = Vector(*body).direction();
            let (world, has_world) = Vector(*world).direction();
            let there = has_body & has_world & weight.is_number();
            let turn = body.cross(&Vector(state.rotation.to_body(&world.0))) * *weight;
            innovation += Vector::choose(there, turn, Vector::zero());
            flags.raise(Flags::SENSOR_MISSING, before.started & !there);
            any = any | there;
        }
        let since = state.since_correction;
        self.correct(gains, state, innovation, since, any);
        state.since_correction = T::choose(any, T::literal(0.0), since);
        flags.raise(Flags::MEASUREMENT_MISSING, before.started & !any);
        flags.raise(Flags::NOT_STARTED, !before.started);
        let rate = state.rate;
        *state = MahonyState::choose(before.started, *state, MahonyState { rate, ..before });
        restart_if_lost(state, &mut flags);
        flags
    }

    /// The rate to turn with, not yet freed from the bias.
    #[inline(always)]
    fn rate(
        &self,
        state: &mut MahonyState<T>,
        gyro: &Vector3<T>,
        dt: T,
        flags: &mut T::Flags,
    ) -> Vector<T> {
        let taken = state.rate.take(gyro, dt, self.sensors.hold, flags);
        // A gyro that has been missing for long stands still, whatever its bias is.
        Vector::choose(taken.lost, Vector(state.bias), taken.value)
    }

    #[inline(always)]
    fn measured(
        &self,
        state: &MahonyState<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
        flags: &mut T::Flags,
    ) -> Directions<T> {
        let force = Vector(*specific_force);
        let (up, has_up) = force.direction();
        let has_up = has_up & force.is_within(self.sensors.force_range);
        flags.raise(Flags::MEASUREMENT_MISSING, !has_up);
        let mut measured = Directions {
            up,
            has_up,
            field: up,
            has_field: T::Mask::same(false),
            magnetometer: false,
        };
        if let Some(field) = magnetic_field {
            // A field along the vertical has no heading.
            let vertical = Vector::choose(has_up, up, Vector(state.rotation.up()));
            let (field, has_field) = Vector(*field).direction();
            let (_, is_level) = horizontal(field, vertical);
            let has_field = has_field & is_level;
            flags.raise(Flags::MAGNETOMETER_MISSING, !has_field);
            measured = Directions { field, has_field, magnetometer: true, ..measured };
        }
        measured
    }

    #[inline(always)]
    fn predict(
        &self,
        state: &mut MahonyState<T>,
        rate: Vector<T>,
        dt: T,
        measured: &Directions<T>,
    ) {
        let turn = (rate - Vector(state.bias)) * dt;
        let predicted = state.rotation.turned(&turn.0);
        if self.form == MahonyForm::Direct {
            // The measurement is of the new attitude: what it rebuilds starts from the predicted one.
            let has_field = measured.has_field & state.heading_known;
            let (attitude, there) = rebuilt(&predicted, &Directions { has_field, ..*measured });
            let turn = Rotation::of_turn(&attitude.to_world(&turn.0));
            let turned = turn.times(&state.rotation).renormalised();
            state.rotation = Rotation::choose(there, turned, predicted);
        } else {
            state.rotation = predicted;
        }
        state.age += dt;
        state.since_correction += dt;
        state.since_heading += dt;
    }

    #[inline(always)]
    fn innovation(
        &self,
        rotation: &Rotation<T>,
        up: Vector<T>,
        measured: &Directions<T>,
        going: T::Mask,
        flags: &mut T::Flags,
    ) -> Vector<T> {
        let is_opposite =
            |one: Vector<T>, other: &Vector<T>| one.dot(other).less(T::literal(-0.999_999));
        let mut opposite = measured.has_up & is_opposite(measured.up, &up);
        let mut innovation =
            Vector::choose(measured.has_up, measured.up.cross(&up), Vector::zero());
        if measured.magnetometer {
            let (north, is_level) = horizontal(measured.field, up);
            let has_north = measured.has_field & is_level;
            let estimated = rotation.north();
            opposite = opposite | has_north & is_opposite(north, &estimated);
            innovation += Vector::choose(has_north, north.cross(&estimated), Vector::zero());
        }
        flags.raise(Flags::AMBIGUOUS, going & opposite);
        if self.form != MahonyForm::Explicit {
            let (attitude, there) = rebuilt(rotation, measured);
            // vee(½(R̃ - R̃ᵀ)) is sin(angle) along the axis: 2 w v of the quaternion.
            let turn = rotation.inverse().times(&attitude);
            let v = Vector(turn.v);
            innovation = Vector::choose(there, (v + v) * turn.w, innovation);
        }
        innovation
    }

    /// About the vertical the magnetometer speaks, about the others gravity: each for the time since it last did.
    #[inline(always)]
    fn correct_both(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        up: Vector<T>,
        innovation: Vector<T>,
        measured: &Directions<T>,
    ) {
        let (since, zero) = (state.since_correction, T::literal(0.0));
        let yaw = up * up.dot(&innovation);
        self.correct(gains, state, innovation - yaw, since, measured.has_up);
        state.since_correction = T::choose(measured.has_up, zero, since);
        if measured.magnetometer {
            let since = state.since_heading;
            self.correct(gains, state, yaw, since, measured.has_field);
            state.since_heading = T::choose(measured.has_field, zero, since);
        }
    }

    /// Turns the attitude and moves the bias along an innovation that counts for the time `since`, where it is `there`.
    #[inline(always)]
    fn correct(
        &self,
        gains: &Gains<T, N, 1>,
        state: &mut MahonyState<T>,
        innovation: Vector<T>,
        since: T,
        there: T::Mask,
    ) {
        let dt = gains.dt();
        let mut correction = *gains.correction();
        let varies = since.less(dt) | dt.less(since);
        if varies.any() {
            let own = self.design.correction(since);
            for (gain, own) in correction.iter_mut().zip(own) {
                *gain = T::choose(varies, own, *gain);
            }
        }
        // The mean of all so far, until that is longer than the filter's own memory.
        let (mut attitude, age) = (correction[0], state.age + dt);
        let early = (attitude * age).less(since);
        if early.any() {
            attitude = T::choose(early, since / age, attitude);
        }
        let turned = state.rotation.turned(&(innovation * attitude).0);
        state.rotation = Rotation::choose(there, turned, state.rotation);
        if let Some(gain) = correction.get(1) {
            let bias = Vector(state.bias);
            let moved = self.limited(bias - innovation * *gain);
            state.bias = Vector::choose(there, moved, bias).0;
        }
    }

    /// The bias, no longer than it may be.
    #[inline(always)]
    fn limited(&self, bias: Vector<T>) -> Vector<T> {
        let square = bias.square();
        let long = (self.bias_limit * self.bias_limit).less(square);
        if !long.any() {
            return bias;
        }
        Vector::choose(long, bias * (self.bias_limit * square.reciprocal_root()), bias)
    }

    /// The same filter in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Mahony<U, N> {
        Mahony {
            design: self.design.each(change),
            form: self.form,
            bias_limit: change.number(self.bias_limit),
            sensors: self.sensors.each(change),
        }
    }
}

/// The attitude with the measured vertical and the heading of the field, or with the smallest turn from `rotation` where there
/// is no field; and where there is one.
#[inline(always)]
fn rebuilt<T: Number>(rotation: &Rotation<T>, measured: &Directions<T>) -> (Rotation<T>, T::Mask) {
    let (levelled, unique) = rotation.levelled(measured.up);
    if !measured.magnetometer {
        return (levelled, measured.has_up & unique);
    }
    let (north, is_level) = horizontal(measured.field, measured.up);
    let has_north = measured.has_field & is_level;
    let facing = Rotation::of_axes(north.cross(&measured.up), north, measured.up);
    let attitude = Rotation::choose(has_north, facing, levelled);
    (attitude, measured.has_up & (has_north | unique))
}

#[inline(always)]
fn restart_if_lost<T: Number>(state: &mut MahonyState<T>, flags: &mut T::Flags) {
    let lost = !state.is_finite();
    if lost.any() {
        state.restart(lost);
        flags.raise(Flags::RESTARTED, lost);
    }
}
