"""Rows out of the middle of a log, for formats that can be read from anywhere."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log

__all__ = ["RowReader", "can_read_rows", "open_rows"]


class RowReader(Protocol):
    """A log whose rows can be reached in any order.

    Attributes
    ----------
    schema
        The columns that were asked for.
    starts
        The first row of every piece that the file is stored in, and at the end the number of rows. A piece is read from
        its beginning, so that these are the good places to cut.
    """

    schema: pa.Schema
    starts: list[int]

    def read(self, start: int, stop: int, batch_rows: int) -> Iterator[pa.RecordBatch]:
        """Yield the rows from `start` up to and without `stop`, not more than `batch_rows` at a time."""


class _Parquet:
    """A Parquet file; its pieces are the row groups."""

    def __init__(self, file: pa.parquet.ParquetFile, schema: pa.Schema) -> None:
        self._file = file
        self.schema = schema
        groups = range(file.metadata.num_row_groups)
        self.starts = _starts([file.metadata.row_group(group).num_rows for group in groups])

    def read(self, start: int, stop: int, batch_rows: int) -> Iterator[pa.RecordBatch]:
        first, last = _pieces(self.starts, start, stop)
        batches = self._file.iter_batches(
            batch_rows, row_groups=list(range(first, last)), columns=self.schema.names
        )
        yield from _within(batches, self.starts[first], start, stop)


@contextlib.contextmanager
def _open_parquet(path: Path, schema: pa.Schema) -> Iterator[RowReader]:
    # A buffer and no prefetch: a row group may be as large as the file.
    with pa.parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False) as file:
        yield _Parquet(file, schema)


FORMATS: dict[str, Callable[[Path, pa.Schema], contextlib.AbstractContextManager[RowReader]]] = {
    ".parquet": _open_parquet,
}
"""The endings of the files whose rows can be reached, and how."""


def can_read_rows(path: str | Path) -> bool:
    """Tell whether a log's format lets its rows be reached in any order, by its ending."""
    return Path(path).suffix.lower() in FORMATS


@contextlib.contextmanager
def open_rows(path: str | Path, columns: Columns) -> Iterator[RowReader]:
    """Open a log of which any rows are to be read.

    Raises
    ------
    LogError
        As :func:`open_log`; or the rows of this format can only be read in order.
    """
    path = Path(path)
    # The checks are those of every log.
    with open_log(path, columns) as log:
        schema = log.schema
    if not can_read_rows(path):
        raise LogError(f'rows of a log that ends in "{path.suffix}" can only be read in order')
    try:
        with FORMATS[path.suffix.lower()](path, schema) as reader:
            yield reader
    except (pa.ArrowException, OSError) as error:
        raise LogError(f"the file is damaged: {' '.join(str(error).split())}") from None


def _starts(lengths: list[int]) -> list[int]:
    """Return where each piece starts, and the end."""
    return [0, *np.cumsum(lengths, dtype=np.int64).tolist()]


def _pieces(starts: list[int], start: int, stop: int) -> tuple[int, int]:
    """Find the pieces that hold the rows from `start` up to `stop`: the first, and the one after the last."""
    first = int(np.searchsorted(starts, start, side="right")) - 1
    return first, int(np.searchsorted(starts, stop, side="left"))


def _within(batches: Iterator[pa.RecordBatch], row: int, start: int, stop: int) -> Iterator[pa.RecordBatch]:
    """Cut batches, the first of which begins at `row`, to the rows from `start` up to `stop`."""
    for batch in batches:
        begin, end = max(start - row, 0), min(stop - row, batch.num_rows)
        if begin < end:
            yield batch.slice(begin, end - begin)
        row += batch.num_rows
        if row >= stop:
            return
