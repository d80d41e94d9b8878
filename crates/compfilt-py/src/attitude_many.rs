//! Many recordings of attitude signals in one call.

use crate::arrays::{Precision, Scalar};
use crate::attitude_session::{AnySession, Recording, Session, Signals};
use crate::attitude_stream::AttitudeEstimate;
use crate::session::Handling;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The arguments of a call: one entry a recording.
pub(crate) struct Given<'a, 'py> {
    pub(crate) gyr: &'a Bound<'py, PyAny>,
    pub(crate) acc: &'a Bound<'py, PyAny>,
    pub(crate) mag: Option<&'a Bound<'py, PyAny>>,
    pub(crate) t: Option<&'a Bound<'py, PyAny>>,
    pub(crate) initial: Option<&'a Bound<'py, PyAny>>,
    pub(crate) fs: Option<f64>,
}

/// The entries of one argument, as many as there are recordings; `None` where it was not given.
fn entries<'py>(
    given: Option<&Bound<'py, PyAny>>,
    name: &str,
    count: usize,
) -> PyResult<Vec<Option<Bound<'py, PyAny>>>> {
    let Some(given) = given else { return Ok(vec![None; count]) };
    let entries = list(given, name)?;
    if entries.len() != count {
        return Err(PyValueError::new_err(format!(
            "gyr and {name} must have one entry a recording, got {count} and {}",
            entries.len()
        )));
    }
    Ok(entries.into_iter().map(|entry| (!entry.is_none()).then_some(entry)).collect())
}

fn list<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let message = format!("{name} must be a sequence with one entry a recording");
    given.try_iter().map_err(|_| PyValueError::new_err(message))?.collect()
}

/// The same error, with the recording that it is about.
pub(crate) fn about(py: Python<'_>, index: usize, error: PyErr) -> PyErr {
    let message = format!("recording {index}: {}", error.value(py));
    PyErr::from_type(error.get_type(py), message)
}

/// Filters every recording from its own start, as `estimate` does one.
pub(crate) fn estimate_many<'py>(
    py: Python<'py>,
    session: impl Fn(Precision) -> PyResult<AnySession>,
    given: &Given<'_, 'py>,
    handling: Handling,
) -> PyResult<Vec<AttitudeEstimate>> {
    if given.fs.is_some() == given.t.is_some() {
        return Err(PyValueError::new_err("give fs in Hz or t in seconds, one of them"));
    }
    let gyr = list(given.gyr, "gyr")?;
    let acc = entries(Some(given.acc), "acc", gyr.len())?;
    let mag = entries(given.mag, "mag", gyr.len())?;
    let t = entries(given.t, "t", gyr.len())?;
    let initial = entries(given.initial, "initial", gyr.len())?;
    let mut signals = Vec::new();
    for (index, gyr) in gyr.iter().enumerate() {
        let acc = acc[index].as_ref().ok_or_else(|| {
            PyValueError::new_err(format!("recording {index}: acc must not be None"))
        })?;
        let one = Signals::new(gyr, acc, mag[index].as_ref(), t[index].as_ref());
        signals.push(one.map_err(|error| about(py, index, error))?);
    }
    let mut results: Vec<Option<AttitudeEstimate>> = Vec::new();
    results.resize_with(signals.len(), || None);
    for precision in [Precision::Single, Precision::Double] {
        let mut of_precision = Call { py, handling, signals: Vec::new(), results: &mut results };
        for (index, (signals, initial)) in signals.iter().zip(&initial).enumerate() {
            if signals.precision() == precision {
                of_precision.signals.push((index, signals, initial.clone()));
            }
        }
        // What float32 cannot represent does not matter where nothing is float32.
        if of_precision.signals.is_empty() && precision == Precision::Single {
            continue;
        }
        match session(precision)? {
            AnySession::Single(session) => of_precision.run(session)?,
            AnySession::Double(session) => of_precision.run(session)?,
        }
    }
    Ok(results.into_iter().flatten().collect())
}

/// The recordings of one precision, with their places among all.
struct Call<'a, 's, 'py> {
    py: Python<'py>,
    handling: Handling,
    signals: Vec<Recording<'a, 's, 'py>>,
    results: &'a mut [Option<AttitudeEstimate>],
}

impl Call<'_, '_, '_> {
    fn run<T: Scalar>(self, mut session: Session<T>) -> PyResult<()> {
        let Self { py, handling, signals, results } = self;
        let indices: Vec<usize> = signals.iter().map(|(index, ..)| *index).collect();
        let all = session.process_many(py, signals, handling)?;
        for (index, (arrays, state)) in indices.into_iter().zip(all) {
            results[index] = Some(AttitudeEstimate::new(py, arrays, state)?);
        }
        Ok(())
    }
}
