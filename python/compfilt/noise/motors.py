"""What running motors add to the noise of a sensor at rest."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from compfilt.checks import positive
from compfilt.noise.channel import ChannelNoise
from compfilt.noise.curves import Array, Spectrum
from compfilt.noise.lines import Line, find_lines
from compfilt.noise.signals import channels
from compfilt.noise.welch import degrees_of_freedom, segment_length, spectrum

if TYPE_CHECKING:
    from compfilt.noise.report import NoiseReport

__all__ = ["Vibration", "add_motors"]

SLOW = 0.05
"""Below this part of half the sample rate lies what a filter lets through of the vibration."""
SURE = 4.0
"""Vibration is what exceeds the noise at rest by so many standard errors."""
CLOCK = 0.02
"""Two recordings of one sensor have one rate if theirs differ by no more than this part: a clock may be off by so much."""


@dataclass(frozen=True)
class Vibration:
    """What running motors add to one channel.

    Attributes
    ----------
    name, unit : str
        Of the channel.
    rms : float
        Of what is added, in that unit: the root of the difference of the variances, 0 where they may as well be equal.
    spectrum : Spectrum
        With the motors running; one-sided.
    slow_density : float
        Two-sided density at low frequencies, up to a twentieth of half the sample rate, in unit/√Hz: what a slow filter sees.
    slow_ratio : float or None
        By how much it is above that of the sensor at rest. Vibration that is rectified or aliased shows here. None where the
        recording at rest shows no noise there, or is too short for it.
    bias_change : float
        By how much the mean differs from that at rest, in that unit.
    lines : tuple of Line
        Lines of this recording that the one at rest has not.
    """

    name: str
    unit: str
    rms: float
    spectrum: Spectrum
    slow_density: float
    slow_ratio: float | None
    bias_change: float
    lines: tuple[Line, ...]


def add_motors(report: "NoiseReport", gyro: npt.ArrayLike, acc: npt.ArrayLike, *, fs: float) -> "NoiseReport":
    """Add a second recording to a report: the body fixed as before, and its motors running.

    Parameters
    ----------
    report : NoiseReport
        Of the sensor at rest.
    gyro, acc : array_like, shape (n, 3)
        With the motors running, in rad/s and m/s².
    fs : float
        The sample rate in Hz: that of the report, within 2 %. What vibration folds into the band hangs on the rate, so that
        no resampling makes two rates one.

    Returns
    -------
    NoiseReport
        The same, with `motors`.

    Raises
    ------
    ValueError
        The signals are too short, of other shapes, or not finite; or fs is not positive, or another than that at
        rest.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> rng = np.random.default_rng(1)
    >>> t = np.arange(20_000) / 200.0
    >>> gyro = rng.normal(0.0, 0.001, (t.size, 3))
    >>> acc = rng.normal([0.0, 0.0, 9.81], 0.02, (t.size, 3))
    >>> shaking = acc + 0.1 * np.sin(2 * np.pi * 31.0 * t)[:, None]
    >>> report = noise.add_motors(noise.analyse(gyro, acc, fs=200.0), gyro, shaking, fs=200.0)
    >>> [(round(line.frequency), round(line.rms, 2)) for line in report.motors[3].lines]
    [(31, 0.07)]
    """
    rates, force = channels("gyro", gyro, width=3), channels("acc", acc, width=3)
    rate = positive("fs", fs)
    if abs(rate / report.fs - 1.0) > CLOCK:
        raise ValueError(
            f"fs must be that of the recording at rest, {report.fs:g} Hz, not {rate:g} Hz: vibration folds into another band "
            "at another rate, so record both at one"
        )
    both = zip(report.channels, (*rates.T, *force.T), strict=True)
    return replace(
        report,
        motors=tuple(_compare(rest, np.ascontiguousarray(x), rate, report.duration) for rest, x in both),
    )


def _compare(rest: ChannelNoise, x: Array, fs: float, duration: float) -> Vibration:
    # Ten values of the spectrum lie in its slow part.
    found = spectrum(x, fs=fs, segment=20.0 / (SLOW * fs))
    slow = _slow_density(found, found.frequency[-1])
    before = _slow_density(rest.spectrum, found.frequency[-1])
    new = tuple(
        line
        for line in find_lines(x, fs=fs)
        if not any(
            abs(line.frequency - old.frequency) < 0.5 and old.rms > 0.5 * line.rms for old in rest.lines
        )
    )
    # Of the fast part alone, so that the drift of a longer recording does not count.
    running, running_error = _fast_power(found, len(x) / fs)
    still, still_error = _fast_power(rest.spectrum, duration)
    added = running - still
    if added < SURE * float(np.hypot(running_error, still_error)):
        added = 0.0
    return Vibration(
        rest.name,
        rest.unit,
        float(np.sqrt(added)),
        found,
        slow,
        slow / before if before else None,
        float(x.mean()) - rest.mean,
        new,
    )


def _slow_density(found: Spectrum, half: float) -> float:
    """Return the mean two-sided density below a twentieth of half the sample rate, the lowest values left out."""
    part = (found.frequency > 0.1 * SLOW * half) & (found.frequency < SLOW * half)
    return float(np.sqrt(np.mean(found.density[part]) / 2.0)) if part.any() else 0.0


def _fast_power(found: Spectrum, duration: float) -> tuple[float, float]:
    """Return the power above a twentieth of half the sample rate, and its standard error."""
    fast = found.frequency >= SLOW * found.frequency[-1]
    power = found.density[fast] * found.frequency[1]
    # Hann's window makes about two neighbouring values one.
    error = np.sqrt(2.0 * np.sum(power**2) * 2.0 / degrees_of_freedom(duration, segment_length(found)))
    return float(np.sum(power)), float(error)
