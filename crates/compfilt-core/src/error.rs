//! Which parameter broke which rule.

use core::fmt;

/// What a parameter must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Rule {
    /// Finite and above zero.
    Positive,
    /// Finite and not below zero.
    NotNegative,
    /// Neither zero nor infinite after rounding to the scalar type.
    Representable,
    /// Between the two values, ends left out.
    Between(u8, u8),
    /// A polynomial whose roots all lie in the left half plane: otherwise the filter is unstable.
    Stable,
    /// From 1 to the order of the filter.
    AtMostOrder,
    /// Short enough for the stored history.
    WithinHistory,
}

/// A parameter that cannot work, with the rule that it broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error {
    parameter: &'static str,
    rule: Rule,
}

impl Error {
    pub(crate) const fn new(parameter: &'static str, rule: Rule) -> Self {
        Self { parameter, rule }
    }

    /// The parameter's name, as it is spelled in the constructor.
    pub fn parameter(&self) -> &'static str {
        self.parameter
    }

    /// The rule that it broke.
    pub fn rule(&self) -> Rule {
        self.rule
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, rule } = self;
        match rule {
            Rule::Positive => write!(f, "{parameter} must be positive and finite"),
            Rule::NotNegative => write!(f, "{parameter} must be finite and not negative"),
            Rule::Representable => write!(
                f,
                "{parameter} must give coefficients and gains that are finite and do not vanish in the scalar type"
            ),
            Rule::Between(low, high) => {
                write!(f, "{parameter} must lie between {low} and {high}, both excluded")
            }
            Rule::Stable => write!(
                f,
                "{parameter} must belong to a stable filter: all roots of s^N + k_1 s^(N-1) + ... + k_N in the left half plane"
            ),
            Rule::AtMostOrder => {
                write!(f, "{parameter} must lie between 1 and the order of the filter")
            }
            Rule::WithinHistory => {
                write!(f, "{parameter} must be short enough for the stored history")
            }
        }
    }
}

impl core::error::Error for Error {}

/// `value`, if it is positive and finite.
pub(crate) fn positive<T: crate::Real>(parameter: &'static str, value: T) -> Result<T, Error> {
    if value.is_finite() && value > nalgebra::zero() {
        Ok(value)
    } else {
        Err(Error::new(parameter, Rule::Positive))
    }
}
