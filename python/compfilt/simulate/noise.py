"""The three noises of an inertial sensor, with the coefficients of an Allan curve (IEEE Std 952).

In all of them σ²(τ) is the Allan variance and S(f) the two-sided density in unit²/Hz.
"""

import math

import numpy as np

from compfilt.motion import Array

__all__ = ["flicker", "random_walk", "white"]


def white(samples: int, density: Array, fs: float, rng: np.random.Generator) -> Array:
    """Draw white noise: S = N², σ² = N²/τ.

    Parameters
    ----------
    samples
        How many rows.
    density
        N of each column, two-sided, in unit/√Hz.
    fs
        Sample rate in Hz.
    rng
        Where the numbers come from.

    Returns
    -------
    ndarray
        (samples, columns), with the standard deviation N √fs.

    Examples
    --------
    >>> import numpy as np
    >>> noise = white(10_000, np.array([0.01]), 100.0, np.random.default_rng(0))
    >>> round(float(noise.std()), 2)
    0.1
    """
    return rng.standard_normal((samples, density.size)) * (density * math.sqrt(fs))


def random_walk(samples: int, density: Array, fs: float, rng: np.random.Generator) -> Array:
    """Draw a random walk, the integral of white noise: S = K²/(2πf)², σ² = K² τ/3. It starts from 0.

    Parameters
    ----------
    samples, fs, rng
        As in `white`.
    density
        K of each column: the two-sided density of the noise that is integrated, in unit/s/√Hz.

    Returns
    -------
    ndarray
        (samples, columns); each sample steps on by K/√fs.

    Examples
    --------
    >>> import numpy as np
    >>> walk = random_walk(10_000, np.array([0.5]), 25.0, np.random.default_rng(0))
    >>> round(float(np.diff(walk, axis=0).std()), 2)
    0.1
    """
    steps = rng.standard_normal((samples, density.size)) * (density / math.sqrt(fs))
    return np.asarray(np.cumsum(steps, axis=0))


def flicker(samples: int, instability: Array, rng: np.random.Generator) -> Array:
    """Draw flicker noise, the drift that limits a sensor's bias: S = B²/(2π|f|), σ² = (2 ln 2/π) B² at every τ.

    Each sample is the mean of the noise over the sample's interval, whose Allan variance does not depend on the sample
    rate. There is no lowest frequency: the noise starts from 0 and its variance grows with the logarithm of the time
    since.

    Parameters
    ----------
    samples, rng
        As in `white`.
    instability
        B of each column, in its unit. The Allan deviation is 0.664 B.

    Returns
    -------
    ndarray
        (samples, columns)

    Notes
    -----
    White noise goes through the filter (1 - z⁻¹)^(-1/2), whose density is that of flicker far below the sample rate, and
    through a short one that makes it that of the means near half of it.

    References
    ----------
    Kasdin, Discrete simulation of colored noise and stochastic processes and 1/f^α power law noise generation,
    Proceedings of the IEEE 83, 1995: the filter with α = 1.

    Examples
    --------
    >>> import numpy as np
    >>> flicker(1000, np.array([0.1, 0.0]), np.random.default_rng(0)).std(axis=0).round(1)
    array([0.2, 0. ])
    """
    k = np.arange(1, samples)
    response = np.concatenate(([1.0], np.cumprod((k - 0.5) / k)))
    # Twice the length: the product of the transforms must not wrap around.
    length = 1 << (2 * samples + MEAN.size - 1).bit_length()
    spectrum = np.fft.rfft(response, length) * np.fft.rfft(MEAN, length)
    noise = rng.standard_normal((samples, instability.size)) * instability
    # Column by column: the transforms of all of them at once need several times the memory of the log.
    for column in noise.T:
        column[:] = np.fft.irfft(np.fft.rfft(column, length) * spectrum, length)[:samples]
    return noise


def _mean_filter(taps: int = 128) -> Array:
    """Return the filter with minimum phase that makes samples of (1 - z⁻¹)^(-1/2) the means of flicker.

    With ν = f/fs, the means have the density Σ sinc²(ν + k)/(2π|ν + k|) of all aliases k, the filter has 1/(2 sin πν):
    the ratio is (sin πν/π)³ Σ 1/|ν + k|³.
    """
    nu = np.arange(1, taps + 1) / (2.0 * taps)
    aliases = np.arange(-1000, 1001)
    ratio = (np.sin(np.pi * nu) / np.pi) ** 3 * (np.abs(nu + aliases[:, None]) ** -3.0).sum(axis=0)
    # The cepstrum of the gain, folded onto positive times, is that of the filter.
    cepstrum = np.fft.irfft(np.concatenate(([0.0], np.log(ratio))) / 2.0)
    cepstrum[1:taps] *= 2.0
    cepstrum[taps + 1 :] = 0.0
    return np.asarray(np.fft.irfft(np.exp(np.fft.rfft(cepstrum)))[:taps])


MEAN = _mean_filter()
