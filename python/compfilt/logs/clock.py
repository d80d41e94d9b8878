"""The time of the samples: to seconds, checked, with the gaps found."""

import numpy as np
import numpy.typing as npt

from compfilt.logs.errors import LogError
from compfilt.logs.recipe import Gap
from compfilt.logs.units import Unit

__all__ = ["Timeline"]


class Timeline:
    """Turn a time column into seconds, batch by batch, and find where the log is interrupted.

    Whole numbers are counted from the first one, since float64 resolves an epoch in nanoseconds to 0.2 µs only.

    Parameters
    ----------
    column
        The column's name, for messages.
    unit
        The column's unit.
    gap
        What counts as a gap, if anything does.
    """

    def __init__(self, column: str, unit: Unit, gap: Gap | None) -> None:
        self.column = column
        self._unit = unit
        self._gap = gap
        self._origin: np.generic | None = None
        self._last: float | None = None

    def count_from(self, origin: np.generic) -> None:
        """Count whole numbers from the log's first one, for a log that is not read from its beginning."""
        self._origin = origin if isinstance(origin, np.integer) else None

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
            if self._origin is None and ticks.size:
                self._origin = ticks[0]
            ticks = ticks - self._origin if ticks.size else ticks  # type: ignore[operator]
        seconds = ticks.astype(np.float64) * self._unit.factor
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
