//! First order, PI, Butterworth of order 2, third order, and chains of these orders.

use crate::border::{Mirror, given, given_mut, is_bool, store_flags};
use crate::status::Status;
use compfilt_core::linear::Held;
use compfilt_core::linear::{Elapsed, Flags};
use compfilt_core::{
    Butterworth, Chain, Error, FirstOrder, Gains, PiForm, State, Stream, StreamState, ThirdOrder,
};

/// What lies in memory as a filter of C does.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Core<const N: usize, const M: usize> {
    pub(crate) stream: Stream<f32, Chain<f32, N, M>>,
    pub(crate) gains: Gains<f32, N, M>,
}

/// A filter of order 1 at one sample period: constant while it runs, and may lie in flash.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Filter1 {
    /// k_1 in 1/s.
    pub coefficients: [f32; 1],
    /// 0: u is the mean over the step that it ends; 1: u is instantaneous, on a straight line from the sample before.
    pub input: u8,
    /// Wraps the innovation into half of it to both sides: 2 pi for an angle in rad. 0: not at all.
    pub period: f32,
    /// For how many seconds a missing u keeps its last value; then it counts as 0.
    pub hold: f32,
    /// The most seconds for which the one measurement after a gap counts.
    pub gap_cap: f32,
    /// The sample period in s.
    pub shifts: [f32; 1],
    /// What a ramp of u adds.
    pub ramp: [f32; 1],
    /// What the innovation is multiplied by.
    pub correction: [f32; 1],
}

/// A filter of order 2 with the first derivative as input: PI, Butterworth, or a chain. Fields as in CompfiltFilter1.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Filter2 {
    /// k_1, k_2 in 1/s, 1/s^2.
    pub coefficients: [f32; 2],
    /// 0: mean; 1: instantaneous.
    pub input: u8,
    /// For the innovation; 0: none.
    pub period: f32,
    /// In s.
    pub hold: f32,
    /// In s.
    pub gap_cap: f32,
    /// The sample period in s, and its power.
    pub shifts: [f32; 2],
    /// What a ramp of u adds.
    pub ramp: [f32; 2],
    /// What the innovation is multiplied by, for every level.
    pub correction: [f32; 2],
}

/// A filter of order 3 with the second derivative as input: position from an acceleration. Fields as in CompfiltFilter1.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Filter3 {
    /// k_1, k_2, k_3 in 1/s, 1/s^2, 1/s^3.
    pub coefficients: [f32; 3],
    /// 0: mean; 1: instantaneous.
    pub input: u8,
    /// For the innovation; 0: none.
    pub period: f32,
    /// In s.
    pub hold: f32,
    /// In s.
    pub gap_cap: f32,
    /// The sample period in s, and its powers.
    pub shifts: [f32; 3],
    /// What a ramp of u adds.
    pub ramp: [f32; 3],
    /// What the innovation is multiplied by, for every level.
    pub correction: [f32; 3],
}

/// The state of a filter of order 1. Read the levels; leave the rest to the library.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct State1 {
    /// The estimate; NaN before the start.
    pub levels: [f32; 1],
    /// The levels after the last correction.
    pub start: [f32; 1],
    /// What u has added since.
    pub driven: [f32; 1],
    /// Seconds since the last correction.
    pub elapsed: f32,
    /// The last u.
    pub input: f32,
    /// Its age in s.
    pub input_age: f32,
    /// Whether the levels are known.
    pub started: u8,
    /// What has happened since the last correction: 0 nothing, 1 one step, 2 one long step.
    pub pending: u8,
}

/// The state of a filter of order 2: level 1 is minus the error of u. Fields as in CompfiltState1.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct State2 {
    /// The estimate, and minus the error of u.
    pub levels: [f32; 2],
    /// The levels after the last correction.
    pub start: [f32; 2],
    /// What u has added since.
    pub driven: [f32; 2],
    /// Seconds since the last correction.
    pub elapsed: f32,
    /// The last u.
    pub input: f32,
    /// Its age in s.
    pub input_age: f32,
    /// Whether the levels are known.
    pub started: u8,
    /// As in CompfiltState1.
    pub pending: u8,
}

/// The state of a filter of order 3: position, velocity, minus the error of u. Fields as in CompfiltState1.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct State3 {
    /// Position, velocity, minus the error of u.
    pub levels: [f32; 3],
    /// The levels after the last correction.
    pub start: [f32; 3],
    /// What u has added since.
    pub driven: [f32; 3],
    /// Seconds since the last correction.
    pub elapsed: f32,
    /// The last u.
    pub input: f32,
    /// Its age in s.
    pub input_age: f32,
    /// Whether the levels are known.
    pub started: u8,
    /// As in CompfiltState1.
    pub pending: u8,
}

/// A state of C that is copied into the core's and back.
pub(crate) trait Stored<const N: usize> {
    fn load(&self) -> Result<StreamState<f32, N>, Status>;
    fn save(&mut self, state: &StreamState<f32, N>);
}

