"""HDF5 files. Nothing in another file is ever read, whatever a link says."""

import contextlib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import h5py  # type: ignore[import-untyped]
import numpy as np
import pyarrow as pa

from compfilt.logs.errors import LogError, quoted
from compfilt.logs.readers.base import (
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    check_rows,
    plain_errors,
    pyarrow_type,
    rows_or_truncated,
    split_element,
)

__all__ = ["open_reader", "read_columns"]

BROKEN = (RuntimeError, KeyError, ValueError, TypeError, UnicodeDecodeError)
"""What h5py raises on damaged files, besides OSError."""

CACHE = 1 << 25
"""How many bytes of a dataset's chunks are kept, so that a chunk is unpacked once."""

LARGEST_CHUNK = 1 << 28
"""How many bytes a chunk may have, which is unpacked as a whole."""

PIECE = 1 << 22
"""How many bytes of a dataset are read at a time, at most."""

MOST_LISTED = 10_000
"""How many columns are listed: a file may declare any number."""


class _Column(NamedTuple):
    """A column of the log: a dataset of one axis, or one column of a dataset with two."""

    dataset: Any
    element: int | None


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a file has, as far as no link leads to them."""
    with _opened(path) as file:
        fields = []
        for name in _listed(file):
            with contextlib.suppress(LogError):
                fields.append(pa.field(name, _type(_find(file, name).dataset, name)))
        return pa.schema(fields)


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open a file; its datasets are read slice by slice."""
    with _opened(path) as file:
        found = {name: _find(file, name) for name in columns.all}
        schema = pa.schema([(name, _type(column.dataset, name)) for name, column in found.items()])
        check_kinds(schema, columns)
        rows = {column.dataset.shape[0]: name for name, column in found.items()}
        if len(rows) > 1:
            (one, first), (other, second) = list(rows.items())[:2]
            raise LogError(f"column {quoted(first)} has {one} rows, but {quoted(second)} has {other}")
        count = next(iter(rows))
        check_rows(count)
        for name, column in found.items():
            with plain_errors(*BROKEN):
                _check_stored(name, column.dataset)
        batch_rows = min(batch_rows, *(_rows_at_a_time(column.dataset) for column in found.values()))
        done = 0

        def slices() -> Iterator[pa.RecordBatch]:
            for start in range(0, count, batch_rows):
                rows = slice(start, min(start + batch_rows, count))
                yield pa.RecordBatch.from_arrays(_read(list(found.values()), rows), schema=schema)

        def batches() -> Iterator[pa.RecordBatch]:
            nonlocal done
            for batch in rows_or_truncated(slices(), *BROKEN):
                done += batch.num_rows
                yield batch

        size = path.stat().st_size
        yield Reading(schema, size, batches, lambda: size * done // count)


def _read(columns: list[_Column], rows: slice) -> list[Any]:
    """Read some rows of all columns; a dataset of which several are wanted is read once."""
    tables = {dataset.name: _slice(dataset, rows) for dataset, _ in columns}
    return [
        pa.array(
            tables[dataset.name]
            if element is None
            else np.ascontiguousarray(tables[dataset.name][:, element])
        )
        for dataset, element in columns
    ]


def _slice(dataset: Any, rows: slice) -> Any:  # noqa: ANN401 - h5py has no types
    if h5py.check_string_dtype(dataset.dtype):
        return dataset.asstr()[rows]
    return dataset[rows].astype(dataset.dtype.newbyteorder("="), copy=False)


def _type(dataset: Any, name: str) -> Any:  # noqa: ANN401
    """Return Arrow's type for that of a dataset."""
    return pa.string() if h5py.check_string_dtype(dataset.dtype) else pyarrow_type(dataset.dtype, name)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    with plain_errors(*BROKEN):
        file = h5py.File(path, "r", rdcc_nbytes=CACHE)
    with file:
        yield file


def _find(file: Any, name: str) -> _Column:  # noqa: ANN401 - h5py has no types
    """Find a column by its dataset's path, without following a link."""
    table, element = name, None
    dataset = _walk(file, name)
    if dataset is None:
        table, element = split_element(name)
        dataset = _walk(file, table) if element is not None else None
    if not isinstance(dataset, h5py.Dataset) or len(dataset.shape or ()) != (1 if element is None else 2):
        check_present([other for other in _listed(file) if other != name], [name])
    if element is not None and element >= dataset.shape[1]:
        raise LogError(f"there is no column {quoted(name)}: {quoted(table)} has {dataset.shape[1]}")
    return _Column(dataset, element)


def _walk(file: Any, path: str) -> Any:  # noqa: ANN401
    """Go down to an object, part by part; nothing if it is not there."""
    here = file
    for part in path.strip("/").split("/"):
        if not isinstance(here, h5py.Group) or not part:
            return None
        with plain_errors(*BROKEN):
            link = here.get(part, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                raise LogError(f"column {quoted(path)} is a link to another file, which is not followed")
            if isinstance(link, h5py.SoftLink):
                raise LogError(f"column {quoted(path)} is a link; name what it leads to: {quoted(link.path)}")
            here = None if link is None else here.get(part)
    return here


def _listed(file: Any) -> list[str]:  # noqa: ANN401
    """Name the columns of all datasets that no link leads to."""
    names: list[str] = []

    def visit(name: str, thing: object) -> bool | None:
        if isinstance(thing, h5py.Dataset) and thing.shape:
            if len(thing.shape) == 1:
                names.append(name)
            elif len(thing.shape) == 2:
                names.extend(f"{name}[{i}]" for i in range(min(thing.shape[1], MOST_LISTED)))
        return True if len(names) > MOST_LISTED else None

    with plain_errors(*BROKEN):
        file.visititems(visit)
    return names


def _check_stored(name: str, dataset: Any) -> None:  # noqa: ANN401
    """Check that a dataset stands in this file, as a whole, in pieces that fit into memory."""
    if dataset.is_virtual or dataset.external:
        raise LogError(f"column {quoted(name)} stands in another file, which is not read")
    if dataset.chunks is None:
        # What has no place in the file would be read as zeros, and there could be any number of them.
        if dataset.id.get_storage_size() < dataset.nbytes:
            raise LogError(f"column {quoted(name)} declares {dataset.shape[0]} rows, but they are not stored")
        return
    if math.prod(dataset.chunks) * dataset.dtype.itemsize > LARGEST_CHUNK:
        raise LogError(f"column {quoted(name)} is stored in pieces of more than {LARGEST_CHUNK >> 20} MB")
    pairs = zip(dataset.shape, dataset.chunks, strict=True)
    pieces = math.prod(-(-size // chunk) for size, chunk in pairs)
    stored = dataset.id.get_num_chunks()
    if stored < pieces:
        raise LogError(
            f"column {quoted(name)} declares {dataset.shape[0]} rows, but only {stored} of {pieces} pieces are stored"
        )


def _rows_at_a_time(dataset: Any) -> int:  # noqa: ANN401
    row_bytes: int = math.prod(dataset.shape[1:]) * dataset.dtype.itemsize
    return max(1, PIECE // max(1, row_bytes))
