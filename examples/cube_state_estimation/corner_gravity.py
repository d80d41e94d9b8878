"""§1.2: gravity while the cube swings."""

import numpy as np

import compfilt as cf
from corner_cube import ARRAY, ROTATIONS, SEEN
from corner_motion import LATE, Swing
from corner_sensors import BIASED, GYRO_BIASED, PERFECT, VIBRATING, Readings, read
from corner_tables import Array, Table


def forces(readings: Readings) -> dict[str, Array]:
    """Return the specific force of gravity by every way, (n, 3) in body axes."""
    body = np.einsum("sij,nsi->nsj", ROTATIONS, readings.acc)
    mean = np.where(SEEN, body, 0.0).sum(axis=1) / SEEN.sum(axis=0)
    return {
        "one sensor, 45 mm from the pivot": body[:, 0],
        "one sensor, 202 mm from the pivot": body[:, 1],
        "mean of the four channels": mean,
        "array, rate unknown": ARRAY.gravity(readings.acc),
        "array, rate by the gyros": ARRAY.gravity(readings.acc, ARRAY.body_rate(readings.gyr)),
    }


def gravity(far: Swing) -> Table:
    """Return the RMS error of φ2 and φ3 by every way with more and more of the sensors' errors, in deg."""
    table: Table = {}
    for name, errors in {
        "perfect": PERFECT,
        "noise": GYRO_BIASED,
        "+ vibration": VIBRATING,
        "+ acc. bias": BIASED,
    }.items():
        for way, force in forces(read(far, errors)).items():
            table.setdefault(way, {}).update(angle_errors(name, cf.tilt(force, axes="cube"), far))
    return table


def angle_errors(name: str, angles: Array, true: Swing) -> dict[str, float | str]:
    """Return two cells: the RMS errors in deg after the start."""
    late = true.t >= LATE
    errors = np.degrees(np.sqrt(np.mean((angles - true.angles)[late] ** 2, axis=0)))
    return {f"{name}: φ2 / deg": float(errors[0]), f"{name}: φ3 / deg": float(errors[1])}
