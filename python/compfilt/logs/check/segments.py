"""Pieces of a log of equal length without a gap, as means over short cells: a bounded extract of a log of any length.

A cell is about 20 ms of samples. While there are more than `KEPT` pieces, every second one is dropped, so that those that stay
lie evenly over the log: 1024 pieces of 8 s and nine columns are 30 MB.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from compfilt.logs.check.source import Array, Mask

__all__ = ["CELLS", "LENGTH", "Segments", "Slicer"]

LENGTH = 8.0
"""Seconds of a piece."""
CELLS = 400
"""Cells of a piece, where the log is fast enough."""
KEPT = 1024
"""How many pieces are kept at most."""
HEAD = 1 << 17
"""How many rows of the log's longest beginning without a gap are kept as they are."""
BREAK = 0.1
"""Seconds without a sample that end a piece."""


@dataclass(frozen=True)
class Segments:
    """The extract.

    Attributes
    ----------
    values
        (s, cells, c) means of the columns over a cell.
    durations
        (s, cells) seconds of a cell.
    numbers
        (s,) which piece of the log it is: neighbours without a gap between them differ by 1.
    head
        (n, c) the first rows after the first break that is no more than a start, as they are, for what needs every sample.
    """

    values: Array
    durations: Array
    numbers: Array
    head: Array

    def __len__(self) -> int:
        return len(self.values)


class Slicer:
    """Cut a log into pieces as its rows come.

    `period` is the usual step in seconds, as far as it is known.
    """

    def __init__(self, columns: int, period: float) -> None:
        self.per_cell = max(1, round(LENGTH / CELLS / period))
        self.cells = max(8, min(CELLS, round(LENGTH / (period * self.per_cell)) // 8 * 8))
        self._break = max(BREAK, 5.0 * period)
        self._period = period
        self._rest = np.empty((0, columns + 1))
        self._pieces: list[tuple[int, Array]] = []
        self._stride = 1
        self._number = 0
        self._head: list[Array] = []
        self._head_rows = 0
        self._head_open = True

    def follow(self, values: Array, steps: Array) -> None:
        """Take the next rows and the seconds that lead to each, NaN or 0 for the first."""
        steps = np.where(np.isnan(steps), self._period, steps)
        sound: Mask = np.asarray(np.isfinite(values).all(axis=1))
        breaks = np.flatnonzero((steps < 0.0) | (steps > self._break))
        rows = np.column_stack((steps, values))
        self._follow_head(rows, breaks)
        for begin, end in zip((0, *breaks), (*breaks, len(rows)), strict=True):
            if begin in breaks:
                self._rest = self._rest[:0]
                self._number += 2
                rows[begin, 0] = self._period
            # A row without a number lends its time to the next one.
            part = rows[begin:end]
            part = _without(part, sound[begin:end])
            self._rest = np.concatenate((self._rest, part))
            self._cut()

    def _follow_head(self, rows: Array, breaks: npt.NDArray[np.intp]) -> None:
        if not self._head_open:
            return
        end = int(breaks[0]) if len(breaks) else len(rows)
        self._head.append(rows[: min(end, HEAD - self._head_rows), 1:])
        self._head_rows += len(self._head[-1])
        self._head_open = self._head_rows < HEAD and not len(breaks)

    def _cut(self) -> None:
        """Turn the waiting rows into pieces as far as they reach."""
        size = self.cells * self.per_cell
        count = len(self._rest) // size
        if not count:
            return
        whole, self._rest = self._rest[: count * size], self._rest[count * size :]
        cells = whole.reshape(count, self.cells, self.per_cell, -1)
        means = cells.mean(axis=2)
        means[..., 0] *= self.per_cell
        for piece in means:
            if self._number % self._stride == 0:
                self._pieces.append((self._number, piece))
            self._number += 1
        while len(self._pieces) > KEPT:
            self._stride *= 2
            self._pieces = [piece for piece in self._pieces if piece[0] % self._stride == 0]

    def finish(self) -> Segments:
        """Return the extract."""
        columns = self._rest.shape[1]
        stack = np.array([piece for _, piece in self._pieces]).reshape(-1, self.cells, columns)
        numbers = np.array([number for number, _ in self._pieces], dtype=np.float64)
        head = np.concatenate(self._head) if self._head else np.empty((0, columns - 1))
        return Segments(stack[..., 1:], stack[..., 0], numbers, head)


def _without(rows: Array, sound: Mask) -> Array:
    """Leave out the rows that are not sound, and add their time to the next that is."""
    if sound.all():
        return rows
    passed = np.cumsum(rows[:, 0])
    kept: Array = rows[sound].copy()
    kept[:, 0] = np.diff(passed[sound], prepend=0.0)
    return kept
