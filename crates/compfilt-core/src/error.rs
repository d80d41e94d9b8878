//! Which parameter broke which rule.

use core::fmt;

/// What a parameter must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
    /// Finite.
    Finite,
    /// Orthogonal to within 1e-6: `S Sᵀ = I`.
    Orthogonal,
    /// At least three channels in use.
    ThreeChannels,
    /// Every channel in use along an axis of the body: what the aligned form needs.
    Aligned,
    /// A geometry of sensors that gives a quantity along these axes.
    Gives(Quantity, BodyAxes, Failure),
}

/// What an accelerometer array is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Quantity {
    /// The specific force of gravity at the pivot.
    Gravity,
    /// The angular acceleration.
    AngularAcceleration,
}

/// Some of the body's axes x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BodyAxes(pub [bool; 3]);

/// Why a geometry of sensors does not give a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Failure {
    /// No channel in use sees the axis.
    Unseen,
    /// It can be mistaken for another motion: both look the same to every channel in use.
    Ambiguous,
    /// It can, but for the body rate, which is not known to this form.
    NeedsRate,
    /// The condition is above 1e6.
    IllConditioned,
}

/// A parameter that cannot work, with the rule that it broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
            Rule::Finite => write!(f, "{parameter} must be finite"),
            Rule::Orthogonal => {
                write!(f, "{parameter} must be orthogonal matrices, S S^T = I to within 1e-6")
            }
            Rule::ThreeChannels => write!(f, "{parameter} must leave at least three in use"),
            Rule::Aligned => {
                write!(f, "{parameter} is for channels that all lie along the body's axes")
            }
            Rule::Gives(quantity, axes, failure) => {
                write!(f, "{parameter} must give {quantity} {axes}, but {failure}")
            }
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Gravity => "gravity along",
            Self::AngularAcceleration => "the angular acceleration about",
        })
    }
}

impl fmt::Display for BodyAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            [true, false, false] => "x",
            [false, true, false] => "y",
            [false, false, true] => "z",
            [true, true, false] => "x and y",
            [true, false, true] => "x and z",
            [false, true, true] => "y and z",
            [true, true, true] => "x, y and z",
            [false, false, false] => "no axis",
        })
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unseen => "no channel in use sees it",
            Self::Ambiguous => "another motion looks the same to every channel in use",
            Self::NeedsRate => "that takes the body rate of a gyro as well",
            Self::IllConditioned => "its condition is above 1e6",
        })
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
