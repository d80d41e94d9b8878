//! A tile of eight runs, turned between memory, where the runs lie one after the other, and registers of one sample of each.
//!
//! Halves of two runs fill a register, which costs loads and stores alone; the other two thirds of the way are shuffles. Where
//! the sequences are eight places of memory, this took 1.3 of the time of whole registers: see `transposed` for those.

use crate::arrays::Scalar;
use crate::runs::Tile;
use crate::simd::{Simd, WIDTH, Wide};

/// Samples of a run that lie together in a register.
const HALF: usize = WIDTH / 2;

/// Runs as registers of one sample each.
#[inline(always)]
pub(crate) fn turned<S: Simd, T: Scalar>(_: S, tile: &Tile<T>) -> [T::Wide<S>; WIDTH] {
    let mut samples = [T::Wide::<S>::from_array([T::zero(); WIDTH]); WIDTH];
    for start in [0, HALF] {
        let mut pairs = [samples[0]; HALF];
        for (pair, x) in pairs.iter_mut().enumerate() {
            let mut numbers = [T::zero(); WIDTH];
            numbers[..HALF].copy_from_slice(&tile[2 * pair][start..start + HALF]);
            numbers[HALF..].copy_from_slice(&tile[2 * pair + 1][start..start + HALF]);
            *x = T::Wide::<S>::from_array(numbers);
        }
        let [a, b, c, d] = pairs;
        let (even, odd) = (a.unzip_low(b), a.unzip_high(b));
        let (later_even, later_odd) = (c.unzip_low(d), c.unzip_high(d));
        samples[start] = even.unzip_low(later_even);
        samples[start + 1] = odd.unzip_low(later_odd);
        samples[start + 2] = even.unzip_high(later_even);
        samples[start + 3] = odd.unzip_high(later_odd);
    }
    samples
}

/// Samples laid down as runs.
#[inline(always)]
pub(crate) fn lay<S: Simd, T: Scalar>(_: S, samples: [T::Wide<S>; WIDTH], tile: &mut Tile<T>) {
    let [a, b, c, d, e, f, g, h] = samples;
    let halves = [pairs_of_runs::<S, T>(a, b, c, d), pairs_of_runs::<S, T>(e, f, g, h)];
    for (number, run) in tile.iter_mut().enumerate() {
        for (half, pairs) in halves.iter().enumerate() {
            let pair = pairs[number / 2].to_array();
            run[half * HALF..][..HALF].copy_from_slice(&pair[number % 2 * HALF..][..HALF]);
        }
    }
}

/// Four samples of two runs in each register.
#[inline(always)]
fn pairs_of_runs<S: Simd, T: Scalar>(
    a: T::Wide<S>,
    b: T::Wide<S>,
    c: T::Wide<S>,
    d: T::Wide<S>,
) -> [T::Wide<S>; HALF] {
    let (even_low, even_high) = (a.zip_low(c), a.zip_high(c));
    let (odd_low, odd_high) = (b.zip_low(d), b.zip_high(d));
    [
        even_low.zip_low(odd_low),
        even_low.zip_high(odd_low),
        even_high.zip_low(odd_high),
        even_high.zip_high(odd_high),
    ]
}
