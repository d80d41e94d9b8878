//! A gravity filter that learns the gyro's bias and sensitivity from the motion.

use super::heading::{Heading, HeadingRule};
use super::held_rate::HeldRate;
use super::rest::{Rest, RestRule};
use super::rotation::{Rotation, direction};
use crate::error::positive;
use crate::linear::Flags;
use crate::{Dt, Error, Real, Rule};
use nalgebra::{ComplexField, Matrix3, Vector3};

/// What is learnt: the gyro's bias, then its sensitivity errors row by row.
const PARAMETERS: usize = 12;

/// The gravity filter with integral action on the gyro's bias and on a matrix of sensitivity errors.
///
/// ```text
/// ω_c = ω - b - M ω       turns body and estimate every sample
/// v += T_b (f̄ - m),   m += ω0² T_b v,   v -= 2ζω0T_b/(1 + 2ζω0T_b) v       every block of T_b seconds, in the gyro's frame
/// ```
///
/// `f̄` is the block's mean force and `m` the low-passed one: the second-order filter in velocity form. The sensitivities of
/// `m` and `v` to the twelve parameters go through the same recurrence, and each parameter moves along its own by the
/// information about it so far; a prior holds those that the motion does not show. At rest the bias follows the gyro. `b` and
/// the symmetric part of `M` converge; its skew part, a misalignment of gyro and accelerometer, hardly does.
///
/// ```
/// use compfilt_core::Dt;
/// use compfilt_core::attitude::{SelfCalibratingFilter, SelfCalibrationState};
/// use compfilt_core::nalgebra::Vector3;
/// let filter = SelfCalibratingFilter::<f32>::new(5.0, 0.43)?;
/// let mut state = SelfCalibrationState::new();
/// filter.update(Dt::new(0.01)?, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81), None);
/// assert_eq!(state.up(), Some(Vector3::z()));
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibratingFilter<T> {
    omega0: T,
    zeta: T,
    rest: RestRule<T>,
    heading: HeadingRule<T>,
    delay: T,
    hold: T,
    gap: T,
    force_range: Option<T>,
    block: T,
    /// Prior standard deviations of the bias in rad/s and of the matrix.
    prior: [T; 2],
    /// The variance density that the velocity's innovations are taken to have.
    noise: T,
    /// Seconds after the start from which on parameters are learnt.
    learn_after: T,
}

impl<T: Real> SelfCalibratingFilter<T> {
    /// The filter with the time constant `tau` in seconds, `omega0 = √2/tau`, and the damping ratio `zeta`.
    ///
    /// # Errors
    /// `tau` or `zeta` is not positive and finite.
    pub fn new(tau: T, zeta: T) -> Result<Self, Error> {
        let t = T::literal;
        Ok(Self {
            omega0: positive("tau", t(2.0).sqrt() / positive("tau", tau)?)?,
            zeta: positive("zeta", zeta)?,
            rest: RestRule::default(),
            heading: HeadingRule::default(),
            delay: T::zero(),
            hold: t(0.1),
            gap: T::one(),
            force_range: None,
            block: t(0.112),
            prior: [t(0.5) * T::pi() / t(180.0), t(0.006)],
            noise: t(1.5),
            learn_after: t(3.0),
        })
    }

    /// When the body counts as resting.
    #[must_use]
    pub fn rest(self, rest: RestRule<T>) -> Self {
        Self { rest, ..self }
    }

    /// How the heading follows the magnetometer.
    #[must_use]
    pub fn heading(self, heading: HeadingRule<T>) -> Self {
        Self { heading, ..self }
    }

    /// How long in s the gyro lags behind the accelerometer; negative where it leads. A property of the sensor.
    ///
    /// # Errors
    /// `delay` is not finite.
    pub fn delay(self, delay: T) -> Result<Self, Error> {
        if delay.is_finite() {
            Ok(Self { delay, ..self })
        } else {
            Err(Error::new("delay", Rule::Finite))
        }
    }

    /// How long in s a missing gyro sample is bridged by the last one; 0.1 where it is not set.
    ///
    /// # Errors
    /// `hold` is negative or not finite.
    pub fn hold(self, hold: T) -> Result<Self, Error> {
        if hold.is_finite() && hold >= T::zero() {
            Ok(Self { hold, ..self })
        } else {
            Err(Error::new("hold", Rule::NotNegative))
        }
    }

    /// The accelerometer's range in m/s²: a sample with a component at it or beyond it is clipped, and counts as missing.
    ///
    /// # Errors
    /// `force_range` is not positive and finite.
    pub fn force_range(self, force_range: T) -> Result<Self, Error> {
        Ok(Self { force_range: Some(positive("force_range", force_range)?), ..self })
    }

    /// The prior standard deviations: of the bias in rad/s, and of the elements of the matrix.
    ///
    /// # Errors
    /// One of them is not positive and finite.
    pub fn prior(self, bias: T, matrix: T) -> Result<Self, Error> {
        Ok(Self {
            prior: [positive("bias_prior", bias)?, positive("matrix_prior", matrix)?],
            ..self
        })
    }

