"""A vehicle on a figure of eight with GPS and a biased accelerometer."""

from typing import NamedTuple

import numpy as np

from third_order_tables import Array

FS = 100.0
T = 1.0 / FS
DURATION = 120.0

GPS_PERIOD, GPS_NOISE, GPS_DELAY = 0.2, 1.0, 0.2
"""s, m, s."""
BIAS = np.array([0.15, -0.10])
ACCELEROMETER_NOISE = 0.05
"""m/s² a sample."""


class Drive(NamedTuple):
    """A vehicle on a horizontal plane; (n, 2) east and north."""

    t: Array
    position: Array
    velocity: Array
    acceleration: Array
    """m/s², mean over the period that ends at the sample."""


def drive_an_eight() -> Drive:
    """Return a figure of eight with a weave in it, begun at rest."""
    t = np.arange(-1, round(DURATION * FS)) * T
    # The clock of the eight runs up to full speed with a time constant of 3 s.
    after = np.maximum(t, 0.0)
    s, speed = after - 3.0 * (1.0 - np.exp(-after / 3.0)), 1.0 - np.exp(-after / 3.0)
    amplitudes = np.array([[40.0, 2.0], [20.0, 3.0]])  # m
    omegas = 2.0 * np.pi / np.array([[40.0, 9.0], [20.0, 7.0]])  # rad/s
    phases = omegas * s[:, None, None]
    position = np.sum(amplitudes * np.sin(phases), axis=2)
    velocity = speed[:, None] * np.sum(amplitudes * omegas * np.cos(phases), axis=2)
    return Drive(t[1:], position[1:], velocity[1:], np.diff(velocity, axis=0) / T)


def sensors(drive: Drive, seed: int = 0) -> tuple[Array, Array]:
    """Return GPS, NaN where no fix has come, and the accelerometer."""
    rng = np.random.default_rng(seed)
    acceleration = drive.acceleration + BIAS + rng.normal(0.0, ACCELEROMETER_NOISE, drive.acceleration.shape)
    late, every = round(GPS_DELAY * FS), round(GPS_PERIOD * FS)
    fixes = np.arange(late, drive.t.size, every)
    gps = np.full(drive.position.shape, np.nan)
    gps[fixes] = drive.position[fixes - late] + rng.normal(0.0, GPS_NOISE, (fixes.size, 2))
    return gps, acceleration
