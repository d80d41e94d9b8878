"""Logs whose truth is known: a child seat in a moving car, seen by a cheap inertial sensor.

References
----------
The setting follows Iontchev et al., who filter the roll of a tilting child seat: first deflected by hand and held on one
side and on the other, then on the road.
"""

import math
from dataclasses import dataclass

import numpy as np

from compfilt.motion import GRAVITY, Array, Motion, mean_rates, specific_force
from compfilt.simulate.length import samples_in

__all__ = ["SensorErrors", "child_seat", "measure", "seat_motion", "static_length"]

LONGEST = 1e6
"""Seconds of a drive: every manoeuvre is drawn before the first sample."""


@dataclass(frozen=True)
class SensorErrors:
    """The errors of a cheap inertial sensor.

    Attributes
    ----------
    gyro_noise
        One-sided density in (deg/s)/√Hz.
    gyro_bias
        Largest bias at the start, in deg/s; each axis has between half of it and all of it.
    gyro_walk
        Random walk of the bias, in deg/s per √s.
    accelerometer_noise
        One-sided density in g/√Hz.
    accelerometer_bias
        Largest bias in g; each axis has between half of it and all of it.
    gyro_decimals, accelerometer_decimals
        How many decimals of a deg/s and of a g the logger writes; None for all.
    """

    gyro_noise: float = 0.01
    gyro_bias: float = 1.0
    gyro_walk: float = 0.005
    accelerometer_noise: float = 300e-6
    accelerometer_bias: float = 0.004
    gyro_decimals: int | None = 2
    accelerometer_decimals: int | None = 4

    @classmethod
    def none(cls) -> "SensorErrors":
        """Return a perfect sensor."""
        return cls(0.0, 0.0, 0.0, 0.0, 0.0, None, None)


def child_seat(
    *, duration: float = 150.0, rate: float = 100.0, seed: int = 0, errors: SensorErrors | None = None
) -> dict[str, Array]:
    """Simulate a log of the child seat.

    The first 40 %, at most 60 s, is the static test: level, held at one side, at the other, level. Then the car
    drives: it speeds up, turns, changes lanes and brakes, the road shakes the seat, and the seat leans into the turns
    and now and then of its own.

    Parameters
    ----------
    duration
        Length of the log in seconds.
    rate
        Samples per second. The gyro's sample is the mean rate over the interval that ends with it, as an integrating
        sensor gives; the accelerometer's is the value at the instant.
    seed
        The same seed gives the same log.
    errors
        The sensor's errors; those of a cheap one by default.

    Returns
    -------
    dict of str to ndarray
        Columns of one length: ``t`` in s, ``ax ay az`` in g, ``gx gy gz`` in deg/s, ``true_roll true_pitch`` in deg.

    Raises
    ------
    ValueError
        `duration` or `rate` is not positive and finite, the drive is longer than 1e6 s, or the log would hold no sample.

    Examples
    --------
    >>> log = child_seat(duration=10.0, rate=50.0, seed=1)
    >>> len(log["t"]), bool(abs(log["true_roll"]).max() > 15.0)
    (500, True)
    """
    samples = samples_in(duration, rate)
    rng = np.random.default_rng(seed)
    motion = seat_motion(duration, rng)
    t = np.arange(samples) / rate
    columns = {"t": np.round(t, 9)}
    measured = measure(motion, t, rate, errors or SensorErrors(), rng)
    columns |= {name: measured[:, i] for i, name in enumerate(("ax", "ay", "az", "gx", "gy", "gz"))}
    for name, angle in (("true_roll", motion.roll), ("true_pitch", motion.pitch)):
        columns[name] = np.round(angle.at(t)[0] * (180.0 / math.pi), 4)
    return columns


def static_length(duration: float) -> float:
    """Return how long the static test lasts in a log of that length, in seconds."""
    return min(60.0, 0.4 * duration)


def seat_motion(duration: float, rng: np.random.Generator) -> Motion:
    """Draw one drive with its static test before it."""
    if duration > LONGEST:
        raise ValueError(f"duration of a drive must be at most {LONGEST:g} s, not {duration:g}")
    motion = Motion()
    start = static_length(duration)
    _static_test(motion, start)
    _drive(motion, start, duration, rng)
    lean, count = math.radians(0.15), 3
    for angle in (motion.roll, motion.pitch):
        angle.sines(
            start, np.full(count, lean), rng.uniform(0.8, 2.5, count), rng.uniform(0.0, 2.0 * math.pi, count)
        )
    for signal, strength in zip(motion.vibration, (0.15, 0.2, 0.35), strict=True):
        count = 12
        amplitudes = strength * rng.uniform(0.5, 1.5, count) * math.sqrt(2.0 / count)
        signal.sines(start, amplitudes, rng.uniform(4.0, 25.0, count), rng.uniform(0.0, 2.0 * math.pi, count))
    return motion


