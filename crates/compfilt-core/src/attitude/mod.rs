//! Attitude: filters on the rotation group.
//!
//! | file | idea |
//! | --- | --- |
//! | `rotation` | unit quaternions, and turns without a trigonometric function |
//! | `held_rate` | a gyro's rate that is held where it is missing |
//! | `mahony` | Mahony's explicit, passive and direct filters |

mod held_rate;
mod mahony;
mod rotation;

pub use held_rate::HeldRate;
pub use mahony::{Mahony, MahonyForm, MahonyState, Observation};
pub use rotation::Rotation;
