"""Any number of samples in a bounded number of bins: all that a picture of them can show, in one pass."""

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt
from tsdownsample import MinMaxDownsampler

__all__ = ["BINS", "Bins"]

Array = npt.NDArray[np.float64]

BINS = 4096
"""How many bins there are at most, an even number. At least half of them are filled: more than a page has pixels."""

_EXTREMES = MinMaxDownsampler()  # type: ignore[no-untyped-call] # LTTB would choose among the extremes, and could leave one out.


class _Extremes:
    """The least and the greatest value of one column in each bin, and when they were."""

    def __init__(self) -> None:
        self.values = np.full((2, BINS), np.nan)
        self.times = np.full((2, BINS), np.nan)
        self.missing = np.zeros(BINS, np.bool_)

    def put(self, where: slice, times: Array, values: Array) -> None:
        """Take samples that fill these bins evenly, or a part of one bin."""
        bins = where.stop - where.start
        missing = ~np.isfinite(values)
        if missing.any():
            values = np.where(missing, np.nan, values)
            self.missing[where] |= missing.reshape(bins, -1).any(axis=1)
        rows = np.arange(values.size) if values.size == bins else _EXTREMES.downsample(values, n_out=2 * bins)
        pairs = rows.reshape(bins, -1)
        for column in (
            0,
            -1,
        ):  # Either of a pair may be the least, and the two are one in bins of one sample.
            self._merge(where, times[pairs[:, column]], values[pairs[:, column]])

    def _merge(self, where: slice, times: Array, values: Array) -> None:
        for kept, at, better in zip(self.values, self.times, (np.less, np.greater), strict=True):
            new = better(values, kept[where]) | np.isnan(kept[where])
            kept[where] = np.where(new, values, kept[where])
            at[where] = np.where(new, times, at[where])

    def halved(self) -> "_Extremes":
        """Make one bin of every two."""
        half = slice(0, BINS // 2)
        halved = _Extremes()
        halved.missing[half] = self.missing.reshape(-1, 2).any(axis=1)
        for times, values in zip(self.times, self.values, strict=True):
            for part in (0, 1):
                halved._merge(half, times[part::2], values[part::2])
        return halved

    def line(self, bins: int) -> tuple[Array, Array]:
        """Return the points of the line through the extremes, in order, with a NaN wherever a value is missing."""
        order = np.argsort(self.times[:, :bins], axis=0, kind="stable")
        times = np.take_along_axis(self.times[:, :bins], order, axis=0)
        values = np.take_along_axis(self.values[:, :bins], order, axis=0)
        points = np.stack([[*times, times[1]], [*values, np.full(bins, np.nan)]])
        shown = np.ones((3, bins), np.bool_)
        shown[1] = values[0] < values[1]
        shown[1] |= values[0] > values[1]
        shown[2] = self.missing[:bins] & ~np.isnan(values[0])
        x, y = points.transpose(0, 2, 1)[:, shown.T]
        return x, y


class Bins:
    """Samples over time in bins of as many rows each; the bins grow where there are more samples.

    A spike, a missing value, a flag or a rest of one sample among any number of them is in its bin.

    Parameters
    ----------
    names : iterable of str
        The columns of numbers.

    Attributes
    ----------
    rows
        How many samples there were.
    starts
        The time of the first sample of each bin, and at the end the time of the last sample.
    at_rest, flags
        Whether the body rests, and which flags are set, on any sample of each bin.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self.rows = 0
        self._width = 1
        self._columns = {name: _Extremes() for name in names}
        self._starts = np.full(BINS, np.nan)
        self._last = np.nan
        self._rest = np.zeros(BINS, np.bool_)
        self._flags = np.zeros(BINS, np.uint8)

    @property
    def _filled(self) -> int:
        return -(-self.rows // self._width)

    @property
    def starts(self) -> Array:  # noqa: D102 - see the class
        return np.append(self._starts[: self._filled], self._last)

    @property
    def at_rest(self) -> npt.NDArray[np.bool_]:  # noqa: D102
        return self._rest[: self._filled]

    @property
    def flags(self) -> npt.NDArray[np.uint8]:  # noqa: D102
        return self._flags[: self._filled]

    def line(self, name: str) -> tuple[Array, Array]:
        """Return times and values of a column; every sample where they are few, the extremes of each bin otherwise.

        A NaN stands where a value is missing.
        """
        return self._columns[name].line(self._filled)

    def missing(self, names: Iterable[str]) -> npt.NDArray[np.bool_]:
        """Tell for each bin whether a value of any of these columns is missing."""
        found = np.zeros(BINS, np.bool_)
        for name in names:
            found |= self._columns[name].missing
        return found[: self._filled]

    def add(
        self,
        times: Array,
        columns: Mapping[str, Array],
        *,
        at_rest: npt.NDArray[np.generic] | None = None,
        flags: npt.NDArray[np.generic] | None = None,
    ) -> None:
        """Take the next samples: their times, and of each column as many values; infinite ones are missing."""
        arrays = {name: np.ascontiguousarray(values, np.float64) for name, values in columns.items()}
        rest = None if at_rest is None else at_rest.astype(np.bool_)
        marks = None if flags is None else flags.astype(np.uint8)
        begin = 0
        while begin < times.size:
            where, end = self._next(begin, times.size)
            bins, part = where.stop - where.start, slice(begin, end)
            if self.rows % self._width == 0:
                self._starts[where] = times[part].reshape(bins, -1)[:, 0]
            for name, values in arrays.items():
                self._columns[name].put(where, times[part], values[part])
            if rest is not None:
                self._rest[where] |= rest[part].reshape(bins, -1).any(axis=1)
            if marks is not None:
                self._flags[where] |= np.bitwise_or.reduce(marks[part].reshape(bins, -1), axis=1)
            self.rows += end - begin
            begin = end
        if times.size:
            self._last = float(times[-1])

    def _next(self, begin: int, end: int) -> tuple[slice, int]:
        """Choose which bins are filled next, and up to which of the new samples."""
        if self.rows == BINS * self._width:
            self._halve()
        first, inside = divmod(self.rows, self._width)
        whole = min((end - begin) // self._width, BINS - first)
        if inside or not whole:
            return slice(first, first + 1), min(end, begin + self._width - inside)
        return slice(first, first + whole), begin + whole * self._width

    def _halve(self) -> None:
        self._columns = {name: column.halved() for name, column in self._columns.items()}
        self._starts = np.append(self._starts[::2], np.full(BINS // 2, np.nan))
        self._rest = np.append(self._rest.reshape(-1, 2).any(axis=1), np.zeros(BINS // 2, np.bool_))
        flags = np.bitwise_or.reduce(self._flags.reshape(-1, 2), axis=1)
        self._flags = np.append(flags, np.zeros(BINS // 2, np.uint8))
        self._width *= 2
