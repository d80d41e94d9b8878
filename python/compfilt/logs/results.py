"""What a result of a recipe holds that can be drawn: its columns by what they are, with their units."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log, read_schema
from compfilt.logs.readers.base import is_time

__all__ = ["GROUPS", "Group", "Result", "read_result"]

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


class Group(NamedTuple):
    """Columns of one kind and unit; the unit is empty where the file does not tell it, as in a CSV."""

    title: str
    unit: str
    columns: dict[str, Array]


@dataclass(frozen=True)
class Result:
    """A result in memory.

    Attributes
    ----------
    time
        The time of the rows, or their numbers from 0 where no time was kept.
    time_name, time_unit
        What `time` is.
    groups
        The columns of numbers.
    at_rest, flags
        One number a row, where they are there.
    """

    time: Array
    time_name: str
    time_unit: str
    groups: tuple[Group, ...]
    at_rest: Array | None
    flags: Array | None


def read_result(path: str | Path) -> Result:
    """Read the columns that a result can have, and no others.

    Raises
    ------
    LogError
        The file cannot be read, or has none of them.
    """
    places = {name: title for title, names in GROUPS.items() for name in names}
    table = _read(path, (*TIMES, *places, "at_rest", "flags"))
    values = {name: _numbers(table.column(name)) for name in table.column_names}
    clock = next((name for name in TIMES if name in values), None)
    drawn = [name for name in values if name not in TIMES]
    if not drawn:
        raise LogError("there is no column of a result, such as roll, yaw, estimate, bias or flags")
    groups: dict[tuple[str, str], dict[str, Array]] = {}
    for name in drawn:
        if name in places:
            groups.setdefault((places[name], _unit(table, name)), {})[name] = values[name]
    return Result(
        np.arange(float(table.num_rows)) if clock is None else values[clock],
        clock or "row",
        _unit(table, clock) if clock else "",
        tuple(Group(title, unit, columns) for (title, unit), columns in groups.items()),
        _marks(values, "at_rest"),
        _marks(values, "flags"),
    )


def _read(path: str | Path, wanted: tuple[str, ...]) -> pa.Table:
    """Read those of the columns that are there and hold numbers, in the order in which they are wanted."""
    numeric = {field.name for field in read_schema(path) if _counts(field)}
    names = tuple(name for name in wanted if name in numeric)
    if not names:
        return pa.table({})
    signals = tuple(name for name in names if name not in TIMES)
    with open_log(path, Columns(signals, tuple(name for name in names if name in TIMES))) as reader:
        return pa.Table.from_batches(list(reader.batches()), reader.schema)


def _counts(field: Any) -> bool:  # noqa: ANN401 - a field of any type
    """Tell whether a column holds numbers; one of a CSV that begins with nothing at all may do so."""
    kind = field.type
    if is_time(kind):
        return field.name in TIMES
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind))


def _numbers(column: Any) -> Array:  # noqa: ANN401 - a column of any type
    """Return a column as numbers; points in time are counted in their unit."""
    values = column.cast(pa.int64()) if is_time(column.type) else column
    return np.asarray(values.to_numpy(), np.float64)


def _marks(values: dict[str, Array], name: str) -> Array | None:
    """Take a column of small whole numbers, where it is there; an empty field is a zero."""
    return np.nan_to_num(values[name]) if name in values else None


def _unit(table: pa.Table, name: str) -> str:
    kind: Any = table.field(name).type
    if is_time(kind):
        return str(kind.unit)
    return str((table.field(name).metadata or {}).get(b"unit", b"").decode(errors="replace"))
