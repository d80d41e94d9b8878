"""The bytes of a text log: decompressed as they come, in whole rows, the last one held back until it is judged."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from compfilt.logs.readers.base import reason

__all__ = ["RowSource"]

PACKED: dict[bytes, Literal["gzip", "zstd"]] = {b"\x1f\x8b": "gzip", b"\x28\xb5\x2f\xfd": "zstd"}
"""How compressed files begin."""

STEP = 512
"""Bytes that are asked of a decompressor at a time: it gives nothing of a step in which the data end too early."""


class RowSource(io.RawIOBase):
    """The bytes of a text file, compressed or not, cut between rows.

    The last row of the file is held back. It may be cut off, and that is seen only when nothing comes after it.

    Parameters
    ----------
    path
        The file; whether it is compressed is told by its first bytes.
    judge
        Gets the last row and whether a line break ends it, and says why it cannot be read, or nothing if it can.
    longest
        How many bytes a row may have for the last one to be held back.

    Attributes
    ----------
    failure : str
        Why the file cannot be read to its end, or nothing.
    """

    def __init__(self, path: Path, judge: Callable[[bytes, bool], str], longest: int) -> None:
        super().__init__()
        self._file = path.open("rb", buffering=0)
        self.size = path.stat().st_size
        self._judge = judge
        self._longest = longest
        self._held = b""
        self._done = False
        self.failure = ""
        begins = self._file.read(4) or b""
        self._file.seek(0)
        packed = next((name for magic, name in PACKED.items() if begins.startswith(magic)), None)
        self._unpacked: Any = None
        if packed is not None:
            self._unpacked = pa.CompressedInputStream(pa.PythonFile(self._file, mode="r"), packed)

    def readable(self) -> bool:
        """Tell that this can be read."""
        return True

    def position(self) -> int:
        """Return how many bytes of the file have been read."""
        return self._file.tell()

    def close(self) -> None:
        """Close the file."""
        if self._unpacked is not None:
            self._unpacked.close()
        self._file.close()
        super().close()

    def read(self, size: int = -1) -> bytes:
        """Read some whole rows, or part of a row that is longer than any should be."""
        while not self._done:
            data = self._take(size)
            if not data:
                return self._last()
            data = self._held + data
            cut = _begin_of_last_row(data)
            if cut or len(data) > self._longest:
                cut = cut or len(data)
                self._held = data[cut:]
                return data[:cut]
            self._held = data
        return b""

    def _take(self, size: int) -> bytes:
        """Take some bytes of the text; none at its end, or where it cannot be read further."""
        if self._unpacked is None:
            return self._file.read(size) or b""
        parts: list[bytes] = []
        try:
            while sum(map(len, parts)) < size and (part := self._unpacked.read(STEP)):
                parts.append(part)
        except (pa.ArrowException, OSError) as error:
            self.failure = f"the compressed data are damaged: {reason(error)}"
            self._unpacked = io.BytesIO()
        return b"".join(parts)

    def _last(self) -> bytes:
        """Return the last row if it is whole."""
        self._done = True
        row, self._held = self._held, b""
        if not row.strip():
            return b""
        ended = row.endswith((b"\n", b"\r"))
        if self.failure and not ended:
            return b""
        why = self._judge(row, ended)
        if why:
            self.failure = self.failure or why
            return b""
        return row


def _begin_of_last_row(data: bytes) -> int:
    """Return where the last line that is not empty begins; 0 if there is only one."""
    end = len(data)
    while end and data[end - 1] in b"\r\n":
        end -= 1
    return max(data.rfind(b"\n", 0, end), data.rfind(b"\r", 0, end)) + 1
