"""The simulated log of the child seat: 60 s static, 90 s on the road, and the true roll."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt.motion import GRAVITY
from compfilt.simulate import child_seat, static_length

Array = npt.NDArray[np.floating[Any]]

RATE = 100.0  # Hz; the paper names none


class Log(NamedTuple):
    """A simulated log in SI units, the true roll, and which samples belong to the drive."""

    t: Array
    gyr: Array
    acc: Array
    roll: Array
    driving: npt.NDArray[np.bool_]


def simulate(seed: int, rate: float = RATE) -> Log:
    """Draw one log."""
    log = child_seat(rate=rate, seed=seed)
    return Log(
        log["t"],
        np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")])),
        GRAVITY * np.column_stack([log[name] for name in ("ax", "ay", "az")]),
        np.radians(log["true_roll"]),
        log["t"] >= static_length(log["t"][-1]),
    )
