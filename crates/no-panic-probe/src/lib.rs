//! What runs per sample, one function each: `scripts/check_no_panic.sh` links them without std and looks for a way to panic or to
//! allocate, `scripts/firmware` does so for microcontrollers, and counts what each one costs there.
#![no_std]

use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyState, Observation, SelfCalibratingFilter,
    SelfCalibrationState,
};
use compfilt_core::gravity::{
    Axes, Cube, CubeSample, Extraction, SensorWeights, mean_rate, tilt,
};
use compfilt_core::linear::{Flags, RateGains, RateState, SplitGains};
use compfilt_core::nalgebra::{Matrix3, SVector, Vector1, Vector2, Vector3};
use compfilt_core::{
    Chain, Discretise, Dt, Gains, History, Matched, Observer, ObserverState, Past, Recurrence,
    Split, State, Stream, StreamState, TiltFilter, TiltState,
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

macro_rules! probe {
    ($($name:ident($($argument:ident: $Type:ty),*) -> $Output:ty $body:block)*) => {$(
        #[unsafe(no_mangle)]
        pub fn $name($($argument: $Type),*) -> $Output $body
    )*};
}

probe! {
    probe_first_order(g: &Gains<f32, 1, 1>, s: &mut State<f32, 1>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_pi(g: &Gains<f32, 2, 1>, s: &mut State<f32, 2>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_third_order(g: &Gains<f32, 3, 2>, s: &mut State<f32, 3>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_butterworth_2(g: &Gains<f32, 2, 1>, s: &mut State<f32, 2>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_butterworth_6(g: &Gains<f64, 6, 1>, s: &mut State<f64, 6>, y: f64, u: f64) -> f64 { g.step(s, y, u) }
    probe_split_2(g: &SplitGains<f32, 2>, s: &mut State<f32, 2>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_split(g: &SplitGains<f32, 3>, s: &mut State<f32, 3>, y: f32, u: f32) -> f32 { g.step(s, y, u) }
    probe_vector(g: &SplitGains<f32, 2>, s: &mut State<Vector3<f32>, 2>, y: &Vector3<f32>) -> () {
        g.step(s, *y, Vector3::zeros());
    }
    probe_predict(g: &Gains<f32, 4, 3>, s: &mut State<f32, 4>, u: f32) -> () { g.predict(s, u) }
    probe_ramp(g: &Gains<f32, 4, 3>, s: &mut State<f32, 4>, u: f32, v: f32) -> () { g.predict_ramp(s, u, v) }
    probe_correct(g: &Gains<f32, 4, 3>, s: &mut State<f32, 4>, e: f32) -> () { g.correct(s, e) }
    probe_rate(g: &RateGains<f32>, s: &mut RateState<f32>, gyro: f32, a: f32) -> f32 { g.update(s, gyro, a) }
    probe_gains(c: &Chain<f32, 3, 2>, dt: f32) -> Option<Gains<f32, 3, 2>> { Dt::new(dt).ok().map(|dt| c.gains(dt)) }
    probe_matched(c: &Matched<f32, 3, 2>, dt: f32) -> Option<Gains<f32, 3, 2>> { Dt::new(dt).ok().map(|dt| c.gains(dt)) }
    probe_stream_pi(c: &Stream<f32, Chain<f32, 2, 1>>, g: &Gains<f32, 2, 1>, s: &mut StreamState<f32, 2>, y: f32, u: f32) -> Flags {
        c.update(g, s, y, u, &mut ())
    }
    probe_stream(
        c: &Stream<f32, Chain<f32, 4, 3>>, g: &Gains<f32, 4, 3>, s: &mut StreamState<f32, 4>, y: f32, u: f32
    ) -> Flags { c.update(g, s, y, u, &mut ()) }
    probe_stream_split(
        c: &Stream<f32, Split<f32, 3>>, g: &SplitGains<f32, 3>, s: &mut StreamState<f32, 3>, y: f32, u: f32
    ) -> Flags { c.update(g, s, y, u, &mut ()) }
    probe_delayed(
        c: &Stream<f32, Chain<f32, 3, 2>>, g: &Gains<f32, 3, 2>, s: &mut StreamState<f32, 3>,
        h: &mut History<f32, [Past<f32>; 32]>, y: f32, u: f32
    ) -> Flags { c.update(g, s, y, u, h) }
    probe_tilt(
        c: &TiltFilter<f32, Chain<f32, 2, 1>>, g: &Gains<f32, 2, 1>, s: &mut TiltState<f32, 2>, gyro: &Vector3<f32>,
        f: &Vector3<f32>
    ) -> Flags { c.update(g, s, gyro, f) }
    probe_extraction(e: &Extraction<f32, [SensorWeights<f32>; 6]>, f: &[Vector3<f32>; 6], w: &Vector3<f32>) -> Vector3<f32> {
        e.step(f, w)
    }
    probe_mean_rate(s: &[Matrix3<f32>; 6], w: &[Vector3<f32>; 6]) -> Vector3<f32> { mean_rate(s, w).0 }
    probe_cube_first_order(
        c: &Cube<f32, Chain<f32, 1, 1>, 6>, g: &Gains<f32, 1, 1>, s: &mut TiltState<f32, 1>, w: &[Vector3<f32>; 6],
        f: &[Vector3<f32>; 6], wheels: &Vector3<f32>
    ) -> CubeSample<f32> { c.update(g, s, w, f, wheels) }
    probe_cube(
        c: &Cube<f32, Chain<f32, 2, 1>, 6>, g: &Gains<f32, 2, 1>, s: &mut TiltState<f32, 2>, w: &[Vector3<f32>; 6],
        f: &[Vector3<f32>; 6], wheels: &Vector3<f32>
    ) -> CubeSample<f32> { c.update(g, s, w, f, wheels) }
    probe_observer(
        o: &Observer<f32, 3, 2, 1>, s: &mut ObserverState<f32, 3, 2, 1>, y: &Vector2<f32>, u: &Vector1<f32>
    ) -> SVector<f32, 3> {
        let (filtered, _) = o.correct(s, y);
        o.predict(s, u);
        filtered
    }
    probe_observer_correct(
        o: &Observer<f32, 3, 2, 1>, s: &mut ObserverState<f32, 3, 2, 1>, y: &Vector2<f32>
    ) -> SVector<f32, 3> { o.correct(s, y).0 }
    probe_observer_predict(
        o: &Observer<f32, 3, 2, 1>, s: &mut ObserverState<f32, 3, 2, 1>, u: &Vector1<f32>
    ) -> Flags { o.predict(s, u) }
    probe_tilt_of_gravity(f: &Vector3<f32>) -> Option<Vector2<f32>> { tilt(Axes::Flu, f) }
    probe_mahony_explicit(
        c: &Mahony<f32, 2>, g: &Gains<f32, 2, 1>, s: &mut MahonyState<f32>, w: &Vector3<f32>, f: &Vector3<f32>
    ) -> Flags { c.update(g, s, w, f, None) }
    probe_mahony(
        c: &Mahony<f32, 2>, g: &Gains<f32, 2, 1>, s: &mut MahonyState<f32>, w: &Vector3<f32>, f: &Vector3<f32>,
        m: &Vector3<f32>
    ) -> Flags { c.update(g, s, w, f, Some(m)) }
    probe_observations(
        c: &Mahony<f32, 2>, g: &Gains<f32, 2, 1>, s: &mut MahonyState<f32>, w: &Vector3<f32>, o: &[Observation<f32>; 4]
    ) -> Flags { c.update_with(g, s, w, o) }
    probe_gravity(
        c: &GravityFilter<f32, 2>, g: &SplitGains<f32, 2>, s: &mut GravityState<f32, 2>, w: &Vector3<f32>, f: &Vector3<f32>
    ) -> Flags { c.update(g, s, w, f, None) }
    probe_gravity_filter(
        c: &GravityFilter<f32, 2>, g: &SplitGains<f32, 2>, s: &mut GravityState<f32, 2>, w: &Vector3<f32>, f: &Vector3<f32>,
        m: &Vector3<f32>
    ) -> Flags { c.update(g, s, w, f, Some(m)) }
    probe_self_calibrating(
        c: &SelfCalibratingFilter<f32>, dt: Dt<f32>, s: &mut SelfCalibrationState<f32>, w: &Vector3<f32>, f: &Vector3<f32>
    ) -> Flags { c.update(dt, s, w, f, None) }
    probe_self_calibration(
        c: &SelfCalibratingFilter<f32>, dt: f32, s: &mut SelfCalibrationState<f32>, w: &Vector3<f32>, f: &Vector3<f32>,
        m: &Vector3<f32>
    ) -> Option<Flags> { Dt::new(dt).ok().map(|dt| c.update(dt, s, w, f, Some(m))) }
}
