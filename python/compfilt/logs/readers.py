"""Logs as streams of record batches: only the columns that are asked for, never the whole file in memory."""

import contextlib
import difflib
import io
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet

from compfilt.logs.errors import LogError

__all__ = ["FORMATS", "Columns", "LogReader", "open_log", "read_schema"]


class LogReader(Protocol):
    """A log that is being read.

    Attributes
    ----------
    schema
        The columns that were asked for.
    size
        The file's size in bytes.
    """

    schema: pa.Schema
    size: int

    def position(self) -> int:
        """Return about how many of the file's bytes have been read."""

    def batches(self) -> Iterator[pa.RecordBatch]:
        """Yield the log's rows in order.

        Raises
        ------
        LogError
            The file is damaged, or a field is not a number.
        """


class Columns(NamedTuple):
    """The columns to read: the signals and the time must hold numbers, the kept ones may hold anything."""

    signals: tuple[str, ...]
    time: tuple[str, ...] = ()
    keep: tuple[str, ...] = ()

    @property
    def all(self) -> list[str]:
        """Every column once."""
        return list(dict.fromkeys((*self.time, *self.signals, *self.keep)))


def open_log(
    path: str | Path,
    columns: Columns,
    *,
    batch_bytes: int = 1 << 20,
    batch_rows: int = 1 << 16,
) -> contextlib.AbstractContextManager[LogReader]:
    """Open a CSV or Parquet file, by its ending.

    Parameters
    ----------
    path
        The file.
    columns
        The columns to read. The signals of a CSV file are float64, and an empty field is missing.
    batch_bytes, batch_rows
        How much is read at a time: bytes of a CSV, rows of a Parquet file.

    Raises
    ------
    LogError
        The file is not there, not readable, empty, of an unknown kind, damaged, lacks a column, or holds something
        other than numbers in a signal. The message names the column and, where it can be known, the row.
    """
    path = Path(path)
    _check_readable(path)
    return FORMATS[path.suffix.lower()].open(path, columns, batch_bytes, batch_rows)


def read_schema(path: str | Path) -> pa.Schema:
    """Read which columns a CSV or Parquet file has, and what they hold at its beginning.

    Raises
    ------
    LogError
        The file is not there, not readable, empty, of an unknown kind, or damaged.
    """
    path = Path(path)
    _check_readable(path)
    with _plain_errors([]):
        return FORMATS[path.suffix.lower()].schema(path)


def _check_readable(path: Path) -> None:
    """Raise LogError unless there is a file of a known kind with something in it."""
    if path.suffix.lower() not in FORMATS:
        raise LogError(f'the ending "{path.suffix}" is not known; logs end in {" or ".join(FORMATS)}')
    if path.is_dir():
        raise LogError("this is a folder, not a file")
    try:
        # The system's own words for a file that is not there or not readable are clearer than those of Arrow.
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror}") from None
    if empty:
        raise LogError("the file is empty")


class _Csv:
    """A CSV file with one header row."""

    def __init__(
        self, file: io.FileIO, reader: pa.csv.CSVStreamingReader, header: list[str], size: int
    ) -> None:
        self._file = file
        self._reader = reader
        self._header = header
        self.schema = reader.schema
        self.size = size

    def position(self) -> int:
        return min(self._file.tell(), self.size)

    def batches(self) -> Iterator[pa.RecordBatch]:
        with _plain_errors(self._header):
            yield from self._reader


def _csv_schema(path: Path) -> pa.Schema:
    with pa.csv.open_csv(path, read_options=pa.csv.ReadOptions(use_threads=False)) as reader:
        return reader.schema


@contextlib.contextmanager
def _open_csv(path: Path, columns: Columns, batch_bytes: int, _batch_rows: int) -> Iterator[LogReader]:
    # One thread is faster here than several, since a batch is small, and Arrow then knows the row of an error.
    read = pa.csv.ReadOptions(use_threads=False, block_size=batch_bytes)
    # The first block is read twice: once to see the header and what the columns hold.
    with _plain_errors([]), pa.csv.open_csv(path, read_options=read) as peek:
        header, first = peek.schema.names, next(iter(peek), None)
    _require(header, columns.all)
    if first is None or not first.num_rows:
        raise LogError("the file holds no rows")
    types = {name: _csv_type(first.column(name)) for name in (*columns.keep, *columns.time)}
    types |= {name: pa.float64() for name in columns.time if not pa.types.is_integer(types[name])}
    types |= {name: pa.float64() for name in columns.signals}
    convert = pa.csv.ConvertOptions(column_types=types, include_columns=columns.all)
    with path.open("rb", buffering=0) as file:
        with _plain_errors(header):
            reader = pa.csv.open_csv(file, read_options=read, convert_options=convert)
        with reader:
            yield _Csv(file, reader, header, path.stat().st_size)


