"""Text files: CSV and other separators, compressed or not."""

import contextlib
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, cast

import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from compfilt.logs.errors import LogError, TruncatedLog, quoted
from compfilt.logs.readers.base import Columns, LogReader, Reading, check_present, is_time, reason
from compfilt.logs.readers.rows import RowSource

__all__ = ["open_reader", "read_columns"]

LARGE_TICKS = 2**48
"""Times beyond it are whole µs or ns of an epoch, of which no log has fractions: they are counted exactly."""


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a file has, and what they hold at its beginning."""
    schema: pa.Schema = _begin(path, _separator(path, None), 1 << 20).schema
    return schema


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, batch_bytes: int, _batch_rows: int) -> Iterator[LogReader]:
    """Open a file with one header row."""
    separator = _separator(path, columns.separator)
    # The first block is read twice: once to see the header and what the columns hold.
    first = _begin(path, separator, batch_bytes)
    header = first.schema.names
    check_present(header, columns.all)
    if not first.num_rows:
        raise LogError("the file holds no rows")
    parse = pa.csv.ParseOptions(delimiter=separator)
    convert = pa.csv.ConvertOptions(column_types=_types(first, columns), include_columns=columns.all)

    def judge(row: bytes, ended: bool) -> str:
        return _why_cut(row, ended, header, parse, convert)

    with contextlib.closing(RowSource(path, judge, batch_bytes)) as source:
        # One thread is faster here than several, since a batch is small, and Arrow then knows the row of an error.
        read = pa.csv.ReadOptions(use_threads=False, block_size=batch_bytes)
        with _plain_errors(header, batch_bytes):
            reader = pa.csv.open_csv(
                cast("IO[bytes]", source), read_options=read, parse_options=parse, convert_options=convert
            )

        def batches() -> Iterator[pa.RecordBatch]:
            rows = 0
            with _plain_errors(header, batch_bytes):
                for batch in reader:
                    rows += batch.num_rows
                    yield batch
            if source.failure:
                raise TruncatedLog(rows, source.failure)

        with reader:
            yield Reading(reader.schema, source.size, batches, source.position)


def _separator(path: Path, chosen: str | None) -> str:
    """Return what stands between the fields: what the recipe says, otherwise what the ending says."""
    if chosen is not None:
        return chosen
    return "\t" if ".tsv" in path.suffixes[-2:] else ","


def _begin(path: Path, separator: str, size: int) -> Any:  # noqa: ANN401 - a table
    """Read the rows that stand completely in the first block."""
    last: list[bytes] = []

    def judge(row: bytes, ended: bool) -> str:
        last.append(row)
        return "" if ended else "it may be cut off"

    with contextlib.closing(RowSource(path, judge, size)) as source:
        text = b""
        while len(text) < size and (part := source.read(size - len(text))):
            text += part
    if source.failure and not text and not last:
        raise LogError(source.failure)
    if b"\n" not in text and b"\r" not in text and len(text) >= size:
        raise LogError(f"the first line is longer than {size} bytes: these are no names of columns")
    with _plain_errors([], size):
        table = _parse(text, separator) if text else None
        if source.failure and last and (table is None or not table.num_rows):
            # The last row shows what the columns hold only if there is no other.
            table = _parse(text + b"".join(last), separator)
        if table is None:
            raise LogError("the file holds no rows")
        table.schema.names  # noqa: B018 - raises if they are no text
        return table


def _parse(text: bytes, separator: str) -> Any:  # noqa: ANN401 - a table
    """Read some rows, whatever they hold; the damaged ones are named when the log is read."""
    parse = pa.csv.ParseOptions(delimiter=separator, invalid_row_handler=lambda _: "skip")
    return pa.csv.read_csv(
        io.BytesIO(text), read_options=pa.csv.ReadOptions(use_threads=False), parse_options=parse
    )


def _types(first: Any, columns: Columns) -> dict[str, Any]:  # noqa: ANN401 - a table, and types
    """Choose the types of the columns: numbers for the signals, what they begin with for the others."""
    types = {name: _kept_type(first.column(name)) for name in columns.keep}
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


def _why_cut(
    row: bytes, ended: bool, header: Sequence[str], parse: pa.csv.ParseOptions, convert: pa.csv.ConvertOptions
) -> str:
    """Say why the last row of a file is one that was cut off, or nothing if it is whole or wrong in another way.

    A row that has all its fields is whole, though nobody can tell whether its last number was longer.
    """
    names = pa.csv.ReadOptions(column_names=list(header), use_threads=False)
    try:
        pa.csv.read_csv(io.BytesIO(row), read_options=names, parse_options=parse, convert_options=convert)
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        if match := _BAD_ROW.search(str(error)):
            short = int(match[3]) < int(match[2])
            return f"its last row has {match[3]} fields, not {match[2]}" if short else ""
        return "" if ended else "its last row ends within a field"
    return ""


_BAD_VALUE = re.compile(
    r"In CSV column #(\d+): (?:Row #(\d+): )?CSV conversion error to ([^:]+): invalid value '(.*)'"
)
_BAD_ROW = re.compile(r"CSV parse error: (?:Row #(\d+): )?Expected (\d+) columns, got (\d+)")


@contextlib.contextmanager
def _plain_errors(names: Sequence[str], block: int) -> Iterator[None]:
    """Turn the errors of Arrow into a sentence about this log; `names` are the columns in the file's order."""
    try:
        yield
    except UnicodeDecodeError:
        raise LogError("this is not a text in UTF-8") from None
    except (pa.ArrowException, OSError) as error:
        text = reason(error)
        if match := _BAD_VALUE.search(text):
            line = f"line {match[2]}: " if match[2] else ""
            wanted = "a time" if match[3].startswith("timestamp") else "a number"
            raise LogError(
                f"{line}column {quoted(names[int(match[1])])} holds {quoted(match[4])}, not {wanted}"
            ) from None
        if match := _BAD_ROW.search(text):
            line = f"line {match[1]}" if match[1] else "a line"
            raise LogError(f"{line} has {match[3]} fields, not {match[2]}") from None
        if "straddl" in text:
            raise LogError(f"a line is longer than {block} bytes") from None
        raise LogError(f"the file is damaged or of another kind: {text}") from None
