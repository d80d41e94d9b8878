"""The one door through which the check sees a log: which columns of numbers there are, and their rows in chunks."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.clock import told_unit
from compfilt.logs.readers import Columns, open_log, read_schema
from compfilt.logs.readers.base import is_time
from compfilt.logs.ticks import Ticks
from compfilt.logs.units import Unit

__all__ = ["Array", "Chunk", "Column", "Mask", "number_columns", "read_chunks"]

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


CHUNK_ROWS = 65_536
"""How many rows are looked at at once."""


class Column(NamedTuple):
    """A column of numbers or of times, with the unit that the file gives it, if it does."""

    name: str
    unit: str | None
    is_time: bool = False


class Chunk(NamedTuple):
    """Some rows.

    Attributes
    ----------
    ticks
        (n,) the time in the column's unit, whole numbers counted from the log's first; None without.
    values
        (n, c) the signals.
    told
        The unit of the time, if the file tells it.
    """

    ticks: Array | None
    values: Array
    told: Unit | None = None


def number_columns(path: str | Path, separator: str | None = None) -> list[Column]:
    """List the columns that hold numbers or times and whose name no other has."""
    schema = read_schema(path, separator)
    found = []
    for item in schema:
        if schema.names.count(item.name) > 1:
            continue
        if is_time(item.type):
            found.append(Column(item.name, item.type.unit, is_time=True))
        elif pa.types.is_integer(item.type) or pa.types.is_floating(item.type):
            unit = (item.metadata or {}).get(b"unit")
            found.append(Column(item.name, unit.decode(errors="replace") if unit else None))
    return found


def _joined(batches: list[pa.RecordBatch]) -> pa.RecordBatch:
    """Make one batch of some with rows."""
    return pa.Table.from_batches(batches).combine_chunks().to_batches()[0]


def _evenly(batches: Iterator[pa.RecordBatch]) -> Iterator[pa.RecordBatch]:
    """Cut a log anew, so that what its first chunk shows does not depend on how the reader cuts it."""
    held: list[pa.RecordBatch] = []
    rows = 0
    for batch in batches:
        rest = batch
        while rows + rest.num_rows >= CHUNK_ROWS:
            yield _joined([*held, rest.slice(0, CHUNK_ROWS - rows)])
            rest = rest.slice(CHUNK_ROWS - rows)
            held, rows = [], 0
        if rest.num_rows:
            held.append(rest)
            rows += rest.num_rows
    if held:
        yield _joined(held)


def read_chunks(
    path: str | Path, time: str | None, signals: Sequence[str], separator: str | None = None
) -> Iterator[Chunk]:
    """Yield the rows of a log in order, at most 65 536 at a time.

    Raises
    ------
    LogError
        The log cannot be read, or a column is missing or holds something else than numbers.
    """
    count = Ticks()
    # Rows are counted even where nothing in them is a number.
    written = () if signals or time is not None else tuple(read_schema(path, separator).names[:1])
    columns = Columns(tuple(signals), () if time is None else (time,), separator=separator, written=written)
    with open_log(path, columns) as reader:
        told = None if time is None else told_unit(reader.schema.field(time))
        for batch in _evenly(reader.batches()):
            # One row a sample, so that the memory of a row lies together.
            values = np.empty((batch.num_rows, len(signals)))
            for place, name in enumerate(signals):
                values[:, place] = batch.column(name).to_numpy(zero_copy_only=False)
            yield Chunk(None if time is None else count.take(batch.column(time)), values, told)
