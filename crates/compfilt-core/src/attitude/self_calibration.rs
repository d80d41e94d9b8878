//! A gravity filter that learns the gyro's bias and sensitivity, and the delay between the sensors, from the motion.

use super::heading::{Heading, HeadingRule};
use super::held_rate::HeldRate;
use super::rest::{Rest, RestRule};
use super::rotation::{Rotation, direction};
use super::sensors::{Sensors, sensor_settings};
use super::strapdown::Strapdown;
use crate::error::positive;
use crate::linear::Flags;
use crate::{Dt, Error, Real};
use nalgebra::{ComplexField, Matrix3, Vector3};

/// What is learnt: the gyro's bias, its sensitivity errors row by row, the delay between both sensors.
const PARAMETERS: usize = 13;

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
pub struct SelfCalibratingFilter<T> {
    omega0: T,
    zeta: T,
    rest: RestRule<T>,
    heading: HeadingRule<T>,
    sensors: Sensors<T>,
    block: T,
    /// Prior standard deviations of the bias in rad/s, of the matrix, and of the delay in s.
    prior: [T; 3],
    /// What they may be at most.
    limits: [T; 3],
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
            sensors: Sensors::new(),
            block: t(0.1),
            prior: [degree, t(0.006), t(0.010)],
            limits: [t(2.0) * degree, t(0.05), t(0.020)],
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

