"""The spectrum of a signal by Welch's method."""

import numpy as np
import numpy.typing as npt
from scipy import signal  # type: ignore[import-untyped]

from compfilt.checks import positive
from compfilt.noise.curves import Spectrum
from compfilt.noise.signals import channels

__all__ = ["degrees_of_freedom", "segment_length", "spectrum", "white_density"]

OVERLAP = 0.5
CORRELATION = 1.0 / 36.0
"""Between the periodograms of neighbouring segments, with Hann's window and half of them in common."""
SEGMENTS = 16
"""Into so many parts of equal length, overlapping by half, a recording is cut by default."""
FEWEST_SAMPLES = 32


def spectrum(x: npt.ArrayLike, *, fs: float, segment: float | None = None) -> Spectrum:
    """Estimate the power density of a signal: Welch's method, Hann's window, half overlapping segments.

    Parameters
    ----------
    x : array_like, shape (n,) or (n, channels)
        The signal.
    fs : float
        The sample rate in Hz.
    segment : float, optional
        How long a segment is, in s: the lowest frequency and the resolution are 1/segment. A sixteenth of the recording by
        default, which makes each value good to about a fifth.

    Returns
    -------
    Spectrum
        One-sided density, the signal's unit squared per Hz. The two-sided density r that gains are chosen from, in unit/√Hz,
        is √(density/2); the one of data sheets is √density.

    Raises
    ------
    ValueError
        The signal is too short or not finite, or fs or segment is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> white = np.random.default_rng(1).normal(0.0, 0.1, 100_000)
    >>> found = noise.spectrum(white, fs=200.0)
    >>> one_sided = float(np.mean(found.density[1:-1]))
    >>> round(one_sided / (2 * 0.1**2 / 200.0), 1)
    1.0
    """
    values = channels("x", x)
    rate = positive("fs", fs)
    length = len(values) // SEGMENTS if segment is None else round(positive("segment", segment) * rate)
    length = min(max(length, FEWEST_SAMPLES), len(values))
    frequency, density = signal.welch(
        values,
        rate,
        window="hann",
        nperseg=length,
        noverlap=int(OVERLAP * length),
        detrend="constant",
        axis=0,
    )
    return Spectrum(np.asarray(frequency), np.asarray(density))


def segment_length(found: Spectrum) -> float:
    """Return how long the segments of a spectrum were, in s."""
    return float(1.0 / found.frequency[1])


def degrees_of_freedom(duration: float, segment: float) -> float:
    """Return those of the chi-square distribution that a value of the spectrum of white noise has."""
    count = max(1.0, (duration / segment - OVERLAP) / (1.0 - OVERLAP))
    return 2.0 * count / (1.0 + 2.0 * CORRELATION * (count - 1.0) / count)


def white_density(found: Spectrum, duration: float) -> npt.NDArray[np.float64]:
    """Return the level of the upper part of a spectrum, where white noise usually prevails: two-sided, in unit/√Hz.

    It is the median from a quarter to four fifths of half the sample rate, which lines do not move.
    """
    half = found.frequency[-1]
    upper = (found.frequency > 0.25 * half) & (found.frequency < 0.8 * half)
    freedom = degrees_of_freedom(duration, segment_length(found))
    # The median of a chi-square distribution lies below its mean (Wilson and Hilferty).
    middle = (1.0 - 2.0 / (9.0 * freedom)) ** 3
    return np.asarray(np.sqrt(np.median(found.density[upper], axis=0) / middle / 2.0))
