"""One pass over a log: everything that the findings are made of, in bounded memory."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compfilt.logs.check.channels import Channels
from compfilt.logs.check.claims import Claims
from compfilt.logs.check.segments import Segments, Slicer
from compfilt.logs.check.source import Array, read_chunks
from compfilt.logs.check.times import Times, likely_unit, possible_rate
from compfilt.logs.readers import is_text
from compfilt.logs.units import Unit

__all__ = ["Survey", "survey"]

UNKNOWN_PERIOD = 0.01
"""Seconds between samples where nothing says how many there are."""


@dataclass(frozen=True)
class Survey:
    """What one pass leaves.

    Attributes
    ----------
    claims
        What was claimed. The values are in SI as far as it goes.
    times
        The time column; None if there is none.
    told
        The unit that the file itself tells of it; None if it does not.
    time_unit
        The unit in which it was read: the one that is told, or else claimed, unless that cannot be.
    period
        The usual step in seconds in that unit.
    channels, segments
        Each column by itself, and the extract.
    rows
        How many rows there are.
    """

    claims: Claims
    times: Times | None
    told: Unit | None
    time_unit: Unit | None
    period: float
    channels: Channels
    segments: Segments
    rows: int
    text: bool

    def columns_of(self, sensor: str) -> slice:
        """Where a sensor stands among the columns."""
        start = self.claims.columns.index(self.claims.triads[sensor].columns[0])
        return slice(start, start + 3)


def survey(path: str | Path, claims: Claims) -> Survey:
    """Read a log once.

    Raises
    ------
    LogError
        The log cannot be read, or lacks a column.
    """
    columns = claims.columns
    factors = _factors(claims)
    times = Times() if claims.time is not None else None
    channels = Channels(len(columns))
    slicer: Slicer | None = None
    told: Unit | None = None
    unit = claims.time_unit
    period = 1.0 / claims.rate if claims.rate is not None else UNKNOWN_PERIOD
    for ticks, values, told in read_chunks(path, claims.time, columns, claims.separator):
        same = channels.follow(values)
        steps = np.full(len(values), period)
        if times is not None and ticks is not None:
            ticks_apart = times.follow(ticks, same)
            if slicer is None and times.step:
                unit = told or unit
                if unit is None or not possible_rate(1.0 / (times.step * unit.factor)):
                    unit = likely_unit(times.step)
                period = times.step * unit.factor
            steps = ticks_apart * (unit.factor if unit is not None else 1.0)
        if slicer is None:
            slicer = Slicer(len(columns), period)
        slicer.follow(values * factors, steps)
    segments = slicer.finish() if slicer is not None else Slicer(len(columns), period).finish()
    return Survey(claims, times, told, unit, period, channels, segments, channels.rows, is_text(path))


def _factors(claims: Claims) -> Array:
    """Return what makes SI of every column, as far as it is claimed."""
    known = {
        column: factor
        for triad in claims.triads.values()
        for column, factor in zip(triad.columns, triad.factors, strict=True)
    }
    return np.array([known.get(column, 1.0) for column in claims.columns])
