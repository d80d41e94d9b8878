"""What is measured of a noise: its spectrum, its Allan deviation."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["AllanCurve", "Spectrum"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Spectrum:
    """The power of a signal over frequency.

    Attributes
    ----------
    frequency : ndarray, shape (m,)
        In Hz, from 0 to half the sample rate.
    density : ndarray, shape (m,) or (m, channels)
        One-sided power density, the signal's unit squared per Hz: white noise of standard deviation σ sampled at fs has
        2 σ²/fs. The two-sided density that gains are chosen from is half of it.
    """

    frequency: Array
    density: Array


@dataclass(frozen=True)
class AllanCurve:
    """The overlapping Allan deviation of one channel.

    Attributes
    ----------
    tau : ndarray, shape (m,)
        Averaging times in s.
    deviation : ndarray, shape (m,)
        In the signal's unit. White noise of the two-sided density N² falls as N/√τ.
    low, high : ndarray, shape (m,)
        Confidence interval of the deviation, one standard deviation wide on each side (68 %).
    duration : float, optional
        How long the recording is, in s. A fit needs it: it tells how much the points of the curve have in common.
    """

    tau: Array
    deviation: Array
    low: Array
    high: Array
    duration: float | None = None
