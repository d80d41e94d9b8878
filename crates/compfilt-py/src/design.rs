//! A design as Python holds it, and the way from its run-time order to the core's types.

use crate::errors::value_error;
use compfilt_core::linear::{
    FrequencyResponse, continuous_response, discrete_response, longest_delay, poles,
};
use compfilt_core::nalgebra::Complex;
use compfilt_core::{
    Butterworth, Chain, Discretise, Error, FirstOrder, PiForm, RateFilter, Real,
    SecondOrderInertial, ThirdOrder,
};
use pyo3::PyResult;
use pyo3::exceptions::PyValueError;
use std::fmt::{self, Display, Formatter};

/// The highest order of a chain.
pub(crate) const MAX_ORDER: usize = 6;

/// An order or a number of terms: from 1 to the highest order.
pub(crate) fn small(name: &str, value: i64) -> PyResult<usize> {
    match usize::try_from(value) {
        Ok(small @ 1..=MAX_ORDER) => Ok(small),
        _ => Err(PyValueError::new_err(format!(
            "{name} must lie between 1 and {MAX_ORDER}, got {value}"
        ))),
    }
}

/// What a person wants; the parameters are rounded to the scalar type only when the filter is made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    FirstOrder { tau: f64 },
    PiForm { kp: f64, ki: f64 },
    Butterworth { omega0: f64, order: usize, q: f64 },
    ThirdOrder { tau: f64 },
    ThirdOrderGains { k1: f64, k2: f64, k3: f64 },
    ThirdOrderButterworth { omega0: f64 },
    SecondOrderInertial { tau: f64 },
    SecondOrderInertialButterworth { omega0: f64 },
    Chain { coefficients: Vec<f64>, derivative_order: usize },
    Rate { tau: f64 },
}

/// A checked design.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Design {
    pub(crate) kind: Kind,
    /// The number of terms in the low-pass; the order where the caller named none.
    pub(crate) split: usize,
    pub(crate) order: usize,
    pub(crate) derivative_order: usize,
}

/// How gains are made from a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    BackwardEuler,
    Matched,
}

/// What tells apart the states that a filter can go on from; in words only where a state is made or taken.
#[derive(Clone, Copy)]
pub(crate) struct KindOfState {
    family: &'static str,
    derivative_order: usize,
    split: usize,
    rule: Rule,
}

impl Display for KindOfState {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { family, derivative_order, split, rule } = self;
        let rule = if *rule == Rule::Matched { "matched" } else { "backward_euler" };
        write!(f, "{family}, derivative_order {derivative_order}, split {split}, {rule}")
    }
}

/// Something to do with a design once its type is known.
pub(crate) trait Visitor<T: Real> {
    type Output;

    fn visit<D, const N: usize>(self, design: D) -> Self::Output
    where
        D: Discretise<T, N> + Send + Sync + 'static,
        D::Gains: Send + Sync;
}

/// Calls `$action!(N, M)` for the run-time order and derivative order.
macro_rules! for_chain {
    ($order:expr, $derivative_order:expr, $action:ident) => {
        match ($order, $derivative_order) {
            (1, 1) => $action!(1, 1),
            (2, 1) => $action!(2, 1),
            (2, 2) => $action!(2, 2),
            (3, 1) => $action!(3, 1),
            (3, 2) => $action!(3, 2),
            (3, 3) => $action!(3, 3),
            (4, 1) => $action!(4, 1),
            (4, 2) => $action!(4, 2),
            (4, 3) => $action!(4, 3),
            (4, 4) => $action!(4, 4),
            (5, 1) => $action!(5, 1),
            (5, 2) => $action!(5, 2),
            (5, 3) => $action!(5, 3),
            (5, 4) => $action!(5, 4),
            (5, 5) => $action!(5, 5),
            (6, 1) => $action!(6, 1),
            (6, 2) => $action!(6, 2),
            (6, 3) => $action!(6, 3),
            (6, 4) => $action!(6, 4),
            (6, 5) => $action!(6, 5),
            (6, 6) => $action!(6, 6),
            (order, derivative_order) => Err(PyValueError::new_err(format!(
                "derivative_order must lie between 1 and the order, and the order between 1 and {MAX_ORDER}: \
                 got derivative_order {derivative_order} and order {order}"
            ))),
        }
    };
}

pub(crate) use for_chain;

/// A design's coefficients as an array, for what does not depend on the derivative order.
macro_rules! for_order {
    ($design:expr, $k:ident => $body:expr) => {{
        let coefficients = $design.coefficients::<f64>()?;
        macro_rules! visit {
            ($N:literal) => {{
                let $k = as_array::<f64, $N>(&coefficients);
                $body
            }};
        }
        match $design.order {
            1 => visit!(1),
            2 => visit!(2),
            3 => visit!(3),
            4 => visit!(4),
            5 => visit!(5),
            _ => visit!(6),
        }
    }};
}

