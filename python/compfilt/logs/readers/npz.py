"""NumPy's archives of arrays. Nothing in them is unpickled."""

import contextlib
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import pyarrow as pa

from compfilt.logs.errors import LogError, TruncatedLog, quoted
from compfilt.logs.readers.base import (
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    check_rows,
    plain_errors,
    pyarrow_type,
    reason,
    split_element,
)

__all__ = ["open_reader", "read_columns"]

BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    ValueError,
    SyntaxError,
    NotImplementedError,
    RuntimeError,
)
"""What the archive's and NumPy's readers raise on damaged files."""

PIECE = 1 << 22
"""How many bytes of an array are read at a time, at most."""

WIDEST = 10_000
"""How many columns an array may have: a damaged header may declare any number."""


class _Array(NamedTuple):
    """One array of the archive, as its header declares it."""

    dtype: Any
    rows: int
    width: int | None
    by_columns: bool


def read_columns(path: Path) -> pa.Schema:
    """Read which columns an archive has: arrays of one axis, and the columns of those with two."""
    with _archive(path) as archive:
        arrays = _arrays(archive)
        fields = []
        for name in _columns(arrays):
            with contextlib.suppress(LogError):
                fields.append(pa.field(name, pyarrow_type(_of(arrays, name).dtype, name)))
        return pa.schema(fields)


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open an archive; every array is read from front to back, piece by piece."""
    with _archive(path) as archive, contextlib.ExitStack() as stack:
        arrays = _arrays(archive)
        check_present(list(_columns(arrays)), columns.all)
        schema = pa.schema([(name, pyarrow_type(_of(arrays, name).dtype, name)) for name in columns.all])
        check_kinds(schema, columns)
        rows = {_of(arrays, name).rows: name for name in columns.all}
        if len(rows) > 1:
            (one, first), (other, second) = list(rows.items())[:2]
            raise LogError(f"column {quoted(first)} has {one} rows, but {quoted(second)} has {other}")
        count = next(iter(rows))
        check_rows(count)
        readers = [_open_column(archive, stack, arrays, name) for name in columns.all]
        batch_rows = min(batch_rows, *(reader.rows_at_a_time for reader in readers))
        done = 0

        def batches() -> Iterator[pa.RecordBatch]:
            nonlocal done
            while done < count:
                wanted = min(batch_rows, count - done)
                pieces, why = zip(*(reader.read(wanted) for reader in readers), strict=True)
                whole = min(map(len, pieces))
                if whole:
                    arrays = [pa.array(piece[:whole]) for piece in pieces]
                    yield pa.RecordBatch.from_arrays(arrays, schema=schema)
                done += whole
                if whole < wanted:
                    raise TruncatedLog(done, next(filter(None, why)))

        size = path.stat().st_size
        yield Reading(schema, size, batches, lambda: size * done // count)


class _Column:
    """One column that is read from front to back."""

    def __init__(self, file: IO[bytes], array: _Array, element: int | None) -> None:
        self._file = file
        self._dtype = array.dtype
        # Of a table that is stored row by row, all columns are read and one is kept.
        self._width = 1 if array.width is None or array.by_columns else array.width
        self._element = 0 if array.by_columns else element or 0
        self.rows_at_a_time = max(1, PIECE // (self._width * array.dtype.itemsize))
        if array.by_columns and element:
            self._skip(element * array.rows * array.dtype.itemsize)

    def _skip(self, size: int) -> None:
        while size > 0 and (skipped := len(self._file.read(min(size, PIECE)))):
            size -= skipped

    def read(self, rows: int) -> tuple[Any, str]:
        """Read the next rows, and why there are fewer than wanted."""
        size = rows * self._width * self._dtype.itemsize
        data = b""
        why = "an array ends too early"
        try:
            while len(data) < size and (part := self._file.read(size - len(data))):
                data += part
        except (OSError, *BROKEN) as error:
            why = reason(error)
        whole = len(data) // (self._width * self._dtype.itemsize)
        table = np.frombuffer(data, self._dtype, whole * self._width).reshape(whole, self._width)
        return table[:, self._element].astype(self._dtype.newbyteorder("=")), why if whole < rows else ""


@contextlib.contextmanager
def _archive(path: Path) -> Iterator[zipfile.ZipFile]:
    with plain_errors(*BROKEN):
        archive = zipfile.ZipFile(path)
    with archive:
        yield archive


def _arrays(archive: zipfile.ZipFile) -> dict[str, _Array]:
    """Read the headers of all arrays."""
    arrays = {}
    for member in archive.namelist():
        if member.endswith(".npy"):
            with plain_errors(*BROKEN, tokenize.TokenError), archive.open(member) as file:
                array = _header(file)
            if array is not None:
                arrays[member.removesuffix(".npy")] = array
    return arrays


def _header(file: IO[bytes]) -> _Array | None:
    """Read an array's header; nothing if it has no rows to read."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, dtype = read(file)
    if len(shape) not in {1, 2} or not dtype.itemsize or (len(shape) == 2 and not 0 < shape[1] <= WIDEST):
        return None
    return _Array(dtype, shape[0], shape[1] if len(shape) == 2 else None, by_columns and len(shape) == 2)


def _columns(arrays: dict[str, _Array]) -> Iterator[str]:
    """Name every column."""
    for name, array in arrays.items():
        if array.width is None:
            yield name
        else:
            yield from (f"{name}[{element}]" for element in range(array.width))


def _of(arrays: dict[str, _Array], column: str) -> _Array:
    """Return the array of a column."""
    return arrays[column] if column in arrays else arrays[split_element(column)[0]]


def _open_column(
    archive: zipfile.ZipFile, stack: contextlib.ExitStack, arrays: dict[str, _Array], name: str
) -> _Column:
    member, element = (name, None) if name in arrays else split_element(name)
    with plain_errors(*BROKEN):
        file = stack.enter_context(archive.open(f"{member}.npy"))
        _header(file)
        return _Column(file, arrays[member], element)
