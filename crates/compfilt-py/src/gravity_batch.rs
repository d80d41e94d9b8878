//! The gravity filters bound to their states.

use crate::arrays::Scalar;
use crate::attitude_batch::{Filter, Output};
use crate::state::Numbers;
use compfilt_core::attitude::{
    Block, GravityFilter, GravityState, Heading, HeldRate, Rest, Rotation, SelfCalibratingFilter,
    SelfCalibrationState, Slope,
};
use compfilt_core::linear::{Flags, SplitGains};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use compfilt_core::{Discretise, Dt, Recurrence};

/// The plain filter bound to its state.
pub(crate) struct Plain<T: Scalar, const N: usize> {
    pub(crate) filter: GravityFilter<T, N>,
    pub(crate) sampled: Option<SplitGains<T, N>>,
    pub(crate) gains: SplitGains<T, N>,
    pub(crate) state: GravityState<T, N>,
}

impl<T: Scalar, const N: usize> Filter<T> for Plain<T, N> {
    fn follow(&mut self, dt: Option<Dt<T>>) {
        match (dt, self.sampled) {
            (Some(dt), _) if self.gains.dt() != dt.seconds() => {
                self.gains = self.filter.design().gains(dt);
            }
            (None, Some(gains)) => self.gains = gains,
            _ => {}
        }
    }

    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, mag: Option<&Vector3<T>>) -> Flags {
        self.filter.update(&self.gains, &mut self.state, gyr, acc, mag)
    }

    fn output(&self) -> Option<Output<T>> {
        let GravityState { rest, resting, .. } = self.state;
        let (rotation, up) = self.filter.attitude(&self.state)?;
        Some(Output { rotation, up, bias: rest.bias, at_rest: resting })
    }

    fn store(&self) -> Numbers {
        let state = &self.state;
        let mut numbers = Numbers::new();
        put_rotation(&mut numbers, &state.rotation);
        for level in &state.levels.levels {
            numbers.put(level.as_slice());
        }
        put_rest(&mut numbers, &state.rest);
        put_inputs(&mut numbers, &state.rate, &state.heading);
        numbers.put(&[state.age, state.since_correction]);
        numbers.put(&[state.started, state.resting].map(number));
        numbers
    }

    fn restore(&mut self, numbers: &Numbers) -> bool {
        let numbers: Vec<T> = numbers.values();
        let mut reader = Reader(&numbers);
        let mut restore = || {
            let rotation = reader.rotation()?;
            let mut state = GravityState::new();
            for level in &mut state.levels.levels {
                *level = reader.vector()?;
            }
            let rest = reader.rest()?;
            let (rate, heading) = reader.inputs()?;
            let [age, since_correction, started, resting] = reader.take()?;
            let (started, resting) = (started != T::zero(), resting != T::zero());
            let last = GravityState {
                rotation,
                rest,
                rate,
                heading,
                age,
                since_correction,
                started,
                resting,
                ..state
            };
            reader.0.is_empty().then_some(last)
        };
        let restored = restore();
        if let Some(state) = restored {
            self.state = state;
        }
        restored.is_some()
    }

    fn reset(&mut self, attitude: Option<Rotation<T>>) {
        self.state = attitude.map_or_else(GravityState::new, GravityState::from_rotation);
    }
}

/// The self-calibrating filter bound to its state.
pub(crate) struct SelfCalibrating<T: Scalar> {
    pub(crate) filter: SelfCalibratingFilter<T>,
    pub(crate) sampled: Option<Dt<T>>,
    pub(crate) dt: Dt<T>,
    pub(crate) state: SelfCalibrationState<T>,
}