impl Design {
    /// Checks the parameters in both scalar types' larger one; float32 is checked when it is used.
    pub(crate) fn new(kind: Kind, split: Option<usize>) -> PyResult<Self> {
        let (order, derivative_order) = kind.orders();
        let split = split.unwrap_or(order);
        let design = Self { kind, split, order, derivative_order };
        if split != order && derivative_order != 1 {
            return Err(PyValueError::new_err(
                "split must be the order unless derivative_order is 1",
            ));
        }
        design.with::<f64, _>(Rule::BackwardEuler, Check)?;
        Ok(design)
    }

    /// Whether the integral of the second input runs beside the filter: the rate filter.
    pub(crate) fn is_rate(&self) -> bool {
        matches!(self.kind, Kind::Rate { .. })
    }

    /// What a state must have come from to be continued with this design, whatever its gains.
    pub(crate) fn kind_of_state(&self, family: &'static str, rule: Rule) -> KindOfState {
        let family = if self.is_rate() { "rate" } else { family };
        let Self { split, derivative_order, .. } = *self;
        KindOfState { family, derivative_order, split, rule }
    }

    /// Which level is minus the error of the derivative, if any is.
    pub(crate) fn bias_level(&self) -> Option<usize> {
        (self.split == self.order && self.order > self.derivative_order)
            .then_some(self.derivative_order)
    }

    /// The names of the levels.
    pub(crate) fn level_names(&self) -> Vec<String> {
        let motion: &[&str] = match self.derivative_order {
            _ if self.is_rate() => &["rate"],
            1 => &["angle"],
            _ => &["position", "velocity", "acceleration"],
        };
        let bias = self.bias_level();
        (0..self.order)
            .map(|level| match motion.get(level) {
                Some(name) if level < self.derivative_order => (*name).to_owned(),
                _ if Some(level) == bias => "minus_bias".to_owned(),
                _ => format!("level{level}"),
            })
            .collect()
    }

    /// `k_1 … k_N` in the scalar type.
    pub(crate) fn coefficients<T: Real>(&self) -> PyResult<Vec<T>> {
        self.kind.coefficients().map_err(value_error)
    }

    /// The roots of the characteristic polynomial, in float64.
    pub(crate) fn poles(&self) -> PyResult<Vec<Complex<f64>>> {
        for_order!(self, k => Ok(poles(&k).to_vec()))
    }

    /// Matched poles are for chains.
    pub(crate) fn check_rule(&self, rule: Rule) -> PyResult<()> {
        if rule == Rule::Matched && (self.split != self.order || self.is_rate()) {
            return Err(PyValueError::new_err(
                "rule must be \"backward_euler\" for a split below the order and for the rate filter",
            ));
        }
        Ok(())
    }

    /// Makes the design in the scalar type `T` and hands it to `visitor`.
    pub(crate) fn with<T: Real, V: Visitor<T>>(
        &self,
        rule: Rule,
        visitor: V,
    ) -> PyResult<V::Output> {
        self.check_rule(rule)?;
        if let Kind::Rate { tau } = self.kind {
            let design = RateFilter::new(T::literal(tau)).map_err(value_error)?;
            return Ok(visitor.visit(design));
        }
        let k = self.coefficients::<T>()?;
        if self.split != self.order {
            return self.with_split(&k, visitor);
        }
        macro_rules! visit {
            ($N:literal, $M:literal) => {{
                let chain = Chain::<T, $N, $M>::new(as_array(&k)).map_err(value_error)?;
                Ok(match rule {
                    Rule::BackwardEuler => visitor.visit(chain),
                    Rule::Matched => visitor.visit(chain.matched()),
                })
            }};
        }
        for_chain!(self.order, self.derivative_order, visit)
    }

    fn with_split<T: Real, V: Visitor<T>>(&self, k: &[T], visitor: V) -> PyResult<V::Output> {
        macro_rules! visit {
            ($N:literal) => {{
                let chain = Chain::<T, $N, 1>::new(as_array(k)).map_err(value_error)?;
                Ok(visitor.visit(chain.split(self.split).map_err(value_error)?))
            }};
        }
        match self.order {
            1 => visit!(1),
            2 => visit!(2),
            3 => visit!(3),
            4 => visit!(4),
            5 => visit!(5),
            _ => visit!(6),
        }
    }
}

impl Kind {
    fn orders(&self) -> (usize, usize) {
        match self {
            Kind::FirstOrder { .. } | Kind::Rate { .. } => (1, 1),
            Kind::PiForm { .. } => (2, 1),
            Kind::Butterworth { order, .. } => (*order, 1),
            Kind::ThirdOrder { .. }
            | Kind::ThirdOrderGains { .. }
            | Kind::ThirdOrderButterworth { .. } => (3, 2),
            Kind::SecondOrderInertial { .. } | Kind::SecondOrderInertialButterworth { .. } => {
                (2, 2)
            }
            Kind::Chain { coefficients, derivative_order } => {
                (coefficients.len(), *derivative_order)
            }
        }
    }

