//! A gravity filter that learns the gyro's bias and sensitivity, and the delay between the sensors, from the motion.

use super::calibration_block::Block;
use super::calibration_state::{PARAMETERS, SelfCalibrationState, matrix_each};
use super::heading::HeadingRule;
use super::rest::RestRule;
use super::rotation::Rotation;
use super::sensors::{STRONGEST, Sensors, sensor_settings};
use super::strapdown::Strapdown;
use super::vector::Vector;
use crate::error::positive;
use crate::linear::{Flags, each};
use crate::{Change, Dt, Error, FlagSet, Mask, Number, Real};
use nalgebra::{Matrix3, Vector3};

/// The gravity filter with integral action on the gyro's bias, on a matrix of sensitivity errors, and on the delay.
///
/// ```text
/// ω_c = ω - b - M ω       turns body and estimate every sample
/// v += T_b (f̄ - m),   m += ω0² T_b v,   v -= 2ζω0T_b/(1 + 2ζω0T_b) v       every block of T_b seconds, in the gyro's frame
/// ```
///
/// `f̄` is the block's mean force and `m` the low-passed one: the second-order filter in velocity form. The sensitivities of
/// `m` and `v` to the thirteen parameters go through the same recurrence, and each parameter moves along its own by the
/// information about it so far; a prior holds those that the motion does not show. At rest the bias follows the gyro. `b` and
/// the symmetric part of `M` converge, the latter in minutes and held back by the prior; its skew part, a misalignment of gyro
/// and accelerometer, hardly does.
///
/// ```
/// use compfilt_core::Dt;
/// use compfilt_core::attitude::{SelfCalibratingFilter, SelfCalibrationState};
/// use compfilt_core::nalgebra::Vector3;
/// let filter = SelfCalibratingFilter::<f32>::new(5.0, 0.5)?;
/// let mut state = SelfCalibrationState::new();
/// filter.update(Dt::new(0.01)?, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81), None);
/// assert_eq!(state.up(), Some(Vector3::z()));
/// # Ok::<(), compfilt_core::Error>(())
/// ```
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
#[repr(C)]
pub struct SelfCalibratingFilter<T> {
    omega0: T,
    zeta: T,
    rest: RestRule<T>,
    heading: HeadingRule<T>,
    sensors: Sensors<T>,
    block: T,
    /// Prior standard deviations of the bias in rad/s, of the matrix, and of the delay in s.
    prior: [T; 3],
    /// What matrix and delay may be at most; the bias has the rest's limit.
    limits: [T; 2],
    /// How fast knowledge of the bias gets old, in rad/s per √s.
    bias_walk: T,
    /// The variance density that the velocity's innovations are taken to have.
    noise: T,
    /// Seconds after the start from which on parameters are learnt.
    learn_after: T,
    /// The sensitivity errors that are known before.
    known: Matrix3<T>,
}

impl<T: Real> SelfCalibratingFilter<T> {
    /// The filter with the time constant `tau` in seconds, `omega0 = √2/tau`, and the damping ratio `zeta`.
    ///
    /// # Errors
    /// `tau` or `zeta` is not positive and finite.
    pub fn new(tau: T, zeta: T) -> Result<Self, Error> {
        let t = T::literal;
        let degree = T::pi() / t(180.0);
        Ok(Self {
            omega0: positive("tau", t(2.0).sqrt() / positive("tau", tau)?)?,
            zeta: positive("zeta", zeta)?,
            rest: RestRule::default(),
            heading: HeadingRule::default(),
            sensors: Sensors::new(t(STRONGEST)),
            block: t(0.1),
            prior: [degree, t(0.006), t(0.010)],
            limits: [t(0.05), t(0.020)],
            bias_walk: t(0.01) * degree,
            noise: T::one(),
            learn_after: t(3.0),
            known: Matrix3::zeros(),
        })
    }

    sensor_settings!();

    /// The prior standard deviations: of the bias in rad/s, of the elements of the matrix, and of the delay in s.
    ///
    /// # Errors
    /// One of them is not positive and finite.
    pub fn prior(self, bias: T, matrix: T, delay: T) -> Result<Self, Error> {
        let bias = positive("bias_prior", bias)?;
        let prior = [bias, positive("matrix_prior", matrix)?, positive("delay_prior", delay)?];
        Ok(Self { prior, ..self })
    }

    /// Sensitivity errors that are known before: the prior's centre.
    #[must_use]
    pub fn calibrated(self, known: Matrix3<T>) -> Self {
        Self { known, ..self }
    }

    /// The sensitivity errors `M`: the gyro reads `M ω` too much.
    pub fn matrix(&self, state: &SelfCalibrationState<T>) -> Matrix3<T> {
        self.known + state.matrix
    }

    /// A strapdown with what was learnt, for the [`Smoother`](super::Smoother).
    pub fn strapdown(&self, state: &SelfCalibrationState<T>) -> Strapdown<T> {
        let delay = self.total_delay(state);
        Strapdown::new(
            state.rest.bias,
            self.matrix(state),
            Sensors { delay, ..self.sensors },
            self.block,
        )
    }

