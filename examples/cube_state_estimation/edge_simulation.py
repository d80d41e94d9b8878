"""The loop on the nonlinear plant, sample by sample."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np

from compfilt.motion import GRAVITY
from edge_cube import (
    ACCELEROMETER_NOISE,
    ARM,
    GYRO_NOISE,
    HALL_NOISE,
    MODEL,
    Array,
    Cube,
    T,
    advance,
    derivative,
)
from edge_estimators import Scheme

CURRENT_LIMIT = 3.0
"""A; 75 mN m."""


@dataclass(frozen=True)
class Case:
    """One run: who estimates, on which plant, with which errors of the sensors."""

    scheme: Scheme
    cube: Cube = MODEL
    noise: float = 1.0
    gyro_bias: float = 0.0
    accelerometer_offset: float = 0.0
    start: float = 0.02
    seed: int = 0


class Runs(NamedTuple):
    """States (samples, 3, cases) and currents (samples, cases); NaN once a cube has fallen."""

    states: Array
    current: Array


def simulate(cases: Sequence[Case], duration: float = 60.0) -> Runs:
    """Run all cases side by side on the nonlinear plant."""
    samples = round(duration / T)
    cube = Cube(*np.array([astuple(case.cube) for case in cases]).T)
    disturbance = np.stack([sensor_errors(case, samples) for case in cases], axis=-1)
    running = [case.scheme.start() for case in cases]
    gains = [case.scheme.gain[0] for case in cases]
    x = np.zeros((3, len(cases)))
    x[0] = [case.start for case in cases]
    current = np.zeros(len(cases))
    states, currents = np.empty((samples, 3, len(cases))), np.empty((samples, len(cases)))
    for k in range(samples):
        y = np.ascontiguousarray((read(cube, x, current) + disturbance[k]).T)
        wanted = [-(gain @ one.estimate(row)) for one, gain, row in zip(running, gains, y, strict=True)]
        current = np.clip(wanted, -CURRENT_LIMIT, CURRENT_LIMIT)
        for one, flowing in zip(running, current.tolist(), strict=True):
            one.advance(flowing)
        states[k], currents[k] = x, current
        x = advance(cube, x, current)
        x[:, np.abs(x[0]) > np.pi / 4.0] = np.nan
    return Runs(states, currents)


def read(cube: Cube, x: Array, current: Array) -> Array:
    """Return the five readings without errors, (5, cases), at the end of a period in which `current` flowed."""
    tilt, rate, wheel = x
    turning = derivative(cube, x, current)[1]
    along = GRAVITY * np.sin(tilt) - ARM * turning
    felt = np.arctan2(along, GRAVITY * np.cos(tilt) - ARM * rate**2)
    push = ARM / GRAVITY * MODEL.torque_constant / MODEL.inertia * current
    return np.array((tilt, felt, felt - push, rate, wheel))


def sensor_errors(case: Case, samples: int) -> Array:
    """Return what the sensors add, (samples, 5)."""
    white = case.noise * np.random.default_rng(case.seed).normal(size=(samples, 3))
    gyro = GYRO_NOISE * white[:, 0] + case.gyro_bias
    accelerometer = ACCELEROMETER_NOISE / GRAVITY * white[:, 2] + case.accelerometer_offset
    nothing = np.zeros(samples)
    return np.column_stack((nothing, accelerometer, accelerometer, gyro, gyro + HALL_NOISE * white[:, 1]))


class Swing(NamedTuple):
    """What a run does after its first third: RMS tilt, rad; RMS current, A; mean slip, rad/s; frequency, Hz."""

    tilt: float
    current: float
    slip: float
    frequency: float


def swing(runs: Runs, case: int) -> Swing:
    """Measure one case."""
    late = slice(len(runs.current) // 3, None)
    x, current = runs.states[late, :, case], runs.current[late, case]
    spectrum = np.abs(np.fft.rfft(x[:, 0] - x[:, 0].mean()))
    return Swing(
        float(np.sqrt(np.mean(x[:, 0] ** 2))),
        float(np.sqrt(np.mean(current**2))),
        float(np.mean(x[:, 2] - x[:, 1])),
        float(np.argmax(spectrum) / (len(x) * T)),
    )
