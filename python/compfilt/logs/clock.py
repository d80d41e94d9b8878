"""The time of the samples: to seconds, checked, with the gaps found."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.errors import LogError, quoted
from compfilt.logs.readers.base import is_time
from compfilt.logs.recipe import Gap
from compfilt.logs.units import TIME, Unit, UnitError, parse_unit

__all__ = ["Timeline", "time_unit"]


class Timeline:
    """Turn a time column into seconds, batch by batch, and find where the log is interrupted.

    Whole numbers are counted from the first one, since float64 resolves an epoch in nanoseconds to 0.2 µs only.

    Parameters
    ----------
    column
        The column's name, for messages.
    unit
        The column's unit; nothing if the log tells it.
    gap
        What counts as a gap, if anything does.
    """

    def __init__(self, column: str, unit: Unit | None, gap: Gap | None) -> None:
        self.column = column
        self._unit = unit
        self._gap = gap
        self._origin: npt.NDArray[np.int64] | None = None
        self._last: float | None = None

    def take(self, batch: pa.RecordBatch, first_row: int) -> npt.NDArray[np.float64]:
        """Take the times out of a batch, in seconds.

        Raises
        ------
        LogError
            A row has no time, or the unit is not known or not the one of the log.
        """
        values = batch.column(self.column)
        self._unit = time_unit(batch.schema.field(self.column), self._unit)
        if is_time(values.type):
            values = values.cast(pa.int64())
        return self.seconds(values.to_numpy(zero_copy_only=False), first_row)

    def seconds(self, ticks: npt.NDArray[np.generic], first_row: int) -> npt.NDArray[np.float64]:
        """Convert one batch to seconds.

        Parameters
        ----------
        ticks
            (n,) whole numbers or floats in the column's unit.
        first_row
            The number of the batch's first row in the log, counted from 1, for messages.

        Raises
        ------
        LogError
            A row has no time.
        """
        if np.issubdtype(ticks.dtype, np.integer):
            # Signed and modulo 2^64: a time before the first one must not become a late one.
            whole = ticks.astype(np.int64)
            if self._origin is None:
                self._origin = whole[:1] if whole.size else None
            ticks = whole if self._origin is None else whole - self._origin
        factor = 1.0 if self._unit is None else self._unit.factor
        seconds = ticks.astype(np.float64) * factor
        untimed = np.flatnonzero(~np.isfinite(seconds))
        if untimed.size:
            raise LogError(f'row {first_row + untimed[0]} has no time in column "{self.column}"')
        return seconds

    def gaps(self, seconds: npt.NDArray[np.float64], first_row: int) -> npt.NDArray[np.intp]:
        """Find the samples of a batch that come after a gap, and keep the batch's last time for the next one.

        Raises
        ------
        LogError
            Time runs backwards, or there is a gap and the policy is to fail.
        """
        if not seconds.size:
            return np.empty(0, dtype=np.intp)
        before = seconds[0] if self._last is None else self._last
        steps = np.diff(seconds, prepend=before)
        back = np.flatnonzero(steps < 0.0)
        if back.size:
            row = int(back[0])
            raise LogError(f"row {first_row + row}: time runs backwards by {-steps[row]:.6g} s")
        self._last = float(seconds[-1])
        if self._gap is None:
            return np.empty(0, dtype=np.intp)
        found = np.flatnonzero(steps > self._gap.longer_than)
        if found.size and self._gap.do == "fail":
            row = int(found[0])
            raise LogError(f"row {first_row + row} comes {steps[row]:.6g} s after the one before: a gap")
        return found


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
    told = _told_unit(field)
    if told is None and chosen is None:
        raise LogError(
            f"column {quoted(field.name)} does not tell its unit: the recipe needs one, as in "
            f'time = {{ column = "t", unit = "s" }}'
        )
    if told is not None and chosen is not None and told.factor != chosen.factor:
        raise LogError(f"column {quoted(field.name)} is in {told.name}, but the recipe says {chosen.name}")
    return chosen or told  # type: ignore[return-value]


def _told_unit(field: Any) -> Unit | None:  # noqa: ANN401
    if is_time(field.type):
        return parse_unit(field.type.unit, TIME)
    name = (field.metadata or {}).get(b"unit", b"")
    try:
        return parse_unit(name.decode(), TIME)
    except (UnitError, UnicodeDecodeError):
        return None
