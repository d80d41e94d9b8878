"""A steady turn, with and without the conversion of the gyro's rates."""

from typing import NamedTuple

import numpy as np

import compfilt as cf
from compfilt.motion import GRAVITY
from seat_filters import ELEVEN, NINE, PAPER_PI, A
from seat_log import RATE, Array

TURN, AFTER = 10.0, 5.0  # s, how long the steady turn and what follows it last


class Turn(NamedTuple):
    """Roll in a steady turn and after it; the true roll is zero."""

    t: Array
    roll: dict[str, Array]


def steady_turn() -> Turn:
    """Turn at 60°/s with the nose 40° down and no roll, then stop turning; perfect sensors, gravity only."""
    yaw_rate, pitch = np.radians(60.0), np.radians(40.0)
    up = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])  # in body axes
    t = np.arange(1, round((TURN + AFTER) * RATE) + 1) / RATE
    gyr = np.where((t <= TURN)[:, None], yaw_rate * up, 0.0)
    acc = np.tile(GRAVITY * up, (t.size, 1))
    usual, paper = (cf.FirstOrder(cf.alpha_to_tau(a, RATE)) for a in (0.98, A))
    designs = {"(9), a = 0.98": usual, NINE: paper, ELEVEN: PAPER_PI}
    rolls = {
        f"{name}, gx as it is": design.filter(cf.tilt(acc)[:, 0], gyr[:, 0], fs=RATE, initial=0.0)
        for name, design in designs.items()
    }
    return Turn(
        t, rolls | {"(9), a = 0.98, converted": cf.TiltFilter(usual).estimate(gyr, acc, fs=RATE).roll}
    )


def turn_errors(t: Array, size: Array) -> tuple[float, float, float]:
    """Return the largest roll in the turn, the one at its end, and the largest after it."""
    turning = t <= TURN
    return size[turning].max(), size[turning][-1], size[~turning].max()