macro_rules! linear {
    ($Filter:ident, $State:ident, $N:literal, $M:literal) => {
        // SAFETY: `Core` holds the same numbers in the same order, the first ones in a `Stream`; all are aligned to four bytes.
        // `input` is the only byte that not every value is good for.
        unsafe impl Mirror for $Filter {
            type Core = Core<$N, $M>;

            fn is_valid(&self) -> bool {
                is_bool(self.input)
            }
        }

        impl $State {
            /// Of a filter that has done nothing yet.
            pub(crate) const NOTHING: Self = Self {
                levels: [0.0; $N],
                start: [0.0; $N],
                driven: [0.0; $N],
                elapsed: 0.0,
                input: 0.0,
                input_age: 0.0,
                started: 0,
                pending: 0,
            };
        }

        impl Stored<$N> for $State {
            fn load(&self) -> Result<StreamState<f32, $N>, Status> {
                if !is_bool(self.started) {
                    return Err(Status::Struct);
                }
                let [start, driven] = [self.start, self.driven].map(|levels| State { levels });
                let elapsed = match self.pending {
                    0 => Elapsed::None,
                    1 => Elapsed::One { dt: self.elapsed },
                    2 => Elapsed::LongStep { time: self.elapsed, start, driven },
                    _ => return Err(Status::Struct),
                };
                Ok(StreamState {
                    levels: State { levels: self.levels },
                    started: self.started == 1,
                    input: Held { value: self.input, age: self.input_age },
                    elapsed,
                })
            }

            fn save(&mut self, state: &StreamState<f32, $N>) {
                self.levels = state.levels.levels;
                self.input = state.input.value;
                self.input_age = state.input.age;
                self.started = u8::from(state.started);
                match state.elapsed {
                    Elapsed::One { dt } => (self.elapsed, self.pending) = (dt, 1),
                    Elapsed::LongStep { time, start, driven } => {
                        (self.elapsed, self.pending) = (time, 2);
                        (self.start, self.driven) = (start.levels, driven.levels);
                    }
                    // Chains with a derivative order of up to 2 take one long step instead of placing poles.
                    Elapsed::None | Elapsed::Placed { .. } => {
                        (self.elapsed, self.pending) = (0.0, 0)
                    }
                }
            }
        }
    };
}

linear!(Filter1, State1, 1, 1);
linear!(Filter2, State2, 2, 1);
linear!(Filter3, State3, 3, 2);

/// Makes a filter, and stores it.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
unsafe fn make<F: Mirror<Core = Core<N, M>>, const N: usize, const M: usize>(
    design: Result<Chain<f32, N, M>, Error>,
    dt: f32,
    filter: *mut F,
) -> Result<(), Status>
where
    Chain<f32, N, M>: compfilt_core::Discretise<f32, N, Gains = Gains<f32, N, M>>,
{
    // SAFETY: the caller's promise is the same.
    let place = unsafe { given_mut(filter) }?;
    let chain = design?;
    let gains = compfilt_core::Discretise::at(&chain, dt)?;
    place.store(Core { stream: Stream::new(chain), gains });
    Ok(())
}

/// Moves a state on by `work`, and stores it with its flags.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
unsafe fn advance<F, S, const N: usize, const M: usize>(
    filter: *const F,
    state: *mut S,
    flags: *mut u8,
    work: impl FnOnce(&Core<N, M>, &mut StreamState<f32, N>) -> Flags,
) -> Result<(), Status>
where
    F: Mirror<Core = Core<N, M>>,
    S: Stored<N>,
{
    // SAFETY: the caller's promise is the same.
    let (filter, place) = unsafe { (given(filter)?.core()?, given_mut(state)?) };
    let mut state = place.load()?;
    let raised = work(filter, &mut state);
    place.save(&state);
    // SAFETY: the caller's promise is the same.
    unsafe { store_flags(flags, raised) };
    Ok(())
}

/// Stores a state whatever was there before.
///
/// # Safety
/// `place` is NULL, or points to a state that nobody else uses.
unsafe fn start<S: Stored<N>, const N: usize>(
    place: *mut S,
    state: StreamState<f32, N>,
    nothing: S,
) -> Result<(), Status> {
    // SAFETY: the caller's promise is the same.
    let place = unsafe { given_mut(place) }?;
    *place = nothing;
    place.save(&state);
    Ok(())
}

/// First order with the time constant `tau` in s, at the sample period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_first_order(tau: f32, dt: f32, filter: *mut Filter1) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { make(FirstOrder::new(tau).map(|design| design.chain()), dt, filter) }.into()
}

/// PI form with the gains `kp` in 1/s and `ki` in 1/s^2, at the sample period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_pi(kp: f32, ki: f32, dt: f32, filter: *mut Filter2) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { make(PiForm::new(kp, ki).map(|design| design.chain()), dt, filter) }.into()
}

/// Butterworth of order 2 at `omega0` in rad/s with the quality factor `q` (1 is Butterworth), at the sample period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_butterworth(
    omega0: f32,
    q: f32,
    dt: f32,
    filter: *mut Filter2,
) -> Status {
    let design = Butterworth::<f32, 2>::with_q(omega0, q);
    // SAFETY: the caller's promise is the same.
    unsafe { make(design.map(|design| design.chain()), dt, filter) }.into()
}

