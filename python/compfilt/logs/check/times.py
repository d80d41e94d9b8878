"""The time column, read once from front to back: rate, jitter, gaps, equal stamps, steps back."""

from dataclasses import dataclass, field

import numpy as np

from compfilt.logs.check.source import Array, Mask
from compfilt.logs.units import TIME, Unit, parse_unit

__all__ = ["GAP", "Times", "likely_unit"]

GAP = 5.0
"""So many times the usual step is a gap."""
SHOWN = 3
"""How many rows are named as examples."""
USUAL_RATE = 200.0
"""Hz: a time unit that nobody names is the one whose rate is nearest to this, counted in factors."""
POSSIBLE = (0.5, 40_000.0)
"""Hz: from where to where a claimed time unit is believed."""


def likely_unit(step: float) -> Unit:
    """Guess the unit of a time column from its usual step: s, ms, us and ns are a thousand apart."""
    units = [parse_unit(name, TIME) for name in ("s", "ms", "us", "ns")]
    return min(units, key=lambda unit: abs(np.log(step * unit.factor * USUAL_RATE)))


def possible_rate(rate: float) -> bool:
    """Whether an inertial sensor may be read so often."""
    return POSSIBLE[0] <= rate <= POSSIBLE[1]


@dataclass
class Events:
    """Something that happened at some rows."""

    count: int = 0
    rows: list[int] = field(default_factory=list)
    total: float = 0.0
    largest: float = 0.0

    def add(self, rows: Array, sizes: Array) -> None:
        """Count rows, numbered from 1 in the log, with the size of each."""
        self.count += len(rows)
        self.rows += [int(row) for row in rows[: SHOWN - len(self.rows)]]
        if len(sizes):
            self.total += float(np.sum(sizes))
            self.largest = max(self.largest, float(np.max(sizes)))

    def where(self, *, text: bool) -> str:
        """Name the first rows; in a text the lines, which have the header before them."""
        more = ", ..." if self.count > len(self.rows) else ""
        name = f"{'line' if text else 'row'}{'s' if self.count > 1 else ''}"
        return f"{name} {', '.join(str(row + text) for row in self.rows)}{more}"


class Times:
    """Follow a time column in its own unit.

    The usual step is the median over the first chunk.
    """

    def __init__(self) -> None:
        self.step = 0.0
        self.spread = 0.0
        self.rows = 0
        self.first = self.last = np.nan
        self.untimed, self.back, self.gaps = Events(), Events(), Events()
        self.equal, self.repeated = Events(), Events()

    def follow(self, ticks: Array, same: Mask) -> Array:
        """Take the next rows; return the steps that lead to them, NaN where there is none.

        `same` tells the rows that are equal to the row before in every signal.
        """
        if not self.step:
            steps = np.diff(ticks)
            usual = steps[steps > 0.0]
            if usual.size:
                self.step = float(np.median(usual))
                self.spread = float(np.subtract(*np.percentile(usual, (95.0, 5.0))))
        steps = np.diff(ticks, prepend=self.last)
        numbers = np.arange(self.rows + 1, self.rows + 1 + len(ticks), dtype=np.float64)
        for events, at, sizes in (
            (self.untimed, ~np.isfinite(ticks), np.zeros(len(ticks))),
            (self.back, steps < 0.0, -steps),
            (self.gaps, steps > GAP * self.step, steps),
            (self.repeated, (steps == 0.0) & same, steps),
            (self.equal, (steps == 0.0) & ~same, steps),
        ):
            events.add(numbers[at], sizes[at])
        if not self.rows:
            self.first = ticks[0]
        self.rows += len(ticks)
        self.last = ticks[-1]
        return steps
