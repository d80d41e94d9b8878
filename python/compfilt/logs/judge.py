"""Bad samples of one signal: found channel by channel, and dealt with as the policy says."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt.logs.faults import Faults
from compfilt.logs.policy import Clipped, SignalPolicy, Stuck
from compfilt.logs.signals import Signal

__all__ = ["Judge", "Verdict"]

Values = npt.NDArray[np.floating]
Rows = npt.NDArray[np.bool_]

KINDS = (Faults.MISSING, Faults.INFINITE, Faults.STUCK, Faults.CLIPPED)


class Verdict(NamedTuple):
    """What became of a signal's rows.

    Attributes
    ----------
    values
        The signal for the filter.
    faults
        (n,) bits of :class:`Faults`; ``None`` where nothing was found.
    restarts
        Where the filter starts anew; ``None`` for nowhere.
    failure
        The first row on which the log fails, counted from 0 in the batch, and why.
    """

    values: Values
    faults: npt.NDArray[np.uint8] | None
    restarts: Rows | None
    failure: tuple[int, str] | None


class Judge:
    """Find the bad samples of a signal, batch by batch, and deal with them.

    A sample is judged by those before it only: a channel counts as stuck, or as clipped at its extreme, from the moment at
    which it has been so for long enough. So a stream can do the same, and what is found does not depend on the batches.

    Parameters
    ----------
    signal
        The signal.
    policy
        What to do.
    dtype
        That of the values.

    Attributes
    ----------
    counts : dict
        For each column, how many samples had each fault.
    smallest, largest : ndarray
        Of each channel, in SI, the infinite ones left out; NaN as long as there is none.
    """

    def __init__(self, signal: Signal, policy: SignalPolicy, dtype: npt.DTypeLike) -> None:
        self._signal = signal
        self._policy = policy
        self._used = np.array([column is not None for column in signal.columns])
        width = len(signal.columns)
        self.counts = {column: dict.fromkeys(KINDS, 0) for column in signal.used}
        self.smallest = np.full(width, np.nan, dtype)
        self.largest = np.full(width, np.nan, dtype)
        self._good = np.full(width, np.nan, dtype)
        self._resetting = False
        self._runs = _Runs(width, dtype)

    @property
    def needs_time(self) -> bool:
        """Whether it looks at the time of the samples."""
        return self._policy.stuck is not None

    def process(
        self,
        values: Values,
        seconds: npt.NDArray[np.float64] | None,
        first_row: int,
        coasting: Rows | None = None,
        holding: Rows | None = None,
    ) -> Verdict:
        """Judge the next rows.

        Parameters
        ----------
        values
            (n,) or (n, c) in SI.
        seconds
            (n,) the time that the filter sees, if there is a time.
        first_row
            The number of the first row in the log, counted from 1, for messages.
        coasting, holding
            (n,) where whatever is there does not count, and where the last good sample stands in for it.
        """
        if not len(values):
            return Verdict(values, None, None, None)
        table = values.reshape(len(values), len(self._signal.columns))
        # NaN goes through a minimum, and infinity shows in one of the two: this is the fastest look at all samples.
        ends = np.minimum.reduce(table), np.maximum.reduce(table)
        plain = bool((np.isfinite(ends).all(axis=0) | ~self._used).all())
        finite = None if plain else np.isfinite(table)
        found = self._found(table, finite, seconds)
        if finite is not None:
            numbers = np.where(finite, table, np.nan)
            ends = np.fmin.reduce(numbers), np.fmax.reduce(numbers)
        self.smallest, self.largest = np.fmin(self.smallest, ends[0]), np.fmax(self.largest, ends[1])
        if not found and not self._resetting and coasting is None and holding is None:
            self._good = table[-1].copy()
            return Verdict(values, None, None, None)
        masks = {do: np.zeros(table.shape, np.bool_) for do in ("coast", "hold", "reset")}
        for do, rows in (("coast", coasting), ("hold", holding)):
            if rows is not None:
                masks[do] |= rows[:, None]
        return self._deal(values, found, masks, first_row)

    def _found(
        self, table: Values, finite: Rows | None, seconds: npt.NDArray[np.float64] | None
    ) -> dict[Faults, tuple[Rows, str]]:
        """Find the bad samples of every kind, and what to do with them."""
        policy = self._policy
        found: dict[Faults, tuple[Rows, str]] = {}
        if finite is not None:
            infinite = np.isinf(table)
            found[Faults.MISSING] = (~finite & ~infinite & self._used, policy.missing)
            found[Faults.INFINITE] = (infinite, policy.infinite)
        stuck, clipped = policy.stuck, policy.clipped
        if stuck is not None or (clipped is not None and clipped.samples is not None):
            self._runs.follow(table, seconds)
        if stuck is not None:
            found[Faults.STUCK] = (self._runs.longer_than(stuck), stuck.do)
        if clipped is not None:
            found[Faults.CLIPPED] = (self._clipped(table, clipped), clipped.do)
        if finite is not None:
            # An infinite sample is that, and neither stuck nor clipped.
            for kind in found.keys() & {Faults.STUCK, Faults.CLIPPED}:
                found[kind] = (finite & found[kind][0], found[kind][1])
        return {kind: case for kind, case in found.items() if case[0].any()}

    def _clipped(self, table: Values, clipped: Clipped) -> Rows:
        """Find values at the ends of the range that is stated, and at those that the channel itself shows."""
        where = np.zeros(table.shape, np.bool_)
        if clipped.low is not None and clipped.high is not None:
            # A raw value at the limit may have been rounded on its way to SI otherwise than the limit was.
            slack = 4.0 * np.finfo(table.dtype).eps
            where |= table >= clipped.high - slack * abs(clipped.high)
            where |= table <= clipped.low + slack * abs(clipped.low)
        if clipped.samples is not None:
            usable = np.where(np.isinf(table), np.nan, table)
            top = np.fmax.accumulate(np.vstack([self.largest, usable]))[1:]
            bottom = np.fmin.accumulate(np.vstack([self.smallest, usable]))[1:]
            # A channel that has shown one value only has no extremes yet.
            at_end = ((table == top) | (table == bottom)) & (bottom < top)
            where |= at_end & (self._runs.lengths >= clipped.samples)
        return where

    def _deal(
        self,
        values: Values,
        found: dict[Faults, tuple[Rows, str]],
        masks: dict[str, Rows],
        first_row: int,
    ) -> Verdict:
        """Count the bad samples and put in their place what the policy says."""
        table = values.reshape(len(values), len(self._signal.columns)).copy()
        faults = np.zeros(len(table), np.uint8)
        failure: tuple[int, str] | None = None
        for kind, (where, do) in found.items():
            faults[where.any(axis=1)] |= np.uint8(kind)
            for column, count in zip(self._signal.columns, where.sum(axis=0).tolist(), strict=True):
                if column is not None:
                    self.counts[column][kind] += count
            if do in masks:
                masks[do] |= where
            elif do == "fail":
                failure = min(failure or (len(table), ""), self._failure(kind, where, first_row))
        gone = masks["coast"] | masks["reset"]
        held = masks["hold"] & ~gone
        table[gone] = np.nan
        self._fill(table, held)
        result = table.reshape(values.shape)
        return Verdict(result, faults, self._recovered(np.any(masks["reset"], axis=1)), failure)

    def _failure(self, kind: Faults, where: Rows, first_row: int) -> tuple[int, str]:
        """Name the first bad sample."""
        rows, places = np.nonzero(where)
        row, column, name = int(rows[0]), self._signal.columns[places[0]], self._signal.name
        what = {
            Faults.MISSING: f'has no number in column "{column}"',
            Faults.INFINITE: f'has an infinite number in column "{column}"',
            Faults.STUCK: f'has had the same value for too long in column "{column}"',
            Faults.CLIPPED: f'is at the end of its range in column "{column}"',
        }
        return row, f"row {first_row + row} {what[kind]} ({name})"

    def _fill(self, table: Values, held: Rows) -> None:
        """Put the last good value of its channel in the place of each held one, and remember the last of all."""
        source = np.vstack([self._good, table])
        good = np.vstack([np.ones((1, table.shape[1]), np.bool_), ~held & np.isfinite(table)])
        last = np.maximum.accumulate(np.where(good, np.arange(len(good))[:, None], 0), axis=0)
        filled = np.take_along_axis(source, last, axis=0)
        table[held] = filled[1:][held]
        self._good = filled[-1]

    def _recovered(self, bad: Rows) -> Rows:
        """Find the rows with which the signal is good again after a spell that resets the filter."""
        before = np.concatenate([[self._resetting], bad[:-1]])
        self._resetting = bool(bad[-1])
        return before & ~bad

    @property
    def state(self) -> dict[str, Any]:
        """All that is carried from batch to batch, in plain numbers; set it to continue from there."""
        return {
            "counts": {column: list(counts.values()) for column, counts in self.counts.items()},
            "smallest": self.smallest.tolist(),
            "largest": self.largest.tolist(),
            "good": self._good.tolist(),
            "resetting": self._resetting,
            "runs": self._runs.state,
        }

    @state.setter
    def state(self, value: dict[str, Any]) -> None:
        self.counts = {
            column: dict(zip(KINDS, counts, strict=True)) for column, counts in value["counts"].items()
        }
        dtype = self._good.dtype
        self.smallest, self.largest, self._good = (
            np.array(value[key], dtype) for key in ("smallest", "largest", "good")
        )
        self._resetting = value["resetting"]
        self._runs.state = value["runs"]


class _Runs:
    """Runs of equal values in every channel: since when, and how many."""

    def __init__(self, width: int, dtype: npt.DTypeLike) -> None:
        self._value = np.full(width, np.nan, dtype)
        self._since = np.zeros(width)
        self._length = np.zeros(width, np.int64)
        self.lengths: npt.NDArray[np.int64] = np.empty((0, width), np.int64)
        self._durations: npt.NDArray[np.float64] | None = None

    def follow(self, table: Values, seconds: npt.NDArray[np.float64] | None) -> None:
        """Take the next rows."""
        rows = np.arange(len(table))[:, None]
        # NaN is unequal to itself: it ends every run.
        new = table != np.vstack([self._value, table[:-1]])
        starts = np.maximum.accumulate(np.where(new, rows, -1), axis=0)
        carried = starts < 0
        self.lengths = rows - starts + np.where(carried, self._length, 0) + np.where(carried, 0, 1)
        if seconds is not None:
            since = np.where(carried, self._since, seconds[np.maximum(starts, 0)])
            # A time that goes back ends nothing, but it does not make a run longer.
            self._durations = seconds[:, None] - since
            self._since = since[-1].copy()
        self._value, self._length = table[-1].copy(), self.lengths[-1].copy()

    def longer_than(self, stuck: Stuck) -> Rows:
        """Find the samples whose run has lasted too long."""
        assert self._durations is not None
        return self._durations > stuck.longer_than

    @property
    def state(self) -> dict[str, Any]:
        return {
            "value": self._value.tolist(),
            "since": self._since.tolist(),
            "length": self._length.tolist(),
        }

    @state.setter
    def state(self, value: dict[str, Any]) -> None:
        self._value = np.array(value["value"], self._value.dtype)
        self._since, self._length = np.array(value["since"]), np.array(value["length"], np.int64)
