//! Gravity: from accelerometers to angles, from body rates to angle rates, and the filters that fuse both.
//!
//! | file | idea |
//! | --- | --- |
//! | `tilt` | gravity to two angles, body rates to their rates, in three systems of axes |
//! | `tilt_filter` | two linear filters whose derivative depends on their own output |
//! | `array` | gravity and the angular acceleration from several accelerometers: geometry, and what it can give |
//! | `least_squares` | the best weights of channels |
//! | `extraction` | the step of an array |
//! | `mean_rate` | one body rate from several gyros |
//! | `cube` | the balancing cube's pipeline of all these |

mod array;
mod cube;
mod extraction;
mod least_squares;
mod mean_rate;
mod tilt;
mod tilt_filter;

pub use crate::error::{BodyAxes, Failure, Quantity};
pub use array::{Accelerometer, AccelerometerArray, Form, Rate};
pub use cube::{Cube, CubeSample};
pub use extraction::{Extraction, SensorWeights};
pub use mean_rate::mean_rate;
pub use tilt::{Axes, angle_rates, tilt};
pub use tilt_filter::{Rates, TiltFilter, TiltState};