    /// The attitude, from body to world, and the world's up in body axes, both turned ahead; `None` before the start.
    pub fn attitude(&self, state: &SelfCalibrationState<T>) -> Option<(Rotation<T>, Vector3<T>)> {
        state.started.then(|| self.ahead(state))
    }

    /// One sample after the time `dt`: `gyro` in rad/s, `specific_force` in m/s², `magnetic_field` of any length, body axes. What
    /// is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    pub fn update(
        &self,
        dt: Dt<T>,
        state: &mut SelfCalibrationState<T>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> Flags {
        self.step(dt.seconds(), state, gyro, specific_force, magnetic_field)
    }
}

impl<T: Number> SelfCalibratingFilter<T> {
    /// How far in s the force is moved ahead by now.
    #[inline(always)]
    pub fn total_delay(&self, state: &SelfCalibrationState<T>) -> T {
        self.sensors.delay + state.delay
    }

    /// [`attitude`](Self::attitude) of recordings side by side: what it says of those that have not started means nothing.
    #[inline(always)]
    pub fn ahead(&self, state: &SelfCalibrationState<T>) -> (Rotation<T>, Vector3<T>) {
        let mut rotation = state.rotation;
        if self.sensors.advances() {
            let rate = self.calibrated_rate(state, Vector(state.rate.value));
            rotation = rotation.turned(&(rate * self.sensors.advance).0);
        }
        (rotation, rotation.up())
    }

    /// `ω - b - M ω`.
    #[inline(always)]
    fn calibrated_rate(&self, state: &SelfCalibrationState<T>, rate: Vector<T>) -> Vector<T> {
        let mut calibrated = rate - Vector(state.rest.bias);
        for (column, part) in rate.parts().into_iter().enumerate() {
            let (known, learnt) = (self.known.data.0[column], state.matrix.data.0[column]);
            let [x, y, z] = known;
            let [a, b, c] = learnt;
            calibrated -= Vector::new(x + a, y + b, z + c) * part;
        }
        calibrated
    }

