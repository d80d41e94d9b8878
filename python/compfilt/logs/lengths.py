"""How long the readings of an accelerometer and of a gyro are on average: a unit that is grossly wrong shows in that."""

import numpy as np
import numpy.typing as npt

from compfilt.logs.signals import Signal
from compfilt.logs.units import ACCELERATION, STANDARD_GRAVITY, parse_unit

__all__ = ["MeanLength"]

EVERY = 16
"""One row of so many is looked at: the mean needs no more, and a log is filtered as fast as before."""
STEPS = 1 << 20
"""Lengths are summed in whole parts of a unit, so that the mean does not depend on how the log is cut."""
LONGEST = 1e6
"""Longer readings count as this long, so that the sum of a batch fits 64 bits."""
FACTOR = 2.0
"""So many times longer or shorter than gravity is beyond what motion makes of most readings."""
FASTEST = 2.0 * np.pi
"""rad/s: hardly anything turns once in a second for all of a log."""
NEAR = 1.3
"""A unit is named if gravity is within this factor with it."""


class MeanLength:
    """The mean length of a signal's readings over a log, batch by batch.

    Attributes
    ----------
    count, total
        How many rows were looked at, and the sum of their lengths in `STEPS` of the SI unit.
    odd
        How many of them were of a length that is not usual.
    """

    def __init__(self, signal: Signal) -> None:
        self._signal = signal
        self._usual = (
            (STANDARD_GRAVITY / FACTOR, STANDARD_GRAVITY * FACTOR)
            if signal.unit.dimension == ACCELERATION
            else (0.0, FASTEST)
        )
        self.count = self.total = self.odd = 0

    def follow(self, values: npt.NDArray[np.floating], first_row: int) -> None:
        """Take the next rows, (n, 3) in SI as they stand in the log; the first is the log's `first_row`, counted from 1."""
        some = values[-(first_row - 1) % EVERY :: EVERY]
        some = np.clip(some[np.isfinite(some).all(axis=1)], -LONGEST, LONGEST).astype(np.float64)
        lengths = np.sqrt(np.einsum("nc,nc->n", some, some))
        low, high = self._usual
        self.count += len(lengths)
        self.total += int(np.rint(STEPS * lengths).astype(np.int64).sum())
        self.odd += int(np.count_nonzero((lengths < low) | (lengths > high)))

    @property
    def doubt(self) -> str:
        """One sentence if the unit that the recipe says is grossly wrong, by the look of it; otherwise nothing."""
        # A few wild readings may spoil the mean, but not the most of them.
        if 2 * self.odd <= self.count:
            return ""
        (low, high), name, mean = self._usual, self._signal.name, self.total / STEPS / self.count
        if low <= mean <= high:
            return ""
        if self._signal.unit.dimension == ACCELERATION:
            told = (
                f"the {name}'s mean length is {mean:.3g} m/s^2, not 9.8: is its unit {self._fitting(mean)}?"
            )
        else:
            right = "deg/s" if self._signal.unit.name == "rad/s" else "right"
            told = f"the {name} says {np.degrees(mean):.3g} deg/s on average: is its unit {right}?"
        return f'{told} "compfilt check LOG --recipe RECIPE" tells'

    def _fitting(self, mean: float) -> str:
        """Name the unit with which gravity is as long as it should be."""
        for name in ("m/s^2", "g", "mg"):
            length = mean / self._signal.unit.factor * parse_unit(name).factor
            if 1.0 / NEAR < length / STANDARD_GRAVITY < NEAR:
                return name
        return "right"

    @property
    def state(self) -> list[int]:
        """The sums so far; set them to continue from there."""
        return [self.count, self.total, self.odd]

    @state.setter
    def state(self, value: list[int]) -> None:
        self.count, self.total, self.odd = value
