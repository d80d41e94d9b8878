//! One filter over a number of samples, for `scripts/count_instructions.py` to run under callgrind.
//!
//! `instructions SCALAR FILTER SAMPLES` runs it; without these arguments it lists what there is.

mod shared;

use compfilt_core::linear::Stream;
use compfilt_core::{PiForm, Real};
use shared::linear::{Steps, rate_filter, samples, tilt_filters, update};
use shared::{Run, attitude, linear, over, sensors};

/// Runs one filter of one scalar type, or names every filter.
struct Counted<'a> {
    scalar: &'a str,
    wanted: Option<(&'a str, usize)>,
}

impl Run for Counted<'_> {
    fn run<X: Copy, S, O>(
        &mut self,
        name: &str,
        mut state: X,
        samples: &[S],
        mut step: impl FnMut(&mut X, &S) -> O,
    ) {
        match self.wanted {
            None => println!("{} {name}", self.scalar),
            Some((wanted, count)) if wanted == name => {
                // Whole logs: a part of one would cost instructions that are not the filter's.
                for _ in 0..count / samples.len() {
                    state = over(state, samples, &mut step);
                }
            }
            Some(_) => {}
        }
    }
}

fn every_filter<T: Real>(runner: &mut Counted) {
    linear::every_filter::<T>(&mut Steps(runner));
    let pi = PiForm::new(T::literal(2.0), T::literal(0.5)).expect("a design").chain();
    update(runner, "pi, Stream::update", &Stream::new(pi), &samples(), &mut ());
    rate_filter::<T>(runner);
    tilt_filters::<T>(runner);
    sensors::arrays::<T>(runner);
    sensors::observer::<T>(runner);
    attitude::every_filter::<T>(runner);
}

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let (scalars, wanted) = match arguments.as_slice() {
        [scalar, name, count] => {
            let count = count.parse().expect("a number of samples");
            (vec![scalar.as_str()], Some((name.as_str(), count)))
        }
        _ => (vec!["f32", "f64"], None),
    };
    for scalar in scalars {
        let mut runner = Counted { scalar, wanted };
        if scalar == "f32" {
            every_filter::<f32>(&mut runner);
        } else {
            every_filter::<f64>(&mut runner);
        }
    }
}
