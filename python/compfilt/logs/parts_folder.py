"""The hidden folder in which the parts of a result lie until they are put together."""

import contextlib
import glob
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

from compfilt.logs.errors import UsageError

try:
    import fcntl
except ModuleNotFoundError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

__all__ = ["folder_beside"]


@contextlib.contextmanager
def folder_beside(out: Path) -> Iterator[Path]:
    """Make a hidden folder for the parts, where there is room for the result too; it goes away with all it holds.

    A run that was killed leaves its folder, and the next one removes it. The names differ: workers of a run that was killed
    may still write, and what they write must not get among the parts of the next one.
    """
    _remove_left(out)
    folder = out.with_name(f".{out.name}.{secrets.token_hex(4)}.parts")
    try:
        folder.mkdir()
    except OSError as error:
        raise UsageError(f"{folder}: the folder cannot be made: {error.strerror}") from None
    with _locked(folder):
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def _remove_left(out: Path) -> None:
    """Remove the folders that no run holds; where there are no locks they stay."""
    for folder in out.parent.glob(f".{glob.escape(out.name)}.????????.parts"):
        with _locked(folder) as ours:
            if ours:
                shutil.rmtree(folder, ignore_errors=True)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[bool]:
    """Hold a folder, which the system lets go when the process dies; tell whether it could be held."""
    handle, ours = None, False
    if fcntl is not None:
        with contextlib.suppress(OSError):
            handle = os.open(folder, os.O_RDONLY)
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            ours = True
    try:
        yield ours
    finally:
        if handle is not None:
            os.close(handle)
