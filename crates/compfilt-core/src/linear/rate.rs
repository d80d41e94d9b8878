//! The rate filter: a gyro's rate and an angular acceleration.

use super::{Discretise, FirstOrder, Flags, Gains, Held, Recurrence, State};
use crate::{Dt, Element, Error, Real};

/// The first-order complementary filter for a rate: the gyro passes through the high-pass, the integrated angular
/// acceleration through the low-pass.
///
/// ```text
/// a_n = a_{n-1} + dt α̇_n
/// ω_n = α (ω_{n-1} + γ_n - γ_{n-1}) + (1 - α) a_n,      α = tau/(tau + dt)
/// ```
///
/// with the gyro `γ` in rad/s and the angular acceleration `α̇` in rad/s². The integral `a` runs open loop: a bias of the
/// angular acceleration makes it drift, and the low-pass does not remove that. The filter is kept because it is the
/// source's; [`drift_free`](Self::drift_free) fuses the same signals the other way round.
///
/// Source: the balancing cube's note on complementary filters, equation (30); its equations (24), (26), (29) have slips.
///
/// ```
/// use compfilt_core::RateFilter;
/// use compfilt_core::linear::RateState;
/// let gains = RateFilter::new(1.0_f64)?.at(0.25)?;
/// let mut state = RateState::new(0.0);
/// assert!((gains.update(&mut state, 1.0, 0.0) - 0.8).abs() < 1e-15); // a step of the gyro passes with α
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RateFilter<T> {
    first_order: FirstOrder<T>,
}

impl<T: Real> RateFilter<T> {
    /// The filter with the time constant `tau` in seconds.
    ///
    /// # Errors
    /// `tau` is not positive and finite, or 1/`tau` is not representable.
    pub fn new(tau: T) -> Result<Self, Error> {
        Ok(Self { first_order: FirstOrder::new(tau)? })
    }

    /// The time constant in seconds.
    pub fn tau(&self) -> T {
        self.first_order.tau()
    }

    /// The pair that does not drift: a first-order filter whose measurement is the gyro and whose input is the angular
    /// acceleration.
    pub fn drift_free(&self) -> FirstOrder<T> {
        self.first_order
    }

    /// The gains at the sample period `dt` in seconds.
    ///
    /// # Errors
    /// `dt` is not positive and finite, or the gain vanishes in the scalar type.
    pub fn at(&self, dt: T) -> Result<RateGains<T>, Error> {
        Discretise::at(self, dt)
    }
}

impl<T: Real> Discretise<T, 1> for RateFilter<T> {
    type Gains = RateGains<T>;

    const LONG_STEPS: bool = false;

    fn gains(&self, dt: Dt<T>) -> RateGains<T> {
        RateGains { chain: self.first_order.chain().gains(dt) }
    }

    fn characteristic(&self, tau: T) -> [T; 1] {
        self.first_order.chain().characteristic(tau)
    }
}

/// The gains of a [`RateFilter`] at one sample period. As a [`Recurrence`] its input is the change of the gyro.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RateGains<T> {
    chain: Gains<T, 1, 1>,
}

impl<T> RateGains<T> {
    /// Of the gains of a first-order filter with the same time constant.
    pub const fn from_parts(chain: Gains<T, 1, 1>) -> Self {
        Self { chain }
    }

    /// The gains of the first-order filter with the same time constant.
    pub const fn chain(&self) -> &Gains<T, 1, 1> {
        &self.chain
    }
}

impl<T: Real> RateGains<T> {
    /// One sample: `gyro` in rad/s, `angular_acceleration` in rad/s². Returns the rate in rad/s.
    pub fn update(&self, state: &mut RateState<T>, gyro: T, angular_acceleration: T) -> T {
        let (integral, change) = state.inputs.convert(gyro, angular_acceleration, self.dt());
        self.step(&mut state.rate, integral, change)
    }
}

impl<T: Real> Recurrence<T, 1> for RateGains<T> {
    #[inline(always)]
    fn predict<E: Element<T>>(&self, state: &mut State<E, 1>, change: E) {
        let [rate] = &mut state.levels;
        *rate = *rate + change;
    }

    #[inline(always)]
    fn predict_and_compare<E: Element<T>>(&self, state: &mut State<E, 1>, y: E, change: E) -> E {
        let [rate] = state.levels;
        self.predict(state, change);
        (y - change) - rate
    }

    #[inline(always)]
    fn predict_ramp<E: Element<T>>(&self, state: &mut State<E, 1>, _: E, change: E) {
        self.predict(state, change);
    }

    fn correction(&self) -> &[T; 1] {
        self.chain.correction()
    }

    fn dt(&self) -> T {
        self.chain.dt()
    }
}

/// The state of a [`RateFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RateState<T> {
    /// The rate in rad/s.
    pub rate: State<T, 1>,
    /// The gyro before and the integrated angular acceleration.
    pub inputs: RateInputs<T>,
}

impl<T: Real> RateState<T> {
    /// Starts at the rate `rate` in rad/s, which the gyro is taken to have read.
    pub fn new(rate: T) -> Self {
        Self { rate: State::at_rest::<T>(rate), inputs: RateInputs::new(rate) }
    }
}

/// Turns the two signals into the recurrence's: the integral of the angular acceleration, and the change of the gyro.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct RateInputs<T> {
    /// The last gyro sample in rad/s.
    pub gyro: T,
    /// The integrated angular acceleration in rad/s.
    pub integral: T,
    /// The last angular acceleration in rad/s².
    pub angular_acceleration: Held<T>,
}

impl<T: Real> RateInputs<T> {
    /// Both at `rate` in rad/s.
    pub fn new(rate: T) -> Self {
        Self { gyro: rate, integral: rate, angular_acceleration: Held::new() }
    }

    /// [`convert`](Self::convert) for samples that may be missing: NaN or infinite. A missing gyro sample is taken to have
    /// moved with the angular acceleration; a missing angular acceleration is held for `hold` seconds, then counts as
    /// zero. Before the first gyro sample the integral is NaN. If one overflows, both start anew from the gyro, and so
    /// should the filter.
    pub fn prepare(&mut self, gyro: T, angular_acceleration: T, dt: T, hold: T) -> (T, T, Flags) {
        let (held, mut flags) = self.angular_acceleration.take(angular_acceleration, dt, hold);
        if !gyro.is_finite() {
            flags |= Flags::MEASUREMENT_MISSING;
        } else if !self.gyro.is_finite() {
            self.gyro = gyro;
            self.integral = gyro;
        }
        let (integral, change) = self.convert(gyro.finite_or(self.gyro + dt * held), held, dt);
        if gyro.is_finite() && !(integral.is_finite() && change.is_finite()) {
            *self = Self { angular_acceleration: self.angular_acceleration, ..Self::new(gyro) };
            return (gyro, T::zero(), flags | Flags::RESTARTED);
        }
        (integral, change, flags)
    }

    /// `(a_n, γ_n - γ_{n-1})`.
    #[inline]
    pub fn convert(&mut self, gyro: T, angular_acceleration: T, dt: T) -> (T, T) {
        let change = gyro - self.gyro;
        self.gyro = gyro;
        self.integral += dt * angular_acceleration;
        (self.integral, change)
    }
}
