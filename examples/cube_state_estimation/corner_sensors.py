"""What the six sensors read, and their errors."""

from typing import NamedTuple

import numpy as np

from compfilt.motion import GRAVITY
from corner_cube import POSITIONS, ROTATIONS
from corner_motion import FS, Swing
from corner_tables import Array

SEED = 4

ACCELEROMETER_NOISE = 300e-6 * GRAVITY * np.sqrt(FS / 2.0)
"""m/s² a sample: 300 µg/√Hz, the MPU-9250's."""
GYRO_NOISE = np.radians(0.01) * np.sqrt(FS / 2.0)
"""rad/s a sample: 0.01 °/s/√Hz, the MPU-9250's."""
GYRO_BIAS = np.radians(0.5)
"""rad/s, RMS over the gyros: what a calibration leaves."""
ACCELEROMETER_BIAS = 3e-3 * GRAVITY
"""m/s², RMS over the channels: what a calibration leaves."""

VIBRATION_LINES = {41.0: 0.5, 83.0: 0.3, 127.0: 0.2}
"""Amplitude in m/s² over frequency in Hz; each channel has phases of its own: the plates of the housing ring."""
VIBRATION_NOISE = 0.25
"""m/s² a sample."""


class Errors(NamedTuple):
    """How much of each error the sensors have: 1 for that of the parts above, 0 for none."""

    noise: float = 0.0
    gyro_bias: float = 0.0
    vibration: float = 0.0
    accelerometer_bias: float = 0.0


PERFECT = Errors()
NOISE = Errors(noise=1.0)
GYRO_BIASED = Errors(noise=1.0, gyro_bias=1.0)
VIBRATING = Errors(noise=1.0, gyro_bias=1.0, vibration=1.0)
BIASED = Errors(noise=1.0, gyro_bias=1.0, vibration=1.0, accelerometer_bias=1.0)


class Readings(NamedTuple):
    """What six sensors read, (n, 6, 3), each in its own axes: rad/s and m/s²."""

    gyr: Array
    acc: Array


def read(true: Swing, errors: Errors) -> Readings:
    """Return the readings, (1.9) turned into each sensor's axes, and the errors of the sensors."""
    rng = np.random.default_rng(SEED)
    felt = accelerations(true, POSITIONS) + true.gravity[:, None]
    acc = np.einsum("sij,nsj->nsi", ROTATIONS, felt)
    gyr = np.einsum("sij,nj->nsi", ROTATIONS, true.rate)
    gyr += errors.gyro_bias * rng.normal(0.0, GYRO_BIAS, (6, 3))
    acc += errors.accelerometer_bias * rng.normal(0.0, ACCELEROMETER_BIAS, (6, 3))
    gyr += errors.noise * rng.normal(0.0, GYRO_NOISE, gyr.shape)
    acc += errors.noise * rng.normal(0.0, ACCELEROMETER_NOISE, acc.shape)
    acc += errors.vibration * vibration(true.t, rng)
    return Readings(gyr, acc)


def accelerations(true: Swing, places: Array) -> Array:
    """Return (1.9) at every place, (n, s, 3) in body axes."""
    rate, acceleration = true.rate[:, None], true.acceleration[:, None]
    return np.cross(acceleration, places) + np.cross(rate, np.cross(rate, places))


def vibration(t: Array, rng: np.random.Generator) -> Array:
    """Return what the motors add to every channel, (n, 6, 3) in m/s²."""
    total = rng.normal(0.0, VIBRATION_NOISE, (t.size, 6, 3))
    for frequency, amplitude in VIBRATION_LINES.items():
        phases = rng.uniform(0.0, 2.0 * np.pi, (6, 3))
        total += amplitude * np.sin(2.0 * np.pi * frequency * t[:, None, None] + phases)
    return total
