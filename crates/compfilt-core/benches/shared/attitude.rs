//! The filters on the rotation group.

use super::{Run, STEPS};
use compfilt_core::attitude::{
    GravityFilter, GravityState, Mahony, MahonyForm, MahonyState, SelfCalibratingFilter,
    SelfCalibrationState,
};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Discretise, Dt, PiForm, Real};

/// A gyro and an accelerometer in motion.
fn motion<T: Real>() -> Vec<(Vector3<T>, Vector3<T>)> {
    let sample = |n: u16| {
        let (s, c) = (f64::from(n) * 0.01).sin_cos();
        let gyro = Vector3::new(s, c, s * c).map(T::literal);
        (gyro, Vector3::new(2.0 * s, 2.0 * c, 9.81).map(T::literal))
    };
    (0..).take(STEPS).map(sample).collect()
}

/// Every filter of attitude under its name.
pub(crate) fn every_filter<T: Real>(runner: &mut impl Run) {
    let motion = motion::<T>();
    let dt = T::literal(0.0035);
    for (name, form) in
        [("mahony, explicit", MahonyForm::Explicit), ("mahony, passive", MahonyForm::Passive)]
    {
        let design = PiForm::new(T::one(), T::literal(0.1)).expect("a design").chain();
        let filter = Mahony::new(design, form);
        let gains = filter.design().at(dt).expect("gains");
        runner.run(name, MahonyState::new(), &motion, |state, (gyro, force)| {
            filter.update(&gains, state, gyro, force, None)
        });
    }
    let filter = GravityFilter::second_order(T::literal(3.0), T::literal(0.5)).expect("a filter");
    let gains = filter.at(dt).expect("gains");
    runner.run("gravity filter", GravityState::new(), &motion, |state, (gyro, force)| {
        filter.update(&gains, state, gyro, force, None)
    });
    let filter = SelfCalibratingFilter::new(T::literal(5.0), T::literal(0.5)).expect("a filter");
    let dt = Dt::new(dt).expect("a time step");
    let start = SelfCalibrationState::new();
    runner.run("gravity filter, self-calibrating", start, &motion, |state, (gyro, force)| {
        filter.update(dt, state, gyro, force, None)
    });
}
