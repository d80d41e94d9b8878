//! Every attitude filter with its gains and its state, in one number or in several side by side.

use crate::arrays::Scalar;
use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyState, Rotation, SelfCalibratingFilter,
    SelfCalibrationState,
};
use compfilt_core::linear::{Gains, SplitGains};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use compfilt_core::{Change, Number};

/// What a filter knows after a sample.
pub(crate) struct Output<T: Number> {
    pub(crate) rotation: Rotation<T>,
    pub(crate) up: Vector3<T>,
    pub(crate) bias: Vector3<T>,
    pub(crate) at_rest: T::Mask,
    /// Before the start the rest means nothing.
    pub(crate) started: T::Mask,
}

/// The signals of a sample.
pub(crate) struct Sample<T> {
    pub(crate) gyr: Vector3<T>,
    pub(crate) acc: Vector3<T>,
    pub(crate) mag: Option<Vector3<T>>,
}

/// An attitude filter, whatever its numbers are.
pub(crate) trait Family: Send + Sync + 'static {
    type Filter<T: Number>: Copy + Send + Sync;
    type Gains<T: Number>: Copy + Send + Sync;
    type State<T: Number>: Copy + Send + Sync;

    /// Whether recordings are worth filtering side by side: code for every instruction set has its price.
    const SIDE_BY_SIDE: bool = true;

    /// The gains over a time step in seconds.
    fn gains<T: Number>(filter: &Self::Filter<T>, dt: T) -> Self::Gains<T>;
    /// The state before the first sample, or from an attitude.
    fn start<T: Scalar>(attitude: Option<Rotation<T>>) -> Self::State<T>;
    fn update<T: Number>(
        filter: &Self::Filter<T>,
        gains: &Self::Gains<T>,
        state: &mut Self::State<T>,
        sample: &Sample<T>,
    ) -> T::Flags;
    fn output<T: Number>(filter: &Self::Filter<T>, state: &Self::State<T>) -> Output<T>;
    /// From body to world.
    fn rotation<T: Number>(state: &Self::State<T>) -> Rotation<T>;
    /// The same filter in other numbers.
    fn filter_in<T: Number, U: Number>(
        filter: &Self::Filter<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::Filter<U>;
    /// The same state in other numbers.
    fn state_in<T: Number, U: Number>(
        state: &Self::State<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::State<U>;
    /// The gyro's sensitivity errors, where the filter learns them.
    fn calibration<T: Scalar>(_: &Self::Filter<T>, _: &Self::State<T>) -> Option<Matrix3<T>> {
        None
    }
    /// The delay that it works with in s, where it learns that.
    fn delay<T: Scalar>(_: &Self::Filter<T>, _: &Self::State<T>) -> Option<T> {
        None
    }
}

/// Mahony's filters of order `N`.
pub(crate) struct MahonyFamily<const N: usize>;

/// The gravity filter of order `N`.
pub(crate) struct GravityFamily<const N: usize>;

/// The gravity filter that calibrates itself.
pub(crate) struct SelfCalibratingFamily;

impl<const N: usize> Family for MahonyFamily<N> {
    type Filter<T: Number> = Mahony<T, N>;
    type Gains<T: Number> = Gains<T, N, 1>;
    type State<T: Number> = MahonyState<T>;

    #[inline(always)]
    fn gains<T: Number>(filter: &Self::Filter<T>, dt: T) -> Self::Gains<T> {
        filter.over(dt)
    }

    fn start<T: Scalar>(attitude: Option<Rotation<T>>) -> Self::State<T> {
        attitude.map_or_else(MahonyState::new, MahonyState::from_rotation)
    }

    #[inline(always)]
    fn update<T: Number>(
        filter: &Self::Filter<T>,
        gains: &Self::Gains<T>,
        state: &mut Self::State<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        filter.update(gains, state, &sample.gyr, &sample.acc, sample.mag.as_ref())
    }

    #[inline(always)]
    fn output<T: Number>(_: &Self::Filter<T>, state: &Self::State<T>) -> Output<T> {
        let MahonyState { rotation, bias, started, .. } = *state;
        Output { rotation, up: rotation.up(), bias, at_rest: !(started | !started), started }
    }

    fn rotation<T: Number>(state: &Self::State<T>) -> Rotation<T> {
        state.rotation
    }

    fn filter_in<T: Number, U: Number>(
        filter: &Self::Filter<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::Filter<U> {
        filter.each(change)
    }

    fn state_in<T: Number, U: Number>(
        state: &Self::State<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::State<U> {
        state.each(change)
    }
}

impl<const N: usize> Family for GravityFamily<N> {
    type Filter<T: Number> = GravityFilter<T, N>;
    type Gains<T: Number> = SplitGains<T, N>;
    type State<T: Number> = GravityState<T, N>;

    // Few choose other orders.
    const SIDE_BY_SIDE: bool = N == 2;

    #[inline(always)]
    fn gains<T: Number>(filter: &Self::Filter<T>, dt: T) -> Self::Gains<T> {
        filter.over(dt)
    }

    fn start<T: Scalar>(attitude: Option<Rotation<T>>) -> Self::State<T> {
        attitude.map_or_else(GravityState::new, GravityState::from_rotation)
    }

    #[inline(always)]
    fn update<T: Number>(
        filter: &Self::Filter<T>,
        gains: &Self::Gains<T>,
        state: &mut Self::State<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        filter.update(gains, state, &sample.gyr, &sample.acc, sample.mag.as_ref())
    }

    #[inline(always)]
    fn output<T: Number>(filter: &Self::Filter<T>, state: &Self::State<T>) -> Output<T> {
        let (rotation, up) = filter.ahead(state);
        let GravityState { rest, resting, started, .. } = *state;
        Output { rotation, up, bias: rest.bias, at_rest: resting, started }
    }

    fn rotation<T: Number>(state: &Self::State<T>) -> Rotation<T> {
        state.rotation
    }

    fn filter_in<T: Number, U: Number>(
        filter: &Self::Filter<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::Filter<U> {
        filter.each(change)
    }

    fn state_in<T: Number, U: Number>(
        state: &Self::State<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::State<U> {
        state.each(change)
    }
}

impl Family for SelfCalibratingFamily {
    type Filter<T: Number> = SelfCalibratingFilter<T>;
    type Gains<T: Number> = T;
    type State<T: Number> = SelfCalibrationState<T>;

    #[inline(always)]
    fn gains<T: Number>(_: &Self::Filter<T>, dt: T) -> Self::Gains<T> {
        dt
    }

    fn start<T: Scalar>(attitude: Option<Rotation<T>>) -> Self::State<T> {
        attitude.map_or_else(SelfCalibrationState::new, SelfCalibrationState::from_rotation)
    }

    #[inline(always)]
    fn update<T: Number>(
        filter: &Self::Filter<T>,
        gains: &Self::Gains<T>,
        state: &mut Self::State<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        filter.step(*gains, state, &sample.gyr, &sample.acc, sample.mag.as_ref())
    }

    #[inline(always)]
    fn output<T: Number>(filter: &Self::Filter<T>, state: &Self::State<T>) -> Output<T> {
        let (rotation, up) = filter.ahead(state);
        let (bias, at_rest, started) = (state.rest.bias, state.resting, state.started);
        Output { rotation, up, bias, at_rest, started }
    }

    fn rotation<T: Number>(state: &Self::State<T>) -> Rotation<T> {
        state.rotation
    }

    fn filter_in<T: Number, U: Number>(
        filter: &Self::Filter<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::Filter<U> {
        filter.each(change)
    }

    fn state_in<T: Number, U: Number>(
        state: &Self::State<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::State<U> {
        state.each(change)
    }

    fn calibration<T: Scalar>(
        filter: &Self::Filter<T>,
        state: &Self::State<T>,
    ) -> Option<Matrix3<T>> {
        Some(filter.matrix(state))
    }

    fn delay<T: Scalar>(filter: &Self::Filter<T>, state: &Self::State<T>) -> Option<T> {
        Some(filter.total_delay(state))
    }
}
