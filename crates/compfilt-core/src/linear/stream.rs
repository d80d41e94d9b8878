//! Samples as they come: missing, held, wrapped, late, at any time step.

use super::chain::correct_with;
use super::{Discretise, Elapsed, Flags, Held, Hindsight, Recurrence, State};
use crate::error::positive;
use crate::{Dt, Error, Real, Rule};
use nalgebra::ComplexField;

/// How the input is taken within a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Input {
    /// Constant: the sample is the mean over the step that it ends.
    #[default]
    Sample,
    /// On a straight line from the sample before: for instantaneous samples.
    Trapezoid,
}

/// The way a filter meets its samples: a design with what is to happen when they are missing, wrap or pause.
///
/// A sample that is NaN or infinite is missing. A missing measurement makes a predicted sample, and the next
/// correction uses the gains for the whole time since the last one. A missing derivative is held for a stated time, then
/// counts as zero.
///
/// ```
/// use compfilt_core::linear::{Flags, Stream, StreamState};
/// use compfilt_core::{Discretise, PiForm};
/// let stream = Stream::new(PiForm::new(2.0_f64, 1.0)?.chain());
/// let gains = stream.design().at(0.01)?;
/// let mut state = StreamState::new();
/// assert!(stream.update(&gains, &mut state, f64::NAN, 0.1, &mut ()).contains(Flags::NOT_STARTED));
/// stream.update(&gains, &mut state, 0.5, 0.1, &mut ());
/// let flags = stream.update(&gains, &mut state, f64::NAN, 0.1, &mut ());
/// assert_eq!(flags, Flags::MEASUREMENT_MISSING);
/// assert!((state.level0() - 0.5).abs() < 0.01);
/// # Ok::<(), compfilt_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct Stream<T, D> {
    design: D,
    input: Input,
    /// Zero: level 0 does not wrap.
    period: T,
    hold: T,
    gap_cap: T,
}

impl<T: Real, D: Copy> Stream<T, D> {
    /// The design with constant input, no wrapping, derivatives held for 0.1 s.
    pub fn new(design: D) -> Self {
        Self {
            design,
            input: Input::Sample,
            period: T::zero(),
            hold: T::literal(0.1),
            gap_cap: no_cap(),
        }
    }

    /// The input within a step.
    #[must_use]
    pub fn input(self, input: Input) -> Self {
        Self { input, ..self }
    }

    /// Wraps the innovation into half a period to both sides: 2π for an angle in radians. Level 0 itself runs on.
    ///
    /// # Errors
    /// `period` is not positive and finite.
    pub fn period(self, period: T) -> Result<Self, Error> {
        Ok(Self { period: positive("period", period)?, ..self })
    }

    /// How long in seconds a missing derivative is held at its last value.
    ///
    /// # Errors
    /// `hold` is not finite or negative.
    pub fn hold(self, hold: T) -> Result<Self, Error> {
        if hold.is_finite() && hold >= T::zero() {
            Ok(Self { hold, ..self })
        } else {
            Err(Error::new("hold", Rule::NotNegative))
        }
    }

    /// The most time in seconds for which the one measurement after a gap counts; without a cap it counts for the
    /// whole gap. Meant for single gaps: where gaps longer than the cap keep coming, filters from order 2 on can become
    /// unstable with it.
    ///
    /// # Errors
    /// `gap_cap` is not positive and finite.
    pub fn gap_cap(self, gap_cap: T) -> Result<Self, Error> {
        Ok(Self { gap_cap: positive("gap_cap", gap_cap)?, ..self })
    }

    /// The design.
    pub fn design(&self) -> &D {
        &self.design
    }

    /// One sample with the `gains` of its time step: predicts with `u`, corrects by `y`.
    #[inline]
    pub fn update<const N: usize, H: Hindsight<T>>(
        &self,
        gains: &D::Gains,
        state: &mut StreamState<T, N>,
        y: T,
        u: T,
        history: &mut H,
    ) -> Flags
    where
        D: Discretise<T, N>,
    {
        if !state.started {
            if !y.is_finite() {
                let (_, flags) = state.input.take(u, gains.dt(), self.hold);
                return flags | Flags::NOT_STARTED | Flags::MEASUREMENT_MISSING;
            }
            state.start(y);
        }
        if y.is_finite() && history.is_now() && self.is_plain(state) {
            let (u, flags) = state.input.take(u, gains.dt(), self.hold);
            let innovation = gains.predict_and_compare(&mut state.levels, y, u);
            state.elapsed = Elapsed::One { dt: gains.dt() };
            return flags | self.correct_by(gains, state, y, innovation);
        }
        let mut flags = self.predict(gains, state, u, history);
        if y.is_finite() {
            flags |= self.correct(gains, state, y, history);
        } else {
            flags |= Flags::MEASUREMENT_MISSING;
        }
        flags
    }

    /// Moves the state on by the time step of `gains` with the derivative `u`.
    #[inline]
    pub fn predict<const N: usize, H: Hindsight<T>>(
        &self,
        gains: &D::Gains,
        state: &mut StreamState<T, N>,
        u: T,
        history: &mut H,
    ) -> Flags
    where
        D: Discretise<T, N>,
    {
        let before = state.input.value;
        let (u, flags) = state.input.take(u, gains.dt(), self.hold);
        if !state.started {
            return flags | Flags::NOT_STARTED;
        }
        history.begin(state.level0());
        let from = before.finite_or(u);
        if D::LONG_STEPS {
            self.lengthen_step(gains, state, from, u);
        } else {
            self.move_on(gains, &mut state.levels, from, u);
            state.elapsed.add(&self.design, gains);
        }
        history.remember(state.levels.levels[0], gains.dt());
        flags
    }

