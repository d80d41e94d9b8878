//! Attitude from a linear filter on the specific force in the frame that the gyro turns.

use super::heading::{Heading, HeadingRule};
use super::held_rate::HeldRate;
use super::rest::{Rest, RestRule};
use super::rotation::{Rotation, direction};
use super::sensors::{Sensors, sensor_settings};
use crate::error::positive;
use crate::linear::{Flags, SplitGains};
use crate::{Chain, Discretise, Dt, Error, Real, Recurrence, Split, State};
use nalgebra::{ComplexField, Vector3};

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
            sensors: Sensors::new(),
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
        let up = state.up()?;
        if self.sensors.advance == T::zero() {
            return Some((state.rotation, up));
        }
        let rate = state.rate.value - state.rest.bias;
        let turn = Rotation::of_turn(&(rate * self.sensors.advance));
        Some((state.rotation.times(&turn).renormalised(), turn.to_body(&up)))
    }

    /// One sample with the `gains` of its time step: `gyro` in rad/s, `specific_force` in m/s², `magnetic_field` of any length,
    /// body axes. What is not finite, has no length, or is clipped is missing: the filter coasts, and says so.
    pub fn update(
        &self,
        gains: &SplitGains<T, N>,
        state: &mut GravityState<T, N>,
        gyro: &Vector3<T>,
        specific_force: &Vector3<T>,
        magnetic_field: Option<&Vector3<T>>,
    ) -> Flags {
        let dt = gains.dt();
        let (held, mut flags) = state.rate.take(gyro, dt, self.sensors.hold);
        let fresh = flags == Flags::default();
        // A gyro that has been missing for long stands still, whatever its bias is.
        let rate = if flags.contains(Flags::DERIVATIVE_MISSING) {
            Vector3::zeros()
        } else {
            held - state.rest.bias
        };
        let there = self.sensors.is_there(specific_force);
        if !there {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        if dt > self.sensors.gap && state.started {
            state.renew();
            flags |= Flags::RESTARTED;
        }
        let force = specific_force - rate.cross(specific_force) * self.sensors.delay;
        let turn = Rotation::of_turn(&(rate * dt));
        state.rotation = state.rotation.times(&turn).renormalised();
        if state.started {
            for level in &mut state.levels.levels {
                *level = turn.to_body(level);
            }
            state.age += dt;
            state.since_correction += dt;
            if there {
                self.correct(gains, state, &force);
            }
        } else if there {
            state.levels = State::at_rest::<T>(force);
            state.started = true;
        } else {
            flags |= Flags::NOT_STARTED;
        }
        if there && fresh {
            state.resting = self.rest.update(&mut state.rest, gyro, specific_force, dt);
        } else {
            state.rest.disturb();
            state.resting = false;
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

    /// One step of the linear filter over the time since the last.
    fn correct(
        &self,
        gains: &SplitGains<T, N>,
        state: &mut GravityState<T, N>,
        force: &Vector3<T>,
    ) {
        let since = state.since_correction;
        if since <= T::zero() {
            return;
        }
        // A slow clock's own step counts in full.
        let most = if gains.dt() > self.cap { gains.dt() } else { self.cap };
        let counted = if since < most { since } else { most };
        state.since_correction = T::zero();
        let early = state.age < self.start;
        if early && (N > 2 || self.design.split() > 1) {
            // Gains that vary are safe for a low-pass up to order 2; for the others the start is a mean.
            if let Some(mean) = state.levels.levels.first_mut() {
                *mean += (force - *mean) * (since / (state.age + since));
            }
            return;
        }
        let own = (early || counted != gains.dt()).then(|| self.gains_of(counted, state.age));
        let gains = own.flatten().unwrap_or(*gains);
        gains.step(&mut state.levels, *force, Vector3::zeros());
    }

    /// The gains of a time step at a time after the start: while that is short, so is the memory. `None` where the powers of
    /// a short time are beyond the scalar type.
    fn gains_of(&self, counted: T, age: T) -> Option<SplitGains<T, N>> {
        let early = age < self.start;
        let design =
            if early { self.design.at_least(T::literal(START) / age) } else { self.design };
        let gains = design.gains(Dt::new(counted).ok()?);
        gains.correction().iter().all(ComplexField::is_finite).then_some(gains)
    }
}

/// The state of a [`GravityFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityState<T: Real, const N: usize> {
    /// Level 0 is the low-passed specific force in m/s², body axes.
    pub levels: State<Vector3<T>, N>,
    /// From body to world: x east, y north, z up; heading 0 at the start where there is no magnetometer.
    pub rotation: Rotation<T>,
    /// Rest, and the gyro's bias.
    pub rest: Rest<T>,
    /// The last rate.
    pub rate: HeldRate<T>,
    /// The heading's filter.
    pub heading: Heading<T>,
    /// Seconds since the start, as long as that counts.
    pub age: T,
    /// Seconds since the last correction.
    pub since_correction: T,
    /// Whether there is an attitude.
    pub started: bool,
    /// Whether the body rests.
    pub resting: bool,
}

impl<T: Real, const N: usize> GravityState<T, N> {
    /// Waits for the first measurement.
    pub fn new() -> Self {
        Self {
            levels: State::at_rest::<T>(Vector3::zeros()),
            rotation: Rotation::identity(),
            rest: Rest::new(),
            rate: HeldRate::new(),
            heading: Heading::new(),
            age: T::zero(),
            since_correction: T::zero(),
            started: false,
            resting: false,
        }
    }

    /// Starts from a known attitude, and a specific force of standard gravity.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let levels = State::at_rest::<T>(rotation.up() * T::literal(9.806_65));
        let age = T::one() / T::zero();
        let heading = Heading::given();
        Self { levels, rotation, heading, age, started: true, ..Self::new() }
    }

    /// The world's up in body axes; `None` before the start.
    pub fn up(&self) -> Option<Vector3<T>> {
        direction(self.levels.levels.first()?).filter(|_| self.started)
    }

    /// Forgets the vertical, keeps heading and bias.
    fn renew(&mut self) {
        self.started = false;
        self.rest.renew();
        (self.age, self.since_correction) = (T::zero(), T::zero());
    }

    fn restart_if_lost(&mut self) -> Flags {
        let mut numbers = self.levels.levels.iter().flat_map(Vector3::iter);
        if numbers.all(ComplexField::is_finite) && self.rotation.is_finite() {
            return Flags::default();
        }
        *self = Self::new();
        Flags::RESTARTED
    }
}

impl<T: Real, const N: usize> Default for GravityState<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
