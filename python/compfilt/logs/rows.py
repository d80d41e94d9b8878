"""Rows out of the middle of a log, for formats that can be read from anywhere."""

import contextlib
import struct
import zipfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet

from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log

__all__ = ["RowReader", "can_read_rows", "open_rows"]

LOCAL_HEADER = 30
"""Bytes before the name of a member of a ZIP archive."""

BROKEN = (pa.ArrowException, OSError, zipfile.BadZipFile, KeyError, ValueError)
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
        first, last = _pieces(self.starts, start, stop)
        batches = self._file.iter_batches(
            batch_rows, row_groups=list(range(first, last)), columns=self.schema.names
        )
        ordered = (batch.select(self.schema.names) for batch in batches)
        yield from _within(ordered, self.starts[first], start, stop)


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
            pieces = (whole.slice(row, batch_rows) for row in range(0, whole.num_rows, batch_rows))
            yield from _within(pieces, self.starts[number], start, stop)


class _Arrays:
    """Arrays of NumPy, which are mapped; there are no pieces."""

    def __init__(self, arrays: Sequence[npt.NDArray[Any]], schema: pa.Schema) -> None:
        self._arrays = arrays
        self.schema = schema
        self.starts = [0, len(arrays[0])]

    def read(self, start: int, stop: int, batch_rows: int) -> Iterator[pa.RecordBatch]:
        for row in range(start, stop, batch_rows):
            rows = slice(row, min(row + batch_rows, stop))
            # A column of a table is not in one piece, and the order of its bytes may not be the machine's.
            columns = [
                np.ascontiguousarray(array[rows], array.dtype.newbyteorder("=")) for array in self._arrays
            ]
            yield pa.RecordBatch.from_arrays([pa.array(column) for column in columns], schema=self.schema)


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


@contextlib.contextmanager
def _open_npz(path: Path, schema: pa.Schema) -> Iterator[RowReader]:
    with zipfile.ZipFile(path) as archive:
        yield _Arrays([_mapped(archive, path, name) for name in schema.names], schema)


def _mapped(archive: zipfile.ZipFile, path: Path, name: str) -> npt.NDArray[Any]:
    """Map a column of an archive: an array, or ``name[0]`` of one that has columns."""
    member, _, number = (name, "", "") if f"{name}.npy" in archive.namelist() else name.rpartition("[")
    info = archive.getinfo(f"{member}.npy")
    if info.compress_type != zipfile.ZIP_STORED:
        raise LogError(f'the array "{member}" is compressed: it can only be read in order')
    with archive.open(info) as file:
        version = np.lib.format.read_magic(file)
        headers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, by_columns, dtype = headers[version](file)
        # Behind the headers: the archive's for the member, with a name and extras, and NumPy's.
        begin = file.tell()
    with path.open("rb") as raw:
        raw.seek(info.header_offset)
        lengths = struct.unpack("<HH", raw.read(LOCAL_HEADER)[-4:])
    begin += info.header_offset + LOCAL_HEADER + sum(lengths)
    array = np.memmap(path, dtype, "r", begin, shape, "F" if by_columns else "C")
    return array[:, int(number[:-1])] if number else array


FORMATS: dict[str, Callable[[Path, pa.Schema], contextlib.AbstractContextManager[RowReader]]] = {
    ".parquet": _open_parquet,
    ".arrow": _open_arrow,
    ".feather": _open_arrow,
    ".ipc": _open_arrow,
    ".npz": _open_npz,
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