    /// Corrects by the measurement `y` with the gains for the time since the last correction; `gains` are those of the
    /// last prediction. The first measurement starts the filter.
    #[inline]
    pub fn correct<const N: usize, H: Hindsight<T>>(
        &self,
        gains: &D::Gains,
        state: &mut StreamState<T, N>,
        y: T,
        history: &mut H,
    ) -> Flags
    where
        D: Discretise<T, N>,
    {
        if !y.is_finite() {
            return Flags::MEASUREMENT_MISSING;
        }
        if !state.started {
            state.start(y);
            return Flags::default();
        }
        let innovation = y - history.recall(state.level0());
        let flags = self.correct_by(gains, state, y, innovation);
        history.amend(state.level0());
        flags
    }

    /// Corrects by an innovation of the measurement `y`, with the gains for the time since the last correction.
    #[inline]
    fn correct_by<const N: usize>(
        &self,
        gains: &D::Gains,
        state: &mut StreamState<T, N>,
        y: T,
        innovation: T,
    ) -> Flags
    where
        D: Discretise<T, N>,
    {
        let correction = state.elapsed.correction(&self.design, gains, self.gap_cap);
        correct_with(&correction, &mut state.levels, self.wrap(innovation));
        state.elapsed = Elapsed::None;
        if state.levels.levels.iter().all(ComplexField::is_finite) {
            return Flags::default();
        }
        state.start(y);
        Flags::RESTARTED
    }

    /// Whether [`update`](Self::update) does nothing but a step of the recurrence, as long as both signals are there and on
    /// time: without a period or a cap loops may then call [`Recurrence::step`](super::Recurrence::step) itself, and
    /// [`Held::renew`] with the last input.
    pub fn is_plain_step<const N: usize>(&self, state: &StreamState<T, N>) -> bool {
        self.period == T::zero() && self.gap_cap == no_cap() && self.is_plain(state)
    }

    /// Whether the last sample was corrected, and the next is predicted with its own input.
    #[inline]
    fn is_plain<const N: usize>(&self, state: &StreamState<T, N>) -> bool {
        self.input == Input::Sample && state.started && matches!(state.elapsed, Elapsed::None)
    }

    /// One prediction with the input going from `from` to `to`, as the stream takes its input.
    #[inline]
    fn move_on<const N: usize>(&self, gains: &D::Gains, levels: &mut State<T, N>, from: T, to: T)
    where
        D: Discretise<T, N>,
    {
        match self.input {
            Input::Sample => gains.predict(levels, to),
            Input::Trapezoid => gains.predict_ramp(levels, from, to),
        }
    }

    /// Predicts from where the last correction left the levels, in one step of the whole time since.
    fn lengthen_step<const N: usize>(
        &self,
        gains: &D::Gains,
        state: &mut StreamState<T, N>,
        from: T,
        to: T,
    ) where
        D: Discretise<T, N>,
    {
        let (time, start, mut driven) = match state.elapsed {
            Elapsed::LongStep { time, start, driven } => (time + gains.dt(), start, driven),
            _ => (gains.dt(), state.levels, State::at_rest::<T>(T::zero())),
        };
        self.move_on(gains, &mut driven, from, to);
        if let (Elapsed::LongStep { .. }, Ok(dt)) = (state.elapsed, Dt::new(time)) {
            state.levels = start;
            self.design.gains(dt).predict(&mut state.levels, T::zero());
            for (level, driven) in state.levels.levels.iter_mut().zip(&driven.levels) {
                *level += *driven;
            }
        } else {
            self.move_on(gains, &mut state.levels, from, to);
        }
        state.elapsed = Elapsed::LongStep { time, start, driven };
    }

    fn wrap(&self, innovation: T) -> T {
        if self.period == T::zero() {
            return innovation;
        }
        innovation - self.period * (innovation / self.period + T::literal(0.5)).floor()
    }
}

/// Longer than any gap.
fn no_cap<T: Real>() -> T {
    T::max_value().unwrap_or(T::one())
}

/// What changes from sample to sample.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StreamState<T: Real, const N: usize> {
    /// The filter's levels.
    pub levels: State<T, N>,
    /// Whether the levels are known: from an initial state or from the first measurement.
    pub started: bool,
    /// The last derivative.
    pub input: Held<T>,
    /// The time since the last correction.
    pub elapsed: Elapsed<T, N>,
}

impl<T: Real, const N: usize> StreamState<T, N> {
    /// Waits for the first measurement.
    pub fn new() -> Self {
        Self {
            levels: State { levels: [T::NAN; N] },
            started: false,
            input: Held::new(),
            elapsed: Elapsed::None,
        }
    }

    /// Starts from known levels.
    pub fn from_levels(levels: [T; N]) -> Self {
        Self { levels: State { levels }, started: true, ..Self::new() }
    }

    /// Level 0; NaN before the first measurement.
    pub fn level0(&self) -> T {
        self.levels.levels[0]
    }

    /// Level 0 at `level0`, the others at zero.
    pub fn start(&mut self, level0: T) {
        self.levels = State::at_rest::<T>(level0);
        self.started = true;
        self.elapsed = Elapsed::None;
    }
}

impl<T: Real, const N: usize> Default for StreamState<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
