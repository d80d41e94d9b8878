"""Where the body rests: runs of seconds as quiet as the quietest of this log, and quiet enough to be no motion."""

from typing import NamedTuple

import numpy as np

from compfilt.logs.check.segments import LENGTH, Segments
from compfilt.logs.check.source import Array

__all__ = ["Rest", "find_rests"]

QUIET = 3.0
"""So many times the noise of the quietest tenth of the log is still rest."""
SHAKE = 0.01
"""An accelerometer that varies by more than this part of its length is not at rest, however restless the log is."""
SWAY = 0.1
"""Nor is a gyro that varies by more than this part of its usual reading."""
SHORTEST = 2
"""Seconds."""


class Rest(NamedTuple):
    """One rest: the seconds of the extract that it covers, and the means of all columns."""

    first: int
    last: int
    mean: Array

    @property
    def seconds(self) -> int:
        """How long it lasts."""
        return self.last - self.first + 1


def find_rests(segments: Segments, rates: slice, force: slice) -> list[Rest]:
    """Find the rests, in order. Seconds are counted through all pieces, eight to a piece."""
    if not len(segments):
        return []
    pieces, cells, columns = segments.values.shape
    seconds = segments.values.reshape(pieces * round(LENGTH), cells // round(LENGTH), columns)
    means, noise = seconds.mean(axis=1), seconds.std(axis=1)
    shake, sway = (np.linalg.norm(noise[:, part], axis=1) for part in (force, rates))
    length = np.linalg.norm(means[:, force], axis=1)
    usual = float(np.sqrt(np.mean(np.sum(segments.values[..., rates] ** 2, axis=-1))))
    quiet = (
        (shake <= np.maximum(QUIET * np.percentile(shake, 10.0), 1e-3 * length))
        & (shake <= SHAKE * length)
        & (sway <= np.maximum(QUIET * np.percentile(sway, 10.0), 1e-3 * usual))
        & (sway <= SWAY * usual)
    )
    piece = np.repeat(segments.numbers, round(LENGTH))
    rests, start = [], 0
    for second in range(1, len(quiet) + 1):
        goes_on = (
            second < len(quiet) and quiet[second] == quiet[start] and piece[second] - piece[second - 1] <= 1.0
        )
        if goes_on:
            continue
        if quiet[start] and second - start >= SHORTEST:
            rests.append(Rest(start, second - 1, means[start:second].mean(axis=0)))
        start = second
    return rests
