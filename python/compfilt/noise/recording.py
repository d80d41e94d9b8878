"""A log as gyro and accelerometer at an even rate: read, cut where samples are missing. Needs the extra ``logs``."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from compfilt.logs.check.claims import Claims, Triad, by_names, by_recipe
from compfilt.logs.check.source import number_columns, read_chunks
from compfilt.logs.check.times import GAP, likely_unit
from compfilt.logs.errors import LogError, UsageError, quoted
from compfilt.logs.recipe import Recipe
from compfilt.logs.units import ACCELERATION, ANGULAR_RATE, STANDARD_GRAVITY, Unit, UnitError, parse_unit
from compfilt.noise.curves import Array
from compfilt.noise.motion import Span
from compfilt.noise.signals import SHORTEST

__all__ = ["Recording", "read_recording"]

UNEVEN = 0.2
"""Steps that vary by more than this part of the usual one are worth a note."""
LOST = 0.01
"""So is a mean step that differs by more than this part: samples are missing."""


@dataclass(frozen=True)
class Recording:
    """A piece of a log without a gap.

    Attributes
    ----------
    gyro, accelerometer
        (n, 3) in rad/s and m/s².
    fs
        In Hz: the mean over the piece.
    start
        Where the piece begins, in s from the beginning of the log.
    notes
        What was cut, and what is odd about the times.
    """

    gyro: Array
    accelerometer: Array
    fs: float
    start: float
    notes: tuple[str, ...]

    def part(self, span: Span) -> "Recording":
        """Cut out a part, given in s from the beginning of this piece."""
        rows = slice(round(span.start * self.fs), round(span.end * self.fs))
        return replace(
            self,
            gyro=self.gyro[rows],
            accelerometer=self.accelerometer[rows],
            start=self.start + span.start,
        )


def read_recording(
    path: str | Path,
    recipe: Recipe | None = None,
    *,
    gyro_unit: str | None = None,
    start: float | None = None,
    end: float | None = None,
) -> Recording:
    """Read the longest piece of a log in which no sample is missing.

    Parameters
    ----------
    path
        A log in any format that recipes can read.
    recipe
        Which columns it has, and their units. Without one they are found by their names.
    gyro_unit
        The gyro's, where neither the recipe nor the log tells it.
    start, end
        The part to read, in s from the beginning of the log.

    Raises
    ------
    LogError
        The log cannot be read, lacks a gyro or an accelerometer, or holds too few samples in a row.
    UsageError
        Nothing tells the gyro's unit, or `gyro_unit` is none.
    """
    claims = by_names(number_columns(path)) if recipe is None else by_recipe(recipe)
    _check_claims(claims)
    gyro, force = claims.triads["gyro"], claims.triads["accelerometer"]
    gyro = _with_gyro_unit(gyro, gyro_unit)
    times, values = _read(path, claims, (*gyro.columns, *force.columns))
    lasts = float(times[-1]) if len(times) else 0.0
    wanted = (times >= (start or 0.0)) & (times <= (np.inf if end is None else end))
    if not wanted.any():
        raise LogError(
            f"there is nothing from {start or 0.0:g} s on to {lasts if end is None else end:g} s: the log lasts {lasts:.6g} s"
        )
    times, values = times[wanted], values[wanted]
    rows, notes = _longest_piece(times, values)
    times, values = times[rows], values[rows]
    step = float(times[-1] - times[0]) / (len(times) - 1)
    notes += _oddities(times, step)
    rates = values[:, :3] * np.array(gyro.factors)
    measured = values[:, 3:] * np.array(force.scale)
    unit = force.unit if force.unit is not None else _unit_of_gravity(measured)
    return Recording(rates, measured * unit.factor, 1.0 / step, float(times[0]), tuple(notes))


def _check_claims(claims: Claims) -> None:
    for sensor in ("gyro", "accelerometer"):
        if sensor not in claims.triads:
            if claims.recipe is not None:
                raise LogError(f"the recipe {claims.recipe.source} names no {sensor} of three columns")
            raise LogError(
                f"no {sensor} was found by name among the columns that hold numbers: name its columns in a recipe (--recipe)"
            )
    if claims.time is None and claims.rate is None:
        raise LogError(
            "no column of times was found by its name: name it in a recipe (--recipe), or the rate"
        )


def _with_gyro_unit(gyro: Triad, name: str | None) -> Triad:
    if gyro.unit is not None:
        return gyro
    if name is None:
        raise UsageError(
            f"nothing tells the unit of {', '.join(map(quoted, gyro.columns))}, and a gyro at rest does not show it: give "
            "--gyro-unit, such as deg/s, or a recipe"
        )
    try:
        return replace(gyro, unit=parse_unit(name, ANGULAR_RATE))
    except UnitError as error:
        raise UsageError(f"--gyro-unit: {error}") from None


def _read(path: str | Path, claims: Claims, columns: Sequence[str]) -> tuple[Array, Array]:
    """Read all rows: the times in s from the first one on, and the columns as they are."""
    chunks = list(read_chunks(path, claims.time, columns))
    values = np.concatenate([chunk.values for chunk in chunks]) if chunks else np.empty((0, len(columns)))
    if claims.time is None:
        assert claims.rate is not None
        return np.arange(len(values)) / claims.rate, values
    ticks = np.concatenate([chunk.ticks for chunk in chunks if chunk.ticks is not None] or [np.empty(0)])
    if not np.isfinite(ticks).all():
        row = int(np.argmin(np.isfinite(ticks)))
        raise LogError(f"row {row + 1} has no time in column {quoted(claims.time)}")
    ahead = np.diff(ticks)[np.diff(ticks) > 0.0]
    if not len(ahead):
        raise LogError(f"the times in column {quoted(claims.time)} do not go forward")
    unit = claims.time_unit if claims.time_unit is not None else likely_unit(float(np.median(ahead)))
    return (ticks - ticks[0]) * unit.factor, values


def _longest_piece(times: Array, values: Array) -> tuple[slice, list[str]]:
    """Find the longest run of rows with all values and without a gap or a way back; say what is left out."""
    steps = np.diff(times)
    ahead = steps[steps > 0.0]
    usual = float(np.median(ahead)) if len(ahead) else np.inf
    missing: npt.NDArray[np.bool_] = np.asarray(~np.isfinite(values).all(axis=1))
    breaks = (steps < 0.0) | (steps > GAP * usual)
    # A new piece begins after a break, and with every change between rows that are whole and rows that are not.
    begins = np.concatenate(([0], 1 + np.flatnonzero(breaks | (missing[1:] ^ missing[:-1])), [len(times)]))
    lengths = np.where(missing[begins[:-1]], 0, np.diff(begins))
    longest = int(lengths.argmax())
    rows = slice(int(begins[longest]), int(begins[longest + 1]))
    if lengths[longest] < SHORTEST:
        raise LogError(
            f"no {SHORTEST} samples in a row are whole: of {len(times)}, {missing.sum()} lack a value, and there are "
            f"{breaks.sum()} gaps"
        )
    if lengths[longest] == len(times):
        return rows, []
    found = [f"{breaks.sum()} gaps in time"] * bool(breaks.any())
    found += [f"{missing.sum()} rows without a value"] * bool(missing.any())
    used = Span(float(times[rows.start]), float(times[rows.stop - 1]))
    return rows, [f"the log has {' and '.join(found)}: the longest piece without is used, {used}"]


def _oddities(times: Array, step: float) -> list[str]:
    steps = np.diff(times)
    usual = float(np.median(steps))
    if usual > 0.0 and abs(step / usual - 1.0) > LOST:
        return [
            f"the mean step is {step:.4g} s, the usual one {usual:.4g} s: samples seem to be missing here and there"
        ]
    vary = float(np.std(steps)) / step
    return [f"the times vary by {vary:.0%} of a step: the clock is taken as even"] if vary > UNEVEN else []


def _unit_of_gravity(measured: Array) -> Unit:
    """Find the unit in which the accelerometer reads one g."""
    # Of a log that moves too, since motion is what it is refused for.
    length = float(np.median(np.linalg.norm(measured, axis=1)))
    for name in ("m/s^2", "g", "mg"):
        unit = parse_unit(name, ACCELERATION)
        if abs(length * unit.factor / STANDARD_GRAVITY - 1.0) < 0.1:
            return unit
    raise LogError(
        f"the accelerometer reads {length:.4g}, which is one g in neither m/s², g nor mg: name its unit in a recipe (--recipe)"
    )
