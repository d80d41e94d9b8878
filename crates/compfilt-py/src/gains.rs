//! The numbers of a design's gains at a sample rate, as a chip runs them: in f32.

use crate::batch::sampled_gains;
use crate::design::{Design, MAX_ORDER, Rule, as_array, for_chain};
use crate::errors::value_error;
use compfilt_core::linear::SplitGains;
use compfilt_core::{Chain, Gains, Recurrence};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;

/// Names and numbers, in the order in which the core's `from_parts` takes them.
pub(crate) type Parts = Vec<(&'static str, Vec<f32>)>;

impl Design {
    /// The coefficients, then the gains at the sample rate `fs` in Hz; those of the rate filter are the first-order filter's.
    pub(crate) fn parts_of_gains(&self, fs: f64, rule: Rule) -> PyResult<Parts> {
        self.check_rule(rule)?;
        let k = self.coefficients::<f32>()?;
        let gains = if self.split == self.order {
            self.parts_of_chain(&k, fs, rule)
        } else {
            self.parts_of_split(&k, fs)
        }?;
        let mut parts = vec![("coefficients", k)];
        parts.extend(gains);
        Ok(parts)
    }

    fn parts_of_chain(&self, k: &[f32], fs: f64, rule: Rule) -> PyResult<Parts> {
        macro_rules! parts {
            ($N:literal, $M:literal) => {{
                let chain = Chain::<f32, $N, $M>::new(as_array(k)).map_err(value_error)?;
                Ok(match rule {
                    Rule::BackwardEuler => of_chain(&sampled_gains::<f32, _, $N>(&chain, fs)?),
                    Rule::Matched => of_chain(&sampled_gains::<f32, _, $N>(&chain.matched(), fs)?),
                })
            }};
        }
        for_chain!(self.order, self.derivative_order, parts)
    }

    fn parts_of_split(&self, k: &[f32], fs: f64) -> PyResult<Parts> {
        macro_rules! parts {
            ($N:literal) => {{
                let chain = Chain::<f32, $N, 1>::new(as_array(k)).map_err(value_error)?;
                let split = chain.split(self.split).map_err(value_error)?;
                Ok(of_split(&sampled_gains::<f32, _, $N>(&split, fs)?))
            }};
        }
        match self.order {
            1 => parts!(1),
            2 => parts!(2),
            3 => parts!(3),
            4 => parts!(4),
            5 => parts!(5),
            _ => parts!(6),
        }
    }
}

fn of_chain<const N: usize, const M: usize>(gains: &Gains<f32, N, M>) -> Parts {
    vec![
        ("shifts", gains.shifts().to_vec()),
        ("ramp", gains.ramp().to_vec()),
        ("correction", gains.correction().to_vec()),
    ]
}

fn of_split<const N: usize>(gains: &SplitGains<f32, N>) -> Parts {
    vec![
        ("dt", vec![gains.dt()]),
        ("half_dt", vec![*gains.half_dt()]),
        ("feedback", gains.feedback().to_vec()),
        ("damping", vec![*gains.damping()]),
        ("correction", gains.correction().to_vec()),
    ]
}
