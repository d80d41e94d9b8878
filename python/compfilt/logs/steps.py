"""How long the time steps of a log are, counted in bins, so that the figures do not depend on how it is cut."""

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Steps"]

SHIFT = 42
"""The bits of a float64 below the first ten of its fraction: bins are 0.1 % wide or narrower."""


class Steps:
    """Count time steps, and tell their distribution.

    Positive floats have the order of their bits read as whole numbers: the upper bits are the number of a bin.

    Attributes
    ----------
    count : int
        How many steps there were.
    shortest, longest : float or None
        In seconds.
    """

    def __init__(self) -> None:
        self.count = 0
        self.shortest: float | None = None
        self.longest: float | None = None
        self._bins: dict[int, int] = {}

    def add(self, steps: npt.NDArray[np.float64]) -> None:
        """Count steps of 0 or more seconds."""
        if not steps.size:
            return
        self.count += steps.size
        low, high = float(steps.min()), float(steps.max())
        self.shortest = low if self.shortest is None else min(low, self.shortest)
        self.longest = high if self.longest is None else max(high, self.longest)
        bins = (
            steps.view(np.int64) >> SHIFT
            if steps.flags.c_contiguous
            else steps.copy().view(np.int64) >> SHIFT
        )
        first = int(bins.min())
        counts = np.bincount(bins - first) if int(bins.max()) - first < 1 << 16 else None
        if counts is not None:
            places = np.flatnonzero(counts)
            pairs = zip((places + first).tolist(), counts[places].tolist(), strict=True)
        else:
            # Zero and a step of seconds lie far apart: there, sorting takes less than counting.
            values, sizes = np.unique(bins, return_counts=True)
            pairs = zip(values.tolist(), sizes.tolist(), strict=True)
        for place, size in pairs:
            self._bins[place] = self._bins.get(place, 0) + size

    def quantile(self, part: float) -> float | None:
        """Return about the step that `part` of all steps do not exceed, in seconds."""
        if not self.count:
            return None
        reached = 0
        for place in sorted(self._bins):
            reached += self._bins[place]
            if reached >= part * self.count:
                break
        low, high = (np.int64(edge << SHIFT).view(np.float64) for edge in (place, place + 1))
        # The first bin is that of equal times, and not of what lies between zero and the smallest numbers.
        middle = 0.5 * (low + high) if place else 0.0
        return float(np.clip(middle, self.shortest, self.longest))

    @property
    def state(self) -> dict[str, Any]:
        """The counts, in plain numbers; set it to continue from there."""
        bins = [list(pair) for pair in sorted(self._bins.items())]
        return {"count": self.count, "shortest": self.shortest, "longest": self.longest, "bins": bins}

    @state.setter
    def state(self, value: dict[str, Any]) -> None:
        self.count, self.shortest, self.longest = value["count"], value["shortest"], value["longest"]
        self._bins = {int(place): int(size) for place, size in value["bins"]}
