"""An MCAP file that was cut, shown to its library as if it had been closed after the last record that is whole."""

import io
import struct
from pathlib import Path
from typing import IO

from compfilt.logs.readers.base import plain_errors

__all__ = ["MendedMcap", "is_cut"]

MAGIC = b"\x89MCAP0\r\n"

FOOTER = b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0) + MAGIC
"""The end of a file without an index."""


def is_cut(path: Path) -> bool:
    """Tell whether a file lacks its end."""
    with plain_errors(), path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(MAGIC)))
        return file.read() != MAGIC


class MendedMcap:
    """The path of a file that lacks its end; what it opens has one.

    Parameters
    ----------
    path
        The file.
    """

    suffix = ".mcap"

    def __init__(self, path: Path) -> None:
        self._path = path

    def __str__(self) -> str:
        return str(self._path)

    def exists(self) -> bool:
        """Tell that the file is there."""
        return True

    def is_dir(self) -> bool:
        """Tell that this is a file."""
        return False

    def open(self, _mode: str) -> IO[bytes]:
        """Open the file."""
        return io.BufferedReader(_WithFooter(self._path))


class _WithFooter(io.RawIOBase):
    """The records of a file that are whole, and a footer."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file = path.open("rb")
        self._end = _end_of_records(self._file, path.stat().st_size)
        self._here = 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        self._file.close()
        super().close()

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        begin = {io.SEEK_SET: 0, io.SEEK_CUR: self._here, io.SEEK_END: self._end + len(FOOTER)}[whence]
        self._here = max(0, begin + offset)
        return self._here

    def readinto(self, buffer: memoryview, /) -> int:  # type: ignore[override]
        if self._here < self._end:
            self._file.seek(self._here)
            data = self._file.read(min(len(buffer), self._end - self._here))
        else:
            begin = self._here - self._end
            data = FOOTER[begin : begin + len(buffer)]
        buffer[: len(data)] = data
        self._here += len(data)
        return len(data)


def _end_of_records(file: IO[bytes], size: int) -> int:
    """Return where the last whole record ends; each begins with its kind and its length."""
    end = len(MAGIC)
    while True:
        file.seek(end)
        head = file.read(9)
        if len(head) < 9:
            return end
        (length,) = struct.unpack("<Q", head[1:])
        if end + 9 + length > size:
            return end
        end += 9 + length
