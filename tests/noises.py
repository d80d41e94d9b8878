"""Noises of known coefficients, made in another way than they are analysed."""

import numpy as np


def white(density, fs, count, rng):
    """White noise of a two-sided density: σ = N √fs."""
    return rng.normal(0.0, density * np.sqrt(fs), count)


def walk(density, fs, count, rng):
    """A random walk driven by white noise of a two-sided density."""
    return np.cumsum(rng.normal(0.0, density / np.sqrt(fs), count))


def flicker(instability, count, rng):
    """Noise of the two-sided power density B²/2πf: white noise through (1 - z⁻¹)^(-1/2), whatever the sample rate.

    The filter begins long before the part that is returned.
    """
    before = 3 * count
    orders = np.arange(1, before + count)
    impulse = np.cumprod(np.concatenate(([1.0], (orders - 0.5) / orders)))
    size = 2 * impulse.size
    driven = np.fft.irfft(np.fft.rfft(impulse, size) * np.fft.rfft(rng.normal(size=impulse.size), size), size)
    return instability * driven[before : before + count]


def still(count, fs, rng, *, gyro=1e-4, acc=1e-3):
    """A sensor at rest: gyro and accelerometer with white noise of two-sided densities, z up."""
    rates = np.column_stack([white(gyro, fs, count, rng) + bias for bias in (0.01, -0.02, 0.005)])
    force = np.column_stack([white(acc, fs, count, rng) + mean for mean in (0.1, -0.2, 9.8)])
    return rates, force