    /// One sample after the time `dt`: `gyro` in rad/s, `specific_force` in m/s², `magnetic_field` of any length, body axes.
    /// What is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    pub fn update(
        &self,
        dt: Dt<T>,
        state: &mut SelfCalibrationState<T>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> Flags {
        let dt = dt.seconds();
        let (held, mut flags) = state.rate.take(gyro, dt, self.hold);
        let lost = flags.contains(Flags::DERIVATIVE_MISSING);
        let rate =
            if lost { Vector3::zeros() } else { held - state.rest.bias - state.matrix * held };
        let there = direction(specific_force).is_some()
            && !self.force_range.is_some_and(|range| specific_force.amax() >= range);
        if !there {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        if dt > self.gap && state.started {
            state.renew();
            flags |= Flags::RESTARTED;
        }
        let turn = Rotation::of_turn(&(rate * dt));
        state.rotation = state.rotation.times(&turn).renormalised();
        if state.started {
            state.frame = state.frame.times(&turn).renormalised();
            state.age += dt;
        } else if there {
            state.mean = *specific_force;
            state.started = true;
        } else {
            flags |= Flags::NOT_STARTED;
        }
        let resting = there
            && state.rate.age == T::zero()
            && self.rest.update(&mut state.rest, gyro, specific_force, dt);
        if !there || state.rate.age > T::zero() {
            state.rest.disturb();
        }
        state.resting = resting;
        if state.started {
            let force = there.then(|| specific_force - rate.cross(specific_force) * self.delay);
            state.block.add(&state.frame, &rate, force, dt);
            // Half a sample short is nearer than half a sample long.
            if state.block.time + dt * T::literal(0.5) >= self.block {
                self.finish(state);
            }
        }
        if let Some(level) = state.up().and_then(|up| state.rotation.levelled(&up)) {
            state.rotation = level.renormalised();
        }
        if state.started {
            flags |=
                self.heading.update(&mut state.heading, &mut state.rotation, magnetic_field, dt);
        }
        flags | state.restart_if_lost()
    }

    /// The end of a block: the filter's step, that of its sensitivities, and the parameters'.
    fn finish(&self, state: &mut SelfCalibrationState<T>) {
        let block = core::mem::replace(&mut state.block, Block::new());
        let time = block.time;
        let Some(force) = block.mean_force() else { return };
        if !state.settled {
            state.settled = true;
            state.mean = force;
            return;
        }
        state.velocity += (force - state.mean) * time;
        for (slope, turned) in state.slopes.iter_mut().zip(block.turned) {
            let change = turned.cross(&state.mean);
            slope.velocity -= (slope.mean + change * T::literal(0.5)) * time;
            slope.mean += change;
        }
        if !state.resting && state.age > self.learn_after {
            self.learn(state, time);
        }
        self.step(state, time);
    }

    /// Moves every parameter along its sensitivity, by the information about it.
    fn learn(&self, state: &mut SelfCalibrationState<T>, time: T) {
        for index in 0..PARAMETERS {
            let prior = if index < 3 { self.prior[0] } else { self.prior[1] };
            let Slope { velocity, mean, information } = state.slopes[index];
            let information = information + velocity.norm_squared() * time / self.noise;
            let total = information + T::one() / (prior * prior);
            let change = -velocity.dot(&state.velocity) * time / (self.noise * total);
            state.slopes[index].information = information;
            match index.checked_sub(3) {
                None => state.rest.bias[index] += change,
                Some(element) => state.matrix[(element / 3, element % 3)] += change,
            }
            state.mean += mean * change;
            state.velocity += velocity * change;
        }
    }

    /// The second-order filter's own motion, for itself and for its sensitivities.
    fn step(&self, state: &mut SelfCalibrationState<T>, time: T) {
        let t = T::literal;
        let mut stiffness = self.omega0 * self.omega0;
        // Fast at the start, but never faster than the block can carry.
        let early = t(2.25) / (state.age * state.age);
        if early > stiffness {
            stiffness = early;
        }
        let most = (t(0.3) / time) * (t(0.3) / time);
        if stiffness > most {
            stiffness = most;
        }
        let damping = t(2.0) * self.zeta * self.omega0 * time;
        let kept = T::one() / (T::one() + damping);
        state.mean += state.velocity * (stiffness * time);
        state.velocity *= kept;
        for slope in &mut state.slopes {
            slope.mean += slope.velocity * (stiffness * time);
            slope.velocity *= kept;
        }
    }
}

/// How the filter's state depends on one parameter, and what is known about that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope<T> {
    /// The derivative of the low-passed force.
    pub mean: Vector3<T>,
    /// The derivative of its velocity.
    pub velocity: Vector3<T>,
    /// The information gathered so far, without the prior.
    pub information: T,
}

