"""PX4's ULog files: a column is a field of a topic, ``sensor_gyro.x`` or ``sensor_gyro[1].x`` for its second instance."""

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyulog import ULog  # type: ignore[import-untyped]

from compfilt.logs.errors import LogError, TruncatedLog, quoted
from compfilt.logs.readers.base import (
    MOST_FIELDS,
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    reason,
)

__all__ = ["open_reader", "read_columns"]

DEEPEST = 20
"""How deep types may lie in each other."""

_COLUMN = re.compile(r"([^.\[]+)(?:\[(\d{1,3})\])?\.(.+)", re.DOTALL)


class _Watched(io.BufferedReader):
    """A file that notices that it ends within a message."""

    cut = False

    def read(self, size: int | None = -1, /) -> bytes:
        """Read bytes, all that are there if there are fewer."""
        data = super().read(size)
        self.cut = self.cut or (size is not None and 0 < len(data) < size)
        return data


class _Chosen:
    """The topics to read, for pyulog; it notes which ones the log has."""

    def __init__(self, *topics: str) -> None:
        self._topics = topics
        self.met: list[str] = []

    def __contains__(self, topic: str) -> bool:
        self.met.append(topic)
        return topic in self._topics


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a log may have: the fields of every topic in it. One instance is told for all."""
    formats = _formats(path)
    chosen = _Chosen()
    _parse(path, chosen)
    return pa.schema(
        [
            (f"{topic}.{field}", pa.from_numpy_dtype(np.dtype(ULog._UNPACK_TYPES[kind][2])))  # noqa: SLF001
            for topic in dict.fromkeys(chosen.met)
            for field, kind in _fields(formats, topic)
        ]
    )


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open a log. The topic that is read, but no other, is held in memory."""
    topic, instance = _one_topic(columns)
    _formats(path)
    log, cut = _parse(path, chosen := _Chosen(topic))
    found = {_prefix(data.name, data.multi_id): data for data in log.data_list}
    prefix = _prefix(topic, instance)
    if prefix not in found:
        _fail_without(topic, prefix, list(found), chosen.met)
    values = found[prefix].data
    check_present([f"{prefix}.{field}" for field in values], columns.all)
    arrays = {name: values[name.removeprefix(f"{prefix}.")] for name in columns.all}
    schema = pa.schema([(name, pa.from_numpy_dtype(array.dtype)) for name, array in arrays.items()])
    check_kinds(schema, columns)
    count = len(next(iter(arrays.values())))
    done = 0

    def batches() -> Iterator[pa.RecordBatch]:
        nonlocal done
        for start in range(0, count, batch_rows):
            parts = [
                pa.array(np.ascontiguousarray(array[start : start + batch_rows])) for array in arrays.values()
            ]
            yield pa.RecordBatch.from_arrays(parts, schema=schema)
            done = min(start + batch_rows, count)
        if cut:
            raise TruncatedLog(count, "the file ends within a message")
        if log.file_corruption:
            raise TruncatedLog(count, "the file is damaged, and messages are lost in it")

    size = path.stat().st_size
    yield Reading(schema, size, batches, lambda: size * done // count)


def _prefix(topic: str, instance: int) -> str:
    return f"{topic}[{instance}]" if instance else topic


def _one_topic(columns: Columns) -> tuple[str, int]:
    """Return the topic and the instance of all columns."""
    topics: dict[tuple[str, int], str] = {}
    for name in columns.all:
        match = _COLUMN.fullmatch(name)
        if match is None:
            raise LogError(f'{quoted(name)} is no column of a ULog, which are named "topic.field"')
        topics.setdefault((match[1], int(match[2] or 0)), name)
    if len(topics) > 1:
        first, second = list(topics.values())[:2]
        raise LogError(
            f"columns {quoted(first)} and {quoted(second)} are of two topics, which have times of their own: "
            "choose all columns, the time too, from one"
        )
    return next(iter(topics))


def _fail_without(topic: str, prefix: str, instances: list[str], met: list[str]) -> None:
    """Say that a topic is not there, and what is."""
    if topic in met and not instances:
        raise LogError(f"the topic {quoted(topic)} has no rows")
    try:
        check_present(sorted(set(instances or met)), [prefix])
    except LogError as error:
        raise LogError(str(error).replace("column", "topic", 1)) from None


def _formats(path: Path) -> dict[str, Any]:
    """Read which types a log declares, and refuse those that pyulog would unfold without end."""
    log, _ = _parse(path, None, parse_header_only=True)
    formats = {name: form.fields for name, form in log.message_formats.items()}
    for name in formats:
        _fields(formats, name)
    return formats


def _parse(path: Path, chosen: _Chosen | None, **options: bool) -> tuple[Any, bool]:
    """Read a log with pyulog, and tell whether it was cut."""
    # pyulog prints what it finds; what matters of it is told by its results.
    with path.open("rb", buffering=0) as raw, contextlib.redirect_stdout(io.StringIO()):
        file = _Watched(raw)
        try:
            return ULog(file, chosen, **options), file.cut
        except Exception as error:  # noqa: BLE001 - it does not say what it raises on damaged files
            raise LogError(f"the file is damaged or of another kind: {reason(error)}") from None


def _fields(formats: dict[str, Any], topic: str) -> list[tuple[str, str]]:
    """Name a topic's fields, with those of the types within it, and their types.

    Raises
    ------
    LogError
        The types hold each other in a circle, or there are more fields than any log has.
    """
    fields: list[tuple[str, str]] = []
    left = [(topic, "", 0)]
    seen = 0
    while left:
        kind, name, depth = left.pop()
        seen += 1
        if kind in ULog._UNPACK_TYPES:  # noqa: SLF001 - the types of the format
            fields.append((name, kind))
            continue
        for below, size, part in reversed(formats.get(kind, [])):
            if seen + len(left) + size > MOST_FIELDS or depth > DEEPEST:
                raise LogError(f"the topic {quoted(topic)} declares more than {MOST_FIELDS} fields")
            full = f"{name}.{part}" if name else part
            names = [f"{full}[{i}]" for i in range(size)] if size else [full]
            left += [(below, element, depth + 1) for element in reversed(names)]
    return [(name, kind) for name, kind in fields if not name.startswith("_padding")]
