//! The rows of eight recordings, gathered into registers and written back.

use crate::arrays::Scalar;
use crate::attitude_batch::ROWS;
use crate::attitude_family::{Output, Sample};
use crate::attitude_log::Part;
use crate::simd::WIDTH;
use crate::simd_number::{WideFlags, WideMask, WideNumber};
use compfilt_core::Mask;
use compfilt_core::nalgebra::Vector3;

type Vectors<'a, T> = [&'a [[T; 3]]; WIDTH];

/// As many rows of eight recordings.
pub(crate) struct Octet<'a, T> {
    gyr: Vectors<'a, T>,
    acc: Vectors<'a, T>,
    mag: Option<Vectors<'a, T>>,
    steps: Option<[&'a [T]; WIDTH]>,
    quaternion: [&'a mut [[T; 4]]; WIDTH],
    up: [&'a mut [[T; 3]]; WIDTH],
    bias: [&'a mut [[T; 3]]; WIDTH],
    at_rest: [&'a mut [bool]; WIDTH],
    flags: [&'a mut [u8]; WIDTH],
}

impl<'a, T: Scalar> Octet<'a, T> {
    /// Of eight parts of the same length; all have times or none, and all have a magnetometer or none, but for spare ones.
    pub(crate) fn new(parts: impl Iterator<Item = Part<'a, T>>) -> Self {
        let nothing = [&[][..]; WIDTH];
        let mut octet = Self {
            gyr: nothing,
            acc: nothing,
            mag: None,
            steps: None,
            quaternion: std::array::from_fn(|_| Default::default()),
            up: std::array::from_fn(|_| Default::default()),
            bias: std::array::from_fn(|_| Default::default()),
            at_rest: std::array::from_fn(|_| Default::default()),
            flags: std::array::from_fn(|_| Default::default()),
        };
        let parts: Vec<_> = parts.collect();
        if parts.iter().any(|part| !part.is_spare && part.mag.is_some()) {
            octet.mag = Some(nothing);
        }
        if parts.iter().any(|part| !part.is_spare && part.steps.is_some()) {
            octet.steps = Some([&[][..]; WIDTH]);
        }
        for (lane, part) in parts.into_iter().enumerate().take(WIDTH) {
            (octet.gyr[lane], octet.acc[lane]) = (part.gyr, part.acc);
            if let (Some(mags), Some(mag)) = (&mut octet.mag, part.mag) {
                mags[lane] = mag;
            }
            if let (Some(all), Some(steps)) = (&mut octet.steps, part.steps) {
                all[lane] = steps;
            }
            (octet.quaternion[lane], octet.up[lane]) = (part.quaternion, part.up);
            (octet.bias[lane], octet.at_rest[lane]) = (part.bias, part.at_rest);
            octet.flags[lane] = part.flags;
            // They are written where there is something to say.
            octet.at_rest[lane].fill(false);
            octet.flags[lane].fill(0);
        }
        octet
    }

    #[inline(always)]
    pub(crate) fn steps(&self, row: usize) -> Option<[T; WIDTH]> {
        let steps = self.steps.as_ref()?;
        let mut of_row = [T::zero(); WIDTH];
        for lane in 0..WIDTH {
            of_row[lane] = steps[lane][row];
        }
        Some(of_row)
    }

    #[inline(always)]
    pub(crate) fn sample<W: WideNumber<T>>(&self, row: usize) -> Sample<W> {
        let mag = self.mag.as_ref().map(|mag| gather(mag, row));
        Sample { gyr: gather(&self.gyr, row), acc: gather(&self.acc, row), mag }
    }

    #[inline(always)]
    pub(crate) fn write<W: WideNumber<T, Flags = WideFlags>>(
        &mut self,
        row: usize,
        flags: &WideFlags,
        output: &Output<W>,
    ) {
        let (w, [[x, y, z]]) = (output.rotation.w, output.rotation.v.data.0);
        let ([[a, b, c]], [[d, e, f]]) = (output.up.data.0, output.bias.data.0);
        let mut numbers = [w, x, y, z, a, b, c, d, e, f];
        if !output.started.all() {
            let (nan, zero) = (W::from_array([T::NAN; WIDTH]), W::from_array([T::zero(); WIDTH]));
            for (index, number) in numbers.iter_mut().enumerate() {
                *number = W::choose(output.started, *number, if index < 7 { nan } else { zero });
            }
        }
        let [w, x, y, z, a, b, c, d, e, f] = numbers;
        let quaternion = [w.to_array(), x.to_array(), y.to_array(), z.to_array()];
        let up = [a.to_array(), b.to_array(), c.to_array()];
        let bias = [d.to_array(), e.to_array(), f.to_array()];
        for lane in 0..WIDTH {
            let [w, x, y, z] = &quaternion;
            self.quaternion[lane][row] = [w[lane], x[lane], y[lane], z[lane]];
            let [x, y, z] = &up;
            self.up[lane][row] = [x[lane], y[lane], z[lane]];
            let [x, y, z] = &bias;
            self.bias[lane][row] = [x[lane], y[lane], z[lane]];
        }
        if flags.any {
            for (out, flags) in self.flags.iter_mut().zip(flags.flags) {
                out[row] = flags.bits();
            }
        }
        let resting = output.at_rest & output.started;
        if resting.any() {
            for (lane, out) in self.at_rest.iter_mut().enumerate() {
                out[row] = resting.at(lane);
            }
        }
    }
}

#[inline(always)]
fn gather<T: Scalar, W: WideNumber<T>>(rows: &Vectors<'_, T>, row: usize) -> Vector3<W> {
    let mut parts = [[T::zero(); WIDTH]; 3];
    for lane in 0..WIDTH {
        let [x, y, z] = rows[lane][row];
        (parts[0][lane], parts[1][lane], parts[2][lane]) = (x, y, z);
    }
    let [x, y, z] = parts;
    Vector3::from_array_storage(compfilt_core::nalgebra::ArrayStorage([[
        W::from_array(x),
        W::from_array(y),
        W::from_array(z),
    ]]))
}

/// What a lane without a recording reads and writes.
pub(crate) struct Spare<T> {
    vectors: Vec<[T; 3]>,
    steps: Vec<T>,
    quaternion: Vec<[T; 4]>,
    up: Vec<[T; 3]>,
    bias: Vec<[T; 3]>,
    at_rest: Vec<bool>,
    flags: Vec<u8>,
}

impl<T: Scalar> Spare<T> {
    pub(crate) fn new() -> Self {
        let rows = ROWS * WIDTH;
        Self {
            vectors: vec![[T::one(); 3]; ROWS],
            steps: vec![T::zero(); ROWS],
            quaternion: vec![[T::zero(); 4]; rows],
            up: vec![[T::zero(); 3]; rows],
            bias: vec![[T::zero(); 3]; rows],
            at_rest: vec![false; rows],
            flags: vec![0; rows],
        }
    }

    /// Eight parts of as many rows.
    pub(crate) fn parts(&mut self, rows: usize) -> impl Iterator<Item = Part<'_, T>> {
        let (vectors, steps) = (&self.vectors[..rows], &self.steps[..rows]);
        let outputs = self.quaternion.chunks_mut(ROWS).zip(self.up.chunks_mut(ROWS));
        let others = self.bias.chunks_mut(ROWS).zip(self.at_rest.chunks_mut(ROWS));
        let outputs = outputs.zip(others).zip(self.flags.chunks_mut(ROWS));
        outputs.map(move |(((quaternion, up), (bias, at_rest)), flags)| Part {
            gyr: vectors,
            acc: vectors,
            mag: Some(vectors),
            steps: Some(steps),
            quaternion: &mut quaternion[..rows],
            up: &mut up[..rows],
            bias: &mut bias[..rows],
            at_rest: &mut at_rest[..rows],
            flags: &mut flags[..rows],
            is_spare: true,
        })
    }
}