/// What a block of samples adds up to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block<T> {
    /// The force in the gyro's frame, times time.
    pub force: Vector3<T>,
    /// How long there was a force.
    pub force_time: T,
    /// How the frame turns with each parameter.
    pub turned: [Vector3<T>; PARAMETERS],
    /// Seconds.
    pub time: T,
}

impl<T: Real> Block<T> {
    fn new() -> Self {
        let zero = Vector3::zeros();
        Self { force: zero, force_time: T::zero(), turned: [zero; PARAMETERS], time: T::zero() }
    }

    fn add(&mut self, frame: &Rotation<T>, rate: &Vector3<T>, force: Option<Vector3<T>>, dt: T) {
        let axes = frame.matrix() * dt;
        if let Some(force) = force {
            self.force += axes * force;
            self.force_time += dt;
        }
        let (bias, matrix) = self.turned.split_at_mut(3);
        for ((axis, bias), row) in axes.column_iter().zip(bias).zip(matrix.chunks_exact_mut(3)) {
            *bias += axis;
            for (part, element) in rate.iter().zip(row) {
                *element += axis * *part;
            }
        }
        self.time += dt;
    }

    fn mean_force(&self) -> Option<Vector3<T>> {
        (self.force_time > T::zero()).then(|| self.force / self.force_time)
    }
}

/// The state of a [`SelfCalibratingFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibrationState<T> {
    /// From body to the gyro's frame.
    pub frame: Rotation<T>,
    /// The low-passed specific force in that frame, m/s².
    pub mean: Vector3<T>,
    /// Its velocity, in the filter's own units.
    pub velocity: Vector3<T>,
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// The sensitivity errors `M`: the gyro reads `M ω` too much.
    pub matrix: Matrix3<T>,
    /// Rest, and the gyro's bias.
    pub rest: Rest<T>,
    /// The sensitivities to the parameters: three of the bias, nine of the matrix row by row.
    pub slopes: [Slope<T>; PARAMETERS],
    /// The block under way.
    pub block: Block<T>,
    /// The last rate.
    pub rate: HeldRate<T>,
    /// The heading's filter.
    pub heading: Heading<T>,
    /// Seconds since the start.
    pub age: T,
    /// Whether there is an attitude.
    pub started: bool,
    /// Whether the first block is over.
    pub settled: bool,
    /// Whether the body rests.
    pub resting: bool,
}

impl<T: Real> SelfCalibrationState<T> {
    /// Waits for the first measurement.
    pub fn new() -> Self {
        let zero = Vector3::zeros();
        Self {
            frame: Rotation::identity(),
            mean: zero,
            velocity: zero,
            rotation: Rotation::identity(),
            matrix: Matrix3::zeros(),
            rest: Rest::new(),
            slopes: [Slope { mean: zero, velocity: zero, information: T::zero() }; PARAMETERS],
            block: Block::new(),
            rate: HeldRate::new(),
            heading: Heading::new(),
            age: T::zero(),
            started: false,
            settled: false,
            resting: false,
        }
    }

    /// The same with sensitivity errors that are known from before.
    #[must_use]
    pub fn calibrated(self, matrix: Matrix3<T>) -> Self {
        Self { matrix, ..self }
    }

    /// Starts from a known attitude, and a specific force of standard gravity.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let mean = rotation.up() * T::literal(9.806_65);
        let heading = Heading { known: true, ..Heading::new() };
        Self {
            mean,
            rotation,
            heading,
            age: T::literal(1e4),
            started: true,
            settled: true,
            ..Self::new()
        }
    }

    /// The world's up in body axes; `None` before the start.
    pub fn up(&self) -> Option<Vector3<T>> {
        direction(&self.mean).filter(|_| self.started).map(|up| self.frame.to_body(&up))
    }

    /// Forgets the vertical, keeps heading and what was learnt.
    fn renew(&mut self) {
        let mut slopes = self.slopes;
        for slope in &mut slopes {
            (slope.mean, slope.velocity) = (Vector3::zeros(), Vector3::zeros());
        }
        self.rest.renew();
        *self = Self {
            rotation: self.rotation,
            matrix: self.matrix,
            rest: self.rest,
            rate: self.rate,
            heading: self.heading,
            slopes,
            ..Self::new()
        };
    }

    fn restart_if_lost(&mut self) -> Flags {
        let finite = |v: &Vector3<T>| v.iter().all(ComplexField::is_finite);
        let whole = finite(&self.mean)
            && finite(&self.velocity)
            && finite(&self.rest.bias)
            && self.matrix.iter().all(ComplexField::is_finite)
            && self.rotation.is_finite()
            && self.frame.is_finite();
        if whole {
            return Flags::default();
        }
        *self = Self::new();
        Flags::RESTARTED
    }
}

impl<T: Real> Default for SelfCalibrationState<T> {
    fn default() -> Self {
        Self::new()
    }
}
