"""The signals that a filter reads: which columns of a log they are, and how they become arrays in SI."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.table import Table
from compfilt.logs.units import Dimension, Unit

__all__ = ["UNUSED", "Signal", "from_numpy", "parse_signal", "refuse_shared", "to_numpy"]

UNUSED = "-"
"""What stands in a recipe in the place of a column that is not used and need not be in the log."""


@dataclass(frozen=True)
class Signal:
    """One input of the filter: its columns, their unit, and a factor for each column.

    A column that is ``None`` stands for a channel that is not used: it is not read, and its values are NaN.
    """

    name: str
    columns: tuple[str | None, ...]
    unit: Unit
    scale: tuple[float, ...]

    @property
    def used(self) -> tuple[str, ...]:
        """The columns that are read."""
        return tuple(column for column in self.columns if column is not None)

    def empty(self, dtype: npt.DTypeLike) -> npt.NDArray[np.floating]:
        """Return the signal of a log without rows."""
        return np.empty(0 if len(self.columns) == 1 else (0, len(self.columns)), dtype)

    def take(self, batch: pa.RecordBatch, dtype: npt.DTypeLike) -> npt.NDArray[np.floating]:
        """Take the signal out of a batch, in SI: (n,) of one column, (n, c) of several."""
        # Column by column in memory, as they come and as they are looked at.
        table = np.empty((batch.num_rows, len(self.columns)), dtype, order="F")
        for place, (column, scale) in enumerate(zip(self.columns, self.scale, strict=True)):
            if column is None:
                table[:, place] = np.nan
                continue
            values = to_numpy(batch.column(column))
            # In float64, so that float32 is rounded once.
            factor = self.unit.factor * scale
            np.multiply(values, factor, out=table[:, place], dtype=np.float64, casting="same_kind")
        return table[:, 0] if len(self.columns) == 1 else table


def to_numpy(column: Any) -> npt.NDArray[Any]:  # noqa: ANN401 - an array of numbers
    """Return a column's values; nulls are NaN, or what Arrow makes of them."""
    if column.null_count or not pa.types.is_primitive(column.type) or pa.types.is_temporal(column.type):
        return np.asarray(column.to_numpy(zero_copy_only=False))
    # Arrow's own way loads pandas where it is installed, which takes longer than to filter a small log.
    return np.from_dlpack(column)


def from_numpy(values: npt.NDArray[Any], kind: Any) -> Any:  # noqa: ANN401 - a type and an array of Arrow
    """Return an array of Arrow on the same memory, without a look for nulls, and without pandas."""
    whole: Any = np.ascontiguousarray(values, kind.to_pandas_dtype())
    return pa.Array.from_buffers(kind, len(whole), [None, pa.py_buffer(whole)])


def parse_signal(
    parent: Table,
    key: str,
    dimension: Dimension | None,
    width: int,
    *,
    owner: str = "",
    may_skip: bool = False,
) -> Signal:
    """Read a signal of one column (`column = "a"`) or of several (`columns = ["a", "b", "c"]`).

    Parameters
    ----------
    parent, key
        Where it stands in the recipe.
    dimension
        What its unit must measure; anything if ``None``.
    width
        How many columns it has.
    owner
        Whose signal it is, for messages; of the whole log if empty.
    may_skip
        Whether columns may be left out with "-".
    """
    table = parent.table(key)
    named = (table.text("column"),) if width == 1 else table.texts("columns")
    if len(named) != width:
        table.fail(f"must name {width} columns, not {len(named)}", "columns")
    columns = tuple(None if may_skip and column == UNUSED else column for column in named)
    used = [column for column in columns if column is not None]
    if not used:
        table.fail("names no column at all", "columns")
    if len(set(used)) != len(used):
        table.fail("names a column twice", "columns")
    unit = table.unit("unit", dimension)
    scale = (1.0,) * width
    if "scale" in table:
        scale = (table.number("scale"),) if width == 1 else table.numbers("scale")
    if len(scale) != width or 0.0 in scale:
        table.fail(f"must hold {width} factors, none of them 0", "scale")
    table.close()
    return Signal(f"{key} of {owner}" if owner else key, columns, unit, scale)


def refuse_shared(log: Table, signals: Iterable[Signal]) -> None:
    """Refuse a column that stands in two signals: where there are many, that is a slip of copying."""
    seen: dict[str, str] = {}
    for signal in signals:
        for column in signal.used:
            if column in seen:
                log.fail(f'has the column "{column}" in two places: {seen[column]}, {signal.name}')
            seen[column] = signal.name
