"""The time of the samples: to seconds, checked, with what is odd about it found and dealt with."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.errors import LogError, quoted
from compfilt.logs.faults import Faults
from compfilt.logs.policy import Gap, Policy
from compfilt.logs.readers.base import is_time
from compfilt.logs.steps import Steps
from compfilt.logs.ticks import Ticks
from compfilt.logs.units import TIME, Unit, UnitError, parse_unit

__all__ = ["LISTED_GAPS", "FoundGap", "Timeline", "Timing", "time_unit", "told_unit"]

LISTED_GAPS = 1000
"""How many gaps are listed one by one; beyond that they are only counted."""

Times = npt.NDArray[np.float64]
Rows = npt.NDArray[np.bool_]


class FoundGap(NamedTuple):
    """A gap: the row after it, counted from 1, the time before it, and how long it was, in seconds."""

    row: int
    after: float
    seconds: float


@dataclass
class Timing:
    """What the times of a batch say.

    Attributes
    ----------
    seconds
        (n,) the time that the filter sees.
    faults
        (n,) bits of :class:`Faults`.
    coasting, holding
        Where the signals do not count, and where the last good ones stand in for them.
    restarts
        Where the filter starts anew.
    failure
        The first row on which the log fails, counted from 0 in the batch, and why.
    """

    seconds: Times
    faults: npt.NDArray[np.uint8]
    coasting: Rows
    holding: Rows
    restarts: Rows
    failure: tuple[int, str] | None = None

    def mark(self, where: Rows, fault: Faults, do: str, why: str) -> None:
        """Note a fault on some rows, and what is to be done about it; `why` belongs to the first of them."""
        self.faults[where] |= np.uint8(fault)
        if do == "fail":
            row = int(where.argmax())
            if self.failure is None or row < self.failure[0]:
                self.failure = (row, why)
        elif do == "coast":
            self.coasting |= where
        elif do == "hold":
            self.holding |= where
        elif do == "reset":
            self.restarts |= where


class Timeline:
    """Turn a time column into seconds, batch by batch, and deal with gaps, equal times and ways back.

    What is found does not depend on how the log is cut into batches.

    Parameters
    ----------
    column
        The column's name, for messages.
    unit
        The column's unit; nothing if the log tells it.
    policy
        What to do about odd times.

    Attributes
    ----------
    gaps : int
        How many gaps there were.
    listed : list of FoundGap
        The first of them.
    first, last : float or None
        The first time, and the latest one, in seconds.
    steps : Steps
        The time steps within the log, gaps and ways back left out.
    """

    def __init__(self, column: str, unit: Unit | None, policy: Policy) -> None:
        self.column = column
        self._unit = unit
        self._policy = policy
        self._ticks = Ticks()
        self._before: float | None = None
        self._left_out = 0.0
        self.gaps = 0
        self.listed: list[FoundGap] = []
        self.first: float | None = None
        self.last: float | None = None
        self.steps = Steps()

    @property
    def origin(self) -> int:
        """What the seconds of whole numbers are counted from, in the column's unit."""
        return self._ticks.origin or 0

    def take(self, batch: pa.RecordBatch) -> Times:
        """Take the times out of a batch, in seconds.

        Raises
        ------
        LogError
            The unit is not known or not the one of the log.
        """
        self._unit = time_unit(batch.schema.field(self.column), self._unit)
        return self._in_seconds(self._ticks.take(batch.column(self.column)))

    def seconds(self, ticks: npt.NDArray[np.generic]) -> Times:
        """Convert one batch, (n,) whole numbers or floats in the column's unit, to seconds."""
        return self._in_seconds(self._ticks.count(ticks))

    def _in_seconds(self, ticks: Times) -> Times:
        return ticks * (1.0 if self._unit is None else self._unit.factor)

    def judge(self, seconds: Times, first_row: int) -> Timing:
        """Find what is odd about the times of the next batch.

        Parameters
        ----------
        seconds
            (n,) from `seconds`.
        first_row
            The number of the batch's first row in the log, counted from 1, for messages.
        """
        rows = seconds.size
        coasting, holding, restarts = np.zeros((3, rows), np.bool_)
        timing = Timing(seconds, np.zeros(rows, np.uint8), coasting, holding, restarts)
        if not rows:
            return timing
        untimed = ~np.isfinite(seconds)
        if untimed.any():
            row = int(untimed.argmax())
            timing.failure = (row, f'row {first_row + row} has no time in column "{self.column}"')
            # What is wrong with the rows before it is still looked for: the first of all is what counts.
            seconds[row:] = seconds[row - 1] if row else self._before or 0.0
        if self.first is None:
            self.first = float(seconds[0])
        before = self._before
        self._before = float(seconds[-1])
        self._find(timing, before, first_row)
        self.last = max(float(seconds.max()), seconds[0] if self.last is None else self.last)
        return timing

    def _find(self, timing: Timing, before: float | None, first_row: int) -> None:
        """Find ways back, equal times and gaps; change the time that the filter sees where the policy says so."""
        raw = timing.seconds
        latest = raw
        if self._policy.backwards in ("coast", "hold"):
            latest = np.maximum.accumulate(raw)
            if self.last is not None:
                latest = np.maximum(latest, self.last)
                before = self.last
        timing.seconds = latest
        steps = np.diff(latest, prepend=latest[0] if before is None else before)
        back = (steps < 0.0) | (raw < latest)
        if back.any():
            row = int(back.argmax())
            by = -steps[row] if steps[row] < 0.0 else latest[row] - raw[row]
            why = (
                f"row {first_row + row}: time runs backwards by {by:.6g} s; "
                'backwards = "coast" in [policy] passes over such rows'
            )
            timing.mark(back, Faults.BACKWARDS, self._policy.backwards, why)
        same = (steps == 0.0) & ~back
        if before is None:
            same[0] = False
        if same.any():
            row = int(same.argmax())
            why = f"row {first_row + row} has the time of the row before"
            timing.mark(same, Faults.DUPLICATE, self._policy.duplicate, why)
        after_gap = self._find_gaps(timing, steps, before, first_row)
        counted = ~(back | after_gap)
        if before is None:
            counted[0] = False
        self.steps.add(steps if counted.all() else steps[counted])

    def _find_gaps(self, timing: Timing, steps: Times, before: float | None, first_row: int) -> Rows:
        """Find the rows that come after a gap."""
        gap: Gap | None = self._policy.gap
        if gap is None:
            return np.zeros(steps.size, np.bool_)
        found = steps > gap.longer_than
        places = np.flatnonzero(found)
        if places.size:
            row = int(places[0])
            why = f"row {first_row + row} comes {steps[row]:.6g} s after the one before: a gap"
            # The sample after the gap is as good as any, whether the filter predicts over the gap or knows nothing of it.
            timing.mark(found, Faults.GAP, "keep" if gap.do in ("coast", "hold") else gap.do, why)
            for place in places[: max(0, LISTED_GAPS - self.gaps)].tolist():
                after = float(timing.seconds[place - 1]) if place else before
                self.listed.append(FoundGap(first_row + place, float(after or 0.0), float(steps[place])))
            self.gaps += places.size
        if gap.do == "hold":
            # Summed one by one, whatever the batch, so that the sums do not depend on how the log is cut.
            left_out = np.cumsum(np.concatenate([[self._left_out], np.where(found, steps, 0.0)]))
            self._left_out = float(left_out[-1])
            timing.seconds = timing.seconds - left_out[1:]
        return found

    @property
    def state(self) -> dict[str, Any]:
        """All that is carried from batch to batch, in plain numbers; set it to continue from there."""
        return {
            "origin": self._ticks.origin,
            "before": self._before,
            "left_out": self._left_out,
            "gaps": self.gaps,
            "listed": [list(gap) for gap in self.listed],
            "first": self.first,
            "last": self.last,
            "steps": self.steps.state,
        }

    @state.setter
    def state(self, value: dict[str, Any]) -> None:
        self._ticks.origin, self._before = value["origin"], value["before"]
        self._left_out, self.gaps = value["left_out"], value["gaps"]
        self.listed = [FoundGap(*gap) for gap in value["listed"]]
        self.first, self.last = value["first"], value["last"]
        self.steps.state = value["steps"]


