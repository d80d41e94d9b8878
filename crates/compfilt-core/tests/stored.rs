//! Designs, gains, states and flags can be stored and read again, to the bit.
#![cfg(feature = "serde")]

use compfilt_core::attitude::{GravityFilter, GravityState, Mahony, MahonyForm, MahonyState};
use compfilt_core::attitude::{SelfCalibratingFilter, SelfCalibrationState};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{Butterworth, Discretise, Dt, PiForm, RateFilter, Stream, StreamState};
use serde::{Serialize, de::DeserializeOwned};

/// What comes back is stored as the same bytes: NaN is not equal to itself, its bytes are.
fn again<S: Serialize + DeserializeOwned>(value: &S) -> S {
    let bytes = postcard::to_allocvec(value).unwrap();
    let read: S = postcard::from_bytes(&bytes).unwrap();
    assert_eq!(bytes, postcard::to_allocvec(&read).unwrap());
    read
}

#[test]
fn a_stream_goes_on_where_it_was() {
    let design = Butterworth::<f32, 4>::new(2.0).unwrap().chain();
    let stream = again(&Stream::new(design));
    let gains = again(&stream.design().at(0.01).unwrap());
    let mut state = again(&StreamState::new());
    stream.update(&gains, &mut state, 0.3, 0.1, &mut ());
    // In the middle of what is to be corrected.
    stream.predict(&gains, &mut state, 0.2, &mut ());
    stream.predict(&gains, &mut state, 0.3, &mut ());
    let mut stored = again(&state);
    for state in [&mut state, &mut stored] {
        let flags = stream.correct(&gains, state, 0.5, &mut ());
        assert_eq!(again(&flags), flags);
    }
    assert_eq!(state, stored);
}

#[test]
fn gains_of_every_form() {
    let split = Butterworth::<f64, 3>::new(2.0).unwrap().split(1).unwrap();
    let gains = again(&again(&split).at(0.01).unwrap());
    assert_eq!(gains, split.at(0.01).unwrap());
    let rate = RateFilter::new(1.0_f32).unwrap();
    assert_eq!(again(&again(&rate).at(0.01).unwrap()), rate.at(0.01).unwrap());
    let matched = PiForm::new(1.0_f32, 0.1).unwrap().matched();
    assert_eq!(again(&matched), matched);
}

#[test]
fn attitude_filters_go_on_where_they_were() {
    let (gyro, force) = (Vector3::new(0.1_f32, -0.2, 0.3), Vector3::new(0.5, 0.2, 9.7));
    let mahony = again(&Mahony::new(PiForm::new(1.0, 0.1).unwrap().chain(), MahonyForm::Passive));
    let gains = mahony.design().at(0.01).unwrap();
    let mut state = MahonyState::new();
    mahony.update(&gains, &mut state, &gyro, &force, None);
    assert_eq!(again(&state), state);

    let filter = again(&GravityFilter::<f32, 2>::second_order(3.0, 0.5).unwrap());
    let gains = again(&filter.at(0.01).unwrap());
    let mut state = GravityState::new();
    filter.update(&gains, &mut state, &gyro, &force, None);
    assert_eq!(again(&state), state);

    let filter = again(&SelfCalibratingFilter::<f32>::new(5.0, 0.5).unwrap());
    let mut state = SelfCalibrationState::new();
    filter.update(Dt::new(0.01).unwrap(), &mut state, &gyro, &force, None);
    assert_eq!(again(&state), state);
}
