"""The numbers of a time column as float64 that lose nothing: whole numbers are counted from the log's first."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.readers.base import is_time
from compfilt.logs.signals import to_numpy

__all__ = ["Ticks"]

Times = npt.NDArray[np.float64]


class Ticks:
    """Count times in the column's own unit, batch by batch.

    Float64 resolves an epoch in nanoseconds to 0.2 µs only: whole numbers, points in time and spans of time are counted from the
    first one. Floats stay as they are.

    Attributes
    ----------
    origin : int or None
        What whole numbers are counted from, once there is one.
    """

    def __init__(self) -> None:
        self.origin: int | None = None

    def take(self, values: Any) -> Times:  # noqa: ANN401 - an array of any type
        """Return a column's next rows, (n,), NaN where there is none."""
        if is_time(values.type):
            values = values.cast(pa.int64())
        if not (values.null_count and pa.types.is_integer(values.type)):
            return self.count(to_numpy(values))
        # Arrow would give all of the batch as floats. What stands in for a missing number must not become the origin.
        known = values.drop_null()
        stand_in = self.origin if self.origin is not None else known[0].as_py() if len(known) else None
        if stand_in is None:
            return np.full(len(values), np.nan)
        counted = self.count(to_numpy(values.fill_null(stand_in)))
        counted[values.is_null().to_numpy(zero_copy_only=False)] = np.nan
        return counted

    def count(self, ticks: npt.NDArray[np.generic]) -> Times:
        """Return the next rows, (n,) whole numbers or floats."""
        if np.issubdtype(ticks.dtype, np.integer):
            if ticks.dtype.itemsize < 8:
                # The span of a log may be more than half of what such a number can be.
                ticks = ticks.astype(np.int64)
            if self.origin is None and ticks.size:
                self.origin = int(ticks[0])
            if self.origin:
                ticks = ticks - ticks.dtype.type(self.origin)  # type: ignore[operator]
            if np.issubdtype(ticks.dtype, np.unsignedinteger):
                # A time before the first one wraps around; its difference, read with a sign, does not.
                ticks = ticks.view(np.dtype(f"i{ticks.dtype.itemsize}"))
        return ticks.astype(np.float64)