    /// How far in s the force is moved ahead by now.
    pub fn total_delay(&self, state: &SelfCalibrationState<T>) -> T {
        self.sensors.delay + state.delay
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
        let up = state.up()?;
        if self.sensors.advance == T::zero() {
            return Some((state.rotation, up));
        }
        let rate = state.rate.value - state.rest.bias - self.matrix(state) * state.rate.value;
        let turn = Rotation::of_turn(&(rate * self.sensors.advance));
        Some((state.rotation.times(&turn).renormalised(), turn.to_body(&up)))
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
        let (held, mut flags) = state.rate.take(gyro, dt, self.sensors.hold);
        let fresh = flags == Flags::default();
        let lost = flags.contains(Flags::DERIVATIVE_MISSING);
        let rate = if lost {
            Vector3::zeros()
        } else {
            held - state.rest.bias - self.matrix(state) * held
        };
        let there = self.sensors.is_there(specific_force);
        if !there {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        let mut counted = dt;
        if dt > self.sensors.gap && state.started {
            state.renew();
            flags |= Flags::RESTARTED;
            counted = T::zero();
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
        let resting = there && fresh && self.rest.update(&mut state.rest, gyro, specific_force, dt);
        if !(there && fresh) {
            state.rest.disturb();
        }
        state.resting = resting;
        if state.started {
            let force = there.then_some(specific_force);
            state.block.add(&state.frame, &rate, force, counted);
            // Half a sample short is nearer than half a sample long.
            if state.block.time + dt * T::literal(0.5) >= self.block {
                self.finish(state);
            }
        }
        if let Some(up) = state.up() {
            state.rotation = state.rotation.upright(&up).renormalised();
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
        let Some((force, ahead)) = block.means() else {
            // The frame has turned, seen or not.
            for (slope, turned) in state.slopes.iter_mut().zip(block.turned) {
                slope.mean += turned.cross(&state.mean);
            }
            return;
        };
        let force = force + ahead * self.total_delay(state);
        if !state.settled {
            state.settled = true;
            state.mean = force;
            return;
        }
        state.velocity += (force - state.mean) * time;
        let still = [Vector3::zeros()];
        for (slope, turned) in state.slopes.iter_mut().zip(block.turned.iter().chain(&still)) {
            let change = turned.cross(&state.mean);
            slope.velocity -= (slope.mean + change * T::literal(0.5)) * time;
            slope.mean += change;
        }
        if let Some(delay) = state.slopes.last_mut() {
            delay.velocity += ahead * time;
        }
        if !state.resting && state.age > self.learn_after {
            self.learn(state, time);
        }
        self.step(state, time);
    }

    /// Moves every parameter along its sensitivity, by the information about it.
    fn learn(&self, state: &mut SelfCalibrationState<T>, time: T) {
        let SelfCalibrationState { rest, matrix, delay, slopes, mean, velocity, .. } = state;
        let [prior_bias, prior_matrix, prior_delay] = self.prior;
        let [_, limit_matrix, limit_delay] = self.limits;
        let limit_bias = self.rest.largest_bias();
        let kinds = |count, prior, limit, walk| core::iter::repeat_n((prior, limit, walk), count);
        let kinds = kinds(3, prior_bias, limit_bias, self.bias_walk)
            .chain(kinds(9, prior_matrix, limit_matrix, T::zero()))
            .chain(kinds(1, prior_delay, limit_delay, T::zero()));
        // The matrix is stored column by column and learnt row by row.
        let mut rows = matrix.transpose();
        let parameters = rest.bias.iter_mut().chain(rows.iter_mut()).chain([delay]);
        for ((parameter, slope), (prior, limit, walk)) in parameters.zip(slopes).zip(kinds) {
            let gathered = slope.information + T::one() / (prior * prior);
            let gathered = gathered / (T::one() + gathered * walk * walk * time);
            let total = gathered + slope.velocity.norm_squared() * time / self.noise;
            slope.information = total - T::one() / (prior * prior);
            let wanted = *parameter - slope.velocity.dot(velocity) * time / (self.noise * total);
            let change = wanted.clamp(-limit, limit) - *parameter;
            *parameter += change;
            *mean += slope.mean * change;
            *velocity += slope.velocity * change;
        }
        *matrix = rows.transpose();
    }

    /// The second-order filter's own motion, for itself and for its sensitivities.
    fn step(&self, state: &mut SelfCalibrationState<T>, time: T) {
        let t = T::literal;
        let larger = |one: T, other: T| if one > other { one } else { other };
        // Fast at the start, but never faster than the block can carry.
        let early = t(3.0) / state.age;
        let damping = larger(t(2.0) * self.zeta * self.omega0, early);
        let stiffness = larger(self.omega0 * self.omega0, early / state.age);
        let most = (t(0.3) / time) * (t(0.3) / time);
        let stiffness = if stiffness > most { most } else { stiffness };
        let kept = T::one() / (T::one() + damping * time);
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
    /// The information gathered so far, beside the prior's.
    pub information: T,
}

/// What a block of samples adds up to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block<T> {
    /// The force in the gyro's frame, times time.
    pub force: Vector3<T>,
    /// What it would be more by for each second that it is moved ahead, times time.
    pub ahead: Vector3<T>,
    /// How long there was a force.
    pub force_time: T,
    /// How the frame turns with each parameter.
    pub turned: [Vector3<T>; 12],
    /// Seconds.
    pub time: T,
}

impl<T: Real> Block<T> {
    fn new() -> Self {
        let zero = Vector3::zeros();
        Self {
            force: zero,
            ahead: zero,
            force_time: T::zero(),
            turned: [zero; 12],
            time: T::zero(),
        }
    }

    fn add(&mut self, frame: &Rotation<T>, rate: &Vector3<T>, force: Option<&Vector3<T>>, dt: T) {
        let axes = frame.matrix() * dt;
        if let Some(force) = force {
            self.force += axes * force;
            self.ahead -= axes * rate.cross(force);
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

    /// The mean force, and what it gains for each second that it is moved ahead.
    fn means(&self) -> Option<(Vector3<T>, Vector3<T>)> {
        let time = self.force_time;
        (time > T::zero()).then(|| (self.force / time, self.ahead / time))
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
    /// What was learnt of the sensitivity errors, to be added to those known before.
    pub matrix: Matrix3<T>,
    /// What was learnt of the delay in s, to be added to the filter's.
    pub delay: T,
    /// Rest, and the gyro's bias.
    pub rest: Rest<T>,
    /// The sensitivities to the parameters: three of the bias, nine of the matrix row by row, the delay.
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
            delay: T::zero(),
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

    /// Starts from a known attitude, and a specific force of standard gravity.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let mean = rotation.up() * T::literal(9.806_65);
        let heading = Heading::given();
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
            delay: self.delay,
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
