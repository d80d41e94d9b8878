//! The core against the committed reference vectors, which other code made: every file, every level, at its stated tolerance.

mod common;

use common::gains;
use compfilt_core::gravity::{Axes, TiltFilter, TiltState};
use compfilt_core::linear::{
    Hindsight, History, Input, Past, RateInputs, RateState, Stream, StreamState,
};
use compfilt_core::nalgebra::Vector3;
use compfilt_core::{
    Butterworth, Chain, Discretise, FirstOrder, PiForm, RateFilter, SecondOrderInertial, ThirdOrder,
};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Keys that describe a file; one that is not here asks for something that this test does not do.
const KEYS: &[&str] = &[
    "after_gap",
    "axes",
    "coefficients",
    "delay",
    "derivative_order",
    "design",
    "dt",
    "gap_cap",
    "generator",
    "initial",
    "input",
    "ki",
    "kp",
    "missing",
    "omega0",
    "order",
    "period",
    "q",
    "rates",
    "rule",
    "split",
    "tau",
    "tolerance",
];

#[derive(Default)]
struct File {
    name: String,
    header: BTreeMap<String, String>,
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl File {
    fn read(path: &Path) -> Self {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let mut file = Self { name, ..Self::default() };
        for line in fs::read_to_string(path).expect("readable").lines() {
            if let Some((key, value)) = line.strip_prefix('#').and_then(|line| line.split_once('='))
            {
                file.header.insert(key.trim().into(), value.trim().into());
            } else if file.columns.is_empty() {
                file.columns = line.split(',').map(String::from).collect();
            } else {
                file.rows.push(line.split(',').map(number).collect());
            }
        }
        for key in file.header.keys() {
            assert!(KEYS.contains(&key.as_str()), "{}: unknown key {key}", file.name);
        }
        assert!(file.rows.len() > 100, "{}: {} rows", file.name, file.rows.len());
        file
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.header.get(key).map(String::as_str)
    }

    fn value(&self, key: &str) -> f64 {
        number(self.text(key).unwrap_or_else(|| panic!("{}: no {key}", self.name)))
    }

    fn option(&self, key: &str) -> Option<f64> {
        self.text(key).map(number)
    }

    fn coefficients<const N: usize>(&self) -> [f64; N] {
        let list = self.text("coefficients").expect("coefficients").split(", ");
        list.map(number).collect::<Vec<_>>().try_into().expect("one for every level")
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let place = self.columns.iter().position(|column| column == name);
        let place = place.unwrap_or_else(|| panic!("{}: no column {name}", self.name));
        self.rows.iter().map(|row| row[place]).collect()
    }

    /// `|found - column| <= tolerance * max(1, max |column|)` in all rows.
    fn compare(&self, name: &str, found: &[f64]) {
        let wanted = self.column(name);
        let largest = wanted.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
        assert_eq!(found.len(), wanted.len());
        for (row, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            let error = (found - wanted).abs() / largest;
            assert!(
                error <= self.value("tolerance"),
                "{}, {name}, row {row}: {found} instead of {wanted} ({error:e})",
                self.name
            );
        }
    }
}

fn number(text: &str) -> f64 {
    text.trim().parse().unwrap_or_else(|_| panic!("no number: {text}"))
}

// ---------------------------------------------------------------------------------------------------------------- linear

fn stream<D: Copy>(file: &File, design: D) -> Stream<f64, D> {
    let mut stream = Stream::new(design).input(match file.text("input") {
        Some("sample") => Input::Sample,
        Some("trapezoid") => Input::Trapezoid,
        other => panic!("{}: input {other:?}", file.name),
    });
    if let Some(period) = file.option("period") {
        stream = stream.period(period).expect("a period");
    }
    if let Some(cap) = file.option("gap_cap") {
        stream = stream.gap_cap(cap).expect("a cap");
    }
    stream
}

/// Every level from the file's samples, from levels at zero.
fn compare_with<D: Discretise<f64, N>, const N: usize>(file: &File, design: D) {
    let stream = stream(file, design);
    let levels = match file.option("delay") {
        None => run(file, &stream, &mut ()),
        Some(delay) => {
            let ring = vec![Past { level0: 0.0, dt: 0.0 }; 64];
            run(file, &stream, &mut History::new(ring, delay).expect("a delay"))
        }
    };
    for i in 0..N {
        let level: Vec<_> = levels.iter().map(|levels| levels[i]).collect();
        file.compare(&format!("level{i}"), &level);
    }
}

fn run<D: Discretise<f64, N>, H: Hindsight<f64>, const N: usize>(
    file: &File,
    stream: &Stream<f64, D>,
    history: &mut H,
) -> Vec<[f64; N]> {
    let mut state = StreamState::from_levels([0.0; N]);
    let samples = file.column("y").into_iter().zip(file.column("u")).zip(file.column("dt"));
    let step = |((y, u), dt): ((f64, f64), f64)| {
        stream.update(&gains(stream.design(), dt), &mut state, y, u, history);
        state.levels.levels
    };
    samples.map(step).collect()
}

/// By the file's rule; a chain also checks its coefficients and where the poles go after a gap.
fn compare_chain<const N: usize, const M: usize>(file: &File, chain: Chain<f64, N, M>) {
    for (found, wanted) in chain.coefficients().iter().zip(file.coefficients::<N>()) {
        let error = (found / wanted - 1.0).abs();
        assert!(error < 1e-14, "{}: coefficient {found} instead of {wanted}", file.name);
    }
    let long_steps = M <= 2 && file.text("rule") == Some("backward_euler");
    let after_gap = if long_steps { "long_step" } else { "placed" };
    assert!(file.text("after_gap").is_none_or(|text| text == after_gap), "{}", file.name);
    match file.text("rule") {
        Some("backward_euler") => compare_with(file, chain),
        Some("matched") => compare_with(file, chain.matched()),
        other => panic!("{}: rule {other:?}", file.name),
    }
}

fn compare_butterworth<const N: usize>(file: &File) {
    let design = Butterworth::<f64, N>::new(file.value("omega0")).expect("a frequency");
    let degree = number_of(file, "split");
    let split = design.split(degree).expect("a degree");
    if degree < N {
        assert!(matches!(file.text("after_gap"), None | Some("long_step")), "{}", file.name);
        compare_with(file, split);
        return;
    }
    compare_chain(file, design.chain());
    if file.text("rule") == Some("backward_euler") && file.text("missing") == Some("none") {
        compare_with(file, split);
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Small whole numbers.
fn number_of(file: &File, key: &str) -> usize {
    file.value(key) as usize
}

fn compare_linear(file: &File) {
    let value = |key| file.value(key);
    match (file.text("design").expect("a design"), number_of(file, "order")) {
        ("first_order", 1) => {
            compare_chain(file, FirstOrder::new(value("tau")).expect("tau").chain());
        }
        ("pi_form", 2) => {
            compare_chain(file, PiForm::new(value("kp"), value("ki")).expect("gains").chain());
        }
        ("butterworth", 2) if file.text("q").is_some() => {
            let design = Butterworth::with_q(value("omega0"), value("q")).expect("q");
            compare_chain(file, design.chain());
        }
        ("butterworth", 1) => compare_butterworth::<1>(file),
        ("butterworth", 2) => compare_butterworth::<2>(file),
        ("butterworth", 3) => compare_butterworth::<3>(file),
        ("butterworth", 4) => compare_butterworth::<4>(file),
        ("butterworth", 5) => compare_butterworth::<5>(file),
        ("butterworth", 6) => compare_butterworth::<6>(file),
        ("third_order", 3) => {
            compare_chain(file, ThirdOrder::new(value("tau")).expect("tau").chain());
        }
        ("third_order_butterworth", 3) => {
            compare_chain(file, ThirdOrder::butterworth(value("omega0")).expect("omega0").chain());
        }
        ("second_order_inertial", 2) => {
            compare_chain(file, SecondOrderInertial::new(value("tau")).expect("tau").chain());
        }
        ("second_order_inertial_butterworth", 2) => {
            let design = SecondOrderInertial::butterworth(value("omega0")).expect("omega0");
            compare_chain(file, design.chain());
        }
        ("chain", 4) if number_of(file, "derivative_order") == 3 => {
            compare_chain(file, Chain::<f64, 4, 3>::new(file.coefficients()).expect("stable"));
        }
        other => panic!("{}: {other:?}", file.name),
    }
}

// ------------------------------------------------------------------------------------------------- rate filter and tilt

/// By `update` and by the recurrence with the signals prepared.
fn compare_rate_filter(file: &File) {
    let filter = RateFilter::new(file.value("tau")).expect("tau");
    let gains = filter.at(file.value("dt")).expect("dt");
    let samples = || file.column("y").into_iter().zip(file.column("u"));
    let mut state = RateState::new(0.0);
    let rates: Vec<_> = samples().map(|(y, u)| gains.update(&mut state, y, u)).collect();
    file.compare("level0", &rates);

    let (mut inputs, stream) = (RateInputs::new(0.0), Stream::new(filter));
    let mut state = StreamState::from_levels([0.0]);
    let streamed = samples().map(|(gyro, acceleration)| {
        let (y, u, _) = inputs.prepare(gyro, acceleration, file.value("dt"), 0.1);
        stream.update(&gains, &mut state, y, u, &mut ());
        state.level0()
    });
    file.compare("level0", &streamed.collect::<Vec<_>>());
}

fn compare_tilt<D: Discretise<f64, N>, const N: usize>(file: &File, design: D) {
    assert_eq!((file.text("axes"), file.text("rates")), (Some("flu"), Some("output")));
    let filter = TiltFilter::new(design, Axes::Flu);
    let mut state = TiltState { angles: [StreamState::from_levels([0.0; N]); 2] };
    let vectors = |names: [&str; 3]| {
        let [x, y, z] = names.map(|name| file.column(name));
        (0..x.len()).map(|n| Vector3::new(x[n], y[n], z[n])).collect::<Vec<_>>()
    };
    let (gyro, force) = (vectors(["gx", "gy", "gz"]), vectors(["ax", "ay", "az"]));
    let (mut roll, mut pitch) = (Vec::new(), Vec::new());
    for ((gyro, force), dt) in gyro.iter().zip(&force).zip(file.column("dt")) {
        filter.update(&gains(&design, dt), &mut state, gyro, force);
        let angles = filter.angles(&state);
        roll.push(angles[0]);
        pitch.push(angles[1]);
    }
    file.compare("roll", &roll);
    file.compare("pitch", &pitch);
}

fn compare(file: &File) {
    assert_eq!(file.text("initial"), Some("zeros"), "{}", file.name);
    match file.text("design") {
        Some("rate_filter") => compare_rate_filter(file),
        Some("first_order") if file.text("axes").is_some() => {
            compare_tilt(file, FirstOrder::new(file.value("tau")).expect("tau").chain());
        }
        Some("pi_form") if file.text("axes").is_some() => {
            let design = PiForm::new(file.value("kp"), file.value("ki")).expect("gains");
            compare_tilt(file, design.chain());
        }
        _ => compare_linear(file),
    }
}

/// The folder lies beside the crate in the repository; a packaged crate comes without it.
fn files() -> Option<Vec<PathBuf>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/vectors");
    let entries = fs::read_dir(folder).ok()?;
    let paths = entries.map(|entry| entry.expect("an entry").path());
    Some(paths.filter(|path| path.extension().is_some_and(|end| end == "csv")).collect())
}

#[test]
fn every_reference_vector_is_met() {
    let Some(files) = files() else {
        println!("skipped: tests/vectors is not here");
        return;
    };
    assert!(files.len() >= 50, "{} files only", files.len());
    for path in &files {
        compare(&File::read(path));
    }
}