    fn coefficients<T: Real>(&self) -> Result<Vec<T>, Error> {
        let t = T::literal;
        Ok(match self {
            Kind::FirstOrder { tau } | Kind::Rate { tau } => {
                FirstOrder::new(t(*tau))?.chain().coefficients().to_vec()
            }
            Kind::PiForm { kp, ki } => PiForm::new(t(*kp), t(*ki))?.chain().coefficients().to_vec(),
            Kind::Butterworth { omega0, order, q } => butterworth(t(*omega0), *order, t(*q))?,
            Kind::ThirdOrder { tau } => ThirdOrder::new(t(*tau))?.chain().coefficients().to_vec(),
            Kind::ThirdOrderGains { k1, k2, k3 } => {
                ThirdOrder::from_gains(t(*k1), t(*k2), t(*k3))?.chain().coefficients().to_vec()
            }
            Kind::ThirdOrderButterworth { omega0 } => {
                ThirdOrder::butterworth(t(*omega0))?.chain().coefficients().to_vec()
            }
            Kind::SecondOrderInertial { tau } => {
                SecondOrderInertial::new(t(*tau))?.chain().coefficients().to_vec()
            }
            Kind::SecondOrderInertialButterworth { omega0 } => {
                SecondOrderInertial::butterworth(t(*omega0))?.chain().coefficients().to_vec()
            }
            Kind::Chain { coefficients, .. } => coefficients.iter().map(|k| t(*k)).collect(),
        })
    }
}

fn butterworth<T: Real>(omega0: T, order: usize, q: T) -> Result<Vec<T>, Error> {
    Ok(match order {
        1 => Butterworth::<T, 1>::new(omega0)?.chain().coefficients().to_vec(),
        2 => Butterworth::<T, 2>::with_q(omega0, q)?.chain().coefficients().to_vec(),
        3 => Butterworth::<T, 3>::new(omega0)?.chain().coefficients().to_vec(),
        4 => Butterworth::<T, 4>::new(omega0)?.chain().coefficients().to_vec(),
        5 => Butterworth::<T, 5>::new(omega0)?.chain().coefficients().to_vec(),
        _ => Butterworth::<T, 6>::new(omega0)?.chain().coefficients().to_vec(),
    })
}

/// The slice as an array of the length that its caller has matched on.
pub(crate) fn as_array<T: Real, const N: usize>(slice: &[T]) -> [T; N] {
    core::array::from_fn(|i| slice.get(i).copied().unwrap_or(T::NAN))
}

/// Makes the design and forgets it: only the checks matter.
struct Check;

impl<T: Real> Visitor<T> for Check {
    type Output = ();

    fn visit<D, const N: usize>(self, _: D)
    where
        D: Discretise<T, N> + Send + Sync + 'static,
        D::Gains: Send + Sync,
    {
    }
}

impl Design {
    /// The continuous pair at each frequency in rad/s.
    pub(crate) fn continuous_response(
        &self,
        omega: &[f64],
    ) -> PyResult<Vec<FrequencyResponse<f64>>> {
        for_order!(self, k => {
            Ok(omega.iter().map(|omega| continuous_response(&k, self.split, *omega)).collect())
        })
    }

    /// The discrete pair at each frequency in rad/s, at the sample rate `fs` in Hz.
    pub(crate) fn discrete_response(
        &self,
        rule: Rule,
        fs: f64,
        omega: &[f64],
    ) -> PyResult<Vec<FrequencyResponse<f64>>> {
        self.with::<f64, _>(rule, Respond { fs, omega })?
    }

    /// A delay of the measurement with which the loop would be unstable cannot work.
    pub(crate) fn check_delay(&self, delay: f64) -> PyResult<()> {
        if delay == 0.0 {
            return Ok(());
        }
        let longest = for_order!(self, k => longest_delay(&k, self.split));
        if delay < longest {
            return Ok(());
        }
        Err(PyValueError::new_err(format!(
            "delay must be shorter than {longest:.6} s, at which the loop with these gains becomes unstable, got {delay} s"
        )))
    }
}

struct Respond<'a> {
    fs: f64,
    omega: &'a [f64],
}

impl Visitor<f64> for Respond<'_> {
    type Output = PyResult<Vec<FrequencyResponse<f64>>>;

    fn visit<D, const N: usize>(self, design: D) -> Self::Output
    where
        D: Discretise<f64, N> + Send + Sync + 'static,
        D::Gains: Send + Sync,
    {
        let gains = crate::batch::sampled_gains::<f64, D, N>(&design, self.fs)?;
        Ok(self.omega.iter().map(|omega| discrete_response::<f64, D, N>(&gains, *omega)).collect())
    }
}
