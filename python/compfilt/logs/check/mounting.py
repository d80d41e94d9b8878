"""Which sensor's axes are swapped, negated or left-handed: what two trials of the gyro say together.

Let P turn a body's axes into those that a sensor claims, +1 or -1 its determinant. A vector v that stands still in the world obeys
v' = v x w in body axes, and in the sensors' axes (P_v v)' = P_v v x det(P_v) P_v P_w' (P_w w): what a trial finds is
M = det(P_v) P_v P_w'. Its determinant is that of P_w, so a left-handed gyro is beyond doubt; one accelerometer axis that is negated
looks like two gyro axes that are; and an accelerometer with all three negated looks like itself: that takes the direction of gravity.
"""

from dataclasses import dataclass

import numpy as np

from compfilt.logs.check.source import Array
from compfilt.logs.check.turning import Trial

__all__ = ["Mounting", "decide"]

EYE = np.eye(3)


@dataclass(frozen=True)
class Mounting:
    """What is to be done to each sensor's columns: (3, 3) signed permutations, right axes = matrix times claimed axes.

    Attributes
    ----------
    wrong
        The sensors that are changed.
    reason
        Why it is these.
    """

    gyro: Array
    accelerometer: Array
    magnetometer: Array
    wrong: tuple[str, ...]
    reason: str


def decide(gravity: Trial | None, field: Trial | None) -> Mounting:  # noqa: PLR0911 - one return a case
    """Choose the sensor that is to be changed: the one that two others agree against, or else the smallest change.

    The trials are those against the accelerometer and against the magnetometer, None where there is none to go by.
    """
    with_force, with_field = _found(gravity), _found(field)
    if with_force is None and with_field is None:
        return Mounting(EYE, EYE, EYE, (), "")
    if field is None or (with_field is None and not field.sure):
        assert with_force is not None
        return _alone(with_force)
    if with_force is None:
        # Only the magnetometer speaks against the gyro; the accelerometer agrees with the gyro, or says nothing.
        assert with_field is not None
        assert gravity is not None
        if gravity.sure:
            return Mounting(
                EYE,
                EYE,
                _undone(with_field),
                ("magnetometer",),
                "gyro and accelerometer agree with each other",
            )
        return Mounting(
            with_field, EYE, EYE, ("gyro",), "the magnetometer shows it; gravity alone does not tell"
        )
    if with_field is None:
        if np.linalg.det(with_force) > 0.0:
            reason = "gyro and magnetometer agree with each other"
            return Mounting(EYE, _undone(with_force), EYE, ("accelerometer",), reason)
        return _alone(with_force)
    if np.array_equal(with_force, with_field) or (gravity is not None and gravity.leaves_open(with_field)):
        return Mounting(
            with_field, EYE, EYE, ("gyro",), "accelerometer and magnetometer agree with each other"
        )
    if np.linalg.det(with_force) * np.linalg.det(with_field) > 0.0:
        reason = "all three disagree; the accelerometer was taken as it is"
        return Mounting(with_force, EYE, _undone(with_field @ with_force.T), ("gyro", "magnetometer"), reason)
    return _alone(with_force)


def _found(trial: Trial | None) -> Array | None:
    """Return the mounting of a trial that rules the claimed axes out, beyond doubt and by far; None otherwise."""
    if trial is None or trial.accepts_axes:
        return None
    return trial.mounting if trial.angle < 0.7 * trial.identity_angle else None


def _alone(found: Array) -> Mounting:
    """Decide between gyro and accelerometer without a third sensor."""
    if np.linalg.det(found) < 0.0:
        reason = "the gyro's axes are left-handed, which nothing in the accelerometer can cause"
        return Mounting(found, EYE, EYE, ("gyro",), reason)
    other = _undone(found)
    if _size(other) < _size(found):
        reason = "that is the smallest change; the same in the gyro would be a change of more columns"
        return Mounting(EYE, other, EYE, ("accelerometer",), reason)
    reason = "that is the smallest change; it could also be the accelerometer instead"
    return Mounting(found, EYE, EYE, ("gyro",), reason)


def _undone(found: Array) -> Array:
    """Return the change of the vector sensor that undoes what was found: of the two with either sign, the smaller."""
    back = found.T
    return back if _size(back) <= _size(-back) else -back


def _size(matrix: Array) -> int:
    """Count the columns that are moved, twice, and those that are negated."""
    return 2 * int(np.sum(np.diag(matrix) == 0.0)) + int(np.sum(matrix < 0.0))
