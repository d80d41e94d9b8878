"""From rest to rest: gravity as the gyro carries it, against gravity as it is measured at the end."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from compfilt.logs.check.frame import turn
from compfilt.logs.check.rests import Rest
from compfilt.logs.check.segments import LENGTH
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey
from compfilt.logs.check.turning import SCALES

__all__ = ["Carried", "carry_between_rests"]

TURNED = 10.0
"""Degrees by which gravity must have turned from rest to rest for a pair to count."""
LONGEST = 60
"""Seconds between two rests over which the gyro is still believed."""
MOST_PAIRS = 40


class Carried(NamedTuple):
    """What the gyro makes of gravity from rest to rest, by medians over the pairs of rests, in degrees.

    Attributes
    ----------
    pairs
        How many pairs show a turn.
    turned
        By how much gravity turned.
    found, claimed
        By how much the gyro misses it, as found and as claimed.
    scale
        The usual scale of the gyro with which it hits gravity and without which it misses; None if there is none, or if one pair
        only would say so.
    """

    pairs: int
    turned: float
    found: float
    claimed: float
    scale: float | None

    def __str__(self) -> str:
        pairs = f"{self.pairs} pair{'s' if self.pairs > 1 else ''} of rests, between which gravity turns by {self.turned:.2g} deg"
        as_found = f"over {pairs}, the gyro carries it to within {self.found:.2g} deg"
        return as_found + (
            f", as claimed {self.claimed:.2g} deg" if abs(self.claimed - self.found) > 1e-9 else ""
        )


def carry_between_rests(survey: Survey, rests: list[Rest], bias: Array, matrix: Array) -> Carried | None:
    """Carry gravity from every rest to the next by the gyro; None where no pair shows a turn.

    `matrix` is the gyro's matrix as found; the claim and the usual scales are tried beside it.
    """
    force, rates = survey.columns_of("accelerometer"), survey.columns_of("gyro")
    segments = survey.segments
    matrices = np.stack((matrix, *(scale * np.eye(3) for scale in SCALES)))
    per_second = segments.values.shape[1] // round(LENGTH)
    turns = ((segments.values[..., rates] - bias) * segments.durations[..., None]).reshape(-1, 3)
    numbers = np.repeat(segments.numbers, round(LENGTH))
    turned, misses = [], []
    for before, after in pairwise(rests):
        pieces = after.first // round(LENGTH) - before.last // round(LENGTH)
        whole = numbers[after.first] - numbers[before.last] <= pieces
        start, end = before.mean[force][:, None], after.mean[force][:, None]
        angle = float(_angle(start, end)[0])
        if not whole or after.first - before.last > LONGEST or angle < TURNED:
            continue
        carried = np.repeat(start, len(matrices), axis=1)
        # From the middle of the last quiet second to that of the first.
        middle = per_second // 2
        for r in turns[before.last * per_second + middle : after.first * per_second + middle]:
            carried = turn(carried, -(matrices @ r).T)
        turned.append(angle)
        misses.append(_angle(carried, end))
        if len(misses) == MOST_PAIRS:
            break
    if not misses:
        return None
    found, *usual = np.median(misses, axis=0).tolist()
    return Carried(
        len(misses),
        float(np.median(turned)),
        found,
        usual[0],
        _scale(usual, float(np.median(turned)), len(misses)),
    )


def _scale(misses: list[float], turned: float, pairs: int) -> float | None:
    """Choose the scale that hits, where all others miss."""
    order = np.argsort(misses)
    hits = misses[order[0]] < 0.15 * turned and misses[order[1]] > 0.4 * turned
    return SCALES[int(order[0])] if hits and pairs >= 2 else None


def _angle(a: Array, b: Array) -> Array:
    """Return the angles between columns, in degrees."""
    cross = np.linalg.norm(np.cross(a, b, axis=0), axis=0)
    return np.asarray(np.degrees(np.arctan2(cross, (a * b).sum(axis=0))))
