"""Noise of gravity, angles and rates on the cube at rest, against gains and closed forms."""

import numpy as np

import compfilt as cf
from compfilt.motion import GRAVITY
from corner_cube import ARRAY, OPERATING_POINT
from corner_filters import TAU
from corner_gravity import forces
from corner_motion import FS, stand
from corner_sensors import ACCELEROMETER_NOISE, GYRO_NOISE, NOISE, SEED, Readings, read
from corner_tables import Array, Table, rms

HALL_NOISE = 0.5
"""Of a wheel's rate, in rad/s a sample."""


def noise() -> Table:
    """Compare the noise of the cube at rest with what the library's gains and closed forms say, RMS over the axes."""
    still, sigma = stand(), ACCELEROMETER_NOISE
    readings = read(still, NOISE)
    found = forces(readings) | {"array, rate known exactly": ARRAY.gravity(readings.acc, still.rate)}
    gains = {
        "one sensor, 202 mm from the pivot": np.ones(3),
        "mean of the four channels": np.full(3, 0.5),
        "array, rate unknown": ARRAY.noise_gain,
        "array, rate known exactly": ARRAY.noise_gain_with_gyro,
    }
    table = {f"{way} / σ": compare(gain, found[way] / sigma) for way, gain in gains.items()}
    acceleration = ARRAY.angular_acceleration(readings.acc)
    angles = np.degrees(cf.tilt(found["array, rate unknown"], axes="cube"))
    spread = np.degrees(sigma / GRAVITY) * ARRAY.noise_gain[0]  # the gain is the same along all three axes
    lever = np.cos(OPERATING_POINT[0])
    return {
        **table,
        "angular acceleration / (σ/m)": compare(ARRAY.angular_acceleration_noise_gain, acceleration / sigma),
        "φ2 by the array / deg": compare(spread, angles[:, 0]),
        "φ3 by the array / deg": compare(spread / lever, angles[:, 1]),
        **wheel_noise(readings),
    }


def compare(predicted: Array | float, signal: Array) -> dict[str, float | str]:
    """Return a predicted standard deviation and that of a signal."""
    return {"predicted": rms(predicted), "measured": rms(np.std(signal, axis=0))}


def wheel_noise(readings: Readings) -> Table:
    """Return the noise of u_K and u_R, (1.4) and (1.5), with the wheels at 200 rad/s."""
    wheel = 200.0 + np.random.default_rng(SEED).normal(0.0, HALL_NOISE, (readings.gyr.shape[0], 3))
    cube = cf.Cube(ARRAY, cf.FirstOrder(TAU)).estimate(*readings, wheel, fs=FS)
    both = np.hypot(GYRO_NOISE / np.sqrt(6.0), HALL_NOISE)
    return {
        "u_K, mean of six gyros / one gyro's": compare(1.0 / np.sqrt(6.0), cube.body_rate / GYRO_NOISE),
        "u_R = u_K + ψ̇ / (rad/s)": compare(both, cube.wheel_rate),
    }
