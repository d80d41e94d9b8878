"""What is claimed about a log before it is looked at: by a recipe, or by the names and units of its columns."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from compfilt.logs.check.source import Column
from compfilt.logs.recipe import Recipe
from compfilt.logs.signals import Signal
from compfilt.logs.units import (
    ACCELERATION,
    ANGULAR_RATE,
    MAGNETIC_FIELD,
    TIME,
    Dimension,
    Unit,
    UnitError,
    parse_unit,
)

__all__ = ["DIMENSIONS", "Claims", "Triad", "by_names", "by_recipe", "triads_without_names"]

DIMENSIONS: Final = {"gyro": ANGULAR_RATE, "accelerometer": ACCELERATION, "magnetometer": MAGNETIC_FIELD}


@dataclass(frozen=True)
class Triad:
    """Three columns that are one sensor; `unit` is None where nobody says it."""

    columns: tuple[str, ...]
    unit: Unit | None = None
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)

    @property
    def factors(self) -> tuple[float, ...]:
        """What makes SI of the columns, as far as it is claimed."""
        unit = self.unit.factor if self.unit is not None else 1.0
        return tuple(unit * scale for scale in self.scale)


@dataclass(frozen=True)
class Claims:
    """Which columns are what.

    Attributes
    ----------
    time, time_unit, rate
        As in a recipe; all None where nobody says.
    triads
        The sensors by their names in a recipe: ``gyro``, ``accelerometer``, ``magnetometer``.
    others
        Further columns that a recipe reads.
    axes
        ``"flu"``, ``"frd"``, or None where nobody says.
    recipe
        The recipe, or None.
    separator
        What separates the fields of a text, where its ending does not tell it.
    """

    time: str | None
    time_unit: Unit | None
    rate: float | None
    triads: dict[str, Triad]
    others: tuple[str, ...] = ()
    axes: str | None = None
    recipe: Recipe | None = None
    separator: str | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Every signal column, without repetition."""
        of_triads = [column for triad in self.triads.values() for column in triad.columns]
        return tuple(dict.fromkeys((*of_triads, *self.others)))

    @property
    def has_both(self) -> bool:
        """Whether there is a gyro and an accelerometer: then each can be held against the other."""
        return "gyro" in self.triads and "accelerometer" in self.triads


def by_recipe(recipe: Recipe) -> Claims:
    """Take a recipe by its word."""
    triads = {}
    for name in DIMENSIONS:
        signal = getattr(recipe.filter, name, None)
        if isinstance(signal, Signal) and len(signal.used) == 3:
            triads[name] = Triad(signal.used, signal.unit, signal.scale)
    axes = getattr(recipe.filter, "axes", None)
    clock = recipe.clock
    return Claims(
        clock.column,
        clock.unit,
        clock.rate,
        triads,
        recipe.signal_columns,
        axes if axes in {"flu", "frd"} else None,
        recipe,
        recipe.separator,
    )


TIME_NAME = re.compile(r"(?i)^t$|^t[_ .(\[]|time|stamp|clock")
TIME_UNITS = re.compile(r"(?i)[_ .(\[](ns|us|µs|ms|s|sec|seconds?|nsec|usec|msec)[)\]]?$")
SPELLINGS = {"sec": "s", "second": "s", "seconds": "s", "nsec": "ns", "usec": "us", "msec": "ms"}
SENSOR_NAMES = {
    "gyro": re.compile(r"(?i)gyr|ang\w*[_ .]?(vel|rate)|omega|^[gw]_?$|^imu\.?g"),
    "accelerometer": re.compile(r"(?i)acc|spec\w*[_ .]?force|^[af]_?$|^imu\.?a"),
    "magnetometer": re.compile(r"(?i)mag|^[mbh]_?$|^imu\.?m"),
}
UNIT_IN_NAME = re.compile(
    r"(?i)[_ .(\[](rad/s|rads|rad_s|rad|deg|deg/s|degs|deg_s|dps|mdps|m/s\^?2|m/s²|mps2|ms2|m_s2|g|mg|ut|nt|mt|gauss|mgauss)[)\]]?$"
)
IN_NAMES = {
    "rads": "rad/s", "rad": "rad/s", "deg": "deg/s", "rad_s": "rad/s", "degs": "deg/s", "deg_s": "deg/s", "mps2": "m/s^2", "ms2": "m/s^2", "m_s2": "m/s^2",
    "ut": "uT", "nt": "nT", "mt": "mT",
}  # fmt: skip
LONGEST_NAME = 200
"""Longer names are not guessed from: all that a name may be without one letter is the square of its length."""
AXIS = re.compile(r"[xyzXYZ0-3]")


def by_names(columns: Sequence[Column]) -> Claims:
    """Guess what the columns are from what they are called, and their units from the file or their names."""
    triads: dict[str, Triad] = {}
    for stem, group in _groups(columns):
        for name, pattern in SENSOR_NAMES.items():
            if name not in triads and pattern.search(stem):
                triads[name] = Triad(
                    tuple(column.name for column in group), _unit_of(group[0], DIMENSIONS[name], stem)
                )
                break
    time = _time_of(columns)
    unit = None
    if time is not None:
        named = TIME_UNITS.search(time.name)
        unit = _parsed(time.unit or (named[1] if named else None), TIME)
    return Claims(time.name if time is not None else None, unit, None, triads)


def _time_of(columns: Sequence[Column]) -> Column | None:
    """Find the time: the first column that is called so, or else the first that holds times by its type."""
    named = (
        column for column in columns if len(column.name) <= LONGEST_NAME and TIME_NAME.search(column.name)
    )
    return next(named, next((column for column in columns if column.is_time), None))


def triads_without_names(columns: Sequence[Column]) -> list[Triad]:
    """Return what may be sensors if the names do not say it: groups by axis, or else every three columns in a row."""
    groups = [Triad(tuple(column.name for column in group)) for _, group in _groups(columns)]
    names = [column.name for column in columns]
    return (
        groups
        if len(groups) > 1
        else [Triad(tuple(names[i : i + 3])) for i in range(min(len(names) - 2, 16))]
    )


def _groups(columns: Sequence[Column]) -> Iterator[tuple[str, list[Column]]]:
    """Find columns whose names differ in one letter or digit only, that of the axis; give the rest of the name, and the three."""
    stems: dict[tuple[str, str], dict[str, Column]] = {}
    for column in columns:
        if len(column.name) > LONGEST_NAME or column.is_time:
            continue
        for match in AXIS.finditer(column.name):
            around = column.name[: match.start()], column.name[match.end() :]
            stems.setdefault(around, {})[match[0].lower()] = column
    for (before, behind), found in stems.items():
        for axes in ("xyz", "012", "123"):
            if set(axes) <= set(found):
                yield before.rstrip("_ .-[(") + behind.lstrip("])"), [found[axis] for axis in axes]
                break


def _unit_of(column: Column, dimension: Dimension, stem: str) -> Unit | None:
    """Find the unit that the file or the name gives."""
    named = UNIT_IN_NAME.search(stem)
    return _parsed(column.unit or (named[1] if named else None), dimension)


def _parsed(name: str | None, dimension: Dimension) -> Unit | None:
    if name is None:
        return None
    folded = name.lower()
    try:
        return parse_unit(SPELLINGS.get(folded, IN_NAMES.get(folded, name)), dimension)
    except UnitError:
        return None
