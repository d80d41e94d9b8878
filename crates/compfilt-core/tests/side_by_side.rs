//! Recordings side by side: each one has the bits that it has alone, whatever the others are going through.

mod common;

use common::{Noise, butterworth, split};
use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyForm, MahonyState, Observation, RestRule, Rotation,
    SelfCalibratingFilter, SelfCalibrationState,
};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use compfilt_core::{
    Change, Element, FirstOrder, FlagSet, Flags, Mask, Number, PiForm, Real, Split,
};
use core::array::from_fn;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};
use proptest::prelude::{Just, ProptestConfig, Strategy, any};
use proptest::{collection, option, prop_oneof, proptest, sample};

// ------------------------------------------------------------------------------------------------- several numbers

const LANES: usize = 4;

/// Several numbers side by side, each on its own: the plainest that there can be.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Several<T>([T; LANES]);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Answers([bool; LANES]);

#[derive(Clone, Copy, Default)]
struct SeveralFlags([Flags; LANES]);

macro_rules! operator {
    ($Operator:ident, $name:ident, $Assign:ident, $assign:ident) => {
        operator!($Operator, $name);
        impl<T: Real> $Assign for Several<T> {
            fn $assign(&mut self, other: Self) {
                *self = $Operator::$name(*self, other);
            }
        }
    };
    ($Operator:ident, $name:ident) => {
        impl<T: Real> $Operator for Several<T> {
            type Output = Self;

            fn $name(self, other: Self) -> Self {
                Self(from_fn(|lane| $Operator::$name(self.0[lane], other.0[lane])))
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div);

impl<T: Real> Neg for Several<T> {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.map(|number| -number))
    }
}

impl<T: Real> Element<Several<T>> for Several<T> {
    fn neutral() -> Self {
        Self([T::zero(); LANES])
    }
}

impl<T: Real> Number for Several<T> {
    type Mask = Answers;
    type Flags = SeveralFlags;

    const EPSILON: f64 = T::EPSILON;
    const ROOT_GUESS: u64 = T::ROOT_GUESS;
    const ROOT_STEPS: usize = T::ROOT_STEPS;

    fn literal(value: f64) -> Self {
        Self([T::literal(value); LANES])
    }

    fn less(self, bound: Self) -> Answers {
        Answers(from_fn(|lane| self.0[lane].less(bound.0[lane])))
    }

    fn at_most(self, bound: Self) -> Answers {
        Answers(from_fn(|lane| self.0[lane].at_most(bound.0[lane])))
    }

    fn choose(mask: Answers, yes: Self, no: Self) -> Self {
        Self(from_fn(|lane| if mask.0[lane] { yes.0[lane] } else { no.0[lane] }))
    }

    fn magnitude(self) -> Self {
        Self(self.0.map(Number::magnitude))
    }

    fn root_guess(self) -> Self {
        Self(self.0.map(Number::root_guess))
    }
}

impl BitAnd for Answers {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] & other.0[lane]))
    }
}

impl BitOr for Answers {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] | other.0[lane]))
    }
}

impl Not for Answers {
    type Output = Self;

    fn not(self) -> Self {
        Self(self.0.map(|answer| !answer))
    }
}

impl Mask for Answers {
    fn same(answer: bool) -> Self {
        Self([answer; LANES])
    }

    fn any(self) -> bool {
        self.0.contains(&true)
    }

    fn all(self) -> bool {
        !self.0.contains(&false)
    }
}

