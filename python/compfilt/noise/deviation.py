"""The overlapping Allan deviation of a channel."""

import allantools  # type: ignore[import-untyped]
import numpy as np
import numpy.typing as npt

from compfilt.checks import positive
from compfilt.noise.curves import AllanCurve, Array
from compfilt.noise.signals import channel

__all__ = ["allan"]

PER_OCTAVE = 4
FEWEST = 4
"""The longest averaging time fits so many times into the recording: beyond, the curve says nothing."""


def allan(x: npt.ArrayLike, *, fs: float) -> AllanCurve:
    """Estimate the overlapping Allan deviation of one channel of a rate.

    A gyro's rate, or an accelerometer's specific force: what is averaged is the signal itself (IEEE Std 952). allantools does it.

    Parameters
    ----------
    x : array_like, shape (n,)
        One channel of the sensor at rest.
    fs : float
        The sample rate in Hz.

    Returns
    -------
    AllanCurve
        Averaging times from one sample to a quarter of the recording, four to an octave. The intervals are those of Greenhall's
        equivalent degrees of freedom, for the noise that the slope of the curve shows.

    Raises
    ------
    ValueError
        The signal is too short, not one channel or not finite, or fs is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> white = np.random.default_rng(1).normal(0.0, 0.1, 100_000)
    >>> curve = noise.allan(white, fs=100.0)
    >>> density = 0.1 / np.sqrt(100.0)  # two-sided
    >>> at_one_second = np.interp(1.0, curve.tau, curve.deviation)
    >>> bool(abs(at_one_second / density - 1.0) < 0.05)
    True
    """
    values = channel("x", x)
    rate = positive("fs", fs)
    longest = len(values) // FEWEST
    octaves = np.log2(longest)
    factors = np.unique(np.round(2.0 ** (np.arange(int(PER_OCTAVE * octaves) + 1) / PER_OCTAVE)))
    # Without the mean, which does not count, the sums of a long recording stay small and exact.
    tau, deviation, _, _ = allantools.oadev(
        values - values.mean(), rate=rate, data_type="freq", taus=factors / rate
    )
    low, high = _interval(factors.astype(int), deviation, len(values) + 1)
    return AllanCurve(np.asarray(tau), np.asarray(deviation), low, high, len(values) / rate)


def _interval(factors: npt.NDArray[np.int_], deviation: Array, phases: int) -> tuple[Array, Array]:
    """Return the confidence interval of every point."""
    ends = [
        allantools.confidence_interval(
            point, allantools.edf_greenhall(alpha, 2, factor, phases, overlapping=True)
        )
        for factor, point, alpha in zip(factors, deviation, _noise_types(factors, deviation), strict=True)
    ]
    low, high = np.array(ends).T
    return low, high


def _noise_types(factors: npt.NDArray[np.int_], deviation: Array) -> list[int]:
    """Return the exponent of the density of each point's noise by its slope: 0 white, -1 flicker, -2 random walk."""
    if not deviation.all():
        return [0] * len(factors)
    x, y = np.log(factors), 2.0 * np.log(deviation)
    slopes = [
        np.polyfit(x[near], y[near], 1)[0]
        for place in range(len(x))
        for near in [slice(max(place - PER_OCTAVE, 0), place + PER_OCTAVE + 1)]
    ]
    return [int(np.clip(-1 - round(slope), -2, 0)) for slope in slopes]
