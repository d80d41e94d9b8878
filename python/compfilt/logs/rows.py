"""Rows out of the middle of a log, for formats that can be read from anywhere."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log

__all__ = ["RowReader", "can_read_rows", "open_rows"]

BROKEN = (pa.ArrowException, OSError, KeyError, ValueError)
"""What the libraries raise on damaged files."""


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
        for number in range(*_pieces(self.starts, start, stop)):
            yield from _within(self._group(number, batch_rows), self.starts[number], start, stop)

    def _group(self, number: int, batch_rows: int) -> Iterator[pa.RecordBatch]:
        rows = self.starts[number + 1] - self.starts[number]
        for batch in self._file.iter_batches(batch_rows, row_groups=[number], columns=self.schema.names):
            rows -= batch.num_rows
            yield batch.select(self.schema.names)
        # The rows of the next group would come under the numbers of those that are not there.
        if rows > 0:
            raise LogError("the file declares rows that it does not have")


class _Batches:
    """An Arrow file, which is mapped; its pieces are the batches."""

    def __init__(self, reader: Any, schema: pa.Schema) -> None:  # noqa: ANN401 - the stubs do not know the class
        self._reader = reader
        self.schema = schema
        self.starts = _starts(
            [reader.get_batch(number).num_rows for number in range(reader.num_record_batches)]
        )

    def read(self, start: int, stop: int, batch_rows: int) -> Iterator[pa.RecordBatch]:
        for number in range(*_pieces(self.starts, start, stop)):
            whole = self._reader.get_batch(number).select(self.schema.names)
            # A damaged file must not make anything read beside the data; each row is looked at once.
            whole.validate()
            pieces = (whole.slice(row, batch_rows) for row in range(0, whole.num_rows, batch_rows))
            for piece in _within(pieces, self.starts[number], start, stop):
                piece.validate(full=True)
                yield piece


@contextlib.contextmanager
def _open_parquet(path: Path, schema: pa.Schema) -> Iterator[RowReader]:
    # A buffer and no prefetch: a row group may be as large as the file.
    with pa.parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False) as file:
        yield _Parquet(file, schema)


@contextlib.contextmanager
def _open_arrow(path: Path, schema: pa.Schema) -> Iterator[RowReader]:
    with pa.memory_map(str(path)) as source:
        held: pa.Schema = pa.ipc.open_file(source).schema
        # What is compressed is decompressed column by column.
        wanted = [held.get_field_index(name) for name in schema.names]
        options = pa.ipc.IpcReadOptions(included_fields=wanted)
        with pa.ipc.open_file(source, options=options) as reader:
            yield _Batches(reader, schema)


FORMATS: dict[str, Callable[[Path, pa.Schema], contextlib.AbstractContextManager[RowReader]]] = {
    ".parquet": _open_parquet,
    ".arrow": _open_arrow,
    ".feather": _open_arrow,
    ".ipc": _open_arrow,
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
    except BROKEN as error:
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
