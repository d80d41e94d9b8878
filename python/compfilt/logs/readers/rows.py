"""The rows of a text log: decompressed as they come, in blocks of whole rows, the last one held back until it is judged."""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from compfilt.logs.readers.base import reason

__all__ = ["RowSource"]

PACKED: dict[bytes, Literal["gzip", "zstd"]] = {b"\x1f\x8b": "gzip", b"\x28\xb5\x2f\xfd": "zstd"}
"""How compressed files begin."""

STEP = 512
"""Bytes that are asked of a decompressor at a time: it gives nothing of a step in which the data end too early."""


class RowSource:
    """The bytes of a text file, compressed or not, cut between rows.

    The last row of the file is held back. It may be cut off, and that is seen only when nothing comes after it.

    Parameters
    ----------
    path
        The file; whether it is compressed is told by its first bytes.
    judge
        Gets the last row and whether a line break ends it, and says why it cannot be read, or nothing if it can.
    block
        How many bytes are read at a time; no row may be longer.

    Attributes
    ----------
    size : int
        The file's size.
    failure : str
        Why the file cannot be read to its end, or nothing.
    """

    def __init__(self, path: Path, judge: Callable[[bytes, bool], str], block: int) -> None:
        self._file = path.open("rb", buffering=0)
        self.size = path.stat().st_size
        self.failure = ""
        self._judge = judge
        self._block = block
        begins = self._file.read(4) or b""
        self._file.seek(0)
        packed = next((name for magic, name in PACKED.items() if begins.startswith(magic)), None)
        self._unpacked: Any = None
        if packed is not None:
            self._unpacked = pa.CompressedInputStream(pa.PythonFile(self._file, mode="r"), packed)

    def close(self) -> None:
        """Close the file."""
        if self._unpacked is not None:
            self._unpacked.close()
        self._file.close()

    def position(self) -> int:
        """Return how many bytes of the file have been read."""
        return self.size if self._file.closed else self._file.tell()

    def blocks(self) -> Iterator[bytes]:
        """Yield the rows in order, in blocks of about the size that was asked for."""
        held = b""
        while data := self._take():
            data = held + data
            cut = _begin_of_last_row(data)
            if cut:
                yield data[:cut]
            held = data[cut:]
            if len(held) > self._block:
                self.failure = f"a line is longer than {self._block} bytes"
                return
        last = self._last(held)
        if last:
            yield last

    def _take(self) -> bytes:
        """Take some bytes of the text; none at its end, or where it cannot be read further."""
        if self._unpacked is None:
            return self._file.read(self._block) or b""
        parts: list[bytes] = []
        try:
            for _ in range(max(1, self._block // STEP)):
                parts.append(self._unpacked.read(STEP))
                if not parts[-1]:
                    break
        except (pa.ArrowException, OSError) as error:
            self.failure = f"the compressed data are damaged: {reason(error)}"
            self._unpacked = io.BytesIO()
        return b"".join(parts)

    def _last(self, row: bytes) -> bytes:
        """Return the last row if it is whole."""
        if not row.strip():
            return b""
        ended = row.endswith((b"\n", b"\r"))
        if self.failure and not ended:
            return b""
        why = self._judge(row, ended)
        self.failure = self.failure or why
        return b"" if why else row


def _begin_of_last_row(data: bytes) -> int:
    """Return where the last line that is not empty begins; 0 if there is only one."""
    end = len(data)
    while end and data[end - 1] in b"\r\n":
        end -= 1
    return max(data.rfind(b"\n", 0, end), data.rfind(b"\r", 0, end)) + 1
