"""Each column by itself, read once from front to back: what is missing, stuck, or cut off at the end of a range."""

from typing import NamedTuple

import numpy as np

from compfilt.logs.check.source import Array, Mask

__all__ = ["Channels", "Limit"]

KEPT = 512
"""How many of the largest and of the smallest values of a column are remembered."""
NEAR = 0.01
"""The part of the whole range below the largest value in which a peak that is not cut off has more samples than at its top."""


class Limit(NamedTuple):
    """Where a column is cut off: at which value, how often, in how many places."""

    value: float
    samples: int
    places: int


class Channels:
    """Follow all signal columns of a log, (n, c) at a time."""

    def __init__(self, count: int) -> None:
        self.rows = 0
        self.repeated = 0
        self.missing = np.zeros(count, int)
        self.changes = np.zeros(count, int)
        self.smallest_step = np.full(count, np.inf)
        self.longest = np.zeros(count, int)
        self.longest_end = np.zeros(count, int)
        self.stuck_value = np.full(count, np.nan)
        self._run = np.zeros(count, int)
        self._before: Array | None = None
        self._tops = [[np.empty((0, 2)), np.empty((0, 2))] for _ in range(count)]

    def follow(self, values: Array) -> Mask:
        """Take the next rows; return which of them are equal to the row before in every column."""
        before = np.full((1, values.shape[1]), np.nan) if self._before is None else self._before
        if self._before is None and len(values):
            self.stuck_value = values[0].copy()
        steps = np.diff(values, axis=0, prepend=before)
        self.missing += np.sum(~np.isfinite(values), axis=0)
        changed = steps != 0.0
        self.changes += changed.sum(axis=0)
        moved = np.where(changed & np.isfinite(steps), np.abs(steps), np.inf)
        self.smallest_step = np.minimum(self.smallest_step, moved.min(axis=0, initial=np.inf))
        # A log at rest without noise holds every column: only while others change does it say anything.
        lively = changed.sum(axis=1) >= max(1, values.shape[1] // 2)
        self._follow_runs(values, changed, lively)
        for place in range(values.shape[1]):
            self._follow_tops(place, np.where(lively, values[:, place], np.nan))
        same: Mask = np.asarray(~changed.any(axis=1))
        self.repeated += int(same.sum())
        self.rows += len(values)
        self._before = values[-1:]
        return same

    def _follow_runs(self, values: Array, changed: Mask, lively: Mask) -> None:
        """Find each column's longest run of one value, counted in rows in which the other columns change."""
        lasting = np.cumsum(lively)
        for place in range(values.shape[1]):
            # How much of the count had passed at the last change, for every row.
            starts = np.maximum.accumulate(np.where(changed[:, place], lasting, 0))
            began = np.maximum.accumulate(changed[:, place])
            runs = lasting - starts + np.where(began, 0, self._run[place])
            row = int(np.argmax(runs))
            if runs[row] > self.longest[place]:
                self.longest[place], self.longest_end[place] = runs[row], self.rows + row + 1
                self.stuck_value[place] = values[row, place]
            self._run[place] = runs[-1]

    def _follow_tops(self, place: int, values: Array) -> None:
        """Keep the largest values and the smallest, with their rows."""
        at = np.flatnonzero(np.isfinite(values))
        for end, sign in enumerate((1.0, -1.0)):
            known = self._tops[place][end]
            signed = sign * values[at]
            if len(known) == KEPT:
                signed_at = signed > known[:, 0].min()
                rows, signed = at[signed_at], signed[signed_at]
            else:
                rows = at
            joined = np.concatenate((known, np.column_stack((signed, self.rows + rows))))
            if len(joined) > KEPT:
                # Of equal values the first, so that nothing depends on the batches.
                joined = joined[np.lexsort((joined[:, 1], -joined[:, 0]))[:KEPT]]
            self._tops[place][end] = joined

    def limits(self, place: int) -> list[Limit]:
        """Find the ends of a column at which it is cut off.

        A real signal hardly ever reads its very largest value three times; one that is cut off does so more often than it comes
        near it.
        """
        found = []
        high, low = (top[:, 0].max(initial=-np.inf) for top in self._tops[place])
        if high + low < 40.0 * self.smallest_step[place]:
            return []
        for end, sign in enumerate((1.0, -1.0)):
            tops = self._tops[place][end]
            largest = tops[:, 0].max()
            at = tops[tops[:, 0] >= largest - 1e-9 * abs(largest)]
            # At least some steps of a coarse column: the top of a smooth peak lasts as long as those below it together.
            band = max(NEAR * (high + low), 4.0 * self.smallest_step[place])
            near = int(np.sum(tops[:, 0] >= largest - band)) - len(at)
            places = 1 + int(np.sum(np.diff(np.sort(at[:, 1])) > 1.0))
            if len(at) >= 3 and len(at) > near:
                found.append(Limit(float(sign * largest), len(at), places))
        return found
