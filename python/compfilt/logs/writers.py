"""Results as files that are either complete or not there."""

import contextlib
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

import pyarrow as pa

from compfilt.logs.encoders import FORMATS, LogWriter
from compfilt.logs.errors import LogError, UsageError

__all__ = [
    "abandoned_on_failure",
    "check_ending",
    "check_target",
    "complete_file",
    "create_log",
    "result_name",
]


def result_name(log: Path) -> str:
    """Name a log's result in a folder: as the log, but in a format that is written."""
    if log.suffix.lower() in FORMATS and not log.is_dir():
        return log.name
    name = log.name
    if not log.is_dir():  # the folder of a bag may have a dot in its name
        packed = log.suffix.lower() in {".gz", ".zst"}
        name = Path(log.stem).stem if packed else log.stem
    return f"{name}.parquet"


def check_ending(path: Path, endings: Iterable[str] = tuple(FORMATS)) -> None:
    """Raise UsageError unless the file's kind can be written."""
    if path.suffix.lower() not in endings:
        raise UsageError(
            f'{path}: cannot write a file that ends in "{path.suffix}"; use {" or ".join(endings)}'
        )


def check_target(path: Path, *, force: bool, folder: bool = False) -> None:
    """Raise UsageError if a result is there already that may not be replaced, or a folder, unless results may be one."""
    if path.is_dir() and not folder:
        raise UsageError(f"{path}: this is a folder, not a file")
    if path.exists() and not force:
        raise UsageError(f"{path}: is already there; --force replaces it")


@contextlib.contextmanager
def complete_file(path: Path) -> Iterator[IO[bytes]]:
    """Write a file that appears under its name only when it is complete.

    It grows under a temporary name in the same folder. When the block ends well it is moved into place; when it ends
    with an exception, Ctrl-C among them, the temporary file is removed and whatever stood under the name stays.

    Raises
    ------
    LogError
        The folder or the file cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        # Not tempfile: its files are private to the user, while a result follows the umask like any other file.
        with temporary.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise LogError(f"{path} cannot be written: {error.strerror or error}") from None
    finally:
        # Where it cannot be removed, what went wrong before says why.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def create_log(path: Path, schema: pa.Schema) -> Iterator[LogWriter]:
    """Write a CSV, Parquet or Arrow file, by its ending, as :func:`complete_file` does.

    Raises
    ------
    LogError
        The folder or the file cannot be written.
    """
    with complete_file(path) as file:
        writer = FORMATS[path.suffix.lower()](file, schema)
        with abandoned_on_failure(writer):
            yield writer
            writer.close()


@contextlib.contextmanager
def abandoned_on_failure(writer: LogWriter) -> Iterator[None]:
    """Let go of the writer's file when the block ends with an exception."""
    try:
        yield
    except BaseException:
        with contextlib.suppress(Exception):
            writer.abandon()
        raise
