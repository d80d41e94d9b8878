"""What every reader of logs shares: the columns to read, what a reader offers, and the checks of the columns."""

import contextlib
import difflib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import pyarrow as pa

from compfilt.logs.errors import LogError, TruncatedLog, quoted

__all__ = [
    "MOST_FIELDS",
    "Columns",
    "LogReader",
    "Reading",
    "check_kinds",
    "check_present",
    "check_rows",
    "is_time",
    "plain_errors",
    "plain_names",
    "pyarrow_type",
    "reason",
    "rows_or_truncated",
    "size_of",
    "split_element",
]

COMPARED = 5000
"""How many column names are looked through for one that is written nearly so: comparing is slow."""


MOST_FIELDS = 10_000
"""How many fields a topic may have: types that hold each other can declare any number."""


class Columns(NamedTuple):
    """The columns to read, and how they are separated in a text file.

    The signals must hold numbers, the time numbers or times, and the kept ones may hold anything. Those that are `written` are kept too,
    but of a text file they are the fields as they stand there.
    """

    signals: tuple[str, ...]
    time: tuple[str, ...] = ()
    keep: tuple[str, ...] = ()
    separator: str | None = None
    written: tuple[str, ...] = ()

    @property
    def all(self) -> list[str]:
        """Every column once."""
        return list(dict.fromkeys((*self.time, *self.signals, *self.keep, *self.written)))


class LogReader(Protocol):
    """A log that is being read.

    Attributes
    ----------
    schema
        The columns that were asked for.
    size
        The log's size in bytes.
    """

    schema: pa.Schema
    size: int

    def position(self) -> int:
        """Return about how many of the log's bytes have been read."""

    def batches(self) -> Iterator[pa.RecordBatch]:
        """Yield the log's rows in order.

        Raises
        ------
        TruncatedLog
            The log is damaged. It is raised after all rows that can be read.
        LogError
            A field is not a number, or a row has too many or too few fields.
        """


class Reading:
    """A log that is being read, from what its format has to say about it.

    Parameters
    ----------
    schema, size
        As in :class:`LogReader`.
    batches
        Yields the log's rows.
    position
        Tells how many bytes have been read.
    """

    def __init__(
        self,
        schema: pa.Schema,
        size: int,
        batches: Callable[[], Iterator[pa.RecordBatch]],
        position: Callable[[], int],
    ) -> None:
        self.schema = schema
        self.size = size
        self._batches = batches
        self._position = position

    def position(self) -> int:
        """Return about how many of the log's bytes have been read."""
        return min(self._position(), self.size)

    def batches(self) -> Iterator[pa.RecordBatch]:
        """Yield the log's rows in order."""
        return self._batches()


def check_present(present: Sequence[str], wanted: Sequence[str]) -> None:
    """Check that each column is there, once.

    Raises
    ------
    LogError
        One is not there, or several have its name. The message proposes names that are written nearly so.
    """
    counts = Counter(present)
    for name in wanted:
        if counts[name] > 1:
            raise LogError(f"there are {counts[name]} columns {quoted(name)}")
        if not counts[name]:
            readable = [column for column in present[:COMPARED] if len(column) <= 2 * len(name) + 20]
            near = difflib.get_close_matches(name, readable, n=3)
            hint = " or ".join(quoted(column) for column in near)
            shown = ", ".join(quoted(column)[1:-1] for column in present[:20])
            rest = ", ..." if len(present) > 20 else ""
            raise LogError(
                f"there is no column {quoted(name)}"
                + (f" (is it {hint}?)" if near else f"; there are {shown}{rest}")
            )


def check_kinds(schema: pa.Schema, columns: Columns) -> None:
    """Check that the signals hold numbers, and the time numbers or times.

    Raises
    ------
    LogError
        One of them does not.
    """
    for name in dict.fromkeys((*columns.signals, *columns.time)):
        held = schema.field(name).type
        if not (pa.types.is_integer(held) or pa.types.is_floating(held)):
            if is_time(held) and name not in columns.signals:
                continue
            raise LogError(f"column {quoted(name)} holds {_described(held)}, not numbers")


def is_time(held: Any) -> bool:  # noqa: ANN401 - a type of Arrow
    """Tell whether a type is one of points in time or of spans of time that are counted in a unit."""
    return bool(pa.types.is_timestamp(held) or pa.types.is_duration(held))


def check_rows(rows: int) -> None:
    """Raise LogError if there are none."""
    if rows <= 0:
        raise LogError("the file holds no rows")


def pyarrow_type(dtype: Any, name: str) -> Any:  # noqa: ANN401 - types of numpy and of Arrow
    """Return Arrow's type for that of a column in numpy."""
    try:
        return pa.from_numpy_dtype(dtype.newbyteorder("="))
    except (pa.ArrowException, NotImplementedError, TypeError):
        raise LogError(f"column {quoted(name)} holds {_described(dtype)}, not numbers") from None


def split_element(name: str) -> tuple[str, int | None]:
    """Split the name of a column of a table, ``name[0]``, into the table's name and the column's number.

    Examples
    --------
    >>> split_element("imu/gyro[2]"), split_element("imu/t")
    (('imu/gyro', 2), ('imu/t', None))
    """
    table, bracket, number = name.rpartition("[")
    digits = number[:-1]
    if bracket and number.endswith("]") and digits.isascii() and digits.isdigit() and len(digits) < 10:
        return table, int(digits)
    return name, None


@contextlib.contextmanager
def plain_errors(*kinds: type[Exception]) -> Iterator[None]:
    """Turn the errors of a library about a file that cannot be opened into a sentence about this log."""
    try:
        yield
    except LogError:
        raise
    except _broken(kinds) as error:
        raise LogError(f"the file is damaged or of another kind: {reason(error)}") from None


@contextlib.contextmanager
def plain_names() -> Iterator[None]:
    """Turn the error about the name of a column that is no text into a sentence about this log."""
    try:
        yield
    except UnicodeDecodeError:
        raise LogError("the name of a column is not a text in UTF-8") from None


def rows_or_truncated(
    batches: Iterator[pa.RecordBatch], *kinds: type[Exception], rows: int = 0
) -> Iterator[pa.RecordBatch]:
    """Yield batches; an error of the library that reads them means that no more of the log can be read.

    Parameters
    ----------
    batches
        Where they come from.
    kinds
        What the library raises on damaged files, besides Arrow's and the system's errors.
    rows
        How many rows came before.
    """
    while True:
        try:
            batch = next(batches)
        except StopIteration:
            return
        except _broken(kinds) as error:
            raise TruncatedLog(rows, reason(error)) from None
        if batch.num_rows:
            yield batch
            rows += batch.num_rows


def _broken(kinds: tuple[type[Exception], ...]) -> tuple[type[Exception], ...]:
    """Return what libraries raise on files that they cannot read."""
    return (pa.ArrowException, OSError, MemoryError, *kinds)


def reason(error: Exception) -> str:
    """Return what a library says about an error, on one line and not too long."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 300 else text[:300] + "..."


def size_of(path: Path) -> int:
    """Return the size of a file, or of all files of a folder, in bytes."""
    if path.is_dir():
        return sum(file.stat().st_size for file in path.iterdir() if file.is_file())
    return path.stat().st_size


def _described(held: object) -> str:
    """Name a type; one of a hostile file may be nested a thousand times."""
    text = str(held)
    return text if len(text) <= 60 else text[:60] + "..."