def _static_test(motion: Motion, length: float) -> None:
    """Deflect the seat to one side, hold it, then to the other; the seat is mounted 4° nose up."""
    held, move = math.radians(20.0), min(1.5, length / 15.0)
    motion.pitch.step(-2.0, 1.0, math.radians(-4.0))
    for moment, change in ((0.2, held), (0.45, -2.0 * held), (0.75, held)):
        motion.roll.step(moment * length, move, change)


def _drive(motion: Motion, start: float, end: float, rng: np.random.Generator) -> None:
    """Draw the manoeuvres from `start` to `end`, one after the other."""
    speed = 14.0
    motion.speed.step(start + 1.0, 8.0, speed)
    motion.pitch.pulse(start + 1.2, 1.5, 5.0, math.radians(-1.5))
    now = start + 10.0
    while now < end:
        kind = rng.choice(["turn", "lane", "speed", "lean"], p=[0.4, 0.15, 0.25, 0.2])
        side = rng.choice([-1.0, 1.0])
        if kind == "turn":
            now += _turn(motion, now, side * rng.uniform(1.5, 3.5) / speed, speed, rng.uniform(1.5, 5.0))
        elif kind == "lane":
            now += _turn(motion, now, side * 1.5 / speed, speed, 0.3)
            now += _turn(motion, now, -side * 1.5 / speed, speed, 0.3)
        elif kind == "speed":
            change = rng.uniform(3.0, 7.0) * (1.0 if speed < 9.0 else -1.0 if speed > 15.0 else side)
            lasts = abs(change) / 1.6
            motion.speed.step(now, lasts, change)
            # Braking pitches the seat nose down, which is positive in these axes.
            motion.pitch.pulse(now + 0.2, 0.4 * lasts, 0.2 * lasts, math.radians(-0.3) * change)
            speed, now = speed + change, now + lasts
        else:
            motion.roll.pulse(now, 0.8, rng.uniform(1.0, 3.0), side * math.radians(rng.uniform(4.0, 10.0)))
            now += 3.0
        now += rng.uniform(0.5, 3.0)


def _turn(motion: Motion, now: float, yaw_rate: float, speed: float, hold: float) -> float:
    """Add a turn and the seat's lean into it, a little later; return how long the turn takes."""
    ramp = 1.2
    motion.yaw_rate.pulse(now, ramp, hold, yaw_rate)
    # Half of the lean that would make the passenger feel no side force.
    motion.roll.pulse(now + 0.4, ramp, hold, -0.5 * math.atan(speed * yaw_rate / GRAVITY))
    return 2.0 * ramp + hold


def measure(motion: Motion, t: Array, rate: float, errors: SensorErrors, rng: np.random.Generator) -> Array:
    """Return what the sensor logs, (n, 6): the accelerometer in g, then the gyro in deg/s."""
    gyro = np.degrees(mean_rates(motion, t, rate))
    accelerometer = specific_force(motion, t) / GRAVITY
    bandwidth = math.sqrt(rate / 2.0)
    walk = rng.normal(0.0, errors.gyro_walk / math.sqrt(rate), (t.size, 3)).cumsum(axis=0)
    gyro += _bias(errors.gyro_bias, rng) + walk + rng.normal(0.0, errors.gyro_noise * bandwidth, (t.size, 3))
    accelerometer += _bias(errors.accelerometer_bias, rng)
    accelerometer += rng.normal(0.0, errors.accelerometer_noise * bandwidth, (t.size, 3))
    if errors.gyro_decimals is not None:
        gyro = np.round(gyro, errors.gyro_decimals)
    if errors.accelerometer_decimals is not None:
        accelerometer = np.round(accelerometer, errors.accelerometer_decimals)
    return np.concatenate((accelerometer, gyro), axis=1)


def _bias(largest: float, rng: np.random.Generator) -> Array:
    """Draw a bias for each axis: either sign, between half of the largest and all of it."""
    size, sign = rng.uniform(0.5, 1.0, 3), rng.choice([-1.0, 1.0], 3)
    return np.asarray(largest * size * sign)
