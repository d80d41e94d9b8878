//! Attitude from a linear filter on the specific force in the frame that the gyro turns.

use super::gravity_state::GravityState;
use super::heading::HeadingRule;
use super::rest::RestRule;
use super::rotation::Rotation;
use super::sensors::{STRONGEST, Sensors, sensor_settings};
use super::vector::Vector;
use crate::error::positive;
use crate::linear::{Flags, SplitGains};
use crate::{
    Chain, Change, Discretise, Error, FlagSet, Mask, Number, Real, Recurrence, Split, State,
};
use nalgebra::Vector3;

/// The vertical as a low-pass of the specific force in the frame that the gyro turns: a linear complementary filter on three
/// components, without angles.
///
/// ```text
/// x_i ← exp(-[ω dt]×) x_i,    then one step of the linear filter with u = 0 and y = f - delay ω × f,      up = x_0/|x_0|
/// ```
///
/// In that frame gravity stands still and the motion's accelerations average out, the better since the force is not normalised.
/// With `split = 1` the filter is a true low-pass of order `N`. While the body rests ([`RestRule`]) the gyro's bias is estimated.
/// At the start the filter is as fast as the time since then allows. The heading is the gyro's, or slowly the magnetometer's
/// ([`HeadingRule`]). No step calls a trigonometric function. Sources: the linear filters of this crate; the frame is that of
/// D. Laidig, T. Seel, 2023.
///
/// ```
/// use compfilt_core::attitude::{GravityFilter, GravityState};
/// use compfilt_core::nalgebra::Vector3;
/// let filter = GravityFilter::<f32, 2>::second_order(3.0, 0.5)?;
/// let gains = filter.at(0.01)?;
/// let mut state = GravityState::new();
/// filter.update(&gains, &mut state, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 9.81), None);
/// assert_eq!(state.up(), Some(Vector3::z()));
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct GravityFilter<T, const N: usize> {
    design: Split<T, N>,
    rest: RestRule<T>,
    heading: HeadingRule<T>,
    sensors: Sensors<T>,
    cap: T,
    /// How long in s the start lasts.
    start: T,
}

/// At the time `t` after the start the filter is at least as fast as one with all poles at this over `t`.
pub(super) const START: f64 = 2.0;

impl<T: Real> GravityFilter<T, 2> {
    /// Order 2 with the time constant `tau` in seconds, `omega0 = √2/tau`, the damping ratio `zeta` and `split = 1`.
    ///
    /// # Errors
    /// `tau` or `zeta` is not positive and finite, or a coefficient is not representable.
    pub fn second_order(tau: T, zeta: T) -> Result<Self, Error> {
        let omega0 = T::literal(2.0).sqrt() / positive("tau", tau)?;
        let k1 = T::literal(2.0) * positive("zeta", zeta)? * omega0;
        Self::new(Chain::of_design("tau", [k1, omega0 * omega0])?.split(1)?)
    }
}

impl<T: Real, const N: usize> GravityFilter<T, N> {
    /// The filter of any order and split.
    ///
    /// # Errors
    /// The speed of the design's poles is not representable.
    pub fn new(design: Split<T, N>) -> Result<Self, Error> {
        // The poles' mean and geometric mean: k_1 is their sum, k_N their product.
        #[allow(clippy::cast_precision_loss)] // The order is a small number.
        let order = T::literal(N as f64);
        let mean = design.coefficients().first().copied().unwrap_or(T::one()) / order;
        let product = design.coefficients().last().copied().unwrap_or(T::one());
        let geometric_mean = positive("design", product.powf(T::one() / order))?;
        let speed = if mean < geometric_mean { mean } else { geometric_mean };
        Ok(Self {
            design,
            rest: RestRule::default(),
            heading: HeadingRule::default(),
            sensors: Sensors::new(T::literal(STRONGEST)),
            cap: T::literal(0.1),
            start: T::literal(START) / speed,
        })
    }

    sensor_settings!();

    /// The linear design.
    pub fn design(&self) -> &Split<T, N> {
        &self.design
    }

    /// The gains at the sample period `dt` in seconds.
    ///
    /// # Errors
    /// `dt` is not positive and finite, or a gain vanishes in the scalar type.
    pub fn at(&self, dt: T) -> Result<SplitGains<T, N>, Error> {
        self.design.at(dt)
    }

    /// The attitude, from body to world, and the world's up in body axes, both turned ahead; `None` before the start.
    pub fn attitude(&self, state: &GravityState<T, N>) -> Option<(Rotation<T>, Vector3<T>)> {
        state.started.then(|| self.ahead(state))
    }
}

impl<T: Number, const N: usize> GravityFilter<T, N> {
    /// The gains of recordings side by side: `dt` in seconds must be that of a [`Dt`](crate::Dt).
    #[inline(always)]
    pub fn over(&self, dt: T) -> SplitGains<T, N> {
        self.design.over(dt)
    }

    /// [`attitude`](Self::attitude) of recordings side by side: what it says of those that have not started means nothing.
    #[inline(always)]
    pub fn ahead(&self, state: &GravityState<T, N>) -> (Rotation<T>, Vector3<T>) {
        let mut rotation = state.rotation;
        if self.sensors.advances() {
            let rate = Vector(state.rate.value) - Vector(state.rest.bias);
            rotation = rotation.turned(&(rate * self.sensors.advance).0);
        }
        (rotation, rotation.up())
    }

