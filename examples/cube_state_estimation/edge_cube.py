"""The cube that balances on an edge with one reaction wheel: its equations, its sensors and their noise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from compfilt.motion import GRAVITY

Array = npt.NDArray[np.float64]

T = 0.02
"""Sample period, s."""

ARM = 0.06
"""From the edge to the accelerometer, m."""
GYRO_NOISE, HALL_NOISE, ACCELEROMETER_NOISE = np.radians(0.2), 1.0, 0.3
"""RMS per sample, motor vibration included: rad/s, rad/s, m/s²."""
BIAS_WALK = np.radians(6e-4)
"""Of the gyro, per sample, rad/s."""
COULOMB = 0.002
"""Dry friction of motor and wheel bearing, N m: what 0.08 A makes."""

TILT, ACCELEROMETER, PUSHLESS, RATE, WHEEL = range(5)
"""What can be read: the true tilt, the accelerometer's, that without the motor's push, the gyro u_K, the wheel u_R."""
RATES = [RATE, WHEEL]


@dataclass(frozen=True)
class Cube:
    """The one-dimensional prototype of Gajamohan, Merz, Thommen and D'Andrea (2012); SI units.

    Attributes
    ----------
    lever
        Mass times distance of its centre from the edge, m_b l_b + m_w l.
    inertia
        Of the body about the edge, the wheel taken as a point mass: I_b + m_w l².
    wheel
        Inertia of the wheel about its axis.
    body_friction, wheel_friction
        Viscous, at the edge and at the axis.
    torque_constant
        Of the motor, N m/A.
    coulomb
        Dry friction at the axis. The model of every observer is without.
    """

    lever: float = 0.419 * 0.075 + 0.204 * 0.085
    inertia: float = 3.34e-3 + 0.204 * 0.085**2
    wheel: float = 0.57e-3
    body_friction: float = 1.02e-3
    wheel_friction: float = 0.05e-3
    torque_constant: float = 25.1e-3
    coulomb: float = 0.0


MODEL = Cube()

DRY = replace(MODEL, coulomb=COULOMB)


def changed(**factors: float) -> Cube:
    """Return the model's cube with some of its numbers multiplied."""
    return replace(MODEL, **{name: factor * getattr(MODEL, name) for name, factor in factors.items()})


def sticky(friction: float) -> Cube:
    """Return a cube with more viscous friction at the axis than the model has, N m s/rad."""
    return replace(MODEL, wheel_friction=MODEL.wheel_friction + friction)


def derivative(cube: Cube, x: Array, current: Array) -> Array:
    """Return the rates of change of φ, u_K and u_R; u_R is the absolute rate of the wheel."""
    tilt, rate, wheel = x
    slip = wheel - rate
    motor = cube.torque_constant * current - cube.wheel_friction * slip - cube.coulomb * np.tanh(slip / 0.05)
    body = cube.lever * GRAVITY * np.sin(tilt) - cube.body_friction * rate - motor
    return np.array((rate, body / cube.inertia, motor / cube.wheel))


def advance(cube: Cube, x: Array, current: Array) -> Array:
    """Integrate over one sample period with a held current, by five steps of Runge and Kutta's rule."""
    h = T / 5
    for _ in range(5):
        k1 = derivative(cube, x, current)
        k2 = derivative(cube, x + h / 2.0 * k1, current)
        k3 = derivative(cube, x + h / 2.0 * k2, current)
        k4 = derivative(cube, x + h * k3, current)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


def continuous(cube: Cube) -> tuple[Array, Array]:
    """Return A and B of the upright cube in continuous time."""
    J, W, c = cube.inertia, cube.wheel, cube.wheel_friction
    A = np.array(
        [
            [0.0, 1.0, 0.0],
            [cube.lever * GRAVITY / J, -(cube.body_friction + c) / J, c / J],
            [0.0, c / W, -c / W],
        ]
    )
    return A, cube.torque_constant * np.array([[0.0], [-1.0 / J], [1.0 / W]])


def discrete(cubes: Sequence[Cube]) -> tuple[Array, Array]:
    """Return A, (k, 3, 3), and B, (k, 3, 1), over one sample period, exact for a held current.

    The exponential of [A B; 0 0] T is a series over a 256th of the period, squared eight times.
    """
    step = np.zeros((len(cubes), 4, 4))
    for block, cube in zip(step, cubes, strict=True):
        block[:3, :3], block[:3, 3:] = continuous(cube)
    step *= T / 256.0
    whole = np.broadcast_to(np.eye(4), step.shape)
    for k in range(8, 0, -1):
        whole = np.eye(4) + step @ whole / k
    for _ in range(8):
        whole = whole @ whole
    return whole[:, :3, :3], whole[:, :3, 3:]


def readings(cube: Cube) -> Array:
    """Return how the five readings depend on φ, u_K, u_R and the last current, (5, 4).

    The accelerometer feels gravity and its own acceleration along the arm: φ_A = φ - (r/g) u̇_K. The model knows what
    of it the motor does.
    """
    A, B = continuous(cube)
    felt = np.array([1.0, 0.0, 0.0, 0.0]) - ARM / GRAVITY * np.concatenate((A[1], B[1]))
    push = np.array([0.0, 0.0, 0.0, ARM / GRAVITY * continuous(MODEL)[1][1, 0]])
    return np.array([np.eye(4)[0], felt, felt + push, np.eye(4)[1], np.eye(4)[2]])


def noise() -> Array:
    """Return the covariance of the five readings; the gyro is in both rates, as u_R = u_K + ψ̇ (S1, (1.5))."""
    covariance = np.zeros((5, 5))
    covariance[1:3, 1:3] = (ACCELEROMETER_NOISE / GRAVITY) ** 2
    covariance[3:, 3:] = GYRO_NOISE**2
    covariance[WHEEL, WHEEL] += HALL_NOISE**2
    return covariance
