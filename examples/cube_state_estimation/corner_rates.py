"""S0 §1.5: the rate from gyros and from the array's angular acceleration."""

import itertools

import numpy as np

import compfilt as cf
from corner_cube import ARRAY, ROTATIONS
from corner_motion import FS, LATE, Swing, T, stand
from corner_sensors import BIASED, GYRO_BIASED, NOISE, PERFECT, VIBRATING, Errors, Readings, read
from corner_tables import Array, Table, rms

RATE_TAU, SHORT_TAU = 0.1, 0.005
RATE_TAUS = np.array([0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
"""Where the error of the rate is looked at over tau, in s."""


def mean_acceleration(readings: Readings) -> Array:
    """Return the array's angular acceleration as the mean over each sample period, (n, 3) in rad/s²."""
    acceleration = ARRAY.angular_acceleration(readings.acc)
    return 0.5 * (acceleration + np.concatenate((acceleration[:1], acceleration[:-1])))


def rate_answers(readings: Readings) -> dict[str, Array]:
    """Return u_K by every way, (n, 3) in rad/s."""
    one, mean = readings.gyr[:, 0] @ ROTATIONS[0], ARRAY.body_rate(readings.gyr)
    acceleration = mean_acceleration(readings)
    fused, short = cf.RateFilter(RATE_TAU), cf.RateFilter(SHORT_TAU)
    start = {"fs": FS, "initial": 0.0}
    return {
        "one gyro": one,
        "mean of six gyros": mean,
        "array's acceleration, integrated": np.cumsum(acceleration, axis=0) * T,
        "S0 (30): mean and array, 0.1 s": fused.filter(mean, acceleration, **start),
        "drift-free: mean and array, 0.1 s": fused.drift_free.filter(mean, acceleration, **start),
        "drift-free: mean and array, 5 ms": short.drift_free.filter(mean, acceleration, **start),
        "drift-free: one and array, 5 ms": short.drift_free.filter(one, acceleration, **start),
    }


def rates(far: Swing) -> Table:
    """Return the RMS error of the rate over the axes with more and more of the sensors' errors, in deg/s."""
    late = far.t >= LATE
    table: Table = {}
    for name, errors in {
        "perfect": PERFECT,
        "noise": NOISE,
        "+ gyro bias": GYRO_BIASED,
        "+ vibration": VIBRATING,
        "+ acc. bias": BIASED,
    }.items():
        for way, rate in rate_answers(read(far, errors)).items():
            table.setdefault(way, {})[f"{name} / (deg/s)"] = float(np.degrees(rms((rate - far.rate)[late])))
    return table


def rate_taus(far: Swing) -> Table:
    """Return the RMS error of the drift-free rate over its time constant, without biases, in deg/s."""
    late = far.t >= LATE
    table: Table = {}
    for name, errors in {"noise": NOISE, "+ vibration": Errors(noise=1.0, vibration=1.0)}.items():
        readings = read(far, errors)
        acceleration = mean_acceleration(readings)
        gyros = {"one": readings.gyr[:, 0] @ ROTATIONS[0], "mean": ARRAY.body_rate(readings.gyr)}
        for tau, (which, gyro) in itertools.product(RATE_TAUS, gyros.items()):
            rate = cf.RateFilter(tau).drift_free.filter(gyro, acceleration, fs=FS, initial=0.0)
            row = table.setdefault(f"tau = {1e3 * tau:g} ms", {})
            row[f"{which}, {name} / (deg/s)"] = float(np.degrees(rms((rate - far.rate)[late])))
    return table


def bias_of_the_array() -> Array:
    """Return the constant error β of the angular acceleration that the accelerometers' biases make, in rad/s²."""
    still = stand()
    return ARRAY.angular_acceleration(read(still, Errors(accelerometer_bias=1.0)).acc[:1])[0]
