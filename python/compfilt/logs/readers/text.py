"""Text files: CSV and other separators, compressed or not."""

import contextlib
import csv
import io
import itertools
import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from compfilt.logs.errors import LogError, TruncatedLog, quoted
from compfilt.logs.readers.base import Columns, LogReader, Reading, check_present, is_time, reason
from compfilt.logs.readers.rows import RowSource

__all__ = ["MISSING", "first_lines", "open_reader", "read_columns", "usual_separator"]

MISSING = frozenset(pa.csv.ConvertOptions().null_values or ())
"""What may stand in the place of a number that is missing."""

BEGIN = 1 << 20
"""Bytes of a file that are looked at for what its columns are: lines may be long."""

LARGE_TICKS = 2**48
"""Times beyond it are whole µs or ns of an epoch, of which no log has fractions: they are counted exactly."""


def read_columns(path: Path, separator: str | None = None) -> pa.Schema:
    """Read which columns a file has, and what they hold at its beginning."""
    separator = usual_separator(path) if separator is None else separator
    begin = _begin(path, BEGIN)
    schema: pa.Schema = _sample(begin, separator, _header(begin, separator)).schema
    return schema


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, batch_bytes: int, _batch_rows: int) -> Iterator[LogReader]:
    """Open a file with one header row."""
    separator = usual_separator(path) if columns.separator is None else columns.separator
    # The first block is read twice: once to see the header and what the columns hold.
    begin = _begin(path, batch_bytes)
    header = _header(begin, separator)
    _check_separated(header, columns)
    check_present(header, columns.all)
    first = _sample(begin, separator, columns.all)
    if not first.num_rows:
        raise LogError("the file holds no rows")
    types = _types(first, columns)
    form = _Form(header, separator, types)

    with contextlib.closing(RowSource(path, form.why_cut, batch_bytes)) as source:

        def batches() -> Iterator[pa.RecordBatch]:
            rows = 0
            for number, block in enumerate(source.blocks()):
                for batch in form.parse(block, rows, first=number == 0):
                    rows += batch.num_rows
                    yield batch
            if source.failure:
                raise TruncatedLog(rows, source.failure, text=True)

        schema = pa.schema([(name, types[name]) for name in columns.all])
        yield Reading(schema, source.size, batches, source.position)


def first_lines(path: Path, count: int) -> dict[int, str]:
    """Read the first lines that hold anything, whatever is in them, by their numbers from 1 on."""
    text = _begin(path, BEGIN).decode("utf-8-sig", "replace")
    lines = enumerate(re.split(r"\r\n|\r|\n", text), 1)
    return dict(itertools.islice(((number, line) for number, line in lines if line.strip()), count))


def _check_separated(header: list[str], columns: Columns) -> None:
    """Refuse a header that is one name of many, since the recipe, or its silence, splits it at the wrong places."""
    found = next((mark for mark in ";\t," if mark in header[0]), None) if len(header) == 1 else None
    if found is not None and not set(columns.all) <= set(header):
        says = "" if columns.separator is None else f", not {json.dumps(columns.separator)}"
        raise LogError(
            f"the only column is called {quoted(header[0])}: the recipe needs separator = {json.dumps(found)}{says}, in [log]"
        )


def usual_separator(path: Path) -> str:
    """Return what stands between the fields by the file's ending."""
    return "\t" if path.name.lower().endswith((".tsv", ".tsv.gz", ".tsv.zst")) else ","


def _begin(path: Path, size: int) -> bytes:
    """Read the rows that stand completely in the first block; the last row of the file only if there is no other."""
    last: list[bytes] = []

    def judge(row: bytes, ended: bool) -> str:
        last.append(row)
        return "" if ended else "it may be cut off"

    with contextlib.closing(RowSource(path, judge, size)) as source:
        blocks = source.blocks()
        text = next(blocks, b"")
        if len(text) < size // 2:
            text += next(blocks, b"")
    if last and source.failure and text.count(b"\n") + text.count(b"\r") < 2:
        text += last[0]
    if not text:
        raise LogError(source.failure or "the file holds no rows")
    return text


def _header(begin: bytes, separator: str) -> list[str]:
    """Read the names of the columns."""
    try:
        text = begin.lstrip(b"\r\n").splitlines()[0].decode("utf-8-sig")
        return next(csv.reader([text], delimiter=separator))
    except UnicodeDecodeError:
        raise LogError("this is not a text in UTF-8") from None
    except (csv.Error, IndexError, StopIteration):
        raise LogError("the first line does not name columns") from None


