"""The errors of every answer: static, on the road, and on other drives."""

from typing import NamedTuple

import numpy as np

from seat_filters import answers
from seat_log import Array, Log, simulate

OTHER_DRIVES = range(101, 121)  # seeds


class Errors(NamedTuple):
    """RMS roll errors in deg: static test and drive of one log, and the drives of twenty others."""

    static: float
    driving: float
    other_drives: float


def compare(log: Log, rolls: dict[str, Array]) -> dict[str, Errors]:
    """Return the errors of every answer on the log and on the other drives."""
    squares = dict.fromkeys(rolls, 0.0)
    for seed in OTHER_DRIVES:
        other = simulate(seed)
        for name, roll in answers(other).items():
            squares[name] += rms((roll - other.roll)[other.driving]) ** 2 / len(OTHER_DRIVES)
    return {
        name: Errors(
            rms((roll - log.roll)[~log.driving]), rms((roll - log.roll)[log.driving]), squares[name] ** 0.5
        )
        for name, roll in rolls.items()
    }


def rms(angle: Array) -> float:
    """Return the root mean square of an angle in deg."""
    return float(np.degrees(np.sqrt(np.mean(angle**2))))
