//! The time since the last correction, and the gains for all of it.

use super::discrete::identity;
use super::placement::place;
use super::{Discretise, Recurrence, State};
use crate::{Dt, Real};
use nalgebra::SVector;

/// The time since the last correction, and what is needed to correct for all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Elapsed<T: Real, const N: usize> {
    /// No prediction yet.
    None,
    /// One prediction: its own gains apply.
    One {
        /// Its time step in seconds.
        dt: T,
    },
    /// Several: the poles are placed on their accumulated transition.
    Placed {
        /// Seconds since the last correction.
        time: T,
        /// The transition, row by row.
        transition: State<SVector<T, N>, N>,
    },
    /// Several, taken as one long step from where the last correction left the levels.
    LongStep {
        /// Seconds since the last correction.
        time: T,
        /// The levels after the last correction.
        start: State<T, N>,
        /// What the input has added to the levels since.
        driven: State<T, N>,
    },
}

impl<T: Real, const N: usize> Elapsed<T, N> {
    /// One prediction more, by a step with `gains`.
    #[inline]
    pub(crate) fn add<D: Discretise<T, N>>(&mut self, design: &D, gains: &D::Gains) {
        if let Self::None = self {
            *self = Self::One { dt: gains.dt() };
        } else {
            self.add_more(design, gains);
        }
    }

    /// The same prediction that moves the state moves the rows of the transition, as lanes.
    fn add_more<D: Discretise<T, N>>(&mut self, design: &D, gains: &D::Gains) {
        let (before, mut transition) = match *self {
            Self::Placed { time, transition } => (time, transition),
            Self::One { dt } => {
                (dt, Dt::new(dt).map_or(identity(), |dt| D::transition(&design.gains(dt))))
            }
            _ => (T::zero(), identity()),
        };
        gains.predict(&mut transition, SVector::zeros());
        *self = Self::Placed { time: before + gains.dt(), transition };
    }

    /// Gains with the poles where one step of the whole time would have them.
    pub(crate) fn correction<D: Discretise<T, N>>(
        &self,
        design: &D,
        gains: &D::Gains,
        cap: T,
    ) -> [T; N] {
        match *self {
            Self::None => [T::zero(); N],
            Self::One { dt: time } | Self::LongStep { time, .. }
                if time == gains.dt() && time <= cap =>
            {
                *gains.correction()
            }
            // Other gains than the last prediction's may have come in between, with a stored state.
            Self::One { dt: time } | Self::LongStep { time, .. } => match Dt::new(time) {
                Ok(time) if time.seconds() > cap => design.capped(time, cap),
                Ok(time) => *design.gains(time).correction(),
                Err(_) => [T::zero(); N],
            },
            Self::Placed { time, transition } => placed(design, &transition, time, cap),
        }
    }
}

/// Gains on the transition over `time` with the poles of one step of it, or of `cap` if that is shorter.
pub(crate) fn placed<T: Real, D: Discretise<T, N>, const N: usize>(
    design: &D,
    transition: &State<SVector<T, N>, N>,
    time: T,
    cap: T,
) -> [T; N] {
    if time == T::zero() {
        return [T::zero(); N];
    }
    place(transition, &design.characteristic(time.min(cap)), time).unwrap_or_else(|| {
        // The powers of the time overflow. After a long gap the measurement is all there is; after next to none it says nothing.
        let mut all = [T::zero(); N];
        if time > T::one() {
            all[0] = T::one();
        }
        all
    })
}
