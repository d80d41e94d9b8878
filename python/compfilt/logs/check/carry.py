"""From rest to rest: gravity as the gyro carries it, against gravity as it is measured at the end."""

from typing import NamedTuple

import numpy as np

from compfilt.logs.check.rests import Rest
from compfilt.logs.check.segments import LENGTH
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey
from compfilt.logs.check.turning import turn

__all__ = ["Carried", "carry_between_rests"]

TURNED = 10.0
"""Degrees by which gravity must have turned from rest to rest for a pair to count."""
LONGEST = 60
"""Seconds between two rests over which the gyro is still believed."""
MOST_PAIRS = 40


class Carried(NamedTuple):
    """How many pairs of rests there are, and the median angles in degrees by which the gyro misses: as found and as claimed."""

    pairs: int
    found: float
    claimed: float

    def __str__(self) -> str:
        pairs = f"{self.pairs} pair{'s' if self.pairs > 1 else ''} of rests"
        as_found = f"over {pairs} the gyro carries gravity to within {self.found:.2g} deg"
        return as_found + (f", as claimed {self.claimed:.2g} deg" if abs(self.claimed - self.found) > 1e-9 else "")


def carry_between_rests(survey: Survey, rests: list[Rest], bias: Array, matrix: Array) -> Carried | None:
    """Carry gravity from every rest to the next by the gyro; None where no pair shows a turn."""
    force, rates = survey.columns_of("accelerometer"), survey.columns_of("gyro")
    segments = survey.segments
    per_second = segments.values.shape[1] // round(LENGTH)
    turns = ((segments.values[..., rates] - bias) * segments.durations[..., None]).reshape(-1, 3)
    numbers = np.repeat(segments.numbers, round(LENGTH))
    misses = []
    for before, after in zip(rests, rests[1:], strict=False):
        seconds = after.first - before.last
        whole = numbers[after.first] - numbers[before.last] <= (after.first // 8) - (before.last // 8)
        start, end = before.mean[force], after.mean[force]
        if not whole or seconds > LONGEST or _angle(start[:, None], end[:, None])[0] < TURNED:
            continue
        carried = np.stack((start, start), axis=1)
        for r in turns[before.last * per_second + per_second // 2 : after.first * per_second + per_second // 2]:
            carried = turn(carried, -np.stack((matrix @ r, r), axis=1))
        misses.append(_angle(carried, end[:, None]))
        if len(misses) == MOST_PAIRS:
            break
    if not misses:
        return None
    found, claimed = np.median(misses, axis=0)
    return Carried(len(misses), float(found), float(claimed))


def _angle(a: Array, b: Array) -> Array:
    """Return the angles between columns, in degrees."""
    cross = np.linalg.norm(np.cross(a, b, axis=0), axis=0)
    return np.asarray(np.degrees(np.arctan2(cross, (a * b).sum(axis=0))))
