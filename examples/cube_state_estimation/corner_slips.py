"""§1.2: the slips of the source that matter."""

import numpy as np

import compfilt as cf
from compfilt.motion import GRAVITY
from corner_gravity import forces
from corner_motion import Swing, T, motion
from corner_sensors import PERFECT, read
from corner_tables import Array, Table, rms


def printed_phi3(force: Array) -> Array:
    """Return φ3 by (1.8) as printed, with k3 in the denominator."""
    return -np.arctan(force[:, 1] / force[:, 2])


def phi3_by_arctan(force: Array) -> Array:
    """Return φ3 by (1.8) with k1 in the denominator, but still without the quadrant."""
    return -np.arctan(force[:, 1] / force[:, 0])


def phi2_by_arcsin(force: Array) -> Array:
    """Return φ2 by (1.8), which needs the length of gravity."""
    return -np.arcsin(np.clip(force[:, 2] / GRAVITY, -1.0, 1.0))


def slips(near: Swing, far: Swing) -> Table:
    """Return the RMS errors in deg that the printed equations make with perfect sensors."""
    cases = {"near / deg": near, "far / deg": far, "everywhere / deg": attitudes()}
    phi3 = {
        "φ3 by (1.8) as printed, k3": printed_phi3,
        "φ3 by (1.8) with k1": phi3_by_arctan,
        "φ3 by atan2": lambda force: cf.tilt(force, axes="cube")[:, 1],
    }
    table: Table = {
        name: {where: off(angle(true.gravity), true.angles[:, 1]) for where, true in cases.items()}
        for name, angle in phi3.items()
    }
    for where, true in (("near / deg", near), ("far / deg", far)):
        found = forces(read(true, PERFECT))
        extracted = found["array, rate unknown"]
        for name, force in {
            "φ2, (1.11) without = 0: plain mean": found["mean of the four channels"],
            "φ2, (1.12) without b_i: sum by 6": extracted / 6.0,
            "φ2, (1.11) and (1.12) mended": extracted,
        }.items():
            table.setdefault(name, {})[where] = off(phi2_by_arcsin(force), true.angles[:, 0])
    return table


def attitudes() -> Swing:
    """Return the cube at rest in attitudes all round, short of φ2 = ±90°."""
    phi2, phi3 = np.meshgrid(
        np.radians(np.arange(-82.5, 85.0, 5.0)), np.radians(np.arange(-177.5, 180.0, 5.0))
    )
    angles = np.column_stack((phi2.ravel(), phi3.ravel()))
    nothing = np.zeros_like(angles)
    t = np.arange(len(angles)) * T
    return motion(t, angles, nothing, nothing, (nothing[:, 0], nothing[:, 0]))


def off(angle: Array, true: Array) -> float:
    """Return the RMS error of an angle in deg, short way round."""
    return float(np.degrees(rms(np.angle(np.exp(1j * (angle - true))))))