    /// One sample with the `gains` of its time step: `gyro` in rad/s, `specific_force` in m/s², `magnetic_field` of any length,
    /// body axes. What is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    #[inline(always)]
    pub fn update(
        &self,
        gains: &SplitGains<T, N>,
        state: &mut GravityState<T, N>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> T::Flags {
        let (dt, mut flags) = (gains.dt(), T::Flags::default());
        let held = state.rate.take(gyro, dt, self.sensors.hold, &mut flags);
        // A gyro that has been missing for long stands still, whatever its bias is.
        let rate = held.value - Vector(state.rest.bias);
        let rate = Vector::choose(held.lost, Vector::zero(), rate);
        let force = Vector(*specific_force);
        let there = self.sensors.is_there(force);
        flags.raise(Flags::MEASUREMENT_MISSING, !there);
        let paused = self.sensors.gap.less(dt) & state.started;
        if paused.any() {
            flags.raise(Flags::RESTARTED, paused);
            state.renew(paused);
        }
        let turn = Rotation::of_turn(&(rate * dt).0);
        state.rotation = state.rotation.times(&turn);
        let moved = self.sensors.moved(force, rate);
        let going = state.started;
        self.follow(gains, state, &turn, moved, there);
        if !going.all() {
            state.start(moved, there & !going);
            flags.raise(Flags::NOT_STARTED, !state.started);
        }
        let there = there & held.fresh;
        state.resting = self.rest.update(&mut state.rest, Vector(*gyro), force, dt, there);
        state.set_upright();
        let heading = (&mut state.heading, &mut state.rotation);
        self.heading.update(heading.0, heading.1, magnetic_field, dt, state.started, &mut flags);
        let lost = !state.is_finite();
        if lost.any() {
            state.restart(lost);
            flags.raise(Flags::RESTARTED, lost);
        }
        flags
    }

    /// Turns the levels with the body and corrects them by the force, where the filter has started.
    #[inline(always)]
    fn follow(
        &self,
        gains: &SplitGains<T, N>,
        state: &mut GravityState<T, N>,
        turn: &Rotation<T>,
        force: Vector<T>,
        there: T::Mask,
    ) {
        let (going, dt, zero) = (state.started, gains.dt(), T::literal(0.0));
        if !going.any() {
            return;
        }
        let mut levels = state.levels();
        for level in &mut levels.levels {
            *level = Vector(turn.to_body(&level.0));
        }
        let age = state.age + dt;
        let mut since = state.since_correction + dt;
        let corrected = going & there & zero.less(since);
        if corrected.any() {
            let stepped = self.corrected(gains, levels, force, since, age);
            for (level, stepped) in levels.levels.iter_mut().zip(stepped.levels) {
                *level = Vector::choose(corrected, stepped, *level);
            }
            since = T::choose(corrected, zero, since);
        }
        for (kept, level) in state.levels.levels.iter_mut().zip(levels.levels) {
            *kept = Vector::choose(going, level, Vector(*kept)).0;
        }
        state.age = T::choose(going, age, state.age);
        state.since_correction = T::choose(going, since, state.since_correction);
    }

    /// One step of the linear filter over the time since the last.
    #[inline(always)]
    fn corrected(
        &self,
        gains: &SplitGains<T, N>,
        mut levels: State<Vector<T>, N>,
        force: Vector<T>,
        since: T,
        age: T,
    ) -> State<Vector<T>, N> {
        let (early, zero) = (age.less(self.start), T::literal(0.0));
        // Gains that vary are safe for a low-pass up to order 2; for the others the start is a mean.
        let mean_first = N > 2 || self.design.split() > 1;
        let quick = early & T::Mask::same(!mean_first);
        let mut gains = *gains;
        if (quick | since.less(gains.dt()) | gains.dt().less(since)).any() {
            // A slow clock's own step counts in full.
            let counted = since.or_less(gains.dt().or_more(self.cap));
            let varies = quick | counted.less(gains.dt()) | gains.dt().less(counted);
            let least = T::choose(quick, T::literal(START) / age, zero);
            let own = self.design.at_least(least).over(counted);
            // The powers of a short time may be beyond the scalar type.
            gains = SplitGains::choose(varies & own.is_finite(), &own, &gains);
        }
        let mean = levels.levels[0];
        gains.step(&mut levels, force, Vector::zero());
        if mean_first && early.any() {
            let mean = mean + (force - mean) * (since / (age + since));
            let beginning = State::<_, N>::at_rest::<T>(mean);
            for (level, mean) in levels.levels.iter_mut().zip(beginning.levels) {
                *level = Vector::choose(early, mean, *level);
            }
        }
        levels
    }

    /// The same filter in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> GravityFilter<U, N> {
        GravityFilter {
            design: self.design.each(change),
            rest: self.rest.each(change),
            heading: self.heading.each(change),
            sensors: self.sensors.each(change),
            cap: change.number(self.cap),
            start: change.number(self.start),
        }
    }
}
