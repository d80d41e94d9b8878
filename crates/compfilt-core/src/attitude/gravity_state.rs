//! The state of the gravity filter.

use super::heading::Heading;
use super::held_rate::HeldRate;
use super::rest::Rest;
use super::rotation::Rotation;
use super::vector::Vector;
use crate::{Change, Mask, Number, Real, State};
use nalgebra::Vector3;

/// The state of a [`GravityFilter`](super::GravityFilter).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(C)]
pub struct GravityState<T: Number, const N: usize> {
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
    pub started: T::Mask,
    /// Whether the body rests.
    pub resting: T::Mask,
}

impl<T: Real, const N: usize> GravityState<T, N> {
    /// Starts from a known attitude, and a specific force of standard gravity.
    pub fn from_rotation(rotation: Rotation<T>) -> Self {
        let levels = State::at_rest::<T>(rotation.up() * T::literal(9.806_65));
        let age = T::literal(f64::INFINITY);
        let heading = Heading::given();
        Self { levels, rotation, heading, age, started: true, ..Self::new() }
    }

    /// The world's up in body axes; `None` before the start.
    pub fn up(&self) -> Option<Vector3<T>> {
        let (up, there) = Vector(*self.levels.levels.first()?).direction();
        (there && self.started).then_some(up.0)
    }
}

impl<T: Number, const N: usize> GravityState<T, N> {
    /// Waits for the first measurement.
    #[inline(always)]
    pub fn new() -> Self {
        let zero = T::literal(0.0);
        Self {
            levels: State { levels: [Vector::zero().0; N] },
            rotation: Rotation::identity(),
            rest: Rest::new(),
            rate: HeldRate::new(),
            heading: Heading::new(),
            age: zero,
            since_correction: zero,
            started: T::Mask::same(false),
            resting: T::Mask::same(false),
        }
    }

    /// The levels in the arithmetic of a step.
    #[inline(always)]
    pub(super) fn levels(&self) -> State<Vector<T>, N> {
        let mut levels = [Vector::zero(); N];
        for (to, from) in levels.iter_mut().zip(&self.levels.levels) {
            *to = Vector(*from);
        }
        State { levels }
    }

    /// The first force is the vertical, where the filter is `starting`.
    #[inline(always)]
    pub(super) fn start(&mut self, force: Vector<T>, starting: T::Mask) {
        let start = State::<_, N>::at_rest::<T>(force);
        for (level, start) in self.levels.levels.iter_mut().zip(start.levels) {
            *level = Vector::choose(starting, start, Vector(*level)).0;
        }
        self.started = self.started | starting;
    }

    /// Turns the attitude until the low-passed force is its vertical.
    #[inline(always)]
    pub(super) fn set_upright(&mut self) {
        let (up, there) = Vector(self.levels.levels[0]).direction();
        let upright = self.rotation.upright(up);
        self.rotation = if (there & self.started).all() {
            upright
        } else {
            Rotation::choose(there & self.started, upright, self.rotation.renormalised())
        };
    }

    /// Forgets the vertical where it has `paused`, and keeps heading and bias.
    #[cold]
    #[inline(never)]
    pub(super) fn renew(&mut self, paused: T::Mask) {
        let zero = T::literal(0.0);
        self.rest = Rest::choose(paused, &self.rest.renewed(), &self.rest);
        self.age = T::choose(paused, zero, self.age);
        self.since_correction = T::choose(paused, zero, self.since_correction);
        self.started = self.started & !paused;
    }

    /// Forgets everything where it is `lost`.
    #[cold]
    #[inline(never)]
    pub(super) fn restart(&mut self, lost: T::Mask) {
        *self = Self::choose(lost, &Self::new(), self);
    }

    #[inline(always)]
    pub(super) fn is_finite(&self) -> T::Mask {
        // One number that is not finite makes the sum none.
        let mut sum = self.rotation.square();
        for level in &self.levels.levels {
            let [x, y, z] = Vector(*level).parts();
            sum += x + y + z;
        }
        sum.is_number()
    }

    /// `yes` where the mask is true, `no` elsewhere.
    #[inline(always)]
    fn choose(mask: T::Mask, yes: &Self, no: &Self) -> Self {
        let mut levels = no.levels;
        for (i, level) in levels.levels.iter_mut().enumerate() {
            *level = Vector::choose(mask, Vector(yes.levels.levels[i]), Vector(*level)).0;
        }
        Self {
            levels,
            rotation: Rotation::choose(mask, yes.rotation, no.rotation),
            rest: Rest::choose(mask, &yes.rest, &no.rest),
            rate: HeldRate::choose(mask, &yes.rate, &no.rate),
            heading: Heading::choose(mask, &yes.heading, &no.heading),
            age: T::choose(mask, yes.age, no.age),
            since_correction: T::choose(mask, yes.since_correction, no.since_correction),
            started: mask & yes.started | !mask & no.started,
            resting: mask & yes.resting | !mask & no.resting,
        }
    }

    /// The same state in other numbers: for several recordings side by side.
    pub fn each<U: Number>(&self, change: &mut impl Change<T, U>) -> GravityState<U, N> {
        // The numbers are stored in this order.
        GravityState {
            rotation: self.rotation.each(change),
            levels: State { levels: self.levels.levels.map(|level| Vector(level).each(change).0) },
            rest: self.rest.each(change),
            rate: self.rate.each(change),
            heading: self.heading.each(change),
            age: change.number(self.age),
            since_correction: change.number(self.since_correction),
            started: change.mask(self.started),
            resting: change.mask(self.resting),
        }
    }
}

impl<T: Number, const N: usize> Default for GravityState<T, N> {
    fn default() -> Self {
        Self::new()
    }
}