def _sample(begin: bytes, separator: str, names: list[str]) -> Any:  # noqa: ANN401 - a table
    """Read some columns, whatever they hold; the damaged rows are named when the log is read."""
    parse = pa.csv.ParseOptions(delimiter=separator)
    with contextlib.suppress(UnicodeDecodeError):
        begin.decode()  # Arrow would decode a damaged row for what handles it, and print that it cannot
        parse.invalid_row_handler = lambda _: "skip"
    with _plain_errors([]):
        return pa.csv.read_csv(
            io.BytesIO(begin),
            read_options=pa.csv.ReadOptions(use_threads=False, block_size=2 * len(begin)),
            parse_options=parse,
            convert_options=pa.csv.ConvertOptions(include_columns=names),
        )


class _Form:
    """How a text becomes columns."""

    def __init__(self, header: list[str], separator: str, types: dict[str, Any]) -> None:
        self._header = header
        self._parse = pa.csv.ParseOptions(delimiter=separator)
        self._convert = pa.csv.ConvertOptions(column_types=types, include_columns=list(types))

    def parse(self, block: bytes, rows: int, *, first: bool) -> list[pa.RecordBatch]:
        """Read a block of whole rows; the log's first one begins with the header."""
        if not block.strip():
            return []
        with _plain_errors(self._header, 0 if first else rows + 1):
            batches: list[pa.RecordBatch] = self._read(block, [] if first else self._header).to_batches()
            return batches

    def why_cut(self, row: bytes, ended: bool) -> str:
        """Say why the last row of a file is one that was cut off, or nothing if it is whole or wrong in another way.

        A row that has all its fields is whole, though nobody can tell whether its last number was longer.
        """
        try:
            self._read(row, self._header)
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            if match := _BAD_ROW.search(str(error)):
                short = int(match[3]) < int(match[2])
                return f"its last row has {match[3]} fields, not {match[2]}" if short else ""
            return "" if ended else "its last row ends within a field"
        return ""

    def _read(self, text: bytes, names: list[str]) -> Any:  # noqa: ANN401 - a table
        # One thread is faster here than several, since a block is small, and Arrow then knows the row of an error.
        read = pa.csv.ReadOptions(column_names=names, use_threads=False, block_size=len(text) + 1)
        return pa.csv.read_csv(
            io.BytesIO(text), read_options=read, parse_options=self._parse, convert_options=self._convert
        )


def _types(first: Any, columns: Columns) -> dict[str, Any]:  # noqa: ANN401 - a table, and types
    """Choose the types of the columns: numbers for the signals, text for the written, what they begin with for the others."""
    types: dict[str, Any] = dict.fromkeys(columns.written, pa.string())
    types |= {name: _kept_type(first.column(name)) for name in columns.keep}
    types |= {name: _kept_type(first.column(name), LARGE_TICKS) for name in columns.time}
    for name in columns.time:
        if is_time(types[name]):
            # The first rows may be at whole seconds by chance.
            types[name] = pa.timestamp("ns", types[name].tz)
        elif not pa.types.is_integer(types[name]):
            types[name] = pa.float64()
    return types | {name: pa.float64() for name in columns.signals}


def _kept_type(values: Any, exact: int = 2**53) -> Any:  # noqa: ANN401 - an array of any type, and its type
    """Choose the type of a kept column from the log's first block.

    A column that begins with whole numbers may go on with others: it is read as float64, unless that would change
    a number. One that begins with nothing at all is carried along as text.
    """
    if pa.types.is_null(values.type):
        return pa.string()
    if pa.types.is_integer(values.type):
        ends = pa.compute.min_max(values)
        largest = max(abs(ends[end].as_py()) for end in ("min", "max"))
        return pa.int64() if largest > exact else pa.float64()
    return values.type


_BAD_VALUE = re.compile(
    r"In CSV column #(\d+): (?:Row #(\d+): )?CSV conversion error to ([^:]+): invalid value '(.*)'"
)
_BAD_ROW = re.compile(r"CSV parse error: (?:Row #(\d+): )?Expected (\d+) columns, got (\d+)")


@contextlib.contextmanager
def _plain_errors(names: Sequence[str], before: int = 0) -> Iterator[None]:
    """Turn the errors of Arrow into a sentence about this log.

    Parameters
    ----------
    names
        The columns in the file's order.
    before
        How many lines come before those that are read.
    """
    try:
        yield
    except UnicodeDecodeError:
        raise LogError("this is not a text in UTF-8") from None
    except (pa.ArrowException, OSError) as error:
        text = reason(error)
        if match := _BAD_VALUE.search(text):
            line = f"line {before + int(match[2])}: " if match[2] else ""
            wanted = "a time" if match[3].startswith("timestamp") else "a number"
            raise LogError(
                f"{line}column {quoted(names[int(match[1])])} holds {quoted(match[4])}, not {wanted}"
            ) from None
        if match := _BAD_ROW.search(text):
            line = f"line {before + int(match[1])}" if match[1] else "a line"
            raise LogError(f"{line} has {match[3]} fields, not {match[2]}") from None
        raise LogError(f"the file is damaged or of another kind: {text}") from None
