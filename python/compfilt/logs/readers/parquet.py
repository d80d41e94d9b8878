"""Parquet files."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet

from compfilt.logs.errors import TruncatedLog
from compfilt.logs.readers.base import (
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    check_rows,
    plain_errors,
    plain_names,
    rows_or_truncated,
)

__all__ = ["open_reader", "read_columns"]


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a file has."""
    with plain_errors(), plain_names(), pa.parquet.ParquetFile(path, pre_buffer=False) as file:
        return file.schema_arrow


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open a file. Without its end, where the index stands, nothing of it can be read."""
    with plain_errors(), plain_names():
        # A buffer and no prefetch: a row group may be as large as the file.
        file = pa.parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False)
    with file:
        held = file.schema_arrow
        with plain_names():
            names = held.names
        check_present(names, columns.all)
        check_kinds(held, columns)
        check_rows(file.metadata.num_rows)
        schema = pa.schema([held.field(name) for name in columns.all])
        size = path.stat().st_size
        rows = 0

        def batches() -> Iterator[pa.RecordBatch]:
            nonlocal rows
            try:
                for batch in rows_or_truncated(file.iter_batches(batch_rows, columns=columns.all)):
                    rows += batch.num_rows
                    yield batch.select(columns.all)
            except TruncatedLog:
                # A batch may hold several row groups, of which the first ones may be whole.
                rest = _by_groups(file, columns.all, rows, batch_rows)
                for batch in rows_or_truncated(rest, rows=rows):
                    rows += batch.num_rows
                    yield batch.select(columns.all)

            declared = file.metadata.num_rows
            if rows < declared:
                raise TruncatedLog(rows, f"the file declares {declared} rows, but does not have them")

        yield Reading(schema, size, batches, lambda: size * rows // file.metadata.num_rows)


def _by_groups(
    file: pa.parquet.ParquetFile, names: list[str], first: int, batch_rows: int
) -> Iterator[pa.RecordBatch]:
    """Read the rows from one on, each row group for itself."""
    begin = 0
    for group in range(file.num_row_groups):
        end = begin + file.metadata.row_group(group).num_rows
        if end > first:
            for batch in file.iter_batches(batch_rows, row_groups=[group], columns=names):
                yield batch.slice(min(batch.num_rows, max(0, first - begin)))
                begin += batch.num_rows
        begin = end