/// Third order with a triple pole at -1/`tau`, `tau` in s, at the sample period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_third_order(tau: f32, dt: f32, filter: *mut Filter3) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { make(ThirdOrder::new(tau).map(|design| design.chain()), dt, filter) }.into()
}

/// Third order with the gains themselves, in 1/s, 1/s^2, 1/s^3, at the sample period `dt` in s.
///
/// # Safety
/// `filter` is NULL, or points to a filter that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_third_order_from_gains(
    k1: f32,
    k2: f32,
    k3: f32,
    dt: f32,
    filter: *mut Filter3,
) -> Status {
    let design = ThirdOrder::from_gains(k1, k2, k3);
    // SAFETY: the caller's promise is the same.
    unsafe { make(design.map(|design| design.chain()), dt, filter) }.into()
}

/// Starts a filter of order 1: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_1(state: *mut State1) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, StreamState::new(), State1::NOTHING) }.into()
}

/// Starts a filter of order 1 from a known level 0; the others are zero. A NaN or infinite level is refused.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_1_at(state: *mut State1, level0: f32) -> Status {
    let mut started = StreamState::new();
    started.start(level0);
    if !(state.is_null() || level0.is_finite()) {
        return Status::Sample;
    }
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, started, State1::NOTHING) }.into()
}

/// One sample of a filter of order 1: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
/// NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_update_1(
    filter: *const Filter1,
    state: *mut State1,
    y: f32,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 1>| {
        core.stream.update(&core.gains, state, y, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Predicts a filter of order 1 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_1`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_predict_1(
    filter: *const Filter1,
    state: *mut State1,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 1>| {
        core.stream.predict(&core.gains, state, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Corrects a filter of order 1 by `y`, for all the time since the last correction. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_1`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_correct_1(
    filter: *const Filter1,
    state: *mut State1,
    y: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 1>| {
        core.stream.correct(&core.gains, state, y, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Starts a filter of order 2: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_2(state: *mut State2) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, StreamState::new(), State2::NOTHING) }.into()
}

/// Starts a filter of order 2 from a known level 0; the others are zero. A NaN or infinite level is refused.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_2_at(state: *mut State2, level0: f32) -> Status {
    let mut started = StreamState::new();
    started.start(level0);
    if !(state.is_null() || level0.is_finite()) {
        return Status::Sample;
    }
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, started, State2::NOTHING) }.into()
}

/// One sample of a filter of order 2: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
/// NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_update_2(
    filter: *const Filter2,
    state: *mut State2,
    y: f32,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 2>| {
        core.stream.update(&core.gains, state, y, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Predicts a filter of order 2 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_2`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_predict_2(
    filter: *const Filter2,
    state: *mut State2,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 2>| {
        core.stream.predict(&core.gains, state, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Corrects a filter of order 2 by `y`, for all the time since the last correction. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_2`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_correct_2(
    filter: *const Filter2,
    state: *mut State2,
    y: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 2>| {
        core.stream.correct(&core.gains, state, y, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Starts a filter of order 3: it waits for the first measurement.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_3(state: *mut State3) -> Status {
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, StreamState::new(), State3::NOTHING) }.into()
}

/// Starts a filter of order 3 from a known level 0; the others are zero. A NaN or infinite level is refused.
///
/// # Safety
/// `state` is NULL, or points to a state that nobody else uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_start_3_at(state: *mut State3, level0: f32) -> Status {
    let mut started = StreamState::new();
    started.start(level0);
    if !(state.is_null() || level0.is_finite()) {
        return Status::Sample;
    }
    // SAFETY: the caller's promise is the same.
    unsafe { start(state, started, State3::NOTHING) }.into()
}

/// One sample of a filter of order 3: predicts with `u`, corrects by `y`. What is NaN or infinite is missing. `flags` may be
/// NULL.
///
/// # Safety
/// The pointers are NULL, or point to what they say; nobody else uses the state or the flags, nobody changes the filter.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_update_3(
    filter: *const Filter3,
    state: *mut State3,
    y: f32,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 3>| {
        core.stream.update(&core.gains, state, y, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Predicts a filter of order 3 by its sample period with `u`, where `y` comes more rarely. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_3`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_predict_3(
    filter: *const Filter3,
    state: *mut State3,
    u: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 3>| {
        core.stream.predict(&core.gains, state, u, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}

/// Corrects a filter of order 3 by `y`, for all the time since the last correction. `flags` may be NULL.
///
/// # Safety
/// As for `compfilt_update_3`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn compfilt_correct_3(
    filter: *const Filter3,
    state: *mut State3,
    y: f32,
    flags: *mut u8,
) -> Status {
    let work = |core: &Core<_, _>, state: &mut StreamState<f32, 3>| {
        core.stream.correct(&core.gains, state, y, &mut ())
    };
    // SAFETY: the caller's promise is the same.
    unsafe { advance(filter, state, flags, work) }.into()
}
