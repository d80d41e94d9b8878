"""How rows become the bytes of a result: one class a format."""

import contextlib
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any, Protocol, cast

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet

from compfilt.logs.errors import LogError, quoted

__all__ = ["FORMATS", "RESUMABLE", "ROWS_PER_GROUP", "LogWriter", "ResumableWriter"]

ROWS_PER_GROUP = 1 << 17
"""How many rows a Parquet row group or a batch of Arrow holds: small ones are slow to read, large ones take memory."""


class LogWriter(Protocol):
    """A result that is being written."""

    def write(self, batch: pa.RecordBatch) -> None:
        """Append rows."""

    def close(self) -> None:
        """Write what is still held back, and the file's end."""

    def abandon(self) -> None:
        """Let go of the file, which nobody will read."""


class ResumableWriter(LogWriter, Protocol):
    """A result that can be continued by another process."""

    def settle(self) -> None:
        """Write what is held back, and whatever makes the file complete as it is; more may follow."""


class _Csv:
    """A CSV file; NaN becomes an empty field, which is how the reader takes it."""

    def __init__(self, file: IO[bytes], schema: pa.Schema, *, append: bool = False) -> None:
        self._file = file
        _check_csv(schema)
        options = pa.csv.WriteOptions(include_header=not append)
        self._writer = pa.csv.CSVWriter(file, schema, write_options=options)

    def write(self, batch: pa.RecordBatch) -> None:
        columns = [_nan_to_null(column) for column in batch.columns]
        self._writer.write_batch(pa.RecordBatch.from_arrays(columns, schema=batch.schema))

    def settle(self) -> None:
        self._file.flush()

    def close(self) -> None:
        self._writer.close()

    def abandon(self) -> None:
        self._writer.close()


def _check_csv(schema: pa.Schema) -> None:
    """Raise LogError if a column holds what is no field of a text, such as a list."""
    for field in schema:
        with _plainly(f"a CSV file cannot hold what column {quoted(field.name)} holds; use .parquet"):
            pa.csv.CSVWriter(io.BytesIO(), pa.schema([field])).close()


@contextlib.contextmanager
def _plainly(sentence: str) -> Iterator[None]:
    """Say what Arrow refuses in a sentence of our own."""
    try:
        yield
    except pa.ArrowException:
        raise LogError(sentence) from None


def _nan_to_null(column: Any) -> Any:  # noqa: ANN401 - an array of any type
    if not pa.types.is_floating(column.type):
        return column
    return pa.compute.if_else(pa.compute.is_nan(column), pa.scalar(None, column.type), column)


class _Groups:
    """Rows, held back until there are enough for a group of a fixed size, so that bytes do not depend on the batches."""

    def __init__(self, schema: pa.Schema, write: Callable[[pa.Table], object]) -> None:
        self._schema = schema
        self._write = write
        self._held: list[pa.RecordBatch] = []
        self._rows = 0

    def add(self, batch: pa.RecordBatch) -> None:
        """Take rows, and write the groups that are full."""
        self._held.append(batch)
        self._rows += batch.num_rows
        while self._rows >= ROWS_PER_GROUP:
            self._write_group(ROWS_PER_GROUP)

    def settle(self) -> None:
        """Write what is left."""
        if self._rows:
            self._write_group(self._rows)

    def _write_group(self, rows: int) -> None:
        held = pa.Table.from_batches(self._held, self._schema)
        # In one chunk: Arrow writes each as a batch of its own, and looks for the end of a Parquet page anew in each.
        self._write(held.slice(0, rows).combine_chunks())
        self._held = held.slice(rows).to_batches()
        self._rows -= rows