impl FlagSet<Answers> for SeveralFlags {
    fn raise(&mut self, flag: Flags, mask: Answers) {
        for (flags, answer) in self.0.iter_mut().zip(mask.0) {
            if answer {
                *flags |= flag;
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------- from one to several

/// The same number in every lane.
struct Same;

impl<T: Real> Change<T, Several<T>> for Same {
    fn number(&mut self, number: T) -> Several<T> {
        Several([number; LANES])
    }

    fn mask(&mut self, mask: bool) -> Answers {
        Answers([mask; LANES])
    }
}

/// The numbers of one lane.
struct Lane(usize);

impl<T: Real> Change<Several<T>, T> for Lane {
    fn number(&mut self, number: Several<T>) -> T {
        number.0[self.0]
    }

    fn mask(&mut self, mask: Answers) -> bool {
        mask.0[self.0]
    }
}

/// All that is in a state, one after the other.
struct Contents<T> {
    numbers: Vec<T>,
    answers: Vec<bool>,
}

impl<T: Real> Change<T, T> for Contents<T> {
    fn number(&mut self, number: T) -> T {
        self.numbers.push(number);
        number
    }

    fn mask(&mut self, mask: bool) -> bool {
        self.answers.push(mask);
        mask
    }
}

/// Puts the contents of several states side by side.
struct Together<T> {
    contents: [Contents<T>; LANES],
    numbers: usize,
    answers: usize,
}

impl<T: Real> Change<T, Several<T>> for Together<T> {
    fn number(&mut self, _: T) -> Several<T> {
        self.numbers += 1;
        Several(from_fn(|lane| self.contents[lane].numbers[self.numbers - 1]))
    }

    fn mask(&mut self, _: bool) -> Answers {
        self.answers += 1;
        Answers(from_fn(|lane| self.contents[lane].answers[self.answers - 1]))
    }
}

/// The bits of a number; one NaN is like the other.
fn bits<T: Real>(number: T) -> u64 {
    let number = number.to_f64();
    if number.is_nan() { f64::NAN.to_bits() } else { number.to_bits() }
}

fn all_bits<T: Real>(numbers: impl IntoIterator<Item = T>) -> Vec<u64> {
    numbers.into_iter().map(bits).collect()
}

// -------------------------------------------------------------------------------------------------- every filter

/// The signals of a sample, and the time that led to it.
struct Sample<T> {
    dt: T,
    gyro: Vector3<T>,
    force: Vector3<T>,
    field: Option<Vector3<T>>,
}

/// What a filter says after a sample.
struct Told<T: Number> {
    rotation: Rotation<T>,
    up: Vector3<T>,
    bias: Vector3<T>,
    at_rest: T::Mask,
    started: T::Mask,
}

impl<T: Real> Told<T> {
    fn bits(&self) -> Vec<u64> {
        let Rotation { w, v } = self.rotation;
        all_bits(
            [w].into_iter()
                .chain([v, self.up, self.bias].into_iter().flat_map(Into::<[T; 3]>::into)),
        )
    }
}

impl<T: Real> Told<Several<T>> {
    fn of(&self, lane: usize) -> Told<T> {
        let vector = |v: &Vector3<Several<T>>| Vector3::new(v.x.0[lane], v.y.0[lane], v.z.0[lane]);
        let Rotation { w, v } = &self.rotation;
        Told {
            rotation: Rotation { w: w.0[lane], v: vector(v) },
            up: vector(&self.up),
            bias: vector(&self.bias),
            at_rest: self.at_rest.0[lane],
            started: self.started.0[lane],
        }
    }
}

/// A filter in any numbers.
trait Attitude {
    type Filter<T: Number>: Copy;
    type State<T: Number>: Copy;

    fn start<T: Real>(rotation: Option<Rotation<T>>) -> Self::State<T>;
    fn step<T: Number>(
        filter: &Self::Filter<T>,
        state: &mut Self::State<T>,
        sample: &Sample<T>,
    ) -> T::Flags;
    fn told<T: Number>(filter: &Self::Filter<T>, state: &Self::State<T>) -> Told<T>;
    /// What the interface for one recording says of the attitude, where there is such an interface.
    fn attitude<T: Real>(
        _: &Self::Filter<T>,
        _: &Self::State<T>,
    ) -> Option<(Rotation<T>, Vector3<T>)> {
        None
    }
    fn filter_in<T: Number, U: Number>(
        filter: &Self::Filter<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::Filter<U>;
    fn state_in<T: Number, U: Number>(
        state: &Self::State<T>,
        change: &mut impl Change<T, U>,
    ) -> Self::State<U>;
}

/// What is the same for all of them.
macro_rules! changes {
    () => {
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
    };
}

struct Mahonys<const N: usize>;

impl<const N: usize> Attitude for Mahonys<N> {
    type Filter<T: Number> = Mahony<T, N>;
    type State<T: Number> = MahonyState<T>;

    fn start<T: Real>(rotation: Option<Rotation<T>>) -> MahonyState<T> {
        rotation.map_or_else(MahonyState::new, MahonyState::from_rotation)
    }

    fn step<T: Number>(
        filter: &Mahony<T, N>,
        state: &mut MahonyState<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        let Sample { dt, gyro, force, field } = sample;
        filter.update(&filter.over(*dt), state, gyro, force, field.as_ref())
    }

    fn told<T: Number>(_: &Mahony<T, N>, state: &MahonyState<T>) -> Told<T> {
        let MahonyState { rotation, bias, started, .. } = *state;
        Told { rotation, up: rotation.up(), bias, at_rest: T::Mask::same(false), started }
    }

    changes!();
}

/// The same filters with directions that any sensors observe: the force as it is, the field, and one that never is there.
struct MahonysOfDirections<const N: usize>;

impl<const N: usize> Attitude for MahonysOfDirections<N> {
    type Filter<T: Number> = Mahony<T, N>;
    type State<T: Number> = MahonyState<T>;

    fn start<T: Real>(rotation: Option<Rotation<T>>) -> MahonyState<T> {
        Mahonys::<N>::start(rotation)
    }

    fn step<T: Number>(
        filter: &Mahony<T, N>,
        state: &mut MahonyState<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        let Sample { dt, gyro, force, field } = sample;
        let t = T::literal;
        let observation = |body: &Vector3<T>, [x, y, z]: [f64; 3]| Observation {
            body: *body,
            world: Vector3::new(t(x), t(y), t(z)),
            // What the first component weighs varies, and may be no number.
            weight: t(0.5) + body.x * t(0.01),
        };
        let mut observed = vec![observation(force, [0.0, 0.0, 1.0])];
        observed.extend(field.as_ref().map(|field| observation(field, [0.0, 20.0, -40.0])));
        observed.push(observation(gyro, [0.0, 0.0, 0.0]));
        filter.update_with(&filter.over(*dt), state, gyro, &observed)
    }

    fn told<T: Number>(filter: &Mahony<T, N>, state: &MahonyState<T>) -> Told<T> {
        Mahonys::<N>::told(filter, state)
    }

    changes!();
}

struct Gravities<const N: usize>;

impl<const N: usize> Attitude for Gravities<N> {
    type Filter<T: Number> = GravityFilter<T, N>;
    type State<T: Number> = GravityState<T, N>;

    fn start<T: Real>(rotation: Option<Rotation<T>>) -> GravityState<T, N> {
        rotation.map_or_else(GravityState::new, GravityState::from_rotation)
    }

    fn step<T: Number>(
        filter: &GravityFilter<T, N>,
        state: &mut GravityState<T, N>,
        sample: &Sample<T>,
    ) -> T::Flags {
        let Sample { dt, gyro, force, field } = sample;
        filter.update(&filter.over(*dt), state, gyro, force, field.as_ref())
    }

    fn told<T: Number>(filter: &GravityFilter<T, N>, state: &GravityState<T, N>) -> Told<T> {
        let (rotation, up) = filter.ahead(state);
        let GravityState { resting, started, .. } = *state;
        Told { rotation, up, bias: state.rest.bias, at_rest: resting, started }
    }

    fn attitude<T: Real>(
        filter: &GravityFilter<T, N>,
        state: &GravityState<T, N>,
    ) -> Option<(Rotation<T>, Vector3<T>)> {
        filter.attitude(state)
    }

    changes!();
}

struct SelfCalibrating;

impl Attitude for SelfCalibrating {
    type Filter<T: Number> = SelfCalibratingFilter<T>;
    type State<T: Number> = SelfCalibrationState<T>;

    fn start<T: Real>(rotation: Option<Rotation<T>>) -> SelfCalibrationState<T> {
        rotation.map_or_else(SelfCalibrationState::new, SelfCalibrationState::from_rotation)
    }

    fn step<T: Number>(
        filter: &SelfCalibratingFilter<T>,
        state: &mut SelfCalibrationState<T>,
        sample: &Sample<T>,
    ) -> T::Flags {
        let Sample { dt, gyro, force, field } = sample;
        filter.step(*dt, state, gyro, force, field.as_ref())
    }

    fn told<T: Number>(
        filter: &SelfCalibratingFilter<T>,
        state: &SelfCalibrationState<T>,
    ) -> Told<T> {
        let (rotation, up) = filter.ahead(state);
        let SelfCalibrationState { resting, started, .. } = *state;
        Told { rotation, up, bias: state.rest.bias, at_rest: resting, started }
    }

    fn attitude<T: Real>(
        filter: &SelfCalibratingFilter<T>,
        state: &SelfCalibrationState<T>,
    ) -> Option<(Rotation<T>, Vector3<T>)> {
        filter.attitude(state)
    }

    changes!();
}

fn contents<A: Attitude, T: Real>(state: &A::State<T>) -> Contents<T> {
    let mut contents = Contents { numbers: Vec::new(), answers: Vec::new() };
    A::state_in(state, &mut contents);
    contents
}

fn state_bits<A: Attitude, T: Real>(state: &A::State<T>) -> (Vec<u64>, Vec<bool>) {
    let Contents { numbers, answers } = contents::<A, T>(state);
    (all_bits(numbers), answers)
}

fn together<A: Attitude, T: Real>(states: &[A::State<T>; LANES]) -> A::State<Several<T>> {
    let contents = states.each_ref().map(contents::<A, T>);
    A::state_in(&states[0], &mut Together { contents, numbers: 0, answers: 0 })
}

// ------------------------------------------------------------------------------------------------- the recordings

const ROWS: usize = 150;
const GYRO: usize = 0;
const FORCE: usize = 1;
const FIELD: usize = 2;

/// Beyond the accelerometer's range, which all filters here are told.
const CLIPPED: f64 = 150.0;
const RANGE: f64 = 100.0;
/// So long that a turn in it is no number.
const ETERNITY: f64 = 1e30;

/// What the body does all the time.
#[derive(Clone, Copy, Debug)]
enum Motion {
    /// Signals that have little to do with each other, from a seed.
    Noise(u32),
    /// It lies still; every so many rows it is upside down, exactly and at once, with this axis along the vertical.
    Turned { axis: usize, every: usize },
}

/// What happens for some rows.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// One component of a signal, or all, read this.
    Reads { signal: usize, all: bool, value: f64 },
    /// A signal points the other way.
    Reversed { signal: usize },
    /// The field is along the vertical: no heading.
    VerticalField,
    /// All signals stand still.
    Still,
    /// The samples are so many seconds apart.
    Steps(f64),
}

#[derive(Clone, Copy, Debug)]
struct Row {
    dt: f64,
    signals: [[f64; 3]; 3],
}

/// One recording before it is made.
#[derive(Clone, Debug)]
struct Plan {
    start: Option<[f64; 3]>,
    dt: f64,
    motion: Motion,
    /// What happens, from which row on, for how many.
    events: Vec<(Event, usize, usize)>,
}

impl Plan {
    fn noise(seed: u32, events: Vec<(Event, usize, usize)>) -> Self {
        Self { start: None, dt: 0.01, motion: Motion::Noise(seed), events }
    }

    fn rows(&self) -> Vec<Row> {
        let mut rows = moved(self.motion, self.dt);
        for (event, first, count) in &self.events {
            let before = rows[*first];
            for row in rows.iter_mut().skip(*first).take(*count) {
                apply(*event, row, &before);
            }
        }
        rows
    }

    fn start<T: Real>(&self) -> Option<Rotation<T>> {
        self.start.map(|turn| Rotation::of_turn(&Vector3::from(turn.map(T::literal))))
    }
}

fn moved(motion: Motion, dt: f64) -> Vec<Row> {
    match motion {
        Motion::Noise(seed) => {
            let mut noise = Noise::new(seed.into());
            let mut about =
                |middle: [f64; 3], size: f64| middle.map(|part| part + size * noise.value::<f64>());
            let mut row = |_| Row {
                dt,
                signals: [
                    about([0.1, -0.2, 0.3], 2.0),
                    about([1.0, 2.0, 9.0], 3.0),
                    about([3.0, 20.0, -40.0], 5.0),
                ],
            };
            (0..ROWS).map(&mut row).collect()
        }
        Motion::Turned { axis, every } => {
            let row = |n: usize| {
                let mut force = [0.0; 3];
                force[axis] = if (n / every).is_multiple_of(2) { 9.806_65 } else { -9.806_65 };
                Row { dt, signals: [[0.0; 3], force, [force[1], force[2], force[0]]] }
            };
            (0..ROWS).map(row).collect()
        }
    }
}

fn apply(event: Event, row: &mut Row, before: &Row) {
    match event {
        Event::Reads { signal, all: true, value } => row.signals[signal] = [value; 3],
        Event::Reads { signal, all: false, value } => row.signals[signal][1] = value,
        Event::Reversed { signal } => row.signals[signal] = row.signals[signal].map(|part| -part),
        Event::VerticalField => row.signals[FIELD] = row.signals[FORCE],
        Event::Still => {
            row.signals = [[0.01, 0.02, -0.01], before.signals[FORCE], before.signals[FIELD]];
        }
        Event::Steps(dt) => row.dt = dt,
    }
}

/// Every event that is to be met, with the number of rows for which it lasts.
fn every_event() -> Vec<(Event, usize)> {
    let missing = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e7, -1e7, 1e-35, 0.0];
    let of = |signal: usize| {
        missing.into_iter().flat_map(move |value| {
            [true, false].map(|all| (Event::Reads { signal, all, value }, 4))
        })
    };
    let mut events: Vec<_> = [GYRO, FORCE, FIELD].into_iter().flat_map(of).collect();
    // Longer than a gyro is held.
    events.push((Event::Reads { signal: GYRO, all: true, value: f64::NAN }, 30));
    for value in [RANGE, CLIPPED, -CLIPPED] {
        events.push((Event::Reads { signal: FORCE, all: false, value }, 2));
    }
    // From a quarter of a turn in a step to as many radians as a gyro may read at all.
    for value in [30.0, 300.0, 1e4, 9e5] {
        events.push((Event::Reads { signal: GYRO, all: true, value }, 2));
        events.push((Event::Reads { signal: GYRO, all: false, value: -value }, 1));
    }
    for signal in [GYRO, FORCE, FIELD] {
        events.push((Event::Reversed { signal }, 1));
        events.push((Event::Reversed { signal }, 20));
    }
    events.push((Event::VerticalField, 5));
    events.push((Event::Still, 60));
    for dt in [0.0, 1e-9, 0.1, 0.3, 0.999, 2.0, ETERNITY] {
        events.push((Event::Steps(dt), 1));
        events.push((Event::Steps(dt), 3));
    }
    events
}

fn plans() -> impl Strategy<Value = Plan> {
    let motion = prop_oneof![
        4 => any::<u32>().prop_map(Motion::Noise),
        1 => (0_usize..3, 1_usize..60).prop_map(|(axis, every)| Motion::Turned { axis, every }),
    ];
    // Some of them start with their first sample, some much later, most with the noise.
    let rows = prop_oneof![2 => Just(0_usize), 8 => 0_usize..ROWS];
    let event = (sample::select(every_event()), rows, option::of(1_usize..60));
    let event =
        event.prop_map(|((event, usual), first, count)| (event, first, count.unwrap_or(usual)));
    let start = option::of(sample::select(vec![
        [0.0; 3],
        [1.0, -2.0, 0.5],
        [3.0, 0.1, 0.0],
        [0.0, 1.5, 0.0],
    ]));
    let dt = sample::select(vec![0.002, 0.01, 0.013, 0.05]);
    (start, dt, motion, collection::vec(event, 0..6)).prop_map(|(start, dt, motion, events)| Plan {
        start,
        dt,
        motion,
        events,
    })
}

fn several_plans() -> impl Strategy<Value = [Plan; LANES]> {
    [plans(), plans(), plans(), plans()]
}

// -------------------------------------------------------------------------------------------------------- the check

/// What was met on the way.
#[derive(Default)]
struct Seen {
    flags: Flags,
    rest: bool,
    /// The largest bias on an axis in rad/s.
    bias: f64,
}

/// The numbers of a row, made of what one recording has or of what several have.
fn sample_of<T: Number>(field: bool, number: impl Fn(&dyn Fn(&Row) -> f64) -> T) -> Sample<T> {
    let vector = |signal: usize| {
        let part = |axis: usize| number(&move |row: &Row| row.signals[signal][axis]);
        Vector3::new(part(0), part(1), part(2))
    };
    Sample {
        dt: number(&|row| row.dt),
        gyro: vector(GYRO),
        force: vector(FORCE),
        field: field.then(|| vector(FIELD)),
    }
}

/// Runs every recording alone and all of them side by side: the flags, what is told and the states are the same after every
/// sample.
fn check<A: Attitude, T: Real>(
    filter: &A::Filter<T>,
    plans: &[Plan; LANES],
    field: bool,
    seen: &mut Seen,
) {
    let recordings = plans.each_ref().map(Plan::rows);
    let mut alone = plans.each_ref().map(|plan| A::start::<T>(plan.start()));
    let (wide, mut state) = (A::filter_in(filter, &mut Same), together::<A, T>(&alone));
    let rows_of_all = (0..ROWS).map(|n| from_fn::<_, LANES, _>(|lane| recordings[lane][n]));
    for (n, rows) in rows_of_all.enumerate() {
        let samples =
            sample_of(field, |part| Several(from_fn(|lane| T::literal(part(&rows[lane])))));
        let flags = A::step::<Several<T>>(&wide, &mut state, &samples);
        let told = A::told::<Several<T>>(&wide, &state);
        for (lane, alone) in alone.iter_mut().enumerate() {
            let sample = sample_of(field, |part| T::literal(part(&rows[lane])));
            let expected = A::step::<T>(filter, alone, &sample);
            assert_eq!(flags.0[lane], expected, "flags, row {n}, lane {lane}");
            let (told, expected) = (told.of(lane), A::told::<T>(filter, alone));
            assert_eq!(told.started, expected.started, "started, row {n}, lane {lane}");
            if expected.started {
                assert_eq!(told.bits(), expected.bits(), "told, row {n}, lane {lane}");
            }
            if let Some((rotation, up)) = A::attitude::<T>(filter, alone) {
                let expected = Told { rotation, up, ..expected };
                assert!(expected.started);
                assert_eq!(told.bits(), expected.bits(), "attitude, row {n}, lane {lane}");
            }
            let own = A::state_in(&state, &mut Lane(lane));
            assert_eq!(
                state_bits::<A, T>(&own),
                state_bits::<A, T>(alone),
                "state, row {n}, lane {lane}"
            );
            seen.flags |= flags.0[lane];
            seen.rest |= told.at_rest;
            for part in &told.bias {
                seen.bias = seen.bias.max(part.to_f64().abs());
            }
        }
    }
}

/// Every event in every lane, beside one that lies still, one that has not started, or one that has just done so.
fn check_every_event<A: Attitude, T: Real>(filter: &A::Filter<T>, field: bool) -> Seen {
    let nothing = Event::Reads { signal: FORCE, all: true, value: f64::NAN };
    let given = Plan { start: Some([1.0, -2.0, 0.5]), ..Plan::noise(1, Vec::new()) };
    let others = [
        Plan { events: vec![(Event::Still, 0, ROWS)], ..given.clone() },
        Plan::noise(2, vec![(nothing, 0, ROWS)]),
        Plan { dt: 0.013, ..Plan::noise(3, vec![(nothing, 0, 65)]) },
    ];
    let mut seen = Seen::default();
    let mut run = |one: Plan, other: Plan, turn: usize| {
        let mut plans = [one, other, others[turn % 3].clone(), others[(turn + 1) % 3].clone()];
        plans.rotate_right(turn % LANES);
        check::<A, T>(filter, &plans, field, &mut seen);
    };
    for (turn, (event, count)) in every_event().into_iter().enumerate() {
        // One that starts with it and meets it again, and one that has gone on for long.
        let one = Plan::noise(4, vec![(event, 0, count), (event, 70, count)]);
        run(one, Plan { events: vec![(event, 30, count)], ..given.clone() }, turn);
    }
    for axis in 0..3 {
        let over =
            Plan { motion: Motion::Turned { axis, every: 25 }, ..Plan::noise(0, Vec::new()) };
        run(Plan { start: (axis == 2).then_some([0.0; 3]), ..over.clone() }, over, axis);
    }
    // Four that are all there, and differ in nothing but their noise: then no branch is taken for the others' sake.
    check::<A, T>(
        filter,
        &[6, 7, 8, 9].map(|seed| Plan::noise(seed, Vec::new())),
        field,
        &mut seen,
    );
    seen
}

#[track_caller]
fn assert_seen(seen: &Seen, flags: &[Flags]) {
    for flag in flags {
        assert!(seen.flags.contains(*flag), "{flag:?} was never met, only {:?}", seen.flags);
    }
}

// ----------------------------------------------------------------------------------------------------- the filters

const FORMS: [MahonyForm; 3] = [MahonyForm::Explicit, MahonyForm::Passive, MahonyForm::Direct];
const BIAS_LIMIT: f64 = 0.02;

fn proportional<T: Real>(form: MahonyForm) -> Mahony<T, 1> {
    let filter = Mahony::new(FirstOrder::new(T::literal(0.4)).unwrap().chain(), form);
    filter.force_range(T::literal(RANGE)).unwrap().hold(T::literal(0.05)).unwrap()
}

fn with_bias<T: Real>(form: MahonyForm) -> Mahony<T, 2> {
    let chain = PiForm::new(T::literal(2.0), T::literal(1.0)).unwrap().chain();
    let filter = Mahony::new(chain, form).force_range(T::literal(RANGE)).unwrap();
    filter.bias_limit(T::literal(BIAS_LIMIT)).unwrap()
}

fn rest_rule<T: Real>() -> RestRule<T> {
    let rule = RestRule::default().time(T::literal(0.1)).unwrap().memory(T::literal(0.05)).unwrap();
    rule.bias_memory(T::literal(0.2)).unwrap()
}

fn gravity<T: Real, const N: usize>(design: Split<T, N>) -> GravityFilter<T, N> {
    GravityFilter::new(design).unwrap().rest(rest_rule()).force_range(T::literal(RANGE)).unwrap()
}

fn moved_ahead<T: Real, const N: usize>(filter: GravityFilter<T, N>) -> GravityFilter<T, N> {
    let filter = filter.delay(T::literal(0.004)).unwrap().advance(T::literal(0.01)).unwrap();
    filter.hold(T::literal(0.05)).unwrap()
}

/// Every second one with all that can be set.
fn every_gravity_filter<T: Real, const N: usize>() -> Vec<GravityFilter<T, N>> {
    let splits = (1..=N).map(|terms| gravity(split::<T, N>(T::literal(3.0), terms)));
    // One whose start is over after a few samples, too.
    let quick = gravity(butterworth::<T, N>(T::literal(20.0)).split(1).unwrap());
    let filters = splits.chain([quick]).enumerate();
    filters.map(|(n, filter)| if n % 2 == 0 { filter } else { moved_ahead(filter) }).collect()
}

fn self_calibrating<T: Real>() -> [SelfCalibratingFilter<T>; 2] {
    let t = T::literal;
    let filter = SelfCalibratingFilter::new(t(1.0), t(0.5)).unwrap().rest(rest_rule());
    let filter = filter.force_range(t(RANGE)).unwrap();
    let known = Matrix3::from_fn(|i, j| t(0.001) * t([1.0, -2.0, 3.0][(i + 2 * j) % 3]));
    let other = filter.delay(t(0.004)).unwrap().advance(t(0.01)).unwrap().hold(t(0.05)).unwrap();
    let other = other.calibrated(known).prior(t(0.05), t(0.05), t(0.02)).unwrap();
    [filter, other]
}

/// Flags that every filter may raise, with or without a magnetometer.
const COMMON: [Flags; 5] = [
    Flags::MEASUREMENT_MISSING,
    Flags::DERIVATIVE_HELD,
    Flags::DERIVATIVE_MISSING,
    Flags::NOT_STARTED,
    Flags::RESTARTED,
];

fn check_every_event_with_and_without_a_field<A: Attitude, T: Real>(filter: &A::Filter<T>) -> Seen {
    let without = check_every_event::<A, T>(filter, false);
    assert_seen(&without, &COMMON);
    assert!(!without.flags.contains(Flags::MAGNETOMETER_MISSING));
    let with = check_every_event::<A, T>(filter, true);
    assert_seen(&with, &COMMON);
    with
}

fn check_mahony_meets_every_event<T: Real>() {
    for form in FORMS {
        let seen = check_every_event_with_and_without_a_field::<Mahonys<1>, T>(&proportional(form));
        assert_seen(&seen, &[Flags::MAGNETOMETER_MISSING, Flags::AMBIGUOUS]);
        assert!(seen.bias == 0.0);
        let seen = check_every_event_with_and_without_a_field::<Mahonys<2>, T>(&with_bias(form));
        assert_seen(&seen, &[Flags::MAGNETOMETER_MISSING, Flags::AMBIGUOUS]);
        assert!(
            seen.bias > 0.5 * BIAS_LIMIT,
            "the limit of the bias was hardly met: {}",
            seen.bias
        );
    }
}

#[test]
fn mahony_meets_every_event() {
    check_mahony_meets_every_event::<f64>();
    check_mahony_meets_every_event::<f32>();
}

#[test]
fn mahony_of_directions_meets_every_event() {
    let filter = with_bias::<f64>(MahonyForm::Explicit);
    // Without a field nothing may be there at all.
    let seen = check_every_event::<MahonysOfDirections<2>, f64>(&filter, false);
    assert_seen(&seen, &COMMON);
    assert_seen(&seen, &[Flags::SENSOR_MISSING]);
    let filter = proportional::<f64>(MahonyForm::Explicit);
    let seen = check_every_event::<MahonysOfDirections<1>, f64>(&filter, true);
    assert_seen(&seen, &[Flags::SENSOR_MISSING, Flags::NOT_STARTED, Flags::RESTARTED]);
}

fn check_gravity_meets_every_event<T: Real, const N: usize>() {
    for filter in every_gravity_filter::<T, N>() {
        let seen = check_every_event_with_and_without_a_field::<Gravities<N>, T>(&filter);
        assert_seen(&seen, &[Flags::MAGNETOMETER_MISSING]);
        assert!(seen.rest && seen.bias > 0.005);
    }
}

#[test]
fn gravity_meets_every_event() {
    check_gravity_meets_every_event::<f64, 1>();
    check_gravity_meets_every_event::<f64, 2>();
    check_gravity_meets_every_event::<f64, 3>();
    check_gravity_meets_every_event::<f32, 2>();
}

fn check_self_calibrating_meets_every_event<T: Real>() {
    for filter in self_calibrating::<T>() {
        let seen = check_every_event_with_and_without_a_field::<SelfCalibrating, T>(&filter);
        assert_seen(&seen, &[Flags::MAGNETOMETER_MISSING]);
        assert!(seen.rest && seen.bias > 0.005);
    }
}

#[test]
fn self_calibrating_meets_every_event() {
    check_self_calibrating_meets_every_event::<f64>();
    check_self_calibrating_meets_every_event::<f32>();
}

#[test]
fn the_events_reach_what_is_rare() {
    let rows = Plan { start: Some([0.0; 3]), ..Plan::noise(1, Vec::new()) };
    let over = Plan { motion: Motion::Turned { axis: 2, every: 25 }, ..rows.clone() };
    let run = |plan: &Plan, count: usize| {
        let filter = gravity::<f64, 2>(split(20.0, 1));
        let mut state = Gravities::<2>::start(plan.start());
        for row in plan.rows().iter().take(count) {
            let sample = sample_of(false, |part| part(row));
            Gravities::<2>::step::<f64>(&filter, &mut state, &sample);
        }
        state
    };
    // Upside down from one sample to the next: the vertical goes through zero, and then the attitude turns over at once.
    let (before, after) = (run(&over, 25), run(&over, 50));
    assert!(before.rotation.up().z > 0.999 && after.rotation.up().z < -0.999);
    assert_eq!(after.rotation, Rotation { w: 0.0, v: Vector3::y() });
    // From a given attitude parameters are learnt within a few blocks, and the prior's limits hold them.
    let [_, filter] = self_calibrating::<f64>();
    let mut state = SelfCalibrating::start(rows.start());
    for row in &rows.rows() {
        let sample = sample_of(false, |part| part(row));
        SelfCalibrating::step::<f64>(&filter, &mut state, &sample);
    }
    assert!(state.age > 1e4 && state.settled);
    assert!(state.matrix.norm() > 1e-4 && state.delay != 0.0 && state.rest.bias.norm() > 1e-3);
}

fn nth<F: Copy>(filters: &[F], index: usize) -> F {
    filters[index % filters.len()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn mahony_alone_and_side_by_side(
        plans in several_plans(), field in any::<bool>(), form in sample::select(FORMS.to_vec())
    ) {
        let seen = &mut Seen::default();
        check::<Mahonys<1>, f64>(&proportional(form), &plans, field, seen);
        check::<Mahonys<2>, f64>(&with_bias(form), &plans, field, seen);
        check::<Mahonys<2>, f32>(&with_bias(form), &plans, field, seen);
        check::<MahonysOfDirections<2>, f64>(&with_bias(form), &plans, field, seen);
    }

    #[test]
    fn gravity_alone_and_side_by_side(plans in several_plans(), field in any::<bool>(), index in 0_usize..12) {
        let seen = &mut Seen::default();
        check::<Gravities<1>, f64>(&nth(&every_gravity_filter(), index), &plans, field, seen);
        check::<Gravities<2>, f64>(&nth(&every_gravity_filter(), index), &plans, field, seen);
        check::<Gravities<2>, f32>(&nth(&every_gravity_filter(), index), &plans, field, seen);
        check::<Gravities<3>, f64>(&nth(&every_gravity_filter(), index), &plans, field, seen);
    }

    #[test]
    fn self_calibrating_alone_and_side_by_side(plans in several_plans(), field in any::<bool>(), index in 0_usize..2) {
        let seen = &mut Seen::default();
        check::<SelfCalibrating, f64>(&self_calibrating()[index], &plans, field, seen);
        check::<SelfCalibrating, f32>(&self_calibrating()[index], &plans, field, seen);
    }
}
