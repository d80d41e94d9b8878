//! A gravity filter that learns the gyro's bias and sensitivity, and the delay between the sensors, from the motion.

use super::heading::{Heading, HeadingRule};
use super::held_rate::HeldRate;
use super::rest::{Rest, RestRule};
use super::rotation::Rotation;
use super::sensors::{STRONGEST, Sensors, sensor_settings};
use super::strapdown::Strapdown;
use super::vector::Vector;
use crate::error::positive;
use crate::linear::{Flags, each};
use crate::{Change, Dt, Error, FlagSet, Mask, Number, Real};
use nalgebra::{Matrix3, Vector3};

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
            sensors: Sensors::new(t(STRONGEST)),
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
            *state = SelfCalibrationState::choose(paused, state.renewed(), *state);
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
            *state = SelfCalibrationState::choose(lost, SelfCalibrationState::new(), *state);
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
        let usual = ends & seen & before.settled;
        if !usual.all() {
            let (block, settled) = (Block::new(), T::Mask::same(true));
            let first = SelfCalibrationState { block, settled, mean: force.0, ..before };
            // The frame has turned, seen or not.
            let mut unseen = SelfCalibrationState { block, ..before };
            for (index, slope) in unseen.slopes.iter_mut().enumerate() {
                slope.mean = (Vector(slope.mean) + before.turned(index)).0;
            }
            let other = SelfCalibrationState::choose(before.settled, *state, first);
            let ended = SelfCalibrationState::choose(seen, other, unseen);
            *state = SelfCalibrationState::choose(ends, ended, before);
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
        let [_, limit_matrix, limit_delay] = self.limits;
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

impl<T: Number> Block<T> {
    #[inline(always)]
    fn new() -> Self {
        let (zero, nothing) = (T::literal(0.0), Vector::zero().0);
        Self { force: nothing, ahead: nothing, force_time: zero, turned: [nothing; 12], time: zero }
    }

    /// A sample that lasts `dt`, with a force where it is `there`.
    #[inline(always)]
    fn add(
        &mut self,
        frame: &Rotation<T>,
        rate: Vector<T>,
        force: Vector<T>,
        there: T::Mask,
        dt: T,
    ) {
        let [x, y, z] = frame.axes();
        let axes = [x * dt, y * dt, z * dt];
        let turned = |v: Vector<T>| {
            let [a, b, c] = v.parts();
            axes[0] * a + axes[1] * b + axes[2] * c
        };
        let force = Vector::choose(there, force, Vector::zero());
        self.force = (Vector(self.force) + turned(force)).0;
        self.ahead = (Vector(self.ahead) - turned(rate.cross(&force))).0;
        self.force_time += T::choose(there, dt, T::literal(0.0));
        let (bias, matrix) = self.turned.split_at_mut(3);
        for ((axis, bias), row) in axes.iter().zip(bias).zip(matrix.chunks_exact_mut(3)) {
            *bias = (Vector(*bias) + *axis).0;
            for (part, element) in rate.parts().iter().zip(row) {
                *element = (Vector(*element) + *axis * *part).0;
            }
        }
        self.time += dt;
    }

    /// The mean force, what it gains for each second that it is moved ahead, and where there was a force.
    #[inline(always)]
    fn means(&self) -> (Vector<T>, Vector<T>, T::Mask) {
        let (zero, one) = (T::literal(0.0), T::literal(1.0));
        let seen = zero.less(self.force_time);
        let scale = one / T::choose(seen, self.force_time, one);
        (Vector(self.force) * scale, Vector(self.ahead) * scale, seen)
    }

    #[inline(always)]
    fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let vector = |a: Vector3<T>, b: Vector3<T>| Vector::choose(mask, Vector(a), Vector(b)).0;
        let mut turned = no.turned;
        for (turned, yes) in turned.iter_mut().zip(&yes.turned) {
            *turned = vector(*yes, *turned);
        }
        Self {
            force: vector(yes.force, no.force),
            ahead: vector(yes.ahead, no.ahead),
            force_time: T::choose(mask, yes.force_time, no.force_time),
            turned,
            time: T::choose(mask, yes.time, no.time),
        }
    }

    fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Block<U> {
        Block {
            force: Vector(self.force).each(change).0,
            ahead: Vector(self.ahead).each(change).0,
            turned: self.turned.map(|turned| Vector(turned).each(change).0),
            force_time: change.number(self.force_time),
            time: change.number(self.time),
        }
    }
}

impl<T: Number> Slope<T> {
    #[inline(always)]
    fn new() -> Self {
        let nothing = Vector::zero().0;
        Self { mean: nothing, velocity: nothing, information: T::literal(0.0) }
    }

    #[inline(always)]
    fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            mean: Vector::choose(mask, Vector(yes.mean), Vector(no.mean)).0,
            velocity: Vector::choose(mask, Vector(yes.velocity), Vector(no.velocity)).0,
            information: T::choose(mask, yes.information, no.information),
        }
    }

    fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> Slope<U> {
        Slope {
            mean: Vector(self.mean).each(change).0,
            velocity: Vector(self.velocity).each(change).0,
            information: change.number(self.information),
        }
    }
}

/// The state of a [`SelfCalibratingFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibrationState<T: Number> {
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
    pub started: T::Mask,
    /// Whether the first block is over.
    pub settled: T::Mask,
    /// Whether the body rests.
    pub resting: T::Mask,
}

impl<T: Real> SelfCalibrationState<T> {
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
        let (up, there) = Vector(self.mean).direction();
        (there && self.started).then(|| self.frame.to_body(&up.0))
    }
}