class _Parquet:
    """A Parquet file in row groups of a fixed size, so that its bytes do not depend on the batches.

    It grows in pieces. Each begins and ends like a file of its own, and has behind it an index of all row groups so far: a
    reader looks at the last index only, so that the file is complete after each piece.
    """

    def __init__(self, file: IO[bytes], schema: pa.Schema, *, append: bool = False) -> None:
        self._path: Any = os.fsencode(file.name)  # Arrow would refuse a name that is no text
        self._schema = schema
        self._index: Any = None
        if append:
            with Path(file.name).open("rb") as held:
                self._index = pa.parquet.read_metadata(held)
        self._sink: Any = None
        self._piece: Any = None
        self._groups = _Groups(schema, self._write_group)
        if not append:
            self._begin()

    def _begin(self) -> None:
        """Begin a piece at the end of the file."""
        self._sink = pa.OSFile(self._path, "ab")
        # Arrow refuses a sink that does not stand at its beginning, and then writes down where in the sink things are. What is
        # appended goes to the end wherever the sink stands: so it finds their places in the whole file.
        os.lseek(self._sink.fileno(), 0, os.SEEK_SET)
        # Measured numbers hardly ever repeat: a dictionary of them is work for nothing.
        repeating: Any = [field.name for field in self._schema if not pa.types.is_floating(field.type)]
        self._piece = pa.parquet.ParquetWriter(self._sink, self._schema, use_dictionary=repeating)

    def write(self, batch: pa.RecordBatch) -> None:
        self._groups.add(batch)

    def _write_group(self, group: pa.Table) -> None:
        if self._piece is None:
            self._begin()
        self._piece.write_table(group, row_group_size=group.num_rows)

    def settle(self) -> None:
        self._groups.settle()
        if self._piece is None:
            return
        self._piece.close()
        index = self._piece.writer.metadata
        if self._index is None:
            self._index = index
        else:
            self._index.append_row_groups(index)
            self._index.write_metadata_file(self._sink)
        self._sink.close()
        self._piece = self._sink = None

    def close(self) -> None:
        self.settle()

    def abandon(self) -> None:
        # Before the file is closed: Arrow's destructor would do it later, fail, and print a traceback.
        if self._piece is not None:
            with contextlib.suppress(Exception):
                self._piece.close()
            self._sink.close()


class _Arrow:
    """A Feather file, which is one of Arrow: not compressed, so that it can be mapped into memory."""

    def __init__(self, file: IO[bytes], schema: pa.Schema) -> None:
        # Such a file holds one dictionary a column, while that of a log may change on the way.
        metadata: Any = schema.metadata
        self._schema = pa.schema([_decoded(field) for field in schema], metadata)
        self._writer = pa.ipc.new_file(cast("Any", file), self._schema)
        self._groups = _Groups(self._schema, self._write_group)

    def write(self, batch: pa.RecordBatch) -> None:
        columns: list[Any] = batch.columns
        columns = [
            column.dictionary_decode() if pa.types.is_dictionary(column.type) else column
            for column in columns
        ]
        self._groups.add(pa.RecordBatch.from_arrays(columns, schema=self._schema))

    def _write_group(self, group: pa.Table) -> None:
        # Copied: of a column that is cut out of a longer one Arrow would write a few bytes of what follows.
        copy = pa.concat_tables([group.slice(0, 1), group.slice(1)]).combine_chunks()
        self._writer.write_table(copy, copy.num_rows)

    def close(self) -> None:
        self._groups.settle()
        self._writer.close()

    def abandon(self) -> None:
        # Before the file is closed: Arrow's destructor would do it later, fail, and print a traceback.
        self._writer.close()


def _decoded(field: Any) -> Any:  # noqa: ANN401 - a field of any type
    return field.with_type(field.type.value_type) if pa.types.is_dictionary(field.type) else field


FORMATS: dict[str, Callable[[IO[bytes], pa.Schema], LogWriter]] = {
    ".csv": _Csv,
    ".parquet": _Parquet,
    ".feather": _Arrow,
    ".arrow": _Arrow,
}
"""The endings of the files that can be written, and how."""

RESUMABLE: dict[str, Callable[..., ResumableWriter]] = {".csv": _Csv, ".parquet": _Parquet}
"""Those that can be continued, with ``append=True``."""
