"""Lines in a spectrum: vibration of motors, hum, whatever repeats."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import ndimage, signal, stats  # type: ignore[import-untyped]

from compfilt.checks import positive
from compfilt.noise.curves import Array
from compfilt.noise.signals import channel
from compfilt.noise.welch import degrees_of_freedom, segment_length, spectrum

__all__ = ["Line", "find_lines"]

LONGEST_SEGMENT = 10.0
"""Seconds: motors do not keep their speed for longer."""
AVERAGED = 32
"""Into so many parts a shorter recording is cut."""
HALF_FLOOR = 50
"""The floor under a value is the median of so many values on each side, of fewer near the ends."""
FIRST = 16
"""The lowest frequency is this many times the resolution: below, too few values make the floor."""
LOBE = 3
"""On so many values on each side Hann's window spreads a line."""


class Line(NamedTuple):
    """A line of a spectrum.

    Attributes
    ----------
    frequency
        In Hz.
    rms
        Of the oscillation alone, without the noise below it, in the signal's unit. Its amplitude is √2 times as large.
    """

    frequency: float
    rms: float


def find_lines(x: npt.ArrayLike, *, fs: float, false_alarm: float = 0.01) -> tuple[Line, ...]:
    """Find the lines that rise from the noise around them.

    A value of Welch's spectrum of noise has a chi-square distribution about the floor, the running median of its neighbours. A
    line is a peak that noise alone reaches with the probability `false_alarm` anywhere in the spectrum.

    Parameters
    ----------
    x : array_like, shape (n,)
        One channel.
    fs : float
        The sample rate in Hz. Vibration faster than half of it appears at a lower frequency, which nothing in the recording tells.
    false_alarm : float
        The probability that noise without lines shows any.

    Returns
    -------
    tuple of Line
        In the order of their frequencies. Those below 16 times the resolution (10 s or a 32nd of the recording) are not
        looked for.

    Raises
    ------
    ValueError
        The signal is too short or not finite, fs is not positive, or false_alarm is not between 0 and 1.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> t = np.arange(60_000) / 500.0
    >>> x = np.random.default_rng(1).normal(0.0, 0.1, t.size) + 0.02 * np.sin(2 * np.pi * 87.3 * t)
    >>> [(round(line.frequency, 1), round(line.rms, 2)) for line in noise.find_lines(x, fs=500.0)]
    [(87.3, 0.01)]
    """
    values = channel("x", x)
    rate = positive("fs", fs)
    if not 0.0 < false_alarm < 1.0:
        raise ValueError(f"false_alarm must lie between 0 and 1, not {false_alarm:g}")
    duration = len(values) / rate
    found = spectrum(values, fs=rate, segment=min(LONGEST_SEGMENT, duration / AVERAGED))
    freedom = degrees_of_freedom(duration, segment_length(found))
    # The last value, at half the sample rate, is real: it has half of the others' degrees of freedom.
    density = found.density[:-1]
    floor = _floor(density, freedom)
    if len(density) <= FIRST or not floor[FIRST:].all():
        return ()
    tested = len(density) - FIRST
    threshold = stats.chi2.isf(false_alarm / tested, freedom) / freedom
    ratio = density / np.maximum(floor, np.finfo(float).tiny)
    peaks, _ = signal.find_peaks(ratio, height=threshold, distance=LOBE + 1)
    lines = (_measure(found.frequency[:-1], density - floor, peak) for peak in peaks if peak >= FIRST)
    return tuple(lines)


def _floor(density: Array, freedom: float) -> Array:
    """Return the mean of the noise under every value, from the median of its neighbours."""
    count = len(density)
    floor = ndimage.median_filter(density, 2 * HALF_FLOOR + 1, mode="nearest")
    for at in (*range(min(HALF_FLOOR, count)), *range(max(count - HALF_FLOOR, HALF_FLOOR), count)):
        # At the lower end as many on both sides, for there the spectrum may be steep, and such a median follows a slope.
        last = 2 * at if at < HALF_FLOOR else count - 1
        floor[at] = np.median(density[max(at - HALF_FLOOR, 0) : last + 1])
    return np.asarray(floor / (1.0 - 2.0 / (9.0 * freedom)) ** 3)


def _measure(frequency: Array, above: Array, peak: int) -> Line:
    around = slice(max(peak - LOBE, 0), peak + LOBE + 1)
    power = np.maximum(above[around], 0.0)
    centre = float(np.sum(frequency[around] * power) / np.sum(power))
    return Line(centre, float(np.sqrt(max(np.sum(above[around]), 0.0) * frequency[1])))
