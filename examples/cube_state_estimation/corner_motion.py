"""Exact motions of the cube about its corner."""

from typing import NamedTuple

import numpy as np

from compfilt.motion import GRAVITY, Signal
from corner_cube import OPERATING_POINT
from corner_tables import Array

FS = 1000.0
T = 1.0 / FS
DURATION = 30.0
LATE = 10.0
"""The errors are counted from here on, in s."""

NEAR, FAR = np.radians(5.0), np.radians(30.0)
"""How far the cube swings from the operating point, in rad."""


class Swing(NamedTuple):
    """A rigid motion about the pivot, exact to rounding."""

    t: Array
    angles: Array
    """φ2 and φ3 in rad, (n, 2)."""
    rate: Array
    """u_K in rad/s, (n, 3)."""
    acceleration: Array
    """The derivative of u_K in rad/s², (n, 3)."""
    gravity: Array
    """Specific force at the pivot in m/s², (n, 3)."""


def swing(amplitude: float) -> Swing:
    """Return a motion that starts at rest at the operating point; its angles and rates grow with the amplitude."""
    phi2, phi3, turning = Signal(), Signal(), Signal()
    size = amplitude * np.array([0.5, 0.3, 0.2])
    phi2.sines(1.0, size, np.array([0.35, 0.8, 1.7]), np.array([0.0, 1.0, 2.0]))
    phi3.sines(1.0, size, np.array([0.29, 0.9, 1.5]), np.array([2.0, 0.0, 4.0]))
    turning.step(1.0, 2.0, 1.5 * amplitude)
    turning.sines(1.0, 2.0 * size, np.array([0.2, 0.5, 1.1]), np.array([1.0, 3.0, 5.0]))
    t = np.arange(round(DURATION * FS)) * T
    offset = np.array([OPERATING_POINT, (0.0, 0.0), (0.0, 0.0)])
    return motion(t, *(np.stack((phi2.at(t), phi3.at(t)), axis=2) + offset[:, None]), turning.at(t)[:2])


def motion(
    t: Array, angles: Array, rates: Array, accelerations: Array, turning: tuple[Array, Array]
) -> Swing:
    """Return the motion with these φ2 and φ3, (n, 2), and with φ̇1 and φ̈1.

    With φ̇1 as third row the inverse of (1.31) is u_K = φ̇1 d + φ̇2 (s3, c3, 0) + φ̇3 k3, where d is down in body axes.
    """
    (c2, c3), (s2, s3) = np.cos(angles).T, np.sin(angles).T
    (v2, v3), (a2, a3), (v1, a1) = rates.T, accelerations.T, turning
    nil, one = np.zeros_like(t), np.ones_like(t)
    down = np.column_stack((c2 * c3, -c2 * s3, s2))
    node, across = np.column_stack((s3, c3, nil)), np.column_stack((c3, -s3, nil))
    k3 = np.column_stack((nil, nil, one))
    rate = v1[:, None] * down + v2[:, None] * node + v3[:, None] * k3
    acceleration = (
        a1[:, None] * down
        - v1[:, None] * np.cross(rate, down)
        + a2[:, None] * node
        + (v2 * v3)[:, None] * across
        + a3[:, None] * k3
    )
    return Swing(t, angles, rate, acceleration, -GRAVITY * down)


def stand() -> Swing:
    """Return the cube at rest at the operating point."""
    t = np.arange(round(DURATION * FS)) * T
    nothing = np.zeros((t.size, 2))
    return motion(t, nothing + OPERATING_POINT, nothing, nothing, (nothing[:, 0], nothing[:, 0]))
