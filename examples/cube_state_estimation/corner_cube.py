"""The cube on its corner, and its six sensors: where they sit, how they are turned, what they see."""

import numpy as np

import compfilt as cf
from corner_tables import Array

EDGE = 0.15
"""Of the cube, in m."""
OPERATING_POINT = (np.arcsin(np.sqrt(1.0 / 3.0)), np.pi / 4.0)
"""φ2 and φ3 in rad with the centre above the corner: 35.26° and 45°."""


def cyclic(one: tuple[float, float, float]) -> list[tuple[float, float, float]]:
    """Return a place and the two that the turns by 120° about the diagonal through the pivot make of it."""
    a, b, c = one
    return [(a, b, c), (c, a, b), (b, c, a)]


def on_faces(near: tuple[float, float], far: tuple[float, float]) -> Array:
    """Place sensors 1, 3, 5 at `near` on the faces at the pivot and 2, 4, 6 at `far` on those opposite, (6, 3) in m.

    Sensors 1 and 2 measure along k1 and k2 and lie flat on the faces across k3, and so on round. The cube stands on the
    pivot with k1 and k3 pointing out of it and k2 into it, so that φ2 and φ3 are positive.
    """
    pairs = zip(cyclic((*near, 0.0)), cyclic((*far, EDGE)), strict=True)
    return np.array([place for pair in pairs for place in pair]) * [-1.0, 1.0, -1.0]


POSITIONS = on_faces((0.02, 0.04), (0.04, 0.13))
K1, K2, K3 = np.eye(3)
ROTATIONS = np.repeat([[K2, K1, -K3], [K3, K2, -K1], [K1, K3, -K2]], 2, axis=0)
"""From body to sensor axes, (1.15) to (1.20); z completes a right-handed frame."""
CHANNELS = np.array([[True, True, False]] * 6)
ARRAY = cf.AccelerometerArray(POSITIONS, ROTATIONS, CHANNELS)
SEEN = np.einsum("sij,si->sj", np.abs(ROTATIONS), CHANNELS) > 0.5
"""Which body axes each sensor sees, (6, 3): four sensors an axis, (1.22)."""