impl<T: Scalar> Filter<T> for SelfCalibrating<T> {
    fn follow(&mut self, dt: Option<Dt<T>>) {
        if let Some(dt) = dt.or(self.sampled) {
            self.dt = dt;
        }
    }

    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, mag: Option<&Vector3<T>>) -> Flags {
        self.filter.update(self.dt, &mut self.state, gyr, acc, mag)
    }

    fn output(&self) -> Option<Output<T>> {
        let SelfCalibrationState { rest, resting, .. } = self.state;
        let (rotation, up) = self.filter.attitude(&self.state)?;
        Some(Output { rotation, up, bias: rest.bias, at_rest: resting })
    }

    fn delay(&self) -> Option<T> {
        Some(self.filter.total_delay(&self.state))
    }

    fn calibration(&self) -> Option<Matrix3<T>> {
        Some(self.filter.matrix(&self.state))
    }

    fn store(&self) -> Numbers {
        let state = &self.state;
        let mut numbers = Numbers::new();
        put_rotation(&mut numbers, &state.rotation);
        put_rotation(&mut numbers, &state.frame);
        for vector in [&state.mean, &state.velocity] {
            numbers.put(vector.as_slice());
        }
        numbers.put(state.matrix.as_slice());
        put_rest(&mut numbers, &state.rest);
        for Slope { mean, velocity, information } in &state.slopes {
            numbers.put(mean.as_slice());
            numbers.put(velocity.as_slice());
            numbers.put(&[*information]);
        }
        let Block { force, ahead, force_time, turned, time } = &state.block;
        for vector in [force, ahead].into_iter().chain(turned) {
            numbers.put(vector.as_slice());
        }
        numbers.put(&[*force_time, *time]);
        put_inputs(&mut numbers, &state.rate, &state.heading);
        numbers.put(&[state.age, state.delay]);
        numbers.put(&[state.started, state.settled, state.resting].map(number));
        numbers
    }

    fn restore(&mut self, numbers: &Numbers) -> bool {
        let numbers: Vec<T> = numbers.values();
        let mut reader = Reader(&numbers);
        let mut restore = || {
            let (rotation, frame) = (reader.rotation()?, reader.rotation()?);
            let (mean, velocity) = (reader.vector()?, reader.vector()?);
            let matrix = Matrix3::from_column_slice(&reader.take::<9>()?);
            let rest = reader.rest()?;
            let mut state = SelfCalibrationState::new();
            for slope in &mut state.slopes {
                let (mean, velocity, [information]) =
                    (reader.vector()?, reader.vector()?, reader.take()?);
                *slope = Slope { mean, velocity, information };
            }
            (state.block.force, state.block.ahead) = (reader.vector()?, reader.vector()?);
            for vector in &mut state.block.turned {
                *vector = reader.vector()?;
            }
            [state.block.force_time, state.block.time] = reader.take()?;
            let (rate, heading) = reader.inputs()?;
            let [age, delay, started, settled, resting] = reader.take()?;
            let is = |flag: T| flag != T::zero();
            let last = SelfCalibrationState {
                rotation,
                frame,
                mean,
                velocity,
                matrix,
                delay,
                rest,
                rate,
                heading,
                age,
                started: is(started),
                settled: is(settled),
                resting: is(resting),
                ..state
            };
            reader.0.is_empty().then_some(last)
        };
        let restored = restore();
        if let Some(state) = restored {
            self.state = state;
        }
        restored.is_some()
    }

    fn reset(&mut self, attitude: Option<Rotation<T>>) {
        self.state =
            attitude.map_or_else(SelfCalibrationState::new, SelfCalibrationState::from_rotation);
    }
}

/// A stored quaternion, if it is one.
pub(crate) fn unit<T: Scalar>(w: T, v: Vector3<T>) -> Option<Rotation<T>> {
    let length = w * w + v.norm_squared();
    ((length - T::one()).abs() < T::literal(1e-3)).then_some(Rotation { w, v })
}

fn number(flag: bool) -> f64 {
    f64::from(u8::from(flag))
}

fn put_rotation<T: Scalar>(numbers: &mut Numbers, rotation: &Rotation<T>) {
    numbers.put(&[rotation.w]);
    numbers.put(rotation.v.as_slice());
}

fn put_rest<T: Scalar>(numbers: &mut Numbers, rest: &Rest<T>) {
    for vector in [rest.bias, rest.gyro, rest.force, rest.anchor] {
        numbers.put(vector.as_slice());
    }
    numbers.put(&[rest.age, rest.still, rest.rested]);
    numbers.put(&[number(rest.begun)]);
}

fn put_inputs<T: Scalar>(numbers: &mut Numbers, rate: &HeldRate<T>, heading: &Heading<T>) {
    numbers.put(rate.value.as_slice());
    numbers.put(&[rate.age, heading.age, heading.since]);
    numbers.put(&[number(heading.known)]);
}

/// Reads the numbers in the order in which they were put.
struct Reader<'a, T>(&'a [T]);

impl<T: Scalar> Reader<'_, T> {
    fn take<const N: usize>(&mut self) -> Option<[T; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    fn vector(&mut self) -> Option<Vector3<T>> {
        self.take().map(Vector3::from)
    }

    fn rotation(&mut self) -> Option<Rotation<T>> {
        let [w] = self.take()?;
        unit(w, self.vector()?)
    }

    fn rest(&mut self) -> Option<Rest<T>> {
        let (bias, gyro) = (self.vector()?, self.vector()?);
        let (force, anchor) = (self.vector()?, self.vector()?);
        let [age, still, rested, begun] = self.take()?;
        Some(Rest { bias, gyro, force, anchor, age, still, rested, begun: begun != T::zero() })
    }

    fn inputs(&mut self) -> Option<(HeldRate<T>, Heading<T>)> {
        let value = self.vector()?;
        let [rate_age, age, since, known] = self.take()?;
        Some((HeldRate { value, age: rate_age }, Heading { age, since, known: known != T::zero() }))
    }
}
