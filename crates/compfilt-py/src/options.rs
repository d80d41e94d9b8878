//! The keyword arguments that all filters share.

use crate::arrays::Backwards;
use crate::batch::Options;
use crate::design::Rule;
use crate::session::Handling;
use compfilt_core::linear::Input;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::num::NonZeroUsize;

/// A number of things: 1 or more.
pub(crate) fn count(name: &str, value: i64) -> PyResult<NonZeroUsize> {
    usize::try_from(value)
        .ok()
        .and_then(NonZeroUsize::new)
        .ok_or_else(|| PyValueError::new_err(format!("{name} must be 1 or more, got {value}")))
}

/// One of a few words.
pub(crate) fn choice<V: Copy>(name: &str, value: &str, choices: &[(&str, V)]) -> PyResult<V> {
    choices.iter().find(|(word, _)| *word == value).map(|(_, chosen)| *chosen).ok_or_else(|| {
        let words: Vec<String> = choices.iter().map(|(word, _)| format!("\"{word}\"")).collect();
        PyValueError::new_err(format!("{name} must be {}, got \"{value}\"", words.join(" or ")))
    })
}

pub(crate) fn rule(rule: &str) -> PyResult<Rule> {
    choice("rule", rule, &[("backward_euler", Rule::BackwardEuler), ("matched", Rule::Matched)])
}

/// The filter's own options, checked.
#[allow(clippy::too_many_arguments)] // They are the keywords of the public functions.
pub(crate) fn options(
    rule: &str,
    input: &str,
    period: Option<f64>,
    delay: f64,
    hold: f64,
    gap_cap: Option<f64>,
) -> PyResult<Options> {
    if !(delay.is_finite() && delay >= 0.0) {
        return Err(PyValueError::new_err(format!(
            "delay must be finite and not negative, got {delay}"
        )));
    }
    Ok(Options {
        rule: self::rule(rule)?,
        input: choice(
            "input",
            input,
            &[("sample", Input::Sample), ("trapezoid", Input::Trapezoid)],
        )?,
        period,
        delay,
        hold,
        gap_cap,
    })
}

/// What a call does with what it meets, checked.
pub(crate) fn handling(missing: &str, backwards: &str, workers: i64) -> PyResult<Handling> {
    Ok(Handling {
        raise_missing: choice("missing", missing, &[("coast", false), ("raise", true)])?,
        backwards: choice(
            "backwards",
            backwards,
            &[("raise", Backwards::Raise), ("restart", Backwards::Restart)],
        )?,
        workers: count("workers", workers)?,
        exact: true,
    })
}

/// Both together.
#[allow(clippy::too_many_arguments)]
pub(crate) fn checked(
    rule: &str,
    input: &str,
    period: Option<f64>,
    delay: f64,
    missing: &str,
    hold: f64,
    gap_cap: Option<f64>,
    backwards: &str,
    workers: i64,
) -> PyResult<(Options, Handling)> {
    Ok((
        options(rule, input, period, delay, hold, gap_cap)?,
        handling(missing, backwards, workers)?,
    ))
}
