//! Gravity: from the accelerometer to angles, from body rates to angle rates, and the filter that fuses both.
//!
//! | file | idea |
//! | --- | --- |
//! | `tilt` | gravity to two angles, body rates to their rates, in three systems of axes |
//! | `tilt_filter` | two linear filters whose derivative depends on their own output |

mod tilt;
mod tilt_filter;

pub use tilt::{Axes, angle_rates, tilt};
pub use tilt_filter::{Rates, TiltFilter, TiltState};