impl<T: Number> SelfCalibrationState<T> {
    /// Waits for the first measurement.
    #[inline(always)]
    pub fn new() -> Self {
        let (zero, nothing, not) = (T::literal(0.0), Vector::zero().0, T::Mask::same(false));
        Self {
            frame: Rotation::identity(),
            mean: nothing,
            velocity: nothing,
            rotation: Rotation::identity(),
            matrix: Matrix3::from_array_storage(nalgebra::ArrayStorage([[zero; 3]; 3])),
            delay: zero,
            rest: Rest::new(),
            slopes: [Slope::new(); PARAMETERS],
            block: Block::new(),
            rate: HeldRate::new(),
            heading: Heading::new(),
            age: zero,
            started: not,
            settled: not,
            resting: not,
        }
    }

    /// How the frame's turn with one parameter has turned the mean; nothing for the delay, which turns nothing.
    #[inline(always)]
    fn turned(&self, index: usize) -> Vector<T> {
        match self.block.turned.get(index) {
            Some(turned) => Vector(*turned).cross(&Vector(self.mean)),
            None => Vector::zero(),
        }
    }

    /// The place of a parameter: the bias, the matrix row by row (it is stored column by column), the delay.
    #[inline(always)]
    fn parameter(&mut self, index: usize) -> &mut T {
        let element = index.saturating_sub(3);
        let part = if index < 3 {
            self.rest.bias.data.0[0].get_mut(index)
        } else {
            self.matrix.data.0[element % 3].get_mut(element / 3)
        };
        part.unwrap_or(&mut self.delay)
    }

    /// Turns the attitude until the low-passed force is its vertical.
    #[inline(always)]
    fn set_upright(&mut self) {
        let (up, there) = Vector(self.mean).direction();
        let upright = self.rotation.upright(Vector(self.frame.to_body(&up.0)));
        self.rotation = if (there & self.started).all() {
            upright
        } else {
            Rotation::choose(there & self.started, upright, self.rotation.renormalised())
        };
    }

    /// The vertical forgotten, heading and what was learnt kept.
    #[inline(never)]
    fn renewed(self) -> Self {
        let mut slopes = [Slope::new(); PARAMETERS];
        for (slope, known) in slopes.iter_mut().zip(&self.slopes) {
            slope.information = known.information;
        }
        Self {
            rotation: self.rotation,
            matrix: self.matrix,
            delay: self.delay,
            rest: self.rest.renewed(),
            rate: self.rate,
            heading: self.heading,
            slopes,
            ..Self::new()
        }
    }

    #[inline(always)]
    fn is_finite(&self) -> T::Mask {
        // One number that is not finite makes the sum none.
        let mut sum = self.rotation.square() + self.frame.square();
        for vector in [self.mean, self.velocity, self.rest.bias] {
            let [x, y, z] = Vector(vector).parts();
            sum += x + y + z;
        }
        for [x, y, z] in self.matrix.data.0 {
            sum += x + y + z;
        }
        sum.is_number()
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(never)]
    fn choose(mask: T::Mask, yes: Self, no: Self) -> Self {
        let vector = |a: Vector3<T>, b: Vector3<T>| Vector::choose(mask, Vector(a), Vector(b)).0;
        let either = |a: T::Mask, b: T::Mask| mask & a | !mask & b;
        let (mut matrix, mut slopes) = (no.matrix, no.slopes);
        for (column, yes) in matrix.data.0.iter_mut().zip(&yes.matrix.data.0) {
            for (element, yes) in column.iter_mut().zip(yes) {
                *element = T::choose(mask, *yes, *element);
            }
        }
        for (slope, yes) in slopes.iter_mut().zip(&yes.slopes) {
            *slope = Slope::choose(mask, yes, slope);
        }
        Self {
            frame: Rotation::choose(mask, yes.frame, no.frame),
            mean: vector(yes.mean, no.mean),
            velocity: vector(yes.velocity, no.velocity),
            rotation: Rotation::choose(mask, yes.rotation, no.rotation),
            matrix,
            delay: T::choose(mask, yes.delay, no.delay),
            rest: Rest::choose(mask, &yes.rest, &no.rest),
            slopes,
            block: Block::choose(mask, &yes.block, &no.block),
            rate: HeldRate::choose(mask, &yes.rate, &no.rate),
            heading: Heading::choose(mask, &yes.heading, &no.heading),
            age: T::choose(mask, yes.age, no.age),
            started: either(yes.started, no.started),
            settled: either(yes.settled, no.settled),
            resting: either(yes.resting, no.resting),
        }
    }

    /// The same state in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> SelfCalibrationState<U> {
        // The numbers are stored in this order.
        SelfCalibrationState {
            rotation: self.rotation.each(change),
            frame: self.frame.each(change),
            mean: Vector(self.mean).each(change).0,
            velocity: Vector(self.velocity).each(change).0,
            matrix: matrix_each(&self.matrix, change),
            rest: self.rest.each(change),
            slopes: self.slopes.map(|slope| slope.each(change)),
            block: self.block.each(change),
            rate: self.rate.each(change),
            heading: self.heading.each(change),
            age: change.number(self.age),
            delay: change.number(self.delay),
            started: change.mask(self.started),
            settled: change.mask(self.settled),
            resting: change.mask(self.resting),
        }
    }
}

fn matrix_each<T: Number, U: Number>(
    matrix: &Matrix3<T>,
    change: &mut impl Change<T, U>,
) -> Matrix3<U> {
    let columns = matrix.data.0.map(|column| each(&column, change));
    Matrix3::from_array_storage(nalgebra::ArrayStorage(columns))
}

impl<T: Number> Default for SelfCalibrationState<T> {
    fn default() -> Self {
        Self::new()
    }
}
