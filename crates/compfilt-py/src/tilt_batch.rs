//! The loops of the tilt filter.

use crate::arrays::Scalar;
use crate::batch::{Options, Steps, sampled_gains};
use crate::design::Visitor;
use crate::errors::value_error;
use crate::state::Numbers;
use crate::tilt::vector;
use compfilt_core::gravity::{Axes, Rates, TiltFilter as Filter, TiltState};
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::{Vector2, Vector3};
use compfilt_core::{Discretise, Dt, Recurrence};
use numpy::ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2, ArrayViewMut3};
use pyo3::prelude::*;

/// A block of samples of a tilt filter, and where the results go.
pub(crate) struct Block<'a, T> {
    pub(crate) gyr: ArrayView2<'a, T>,
    pub(crate) acc: ArrayView2<'a, T>,
    pub(crate) steps: Steps<'a, T>,
    pub(crate) angles: ArrayViewMut2<'a, T>,
    /// `(order, samples, 2)`.
    pub(crate) levels: Option<ArrayViewMut3<'a, T>>,
    pub(crate) flags: ArrayViewMut1<'a, u8>,
}

/// A tilt filter of any order, bound to its state.
pub(crate) trait Runner<T: Scalar>: Send + Sync {
    fn order(&self) -> usize;
    fn block(&mut self, block: Block<'_, T>);
    fn update(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, dt: Option<Dt<T>>) -> Vector2<T>;
    fn store(&self) -> Vec<Numbers>;
    fn restore(&mut self, numbers: &[Numbers]) -> bool;
    fn reset(&mut self, angles: Option<Vector2<T>>);
}

pub(crate) struct Bound2<T: Scalar, D: Discretise<T, N>, const N: usize> {
    filter: Filter<T, D>,
    sampled: Option<D::Gains>,
    gains: D::Gains,
    state: TiltState<T, N>,
}

impl<T: Scalar, D: Discretise<T, N>, const N: usize> Bound2<T, D, N> {
    fn follow(&mut self, dt: T) {
        if self.gains.dt() != dt
            && let Ok(dt) = Dt::new(dt)
        {
            self.gains = self.filter.design().gains(dt);
        }
    }

    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>) -> Flags {
        self.filter.update(&self.gains, &mut self.state, gyr, acc)
    }
}

impl<T, D, const N: usize> Runner<T> for Bound2<T, D, N>
where
    T: Scalar,
    D: Discretise<T, N> + Send + Sync,
    D::Gains: Send + Sync,
{
    fn order(&self) -> usize {
        N
    }

    fn block(&mut self, mut block: Block<'_, T>) {
        if let (Steps::Uniform, Some(gains)) = (block.steps, self.sampled) {
            self.gains = gains;
        }
        for row in 0..block.gyr.nrows() {
            let mut flags = Flags::default();
            if let Steps::Each(steps) = block.steps {
                if steps[row].is_finite() {
                    self.follow(steps[row]);
                } else {
                    self.state = TiltState::new();
                    self.follow(T::zero());
                    flags |= Flags::RESTARTED;
                }
            }
            flags |= self.sample(&vector(block.gyr.row(row)), &vector(block.acc.row(row)));
            let angles = self.filter.angles(&self.state);
            block.angles[(row, 0)] = angles[0];
            block.angles[(row, 1)] = angles[1];
            if let Some(levels) = &mut block.levels {
                for (angle, state) in self.state.angles.iter().enumerate() {
                    for (level, x) in state.levels.levels.iter().enumerate() {
                        levels[(level, row, angle)] = *x;
                    }
                }
            }
            block.flags[row] = flags.bits();
        }
    }

    fn update(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, dt: Option<Dt<T>>) -> Vector2<T> {
        match (dt, self.sampled) {
            (Some(dt), _) => self.follow(dt.seconds()),
            (None, Some(gains)) => self.gains = gains,
            (None, None) => {}
        }
        self.sample(gyr, acc);
        self.filter.angles(&self.state)
    }

    fn store(&self) -> Vec<Numbers> {
        let numbers = |state| {
            let mut numbers = Numbers::new();
            numbers.put_stream(state);
            numbers
        };
        self.state.angles.iter().map(numbers).collect()
    }

    fn restore(&mut self, numbers: &[Numbers]) -> bool {
        for (state, numbers) in self.state.angles.iter_mut().zip(numbers) {
            let mut reader = numbers.reader();
            let Some(stored) = reader.take_stream() else { return false };
            if !reader.is_empty() {
                return false;
            }
            *state = stored;
        }
        true
    }

    fn reset(&mut self, angles: Option<Vector2<T>>) {
        self.state = angles.map_or_else(TiltState::new, |angles| TiltState::from_angles(&angles));
    }
}

/// The settings of a tilt filter, in float64.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Settings {
    pub(crate) axes: Axes,
    /// The operating point of frozen rates.
    pub(crate) frozen: Option<[f64; 2]>,
}

pub(crate) struct Make<'a> {
    pub(crate) settings: Settings,
    pub(crate) options: &'a Options,
    pub(crate) fs: Option<f64>,
}

impl<T: Scalar> Visitor<T> for Make<'_> {
    type Output = PyResult<Box<dyn Runner<T>>>;

    fn visit<D, const N: usize>(self, design: D) -> Self::Output
    where
        D: Discretise<T, N> + Send + Sync + 'static,
        D::Gains: Send + Sync,
    {
        let mut filter = Filter::new(design, self.settings.axes)
            .hold(T::literal(self.options.hold))
            .map_err(value_error)?;
        if let Some(cap) = self.options.gap_cap {
            filter = filter.gap_cap(T::literal(cap)).map_err(value_error)?;
        }
        if let Some([first, second]) = self.settings.frozen {
            let at = Vector2::new(T::literal(first), T::literal(second));
            filter = filter.rates(Rates::Frozen(at));
        }
        let sampled = match self.fs {
            None => None,
            Some(fs) => Some(sampled_gains::<T, D, N>(&design, fs)?),
        };
        let zero = Dt::new(T::zero()).map_err(value_error)?;
        let gains = sampled.unwrap_or_else(|| design.gains(zero));
        Ok(Box::new(Bound2 { filter, sampled, gains, state: TiltState::new() }))
    }
}
