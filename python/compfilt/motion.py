"""A body that tilts on a vehicle: its angles, rates and specific force, exact to rounding.

The motion is made of smooth pieces whose derivatives are known in closed form. Axes are forward, left, up; roll is
positive to the right, pitch nose down.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from compfilt.constants import STANDARD_GRAVITY

__all__ = [
    "GRAVITY",
    "Array",
    "Motion",
    "Signal",
    "body_accelerations",
    "body_rates",
    "mean_rates",
    "specific_force",
]

GRAVITY = STANDARD_GRAVITY
"""m/s², and the accelerometer's g."""

Array = npt.NDArray[np.float64]


class Signal:
    """A sum of smooth steps and of sines, with two derivatives in closed form.

    A step rises from 0 to its height along 10 s³ - 15 s⁴ + 6 s⁵, so that the value, the rate and the acceleration are
    continuous. The sines grow from nothing along such a step.

    Examples
    --------
    >>> signal = Signal()
    >>> signal.step(start=1.0, length=2.0, height=3.0)
    >>> value, rate, acceleration = signal.at(np.array([0.0, 2.0, 4.0]))
    >>> value.tolist(), rate.tolist()
    ([0.0, 1.5, 3.0], [0.0, 2.8125, 0.0])
    """

    def __init__(self) -> None:
        self._steps: list[tuple[float, float, float]] = []
        self._sines: list[tuple[float, float, float]] = []
        self._onset = (0.0, 1.0)

    def step(self, start: float, length: float, height: float) -> None:
        """Add a step that begins at `start` and takes `length` seconds."""
        self._steps.append((start, length, height))

    def pulse(self, start: float, rise: float, hold: float, height: float) -> None:
        """Add a step up and, after `hold` seconds, the same step down."""
        self.step(start, rise, height)
        self.step(start + rise + hold, rise, -height)

    def sines(self, onset: float, amplitudes: Array, frequencies: Array, phases: Array) -> None:
        """Add sines, frequencies in Hz, that grow to their amplitudes within 2 s from `onset`."""
        self._onset = (onset, 2.0)
        self._sines += zip(
            amplitudes.tolist(), (2.0 * math.pi * frequencies).tolist(), phases.tolist(), strict=True
        )

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return the value and its first and second derivatives at the times `t`, which must ascend."""
        total = np.zeros((3, t.size))
        for start, length, height in self._steps:
            i, j = np.searchsorted(t, (start, start + length))
            total[:, i:j] += height * _smooth_step(t[i:j], start, length)
            total[0, j:] += height
        if self._sines:
            rise, rise_rate, rise_acceleration = _smooth_step(t, *self._onset)
            wave, wave_rate, wave_acceleration = self._waves(t)
            total[0] += rise * wave
            total[1] += rise_rate * wave + rise * wave_rate
            total[2] += rise_acceleration * wave + 2.0 * rise_rate * wave_rate + rise * wave_acceleration
        return total[0], total[1], total[2]

    def _waves(self, t: Array) -> Array:
        total = np.zeros((3, t.size))
        for amplitude, omega, phase in self._sines:
            sine, cosine = amplitude * np.sin(omega * t + phase), amplitude * np.cos(omega * t + phase)
            total += np.stack((sine, omega * cosine, -(omega**2) * sine))
        return total


def _smooth_step(t: Array, start: float, length: float) -> Array:
    """Return (3, n): the unit step and its two derivatives; 0 before it and 1 after it."""
    s = np.clip((t - start) / length, 0.0, 1.0)
    return np.stack(
        (
            s**3 * (10.0 + s * (6.0 * s - 15.0)),
            30.0 * s**2 * (1.0 - s) ** 2 / length,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / length**2,
        )
    )


@dataclass(frozen=True)
class Motion:
    """How the seat moves.

    Attributes
    ----------
    roll, pitch
        The seat's angles against the horizontal, in rad.
    yaw_rate
        Of the car, in rad/s.
    speed
        Of the car, in m/s.
    vibration
        Accelerations along forward, left and up in m/s², in the car's frame.
    arm
        How far above the axis of the tilt the sensor sits, in m.
    """

    roll: Signal = field(default_factory=Signal)
    pitch: Signal = field(default_factory=Signal)
    yaw_rate: Signal = field(default_factory=Signal)
    speed: Signal = field(default_factory=Signal)
    vibration: tuple[Signal, Signal, Signal] = field(default_factory=lambda: (Signal(), Signal(), Signal()))
    arm: float = 0.3


def body_rates(motion: Motion, t: Array) -> Array:
    """Return the angular rate in body axes, (n, 3) in rad/s.

    p = φ̇ - ψ̇ sin θ,  q = θ̇ cos φ + ψ̇ sin φ cos θ,  r = -θ̇ sin φ + ψ̇ cos φ cos θ, which solves
    φ̇ = p + tan θ (q sin φ + r cos φ) and θ̇ = q cos φ - r sin φ.
    """
    (roll, roll_rate, _), (pitch, pitch_rate, _) = motion.roll.at(t), motion.pitch.at(t)
    yaw_rate = motion.yaw_rate.at(t)[0]
    level = yaw_rate * np.cos(pitch)
    return np.column_stack(
        (
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + level * np.sin(roll),
            -pitch_rate * np.sin(roll) + level * np.cos(roll),
        )
    )


def mean_rates(motion: Motion, t: Array, rate: float) -> Array:
    """Return what an integrating gyro reads, (n, 3) in rad/s: the means over the sample intervals that end at `t`."""
    # By Gauss-Legendre quadrature: exact for polynomials up to degree 7.
    nodes, weights = np.polynomial.legendre.leggauss(4)
    instants = (t[:, None] + (nodes - 1.0) / (2.0 * rate)).ravel()
    return np.asarray(np.tensordot(body_rates(motion, instants).reshape(t.size, 4, 3), weights / 2.0, (1, 0)))


def body_accelerations(motion: Motion, t: Array) -> Array:
    """Return the angular acceleration in body axes, (n, 3) in rad/s²: the derivative of `body_rates`."""
    (roll, roll_rate, roll_acceleration), (pitch, pitch_rate, pitch_acceleration) = (
        motion.roll.at(t),
        motion.pitch.at(t),
    )
    yaw_rate, yaw_acceleration, _ = motion.yaw_rate.at(t)
    level = yaw_rate * np.cos(pitch)
    level_rate = yaw_acceleration * np.cos(pitch) - yaw_rate * pitch_rate * np.sin(pitch)
    ahead, aside = pitch_acceleration + level * roll_rate, level_rate - pitch_rate * roll_rate
    return np.column_stack(
        (
            roll_acceleration - yaw_acceleration * np.sin(pitch) - yaw_rate * pitch_rate * np.cos(pitch),
            ahead * np.cos(roll) + aside * np.sin(roll),
            -ahead * np.sin(roll) + aside * np.cos(roll),
        )
    )


def specific_force(motion: Motion, t: Array) -> Array:
    """Return what a perfect accelerometer on the seat reads, (n, 3) in m/s², body axes.

    f = Rᵀ (a + g e_z) + ω̇ × r + ω × (ω × r), with a = (v̇, v ψ̇, 0) and the vibration in the frame that turns with the
    car, R = R_y(θ) R_x(φ) from the body into that frame, and r from the axis of the tilt to the sensor.
    """
    roll, pitch = motion.roll.at(t)[0], motion.pitch.at(t)[0]
    speed, speed_rate, _ = motion.speed.at(t)
    ahead, left, up = (signal.at(t)[0] for signal in motion.vibration)
    ahead = ahead + speed_rate
    left = left + speed * motion.yaw_rate.at(t)[0]
    up = up + GRAVITY
    tilted = ahead * np.sin(pitch) + up * np.cos(pitch)
    force = np.column_stack(
        (
            ahead * np.cos(pitch) - up * np.sin(pitch),
            left * np.cos(roll) + tilted * np.sin(roll),
            -left * np.sin(roll) + tilted * np.cos(roll),
        )
    )
    arm = np.array([0.0, 0.0, motion.arm])
    rates = body_rates(motion, t)
    return force + np.cross(body_accelerations(motion, t), arm) + np.cross(rates, np.cross(rates, arm))
