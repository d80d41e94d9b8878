"""The paper's hardware experiment as a simulation."""

from typing import NamedTuple

import numpy as np

import compfilt as cf
from butterworth_family import DEGREE, Array, butterworth
from compfilt.motion import GRAVITY, Motion
from compfilt.simulate import SensorErrors, measure


class Experiment(NamedTuple):
    """The hardware experiment as a simulation; angles in rad, yaw without and with ``period``."""

    t: Array
    truth: dict[str, Array]
    measured: dict[str, Array]
    estimates: dict[str, Array]


def experiment() -> Experiment:
    """Roll by hand from 7 s to 12 s, pitch from 12 s to 14 s, rest; Q = 0.625, 1 kHz.

    Roll and pitch are measured by a simulated cheap accelerometer. The paper does not say how it measures yaw. Here it
    is a heading sensor that stands at 2° and picks up 8 % of the tilt, and tells angles between 0 and 360°.
    """
    rng = np.random.default_rng(0)
    t = np.arange(1, 20_001) / 1000.0
    body = Motion(arm=0.05)
    for start, length, change in (
        (7.0, 1.0, 40),
        (8.0, 1.0, -80),
        (9.0, 1.0, 80),
        (10.0, 1.0, -80),
        (11.0, 1.0, 40),
    ):
        body.roll.step(start, length, change * DEGREE)
    for start, length, change in ((12.0, 0.5, 50), (12.5, 1.0, -100), (13.5, 0.5, 50)):
        body.pitch.step(start, length, change * DEGREE)
    log = measure(body, t, 1000.0, SensorErrors(), rng)
    tilt, gyr = cf.tilt(GRAVITY * log[:, :3]), DEGREE * log[:, 3:]
    roll, pitch = body.roll.at(t)[0], body.pitch.at(t)[0]
    heading = 2.0 * DEGREE + 0.08 * (roll + pitch) + rng.normal(0.0, 0.3 * DEGREE, t.size)
    heading %= 2.0 * np.pi
    design = butterworth(0.625)
    # The rates need no conversion: one angle is zero while the other moves, and yaw rests.
    return Experiment(
        t,
        {"roll": roll, "pitch": pitch, "yaw": np.full(t.size, 2.0 * DEGREE)},
        {"roll": tilt[:, 0], "pitch": tilt[:, 1], "yaw": heading},
        {
            "roll": design.filter(tilt[:, 0], gyr[:, 0], fs=1000.0),
            "pitch": design.filter(tilt[:, 1], gyr[:, 1], fs=1000.0),
            "yaw": design.filter(heading, gyr[:, 2], fs=1000.0),
            "yaw, period = 2 pi": design.filter(heading, gyr[:, 2], fs=1000.0, period=2.0 * np.pi),
        },
    )


def experiment_errors(run: Experiment) -> dict[str, Array]:
    """Return the error of each estimate in deg."""
    return {name: np.degrees(angle - run.truth[name.split(",")[0]]) for name, angle in run.estimates.items()}
