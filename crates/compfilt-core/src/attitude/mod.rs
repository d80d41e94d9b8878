//! Attitude: filters on the rotation group.
//!
//! | file | idea |
//! | --- | --- |
//! | `rotation` | unit quaternions, and turns without a trigonometric function |
//! | `vector` | three components in the arithmetic of a step |
//! | `sensors` | what the gravity filters know of their sensors |
//! | `held_rate` | a gyro's rate that is held where it is missing |
//! | `gravity_filter`, `gravity_state` | the vertical as a linear low-pass in the frame that the gyro turns |
//! | `self_calibration`, `calibration_state`, `calibration_block` | the same with the gyro's bias and sensitivity learnt from the motion |
//! | `strapdown`, `smoother` | the offline answer: a strapdown with a known calibration, smoothed forward and backward |
//! | `rest` | whether the body is at rest, and the gyro's bias while it is |
//! | `heading` | the heading by a magnetometer |
//! | `mahony`, `mahony_state` | Mahony's explicit, passive and direct filters |

mod calibration_block;
mod calibration_state;
mod gravity_filter;
mod gravity_state;
mod heading;
mod held_rate;
mod mahony;
mod mahony_state;
mod rest;
mod rotation;
mod self_calibration;
mod sensors;
mod smoother;
mod strapdown;
mod vector;

pub use calibration_block::{Block, Slope};
pub use calibration_state::SelfCalibrationState;
pub use gravity_filter::GravityFilter;
pub use gravity_state::GravityState;
pub use heading::{Heading, HeadingRule};
pub use held_rate::HeldRate;
pub use mahony::{Mahony, MahonyForm, Observation};
pub use mahony_state::MahonyState;
pub use rest::{Rest, RestRule};
pub use rotation::Rotation;
pub use self_calibration::SelfCalibratingFilter;
pub use smoother::{SmoothedAttitude, Smoother, SmootherBlock};
pub use strapdown::{Strapdown, StrapdownState};
