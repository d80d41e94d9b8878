"""What a result of a recipe holds that can be drawn: its columns by what they are, with their units."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log, read_schema
from compfilt.logs.readers.base import is_time

__all__ = ["GROUPS", "Block", "Group", "Result", "open_result"]

Array = npt.NDArray[np.float64]


def _xyz(name: str) -> tuple[str, ...]:
    return tuple(f"{name}_{axis}" for axis in "xyz")


GROUPS = {
    "angle": ("roll", "pitch", "yaw", "phi2", "phi3", "angle"),
    "estimate": ("estimate",),
    "position": ("position",),
    "velocity": ("velocity",),
    "level": tuple(f"level{i}" for i in range(8)),
    "rate": ("rate",),
    "body rate": _xyz("body_rate"),
    "wheel rate": _xyz("wheel_rate"),
    "bias": ("bias", "roll_bias", "pitch_bias", "phi2_bias", "phi3_bias", *_xyz("gyro_bias")),
    "angular acceleration": _xyz("angular_acceleration"),
    "gravity": _xyz("gravity"),
    "up": _xyz("up"),
    "quaternion": ("qw", "qx", "qy", "qz"),
}
"""The columns of results by what they are."""

TIMES = ("t", "time")
"""The names of a column of the log that counts as the time, if it was kept."""

MARKS = ("at_rest", "flags")
"""The columns that hold a small whole number for each row."""


class Group(NamedTuple):
    """Columns of one kind and unit; the unit is empty where the file does not tell it, as in a CSV."""

    title: str
    unit: str
    columns: tuple[str, ...]


class Block(NamedTuple):
    """Some rows of a result: their time, the columns of numbers, and the marks that are there."""

    time: Array
    columns: dict[str, Array]
    at_rest: Array | None
    flags: Array | None


@dataclass(frozen=True)
class Result:
    """A result that is being read.

    Attributes
    ----------
    time_name, time_unit
        What the time of the rows is; where none was kept, the rows are counted from 0 and it is named `row`.
    groups
        The columns of numbers.
    has_flags
        Whether there is a column of flags.
    blocks
        The rows, once and in order.
    """

    time_name: str
    time_unit: str
    groups: tuple[Group, ...]
    has_flags: bool
    blocks: Iterator[Block]


@contextlib.contextmanager
def open_result(path: str | Path) -> Iterator[Result]:
    """Open the columns that a result can have, and no others; never the whole file in memory.

    Raises
    ------
    LogError
        The file cannot be read, or has none of them.
    """
    places = {name: title for title, names in GROUPS.items() for name in names}
    schema = read_schema(path)
    numeric = {field.name for field in schema if _counts(field)}
    drawn = tuple(name for name in (*places, *MARKS) if name in numeric)
    if not drawn:
        raise LogError("there is no column of a result, such as roll, yaw, estimate, bias or flags")
    clock = tuple(name for name in TIMES if name in numeric)[:1]
    with open_log(path, Columns(drawn, clock)) as reader:
        groups: dict[tuple[str, str], list[str]] = {}
        for name in drawn:
            if name in places:
                groups.setdefault((places[name], _unit(reader.schema, name)), []).append(name)
        yield Result(
            clock[0] if clock else "row",
            _unit(reader.schema, clock[0]) if clock else "",
            tuple(Group(title, unit, tuple(names)) for (title, unit), names in groups.items()),
            "flags" in drawn,
            _blocks(reader.batches(), drawn, clock),
        )


def _blocks(
    batches: Iterator[pa.RecordBatch], drawn: tuple[str, ...], clock: tuple[str, ...]
) -> Iterator[Block]:
    rows = 0
    for batch in batches:
        values = {name: _numbers(batch.column(name)) for name in drawn}
        counted = np.arange(rows, rows + batch.num_rows, dtype=np.float64)
        rows += batch.num_rows
        # An empty field of a mark is a zero.
        marks = [np.nan_to_num(values.pop(name)) if name in values else None for name in MARKS]
        yield Block(_numbers(batch.column(clock[0])) if clock else counted, values, *marks)


def _counts(field: Any) -> bool:  # noqa: ANN401 - a field of any type
    """Tell whether a column holds numbers; one of a CSV that begins with nothing at all may do so."""
    kind = field.type
    if is_time(kind):
        return field.name in TIMES
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind))


def _numbers(column: Any) -> Array:  # noqa: ANN401 - a column of any type
    """Return a column as numbers; points in time are counted in their unit."""
    values = column.cast(pa.int64()) if is_time(column.type) else column
    return np.asarray(values.to_numpy(zero_copy_only=False), np.float64)


def _unit(schema: pa.Schema, name: str) -> str:
    field: Any = schema.field(name)
    if is_time(field.type):
        return str(field.type.unit)
    return str((field.metadata or {}).get(b"unit", b"").decode(errors="replace"))