def _csv_type(values: Any) -> Any:  # noqa: ANN401 - an array of any type, and its type
    """Choose the type of a kept column from the log's first block.

    A column that begins with whole numbers may go on with others: it is read as float64, unless that would change
    a number. One that begins with nothing at all is carried along as text.
    """
    if pa.types.is_null(values.type):
        return pa.string()
    if pa.types.is_integer(values.type):
        ends = pa.compute.min_max(values)
        largest = max(abs(ends[end].as_py()) for end in ("min", "max"))
        return pa.int64() if largest > 2**53 else pa.float64()
    return values.type


class _Parquet:
    """A Parquet file."""

    def __init__(self, file: pa.parquet.ParquetFile, columns: Columns, batch_rows: int, size: int) -> None:
        self._file = file
        self._columns = columns
        self._batch_rows = batch_rows
        self._rows = 0
        self.schema = pa.schema([file.schema_arrow.field(name) for name in columns.all])
        self.size = size

    def position(self) -> int:
        return self.size * self._rows // self._file.metadata.num_rows

    def batches(self) -> Iterator[pa.RecordBatch]:
        with _plain_errors(self._columns.all):
            for batch in self._file.iter_batches(self._batch_rows, columns=self._columns.all):
                self._rows += batch.num_rows
                yield batch


def _parquet_schema(path: Path) -> pa.Schema:
    with pa.parquet.ParquetFile(path, pre_buffer=False) as file:
        return file.schema_arrow


@contextlib.contextmanager
def _open_parquet(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    with _plain_errors([]):
        # A buffer and no prefetch: a row group may be as large as the file.
        file = pa.parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False)
    with file:
        _require(file.schema_arrow.names, columns.all)
        for name in (*columns.signals, *columns.time):
            held = file.schema_arrow.field(name).type
            if not (pa.types.is_integer(held) or pa.types.is_floating(held)):
                raise LogError(f'column "{name}" holds {held}, not numbers')
        if not file.metadata.num_rows:
            raise LogError("the file holds no rows")
        yield _Parquet(file, columns, batch_rows, path.stat().st_size)


class _Format(NamedTuple):
    """How files of one kind are read, and how their columns are."""

    open: Callable[..., contextlib.AbstractContextManager[LogReader]]
    schema: Callable[[Path], pa.Schema]


FORMATS = {".csv": _Format(_open_csv, _csv_schema), ".parquet": _Format(_open_parquet, _parquet_schema)}
"""The endings of the files that can be read, and how."""


def _require(present: Sequence[str], wanted: Sequence[str]) -> None:
    """Check that each column is there, once."""
    for name in wanted:
        count = list(present).count(name)
        if count > 1:
            raise LogError(f'there are {count} columns "{name}"')
        if not count:
            near = difflib.get_close_matches(name, present, n=3)
            hint = " or ".join(f'"{column}"' for column in near)
            shown = ", ".join(present[:20]) + (", ..." if len(present) > 20 else "")
            raise LogError(
                f'there is no column "{name}"' + (f" (is it {hint}?)" if near else f"; there are {shown}")
            )


_BAD_VALUE = re.compile(
    r"In CSV column #(\d+): (?:Row #(\d+): )?CSV conversion error to (\w+): invalid value '(.*)'"
)
_BAD_ROW = re.compile(r"CSV parse error: Row #(\d+): Expected (\d+) columns, got (\d+)")


@contextlib.contextmanager
def _plain_errors(names: Sequence[str]) -> Iterator[None]:
    """Turn the errors of Arrow into a sentence about this log; `names` are the columns in the file's order."""
    try:
        yield
    except UnicodeDecodeError:
        raise LogError("this is not a text in UTF-8") from None
    except (pa.ArrowException, OSError) as error:
        text = " ".join(str(error).split())
        if match := _BAD_VALUE.search(text):
            name = names[int(match[1])]
            line = f"line {match[2]}: " if match[2] else ""
            raise LogError(f'{line}column "{name}" holds "{match[4]}", not a number') from None
        if match := _BAD_ROW.search(text):
            raise LogError(f"line {match[1]} has {match[3]} fields, not {match[2]}") from None
        raise LogError(f"the file is damaged or of another kind: {text}") from None
