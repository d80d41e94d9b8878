"""§1.2 and 1.5: the filters of the angle and of the rate, as derived and as printed."""

import numpy as np

import compfilt as cf
from cube_filter_tables import Array, Table, rms_degrees
from swinging_cube import ALPHA, FS, TAU, Swing, T


def checks(swing: Swing) -> Table:
    """Return by how much the library differs from the plain loops, relative to the signal."""
    rng = np.random.default_rng(0)
    measured = swing.angle + rng.normal(0.0, 0.05, swing.t.size)
    library = cf.FirstOrder(TAU).filter(measured, swing.rate, fs=FS, initial=measured[0])
    rate = cf.RateFilter(TAU).filter(swing.rate, swing.acceleration, fs=FS, initial=0.0)
    (low, high) = cf.FirstOrder(TAU).frequency_response(np.geomspace(1e-2, 1e2, 200))

    def difference(a: Array, b: Array) -> dict[str, float]:
        return {"largest relative difference": float(np.max(abs(a - b)) / np.max(abs(b)))}

    return {
        "cf.FirstOrder, (12)": difference(library, angle_loop(measured, swing.rate)),
        "cf.RateFilter, (30)": difference(rate, rate_loop(swing.rate, swing.acceleration)),
        "LP + HP, 1": difference(low + high, np.ones(low.size)),
    }


def angle_loop(measured: Array, gyro: Array) -> Array:
    """(12), from the first measured angle."""
    angle, last = np.empty(measured.size), measured[0]
    for n in range(measured.size):
        last = angle[n] = ALPHA * (last + T * gyro[n]) + (1.0 - ALPHA) * measured[n]
    return angle


def rate_loop(gyro: Array, acceleration: Array, *, sign: float = -1.0, gain: float = 1.0 - ALPHA) -> Array:
    """(30), from rest; with `sign` = +1 it is (29) as printed, with another `gain` (26)."""
    rate, last, before, integral = np.empty(gyro.size), 0.0, 0.0, 0.0
    for n in range(gyro.size):
        integral += T * acceleration[n]
        last = rate[n] = ALPHA * last + ALPHA * (gyro[n] + sign * before) + gain * integral
        before = gyro[n]
    return rate


GYRO_BIAS, GYRO_NOISE = np.radians(0.5), np.radians(0.1)
ACCELERATION_BIAS, ACCELERATION_NOISE = 0.05, 0.1


def rate_sensors(swing: Swing) -> dict[str, tuple[Array, Array]]:
    """Return gyro in rad/s and angular acceleration in rad/s² with more and more of the sensors' errors."""
    rng = np.random.default_rng(1)
    gyro = swing.rate + GYRO_BIAS + rng.normal(0.0, GYRO_NOISE, swing.t.size)
    noisy = swing.acceleration + rng.normal(0.0, ACCELERATION_NOISE, swing.t.size)
    return {
        "none / (deg/s)": (swing.rate, swing.acceleration),
        "gyro / (deg/s)": (gyro, swing.acceleration),
        "+ noise / (deg/s)": (gyro, noisy),
        "+ bias / (deg/s)": (gyro, noisy + ACCELERATION_BIAS),
    }


def rate_answers(gyro: Array, acceleration: Array) -> dict[str, Array]:
    """Return the rate by every filter, in rad/s."""
    start = {"fs": FS, "initial": 0.0}
    return {
        "gyro alone": gyro,
        "acceleration integrated": np.cumsum(acceleration) * T,
        "(30), cf.RateFilter": cf.RateFilter(TAU).filter(gyro, acceleration, **start),
        "(29) as printed": rate_loop(gyro, acceleration, sign=1.0),
        "(26) as printed": rate_loop(gyro, acceleration, gain=(1.0 - ALPHA) ** 2),
        "drift-free, cf.FirstOrder": cf.FirstOrder(TAU).filter(gyro, acceleration, **start),
        "drift-free, cf.PiForm": cf.PiForm(2.0 / TAU, 1.0 / TAU**2).filter(gyro, acceleration, **start),
    }


def rates(swing: Swing) -> Table:
    """Return the RMS error of the rate after the first 10 s, in deg/s."""
    late = swing.t >= 10.0
    table: Table = {}
    for errors, sensors in rate_sensors(swing).items():
        for answer, rate in rate_answers(*sensors).items():
            table.setdefault(answer, {})[errors] = rms_degrees((rate - swing.rate)[late])
    return table


def left_of_bias(t: Array) -> Array:
    """Return what a bias of the angular acceleration leaves in (30), in rad/s: a ramp behind the low-pass."""
    return ACCELERATION_BIAS * (t - TAU + TAU * np.exp(-t / TAU))
