"""Spectra as lines that can be read: thousands of frequencies in a few points a decade."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

__all__ = ["PER_DECADE", "Averages", "averages", "draw_density"]

Array = npt.NDArray[np.float64]

PER_DECADE = 50
"""How many points there are in a decade at most."""


class Averages(NamedTuple):
    """Of each group of neighbouring frequencies: their mean, the mean density, the least and the greatest density."""

    frequency: Array
    mean: Array
    least: Array
    greatest: Array


def averages(frequency: Array, density: Array) -> Averages:
    """Average a density over groups of equal width on a logarithmic axis; the power of narrow lines is kept.

    Parameters
    ----------
    frequency, density : ndarray, shape (m,)
        Increasing, above 0, in Hz; a power density.
    """
    group = np.floor(PER_DECADE * np.log10(frequency))
    starts = np.flatnonzero(np.diff(group, prepend=-np.inf))
    counts = np.diff(starts, append=frequency.size)
    means = [np.add.reduceat(values, starts) / counts for values in (frequency, density)]
    extremes = [pick.reduceat(density, starts) for pick in (np.minimum, np.maximum)]
    return Averages(means[0], means[1], extremes[0], extremes[1])


def draw_density(axes: Axes, shown: Averages, **look: Any) -> None:  # noqa: ANN401 - matplotlib's
    """Draw the means as a line, and from the least to the greatest a pale band: narrow lines stand out of it."""
    axes.fill_between(
        shown.frequency, shown.least, shown.greatest, color=look["color"], alpha=0.2, lw=0.0, zorder=1.5
    )
    axes.loglog(shown.frequency, shown.mean, **look)
