//! A lane of channels gives the bits of its channels one at a time, for every filter.

mod common;

use common::{Check, Kind, Noise, all_bits, bits, every_filter, gains};
use compfilt_core::nalgebra::{SVector, Vector3};
use compfilt_core::{Discretise, Element, Real, Recurrence, State};

/// Steps a lane of `L` channels beside the channels themselves.
struct Lanes<const L: usize>;

impl<T: Real, const L: usize> Check<T> for Lanes<L> {
    fn check<D: Discretise<T, N>, const N: usize>(&mut self, kind: Kind, design: D) {
        let mut noise = Noise::new(11);
        let mut channels = [State::at_rest::<T>(T::zero()); L];
        for (channel, start) in channels.iter_mut().zip(noise.values(L)) {
            *channel = State::at_rest::<T>(start);
        }
        let levels = core::array::from_fn(|i| SVector::from_fn(|c, _| channels[c].levels[i]));
        let mut lane: State<SVector<T, L>, N> = State { levels };
        for n in 0..200_u8 {
            let dt = T::literal(0.01 * f64::from(1 + n % 5));
            let (y, u) = (vector(&mut noise), vector(&mut noise));
            step(&gains(&design, dt), &mut lane, &mut channels, (y, u), n % 7 == 6);
            for (c, channel) in channels.iter().enumerate() {
                let found: Vec<_> = lane.levels.iter().map(|level| level[c]).collect();
                let wanted = all_bits(&channel.levels);
                assert_eq!(all_bits(&found), wanted, "{}, channel {c}, sample {n}", kind.name);
            }
        }
    }
}

fn vector<T: Real, const L: usize>(noise: &mut Noise) -> SVector<T, L> {
    SVector::from_fn(|_, _| noise.value())
}

/// One sample by `step`, or by a prediction with an input on a straight line and a correction.
fn step<T: Real, G: Recurrence<T, N>, const N: usize, const L: usize>(
    gains: &G,
    lane: &mut State<SVector<T, L>, N>,
    channels: &mut [State<T, N>; L],
    (y, u): (SVector<T, L>, SVector<T, L>),
    ramp: bool,
) {
    if ramp {
        gains.predict_ramp(lane, u, y);
        gains.correct(lane, y - lane.levels[0]);
    } else {
        gains.step(lane, y, u);
    }
    for (c, channel) in channels.iter_mut().enumerate() {
        if ramp {
            gains.predict_ramp(channel, u[c], y[c]);
            gains.correct(channel, y[c] - channel.levels[0]);
        } else {
            gains.step(channel, y[c], u[c]);
        }
    }
}

#[test]
fn eight_channels_in_single_precision() {
    every_filter::<f32>(3.0, 0.5, &mut Lanes::<8>);
}

#[test]
fn four_channels_in_double_precision() {
    every_filter::<f64>(3.0, 0.5, &mut Lanes::<4>);
}

#[test]
fn a_vector_in_both() {
    every_filter::<f32>(0.2, 0.1, &mut Lanes::<3>);
    every_filter::<f64>(0.2, 0.1, &mut Lanes::<3>);
}

/// Axes do not mix: a vector along one axis stays there.
#[test]
fn a_vector_is_filtered_axis_by_axis() {
    let gains = gains(&common::pi(2.0, 0.5), 0.01);
    let mut state = State::at_rest::<f64>(Vector3::neutral());
    for _ in 0..50 {
        gains.step(&mut state, Vector3::new(0.0, 1.0, 0.0), Vector3::zeros());
    }
    assert_eq!((bits(state.levels[0].x), bits(state.levels[0].z)), (0, 0));
    assert!(state.levels[0].y > 0.5);
}