def time_unit(field: Any, chosen: Unit | None) -> Unit:  # noqa: ANN401 - a field of any type
    """Return the unit of a time column: what the log tells about it, or else what the recipe says.

    Arrow's points in time and spans of time have a unit; the metadata of another column may name one.

    Parameters
    ----------
    field
        The column's name, type and metadata.
    chosen
        What the recipe says.

    Raises
    ------
    LogError
        The recipe says another unit than the log, or neither tells one.
    """
    told = told_unit(field)
    if told is None and chosen is None:
        raise LogError(
            f"column {quoted(field.name)} does not tell its unit: the recipe needs one, as in "
            f'time = {{ column = "t", unit = "s" }}'
        )
    if told is not None and chosen is not None and told.factor != chosen.factor:
        raise LogError(f"column {quoted(field.name)} is in {told.name}, but the recipe says {chosen.name}")
    return chosen or told  # type: ignore[return-value]


def told_unit(field: Any) -> Unit | None:  # noqa: ANN401 - a field of any type
    """Return the unit that a log tells of its time column, by the type or the metadata, if it does."""
    if is_time(field.type):
        return parse_unit(field.type.unit, TIME)
    name = (field.metadata or {}).get(b"unit", b"")
    try:
        return parse_unit(name.decode(), TIME)
    except (UnitError, UnicodeDecodeError):
        return None
