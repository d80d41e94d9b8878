//! What the chip does not compute: the recording from the demo's log, and the weights of the cube's accelerometers.

use compfilt_core::gravity::{Accelerometer, AccelerometerArray, Quantity, Rate};
use compfilt_core::nalgebra::{Matrix3, Vector3};
use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

const LOG: &str = "../demo/child_seat.csv";
/// The body stands still first: its first sample, over and over.
const AT_REST: usize = 2048;
const MOVING: usize = 12288;

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("recording.rs"), recording()?)?;
    fs::write(out.join("cube.rs"), cube()?)?;
    let folder = env::var("CARGO_MANIFEST_DIR")?;
    println!("cargo::rustc-link-arg-bins=-T{folder}/link.ld");
    for file in ["build.rs", "link.ld", LOG] {
        println!("cargo::rerun-if-changed={file}");
    }
    Ok(())
}

/// Degrees per second and g to rad/s and m/s²: in f64, rounded once.
fn recording() -> Result<String, Box<dyn Error>> {
    let log = fs::read_to_string(LOG)?;
    let mut rows = Vec::new();
    for line in log.lines().skip(1).take(MOVING) {
        let fields = line.split(',').map(str::parse).collect::<Result<Vec<f64>, _>>()?;
        let [_, ax, ay, az, gx, gy, gz, ..] = fields[..] else { Err("too few columns")? };
        let gyro = [gx, gy, gz].map(|rate| (rate * (std::f64::consts::PI / 180.0)) as f32);
        let force = [ax, ay, az].map(|force| (force * 9.80665) as f32);
        rows.push([gyro, force].concat());
    }
    let rows = [vec![rows[0].clone(); AT_REST], rows].concat();
    let samples = rows.len();
    Ok(format!(
        "/// How many.\npub const SAMPLES: usize = {samples};\nstatic RECORDING: [[f32; 6]; SAMPLES] = {rows:?};\n"
    ))
}

/// Six two-axis sensors on the faces of a cube, each with its own rotation: a design in f64, rounded once.
fn cube() -> Result<String, Box<dyn Error>> {
    let first = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let third = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0);
    let fifth = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    let sensors = [
        ([0.05, 0.02, 0.0], first),
        ([0.10, 0.05, 0.15], first),
        ([0.0, 0.05, 0.02], third),
        ([0.15, 0.09, 0.08], third),
        ([0.02, 0.0, 0.08], fifth),
        ([0.05, 0.15, 0.12], fifth),
    ];
    let array = AccelerometerArray::new(sensors.map(|(position, rotation)| Accelerometer {
        rotation,
        channels: [true, true, false],
        ..Accelerometer::at(Vector3::from(position))
    }))?;
    let gravity = array.extraction(Quantity::Gravity, Rate::Unknown)?.cast::<f32>();
    let matrix = |matrix: &Matrix3<f32>| {
        let [a, b, c]: [[f32; 3]; 3] = matrix.data.0;
        format!("Matrix3::from_array_storage(ArrayStorage([{a:?}, {b:?}, {c:?}]))")
    };
    let weights = gravity.weights.map(|sensor| {
        format!("SensorWeights {{ matrix: {}, used: {:?} }}", matrix(&sensor.matrix), sensor.used)
    });
    let rotations = array.rotations::<f32>().map(|rotation| matrix(&rotation));
    Ok(format!(
        "const WEIGHTS: [SensorWeights<f32>; 6] = [{}];\nconst ROTATIONS: [Matrix3<f32>; 6] = [{}];\n",
        weights.join(", "),
        rotations.join(", ")
    ))
}
