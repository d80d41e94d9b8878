"""The noise of a whole inertial sensor, from one recording at rest."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt.checks import positive
from compfilt.noise.channel import ChannelNoise, analyse_channel
from compfilt.noise.curves import Array
from compfilt.noise.motion import NotAtRest, find_motion
from compfilt.noise.motors import Vibration
from compfilt.noise.signals import channels

__all__ = ["Densities", "NoiseReport", "analyse"]

AXES = ("x", "y", "z")


class Densities(NamedTuple):
    """What gains follow from, all densities two-sided: the arguments of :func:`compfilt.design.from_densities`.

    Attributes
    ----------
    measurement
        r: the noise of the angle that the accelerometer gives, in rad/√Hz. Root mean square of the two directions across gravity.
    derivative
        q_1: the noise of the gyro's rate, in (rad/s)/√Hz. Root mean square of the axes.
    walk
        q_2: the noise that drives its bias, K, in (rad/s²)/√Hz. Root mean square of the axes that show it; 0 where none does.
    """

    measurement: float
    derivative: float
    walk: float


@dataclass(frozen=True)
class NoiseReport:
    """The noise of an inertial sensor at rest.

    Attributes
    ----------
    fs, duration : float
        The sample rate in Hz and the length of the recording in s.
    gyro, accelerometer : tuple of ChannelNoise
        x, y and z.
    gravity : float
        The length of the accelerometer's mean, in m/s².
    motors : tuple of Vibration
        What running motors add to every channel, gyro first; empty without a second recording.
    notes : tuple of str
        What concerns the recording as a whole.
    """

    fs: float
    duration: float
    gyro: tuple[ChannelNoise, ...]
    accelerometer: tuple[ChannelNoise, ...]
    gravity: float
    motors: tuple[Vibration, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def channels(self) -> tuple[ChannelNoise, ...]:
        """All channels, those of the gyro first."""
        return self.gyro + self.accelerometer

    def densities(self) -> Densities:
        """Return the densities that gains of a tilt or attitude filter follow from."""
        up = np.array([channel.mean for channel in self.accelerometer]) / self.gravity
        force = np.array([channel.density for channel in self.accelerometer]) ** 2
        # Noise along gravity does not tilt it.
        across = float(np.sqrt((force.sum() - up**2 @ force) / 2.0)) / self.gravity
        rate = float(np.sqrt(np.mean([channel.density**2 for channel in self.gyro])))
        walks = [
            channel.fit.rate_random_walk.value
            for channel in self.gyro
            if channel.fit is not None and channel.fit.rate_random_walk is not None
        ]
        return Densities(across, rate, float(np.sqrt(np.mean(np.square(walks)))) if walks else 0.0)

    def as_json(self) -> dict[str, Any]:
        """Return what ``compfilt noise --json`` prints: plain numbers in SI, and in the units of data sheets."""
        from compfilt.noise.plain import report_as_json  # noqa: PLC0415 - it needs this class

        return report_as_json(self)

    def table(self) -> str:
        """Return what ``compfilt noise`` prints."""
        from compfilt.noise.table import report_as_table  # noqa: PLC0415

        return report_as_table(self)


def analyse(gyro: npt.ArrayLike, acc: npt.ArrayLike, *, fs: float) -> NoiseReport:
    """Say what noise an inertial sensor has, from a recording at rest.

    Parameters
    ----------
    gyro : array_like, shape (n, 3)
        Rates in rad/s.
    acc : array_like, shape (n, 3)
        Specific force in m/s².
    fs : float
        The sample rate in Hz.

    Returns
    -------
    NoiseReport
        Spectra, Allan deviations, fitted noises and lines of every channel; prints as a table.

    Raises
    ------
    NotAtRest
        The body moves; the error says when. It is a ValueError.
    ValueError
        The signals are too short, of other shapes, or not finite; or fs is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> rng = np.random.default_rng(1)
    >>> gyro = rng.normal(0.0, 0.001, (20_000, 3))
    >>> acc = rng.normal([0.0, 0.0, 9.81], 0.02, (20_000, 3))
    >>> report = noise.analyse(gyro, acc, fs=100.0)
    >>> one_sided = np.sqrt(2.0) * np.degrees(report.gyro[0].fit.random_walk.value)
    >>> round(float(one_sided), 3)  # (deg/s)/√Hz
    0.008
    >>> k1 = report.densities().derivative / report.densities().measurement  # rad/s, first order
    >>> round(float(k1), 1)
    0.5
    """
    rates, force = channels("gyro", gyro, width=3), channels("acc", acc, width=3)
    rate = positive("fs", fs)
    motion = find_motion(rates, force, fs=rate)
    if motion:
        raise NotAtRest(motion)
    gravity = float(np.linalg.norm(force.mean(axis=0)))
    if not gravity:
        raise ValueError("acc must show gravity, but its mean is 0")

    def look(sensor: str, unit: str, values: Array) -> tuple[ChannelNoise, ...]:
        named = zip(AXES, values.T, strict=True)
        return tuple(
            analyse_channel(f"{sensor} {axis}", unit, np.ascontiguousarray(x), rate) for axis, x in named
        )

    seen = look("gyro", "rad/s", rates), look("accelerometer", "m/s^2", force)
    return NoiseReport(rate, len(rates) / rate, *seen, gravity)
