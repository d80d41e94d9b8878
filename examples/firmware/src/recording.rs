//! The recording that all filters run on: gyro in rad/s and accelerometer in m/s², three axes each, 1000 samples a second.

use compfilt_core::nalgebra::Vector3;

include!(concat!(env!("OUT_DIR"), "/recording.rs"));

/// Where both sensors begin to miss samples.
const FIRST_GAPS: usize = 4096;
const NOTHING: Vector3<f32> = Vector3::new(f32::NAN, f32::NAN, f32::NAN);

fn row(n: usize) -> [f32; 6] {
    RECORDING.get(n % SAMPLES).copied().unwrap_or([0.0; 6])
}

/// The gyro's sample.
pub fn gyro(n: usize) -> Vector3<f32> {
    let [x, y, z, ..] = row(n);
    Vector3::new(x, y, z)
}

/// The accelerometer's sample.
pub fn force(n: usize) -> Vector3<f32> {
    let [.., x, y, z] = row(n);
    Vector3::new(x, y, z)
}

/// The gyro's sample; now and then it is missing.
pub fn gyro_with_gaps(n: usize) -> Vector3<f32> {
    let n = n % SAMPLES;
    if n >= FIRST_GAPS && n % 512 < 3 { NOTHING } else { gyro(n) }
}

/// The accelerometer's sample; now and then it is missing.
pub fn force_with_gaps(n: usize) -> Vector3<f32> {
    let n = n % SAMPLES;
    if n >= FIRST_GAPS && n % 640 < 5 { NOTHING } else { force(n) }
}
