"""Arrow's own files and streams, Feather among them."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa

from compfilt.logs.errors import LogError, TruncatedLog
from compfilt.logs.readers.base import (
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    plain_errors,
    plain_names,
    rows_or_truncated,
)

__all__ = ["open_reader", "read_columns"]

MAGIC = b"ARROW1\0\0"
"""How a file begins; what follows is a stream with an index behind it."""


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a file has."""
    with _source(path) as source:
        schema: pa.Schema = _stream(source).schema
        with plain_names():
            schema.names  # noqa: B018 - Arrow looks at the names only when they are asked for
        return schema


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open a file or a stream.

    A file is read from front to back like a stream: its index, which one that was cut has lost, is not needed. It is
    mapped into memory, so that a batch that is as large as the file takes none, unless it is compressed.
    """
    with _source(path) as source:
        held = _stream(source).schema
        with plain_names():
            names = held.names
        check_present(names, columns.all)
        check_kinds(held, columns)
        wanted = [held.get_field_index(name) for name in columns.all]
        source.seek(_start(source))
        stream = _stream(source, pa.ipc.IpcReadOptions(included_fields=wanted))
        schema = pa.schema([held.field(name) for name in columns.all])
        ended = _has_end(source)
        done = False

        def batches() -> Iterator[pa.RecordBatch]:
            nonlocal done
            rows = 0
            for batch in rows_or_truncated(_pieces(stream, batch_rows)):
                rows += batch.num_rows
                yield batch.select(columns.all)
            done = True
            if not ended:
                raise TruncatedLog(rows, "the file ends too early")
            if not rows:
                raise LogError("the file holds no rows")

        yield Reading(schema, source.size(), batches, lambda: source.size() if done else source.tell())


def _pieces(stream: Any, rows: int) -> Iterator[pa.RecordBatch]:  # noqa: ANN401 - the stubs do not know the class
    for batch in stream:
        # A damaged file must not make anything read beside the data.
        batch.validate(full=True)
        for start in range(0, batch.num_rows, rows):
            yield batch.slice(start, rows)


@contextlib.contextmanager
def _source(path: Path) -> Iterator[Any]:
    with plain_errors():
        source = pa.memory_map(str(path))
    with source:
        if source.read(4) == b"FEA1":
            raise LogError("this is the first version of Feather; write it anew with a later one")
        source.seek(_start(source))
        yield source


def _start(source: Any) -> int:  # noqa: ANN401
    """Return where the stream begins."""
    source.seek(0)
    return len(MAGIC) if source.read(len(MAGIC)) == MAGIC else 0


def _has_end(source: Any) -> bool:  # noqa: ANN401
    """Tell whether a file has its end; of a stream, which may do without, nothing can be told."""
    here = source.tell()
    is_file = _start(source) > 0
    source.seek(max(0, source.size() - 6))
    ended = not is_file or source.read(6) == MAGIC[:6]
    source.seek(here)
    return ended


def _stream(source: Any, options: Any = None) -> Any:  # noqa: ANN401
    with plain_errors():
        return pa.ipc.open_stream(source, options=options)
