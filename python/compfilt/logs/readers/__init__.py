"""Logs as streams of record batches: only the columns that are asked for, never the whole file in memory.

Each format has a file of its own, with ``open_reader`` and ``read_columns``. The libraries of most formats come with an
extra, and are imported when a log of that format is opened.
"""

import importlib
import importlib.util
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa

from compfilt.logs.errors import LogError, UsageError, quoted
from compfilt.logs.readers.base import Columns, LogReader, size_of

__all__ = [
    "FORMATS",
    "Columns",
    "LogReader",
    "check_library",
    "first_lines",
    "is_text",
    "open_log",
    "read_schema",
    "size_of",
]


class Format(NamedTuple):
    """A kind of log."""

    title: str
    module: str
    """The file of this package that reads it."""
    endings: tuple[str, ...]
    magic: tuple[bytes, ...] = ()
    """How its files begin; nothing if they may begin in any way."""
    extra: str = "logs"
    library: str = "pyarrow"


_CSV_ENDINGS = tuple(ending + packed for packed in ("", ".gz", ".zst") for ending in (".csv", ".tsv"))

FORMATS = (
    Format("CSV", "text", _CSV_ENDINGS),
    Format("Parquet", "parquet", (".parquet",), (b"PAR1",)),
    Format("Arrow", "arrow", (".arrow", ".feather", ".ipc"), (b"ARROW1", b"FEA1")),
    Format("NumPy", "npz", (".npz",)),
    Format("HDF5", "hdf5", (".h5", ".hdf5"), (b"\x89HDF\r\n\x1a\n",), "hdf5", "h5py"),
    Format("ULog", "ulog", (".ulg",), (b"ULog\x01\x12\x35",), "ulog", "pyulog"),
    Format("ROS 1 bag", "bags", (".bag",), (b"#ROSBAG V",), "bags", "rosbags"),
    Format("ROS 2 bag", "bags", (".db3",), (b"SQLite format 3\0",), "bags", "rosbags"),
    Format("MCAP", "bags", (".mcap",), (b"\x89MCAP0\r\n",), "bags", "rosbags"),
)
"""The kinds of logs that can be read. A ROS 2 bag may also be a folder."""

TEXT = FORMATS[0]


def open_log(
    path: str | Path,
    columns: Columns,
    *,
    batch_bytes: int = 1 << 20,
    batch_rows: int = 1 << 16,
) -> AbstractContextManager[LogReader]:
    """Open a log of any known format, by its ending; without a known ending, by its first bytes.

    Parameters
    ----------
    path
        The file; for a ROS 2 bag also its folder.
    columns
        The columns to read. The signals of a CSV file are float64, and an empty field is missing.
    batch_bytes, batch_rows
        How much is read at a time: bytes of a CSV, rows of the others.

    Raises
    ------
    LogError
        The log is not there, not readable, empty, of an unknown kind, damaged, lacks a column, or holds something
        other than numbers in a signal. The message names the column and, where it can be known, the row.
    UsageError
        The library for this format is not installed; the message names the extra that brings it.
    """
    path = Path(path)
    reader: AbstractContextManager[LogReader] = _module(_format(path)).open_reader(
        path, columns, batch_bytes, batch_rows
    )
    return reader


def read_schema(path: str | Path, separator: str | None = None) -> pa.Schema:
    """Read which columns a log has, and what they hold at its beginning.

    Parameters
    ----------
    path
        The log.
    separator
        What separates the fields of a text, where its ending does not tell it.

    Raises
    ------
    LogError
        The log is not there, not readable, empty, of an unknown kind, or damaged.
    UsageError
        The library for this format is not installed.
    """
    path = Path(path)
    kind = _format(path)
    chosen = (separator,) if kind is TEXT else ()
    schema: pa.Schema = _module(kind).read_columns(path, *chosen)
    return schema


def first_lines(path: str | Path, count: int) -> dict[int, str] | None:
    """Read the first lines of a text that hold anything, by their numbers from 1 on; None if the log is no text.

    Raises
    ------
    LogError
        The log is not there, not readable, empty, or of an unknown kind.
    """
    path = Path(path)
    kind = _format(path)
    return _module(kind).first_lines(path, count) if kind is TEXT else None


def is_text(path: str | Path) -> bool:
    """Tell whether a log that was opened is a text, whose rows have numbers of lines."""
    return _format(Path(path)) is TEXT


def check_library(path: str | Path) -> None:
    """Raise UsageError if the library that reads this kind of log is not installed; the log need not be there."""
    path = Path(path)
    kind = _by_ending(path)
    if path.is_dir():
        kind = _folder_format(path)
    if kind is not None and importlib.util.find_spec(kind.library) is None:
        raise _missing_library(kind)


def _module(kind: Format) -> Any:  # noqa: ANN401 - a module of this package
    """Import what reads a kind of log."""
    try:
        return importlib.import_module(f"{__name__}.{kind.module}")
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("compfilt"):
            raise
        raise _missing_library(kind) from None


def _missing_library(kind: Format) -> UsageError:
    return UsageError(
        f'{kind.title} files are read with {kind.library}: pip install "compfilt[{kind.extra}]"'
    )


def _format(path: Path) -> Format:
    """Tell what kind of log this is, and that there is something in it."""
    if path.is_dir():
        folder = _folder_format(path)
        if folder is None:
            raise LogError("this is a folder, not a file")
        return folder
    by_ending = _by_ending(path)
    begins = _first_bytes(path, needed=by_ending is not None)
    if by_ending is not None and not begins:
        raise LogError("the file is empty")
    by_magic = next((kind for kind in FORMATS if kind.magic and begins.startswith(kind.magic)), None)
    if by_ending is None and by_magic is None:
        endings = ", ".join(ending for kind in FORMATS for ending in kind.endings)
        raise LogError(f"the ending {quoted(path.suffix)} is not known; logs end in {endings}")
    if by_ending is not None and by_magic is not None and by_magic.title != by_ending.title:
        raise LogError(f"by its first bytes this is a file of {by_magic.title}, not of {by_ending.title}")
    return by_ending or by_magic  # type: ignore[return-value]


def _by_ending(path: Path) -> Format | None:
    name = path.name.lower()
    return next((kind for kind in FORMATS if name.endswith(kind.endings)), None)


def _folder_format(path: Path) -> Format | None:
    """Tell whether a folder is a ROS 2 bag."""
    if not (path / "metadata.yaml").is_file():
        return None
    return next(kind for kind in FORMATS if kind.title == "ROS 2 bag")


def _first_bytes(path: Path, *, needed: bool) -> bytes:
    """Read how a file begins; of a file of an unknown kind it does not matter why it cannot be read."""
    try:
        # The system's own words for a file that is not there or not readable are clearer than those of a library.
        with path.open("rb") as file:
            return file.read(16)
    except OSError as error:
        if not needed:
            return b""
        raise LogError(f"cannot be read: {error.strerror}") from None
