//! Linear complementary filters: one observer on a chain of integrators.
//!
//! An absolute measurement `y` of level 0 is noisy at high frequency; an input `u`, the `M`-th
//! derivative of level 0, is wrong at low frequency. With `x_N ≡ 0`,
//!
//! ```text
//! ẋ_i = x_{i+1} + [i = M-1] u + k_{i+1} (y - x_0),      i = 0 … N-1
//! ```
//!
//! passes `y` through a low-pass and `u/s^M` through a high-pass whose sum is 1 at every frequency.
//!
//! | file | idea |
//! | --- | --- |
//! | `chain` | the recurrence: design, gains, state |
//! | `discrete` | gains at a sample period: backward Euler and matched poles |
//! | `split` | the same poles shared out otherwise between low-pass and high-pass |
//! | `placement`, `poles` | gains from wanted poles, and poles from coefficients |
//! | `stream` | samples as they come: missing, held, wrapped, late, at any time step |
//! | `elapsed` | the time since the last correction, and the gains for all of it |
//! | `held`, `flags` | the last value of a signal; what happened to a sample |
//! | `history` | past estimates, for a measurement that arrives late |
//! | `response` | frequency response of both branches |
//! | `block` | a block of samples as one affine map |
//! | the rest | one design a file |

mod block;
mod butterworth;
mod chain;
mod discrete;
mod elapsed;
mod first_order;
mod flags;
mod held;
mod history;
mod pi;
mod placement;
mod poles;
mod rate;
mod response;
mod second_order_inertial;
mod split;
mod stream;
mod third_order;

pub use block::{AffineMap, Motion, Runs, Transition};
pub use butterworth::Butterworth;
pub(crate) use chain::each;
pub use chain::{Chain, Gains, Recurrence, State};
pub use discrete::{Discretise, Matched};
pub use elapsed::Elapsed;
pub use first_order::{FirstOrder, alpha_to_tau, tau_to_alpha};
pub use flags::Flags;
pub use held::Held;
pub use history::{Hindsight, History, Past, longest_delay};
pub use pi::PiForm;
pub use poles::poles;
pub use rate::{RateFilter, RateGains, RateInputs, RateState};
pub use response::{FrequencyResponse, continuous_response, discrete_response};
pub use second_order_inertial::SecondOrderInertial;
pub use split::{Split, SplitGains};
pub use stream::{Input, Stream, StreamState};
pub use third_order::ThirdOrder;

/// A design that is a chain with checked coefficients: `chain()`, `at()` and the conversions.
macro_rules! chain_design {
    ($Design:ident<T $(, $N:ident)?>, $order:expr, $derivative_order:literal) => {
        impl<T: $crate::Real $(, const $N: usize)?> $Design<T $(, $N)?> {
            /// The chain of integrators with this design's coefficients.
            pub fn chain(&self) -> $crate::Chain<T, $order, $derivative_order> {
                self.chain
            }

            /// The gains at the sample period `dt` in seconds, by backward Euler.
            ///
            /// # Errors
            /// `dt` is not a time step, or a gain vanishes or overflows in the scalar type.
            pub fn at(
                &self,
                dt: T,
            ) -> Result<$crate::Gains<T, $order, $derivative_order>, $crate::Error> {
                $crate::Discretise::at(&self.chain, dt)
            }

            /// The design with matched poles, `z = exp(p dt)`, instead of backward Euler.
            pub fn matched(&self) -> $crate::Matched<T, $order, $derivative_order> {
                self.chain.matched()
            }
        }
    };
}
pub(crate) use chain_design;
