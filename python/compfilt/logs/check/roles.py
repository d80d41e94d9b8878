"""Which columns are the gyro and which the accelerometer, where no name says it: by what they do."""

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np

from compfilt.logs.check.claims import Claims, Triad, triads_without_names
from compfilt.logs.check.rests import find_rests
from compfilt.logs.check.source import Column, read_chunks
from compfilt.logs.check.survey import survey
from compfilt.logs.check.turning import SURE, try_mountings

__all__ = ["by_behaviour"]

MOST = 12
"""Sensors that are tried."""


def by_behaviour(path: str | Path, columns: list[Column], named: Claims) -> Claims:
    """Complete what the names say: the time is a column that goes forward, the gyro turns what the accelerometer reads."""
    columns = [column for column in columns if not column.is_time]
    time = named.time if named.time is not None else _goes_forward(path, columns, named.separator)
    rest = [column for column in columns if column.name != time]
    if named.has_both:
        return replace(named, time=time)
    triads = {" ".join(triad.columns): triad for triad in triads_without_names(rest)[:MOST]}
    if len(triads) < 2:
        return replace(named, time=time)
    # Groups may share columns: each column is read once, and a group is found by its places.
    names = tuple(dict.fromkeys(column for triad in triads.values() for column in triad.columns))
    seen = survey(path, Claims(time, named.time_unit, None, {}, names, separator=named.separator))
    best: tuple[float, Triad, Triad] | None = None
    for gyro, force in permutations(triads.values(), 2):
        if set(gyro.columns) & set(force.columns):
            continue
        places = [names.index(column) for column in (*gyro.columns, *force.columns)]
        both = replace(seen.segments, values=seen.segments.values[..., places])
        rates, vector = slice(0, 3), slice(3, 6)
        rests = find_rests(both, rates, vector)
        bias = np.median([one.mean[rates] for one in rests], axis=0) if rests else np.zeros(3)
        trial = try_mountings(both, rates, vector, bias)
        if trial is None or not trial.sure or trial.unturned_margin < SURE:
            continue
        # Of gravity and the field, both of which the gyro turns, an accelerometer also feels the body's motion.
        score = trial.unturned_margin + _roughness(both.values[..., vector])
        if best is None or score > best[0]:
            best = score, gyro, force
    if best is None:
        return replace(named, time=time)
    return replace(named, time=time, triads={"gyro": best[1], "accelerometer": best[2]})


def _roughness(values: np.ndarray) -> float:
    """Return how much the length of a vector varies, as a part of it."""
    length = np.linalg.norm(values, axis=-1)
    return float(length.std() / max(length.mean(), 1e-30))


def _goes_forward(path: str | Path, columns: list[Column], separator: str | None) -> str | None:
    """Find a column that always rises, by nearly equal steps."""
    chunk = next(read_chunks(path, None, [column.name for column in columns], separator), None)
    if chunk is None or len(chunk.values) < 10:
        return None
    for place, column in enumerate(columns):
        steps = np.diff(chunk.values[:, place])
        usual = float(np.median(steps))
        if usual > 0.0 and np.mean(np.abs(steps - usual) < 0.5 * usual) > 0.9 and np.mean(steps > 0.0) > 0.99:
            return column.name
    return None