    /// [`update`](Self::update) of recordings side by side: `dt` in seconds must be that of a [`Dt`].
    #[inline(always)]
    pub fn step(
        &self,
        dt: T,
        state: &mut SelfCalibrationState<T>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> T::Flags {
        let mut flags = T::Flags::default();
        let held = state.rate.take(gyro, dt, self.sensors.hold, &mut flags);
        let rate = self.calibrated_rate(state, held.value);
        let rate = Vector::choose(held.lost, Vector::zero(), rate);
        let force = Vector(*specific_force);
        let there = self.sensors.is_there(force);
        flags.raise(Flags::MEASUREMENT_MISSING, !there);
        let paused = self.sensors.gap.less(dt) & state.started;
        let mut counted = dt;
        if paused.any() {
            *state = SelfCalibrationState::choose_rarely(paused, state.renewed(), *state);
            flags.raise(Flags::RESTARTED, paused);
            counted = T::choose(paused, T::literal(0.0), dt);
        }
        let turn = Rotation::of_turn(&(rate * dt).0);
        state.rotation = state.rotation.times(&turn);
        let frame = state.frame.times(&turn).renormalised();
        let going = state.started;
        state.frame = Rotation::choose(going, frame, state.frame);
        state.age = T::choose(going, state.age + dt, state.age);
        if !going.all() {
            let starting = there & !going;
            state.mean = Vector::choose(starting, force, Vector(state.mean)).0;
            state.started = going | starting;
            flags.raise(Flags::NOT_STARTED, !state.started);
        }
        let fresh = there & held.fresh;
        state.resting = self.rest.update(&mut state.rest, Vector(*gyro), force, dt, fresh);
        let counted = T::choose(state.started, counted, T::literal(0.0));
        state.block.add(&state.frame, rate, force, there, counted);
        // Half a sample short is nearer than half a sample long.
        let ends = self.block.at_most(state.block.time + dt * T::literal(0.5)) & state.started;
        if ends.any() {
            self.finish(state, ends);
        }
        state.set_upright();
        let heading = (&mut state.heading, &mut state.rotation);
        self.heading.update(heading.0, heading.1, magnetic_field, dt, state.started, &mut flags);
        let lost = !state.is_finite();
        if lost.any() {
            *state = SelfCalibrationState::choose_rarely(lost, SelfCalibrationState::new(), *state);
            flags.raise(Flags::RESTARTED, lost);
        }
        flags
    }

    /// The end of a block, where it `ends`: the filter's step, that of its sensitivities, and the parameters'.
    #[inline(always)]
    fn finish(&self, state: &mut SelfCalibrationState<T>, ends: T::Mask) {
        let before = *state;
        state.block = Block::new();
        let (force, ahead, seen) = before.block.means();
        let force = force + ahead * self.total_delay(state);
        self.progress(state, &before.block, force, ahead);
        let usual = seen & before.settled;
        if !(usual | !ends).all() {
            let (block, settled) = (Block::new(), T::Mask::same(true));
            let first = SelfCalibrationState { block, settled, mean: force.0, ..before };
            // The frame has turned, seen or not.
            let mut unseen = SelfCalibrationState { block, ..before };
            for (index, slope) in unseen.slopes.iter_mut().enumerate() {
                slope.mean = (Vector(slope.mean) + before.turned(index)).0;
            }
            let other = SelfCalibrationState::choose_rarely(before.settled, *state, first);
            *state = SelfCalibrationState::choose_rarely(seen, other, unseen);
        }
        // Recordings side by side end their blocks at different times.
        if !ends.all() {
            *state = SelfCalibrationState::choose(ends, *state, before);
        }
    }

    /// A block with a force, of a filter that has settled.
    #[inline(always)]
    fn progress(
        &self,
        state: &mut SelfCalibrationState<T>,
        block: &Block<T>,
        force: Vector<T>,
        ahead: Vector<T>,
    ) {
        let (time, half) = (block.time, T::literal(0.5));
        state.velocity = (Vector(state.velocity) + (force - Vector(state.mean)) * time).0;
        let before = SelfCalibrationState { block: *block, ..*state };
        for (index, slope) in state.slopes.iter_mut().enumerate() {
            let (mean, change) = (Vector(slope.mean), before.turned(index));
            slope.velocity = (Vector(slope.velocity) - (mean + change * half) * time).0;
            slope.mean = (mean + change).0;
        }
        if let Some(delay) = state.slopes.last_mut() {
            delay.velocity = (Vector(delay.velocity) + ahead * time).0;
        }
        let learning = !state.resting & self.learn_after.less(state.age);
        if learning.any() {
            let unlearnt = *state;
            self.learn(state, time);
            if !learning.all() {
                *state = SelfCalibrationState::choose(learning, *state, unlearnt);
            }
        }
        self.move_on(state, time);
    }

    /// Moves every parameter along its sensitivity, by the information about it.
    #[inline(always)]
    fn learn(&self, state: &mut SelfCalibrationState<T>, time: T) {
        let [prior_bias, prior_matrix, prior_delay] = self.prior;
        let [limit_matrix, limit_delay] = self.limits;
        let limit_bias = self.rest.largest_bias();
        for index in 0..PARAMETERS {
            let (prior, limit) = match index {
                0..3 => (prior_bias, limit_bias),
                3..12 => (prior_matrix, limit_matrix),
                _ => (prior_delay, limit_delay),
            };
            // Knowledge of the bias gets old.
            let walk = if index < 3 { self.bias_walk } else { T::literal(0.0) };
            let parameter = *state.parameter(index);
            let Some(slope) = state.slopes.get_mut(index) else { continue };
            let (one, known) = (T::literal(1.0), T::literal(1.0) / (prior * prior));
            let gathered = slope.information + known;
            let gathered = gathered / (one + gathered * walk * walk * time);
            let (mean, velocity) = (Vector(slope.mean), Vector(slope.velocity));
            let total = gathered + velocity.square() * time / self.noise;
            slope.information = total - known;
            let error = velocity.dot(&Vector(state.velocity));
            let wanted = parameter - error * time / (self.noise * total);
            let change = wanted.or_less(limit).or_more(-limit) - parameter;
            state.mean = (Vector(state.mean) + mean * change).0;
            state.velocity = (Vector(state.velocity) + velocity * change).0;
            *state.parameter(index) = parameter + change;
        }
    }

    /// The second-order filter's own motion, for itself and for its sensitivities.
    #[inline(always)]
    fn move_on(&self, state: &mut SelfCalibrationState<T>, time: T) {
        let t = T::literal;
        // Fast at the start, but never faster than the block can carry.
        let early = t(3.0) / state.age;
        let damping = (t(2.0) * self.zeta * self.omega0).or_more(early);
        let most = t(0.3) / time;
        let stiffness = (self.omega0 * self.omega0).or_more(early / state.age).or_less(most * most);
        let (kept, pull) = (t(1.0) / (t(1.0) + damping * time), stiffness * time);
        let velocity = Vector(state.velocity);
        state.mean = (Vector(state.mean) + velocity * pull).0;
        state.velocity = (velocity * kept).0;
        for slope in &mut state.slopes {
            let velocity = Vector(slope.velocity);
            slope.mean = (Vector(slope.mean) + velocity * pull).0;
            slope.velocity = (velocity * kept).0;
        }
    }

    /// The same filter in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> SelfCalibratingFilter<U> {
        SelfCalibratingFilter {
            omega0: change.number(self.omega0),
            zeta: change.number(self.zeta),
            rest: self.rest.each(change),
            heading: self.heading.each(change),
            sensors: self.sensors.each(change),
            block: change.number(self.block),
            prior: each(&self.prior, change),
            limits: each(&self.limits, change),
            bias_walk: change.number(self.bias_walk),
            noise: change.number(self.noise),
            learn_after: change.number(self.learn_after),
            known: matrix_each(&self.known, change),
        }
    }
}
