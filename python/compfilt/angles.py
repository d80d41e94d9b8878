"""Roll, pitch and yaw of quaternions, and back."""

import numpy as np
import numpy.typing as npt

__all__ = ["angles_to_quaternion", "quaternion_to_angles"]

Array = npt.NDArray[np.float64]


def quaternion_to_angles(quaternion: npt.ArrayLike) -> Array:
    """Return roll, pitch and yaw of attitudes: body to world is ``Rz(yaw) Ry(pitch) Rx(roll)``.

    The formula does not ask which way the axes point: body forward, left, up in a world whose z points up, or body
    forward, right, down in a world whose z points down.

    Parameters
    ----------
    quaternion : array_like, shape (n, 4)
        Unit quaternions from body to world, scalar first.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Roll in [-π, π], pitch in [-π/2, π/2] and yaw in [-π, π], in rad. At a pitch of ±π/2 only a combination of roll and
        yaw is known.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.angles import quaternion_to_angles
    >>> estimate = cf.Mahony(kp=1.0).estimate([[0.0, 0.0, 0.0]], [[0.0, 6.94, 6.94]], fs=100.0)
    >>> quaternion_to_angles(estimate.quaternion).round(4)
    array([[0.7854, 0.    , 0.    ]])
    """
    w, x, y, z = np.array(quaternion, np.float64).T.copy()
    # The world's z in body axes, and what yaw needs of the body's x in world axes.
    up_x, up_y, up_z = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), (w * w + z * z) - (x * x + y * y)
    forward_x, forward_y = (w * w + x * x) - (y * y + z * z), 2.0 * (x * y + w * z)
    roll = np.arctan2(up_y, up_z)
    pitch = np.arctan2(-up_x, np.sqrt(up_y * up_y + up_z * up_z))
    yaw = np.arctan2(forward_y, forward_x)
    # Zero, not -0.
    return np.column_stack([roll, pitch, yaw]) + 0.0


def angles_to_quaternion(roll: float, pitch: float, yaw: float) -> Array:
    """Return the attitude with these angles in rad, the inverse of :func:`quaternion_to_angles`.

    Returns
    -------
    ndarray of float64, shape (4,)
        A unit quaternion from body to world, scalar first.

    Examples
    --------
    >>> from compfilt.angles import angles_to_quaternion
    >>> angles_to_quaternion(0.0, 0.0, 3.141592653589793).round(4)
    array([0., 0., 0., 1.])
    """
    half = 0.5 * np.array([roll, pitch, yaw])
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )
