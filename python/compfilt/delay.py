"""The delay between a gyro and an accelerometer, found in a recording without any truth."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from compfilt._core import GravityFilter
from compfilt.flags import Flags

__all__ = ["find_gyro_delay"]

Array = npt.NDArray[np.float64]

TAU = 5.0
"""Memory of the filter that looks for the delay, in s."""
SETTLED = 9.0
"""How long after the start the rows begin, in s."""
LOST = 30.0
"""How long after a lost gyro they begin again, in s: four times as long as the filter's error takes to decay."""
EVERY = 0.1
"""How far apart the rows of the fit are, in s."""
PRIOR = 0.005
"""What a delay is like, in s: a recording without turns says nothing, and gives nearly zero."""


def find_gyro_delay(
    gyr: npt.ArrayLike | Sequence[npt.ArrayLike], acc: npt.ArrayLike | Sequence[npt.ArrayLike], *, fs: float
) -> float:
    """Find the delay for ``GravityFilter(gyro_delay=...)``.

    The gravity filter's second state, the low-passed velocity z of the innovation, is exactly z₀ + δ z₁ in the delay δ. The δ with
    the least Σ|z| over the moving samples is taken, by weighted least squares, and drawn towards zero where the recording
    does not show it. The innovation itself will not do: the body's acceleration hides the delay in it, but its integral is
    bounded, and the delay's is not.

    Parameters
    ----------
    gyr, acc : array_like, shape (n, 3), or sequences of such arrays
        Body rates in rad/s and specific force in m/s², body axes: one recording, or several with the same sensor.
    fs : float
        Sample rate in Hz.

    Returns
    -------
    float
        δ in seconds of f - δ ω × f: how much later the accelerometer's samples are than the frame that the gyro turns. Gyro
        samples that are instantaneous, and no means over their interval, turn it half a sample early: δ is half a period.

    Raises
    ------
    ValueError
        The shapes do not fit, or no recording has motion later than 9 s after its start.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> t = np.arange(0.0, 60.0, 0.01)
    >>> rate, angle = 1.5 * np.cos(1.5 * t), np.sin(1.5 * (t - 0.02))  # the accelerometer is 20 ms late
    >>> gyr = np.column_stack((rate, 0 * t, 0 * t))
    >>> acc = 9.81 * np.column_stack((0 * t, np.sin(angle), np.cos(angle)))
    >>> 0.015 < cf.find_gyro_delay(gyr, acc, fs=100.0) < 0.030
    True
    """
    if not (math.isfinite(fs) and fs > 0.0):
        raise ValueError(f"fs must be positive and finite, got {fs}")
    gyros: Any = [gyr] if _is_one_recording(gyr) else gyr
    accelerometers: Any = [acc] if _is_one_recording(gyr) else acc
    if len(gyros) != len(accelerometers):
        counts = f"{len(gyros)} and {len(accelerometers)}"
        raise ValueError(f"gyr and acc must hold the same number of recordings, got {counts}")
    rows = [_rows(g, a, fs) for g, a in zip(gyros, accelerometers, strict=True)]
    still, slope = (np.concatenate(part) for part in zip(*rows, strict=True))
    if not len(still):
        raise ValueError(f"gyr and acc must show motion later than {SETTLED:g} s after the start")
    return _fit(still, slope)


def _is_one_recording(gyr: npt.ArrayLike | Sequence[npt.ArrayLike]) -> bool:
    """Tell (n, 3) numbers from a sequence of such arrays, which may differ in length."""
    if isinstance(gyr, np.ndarray):
        return gyr.ndim <= 2
    first = gyr[0] if isinstance(gyr, Sequence) and len(gyr) else 0.0
    return np.ndim(first) <= 1


def _rows(gyr: npt.ArrayLike, acc: npt.ArrayLike, fs: float) -> tuple[Array, Array]:
    """Return z at a delay of 0 and its derivative, where the body moves."""
    step = 0.01
    plain = GravityFilter(tau=TAU)
    still = plain._velocity(gyr, acc, fs=fs)  # noqa: SLF001 - only this needs it
    moved = GravityFilter(tau=TAU, gyro_delay=step)._velocity(gyr, acc, fs=fs)  # noqa: SLF001
    estimate = plain.estimate(gyr, acc, fs=fs)
    at = np.arange(math.ceil(SETTLED * fs), len(still), max(1, round(EVERY * fs)))
    # A lost gyro leaves an error, which decays without the start's speed.
    lost = np.cumsum((estimate.flags & Flags.DERIVATIVE_MISSING) != 0)
    quiet = lost[at] == lost[np.maximum(at - math.ceil(LOST * fs), 0)]
    at = at[~estimate.at_rest[at] & (estimate.flags[at] == 0) & quiet]
    return still[at], (moved[at] - still[at]) / step


def _fit(still: Array, slope: Array) -> float:
    """Return the δ with the least Σ|still + δ slope|, drawn towards zero by its standard error."""
    delay, weight = 0.0, np.ones(len(still))
    floor = 1e-6 * math.sqrt(np.mean(np.sum(still**2, axis=1))) + 1e-300
    square = np.sum(slope**2, axis=1)
    for _ in range(50):
        information = float(np.sum(weight * square))
        if information == 0.0:
            return 0.0
        before, delay = delay, -float(np.sum(weight * np.sum(still * slope, axis=1))) / information
        if abs(delay - before) < 1e-7:
            break
        weight = 1.0 / np.maximum(np.linalg.norm(still + delay * slope, axis=1), floor)
    score = weight * np.sum(slope * (still + delay * slope), axis=1)
    # Blocks of 9 s are taken as independent.
    blocks = np.add.reduceat(score, np.arange(0, len(score), round(9.0 / EVERY)))
    variance = float(np.sum(blocks**2)) / information**2
    return delay * PRIOR**2 / (PRIOR**2 + variance)
