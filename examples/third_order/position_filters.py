"""Position, velocity and bias from GPS and accelerometer by filters of every order."""

from typing import NamedTuple

import numpy as np

import compfilt as cf
from figure_of_eight import BIAS, FS, GPS_DELAY, GPS_PERIOD, Drive, T, sensors
from third_order_tables import Array, Table

TAU = 4.0

LATE = 40.0
"""The errors are counted from here on, in s."""


class Answer(NamedTuple):
    """Position, velocity and bias by one filter, (n, 2); NaN where it has none."""

    position: Array
    velocity: Array
    bias: Array


def answers(drive: Drive) -> dict[str, Answer]:
    """Return what every filter makes of the same sensors."""
    gps, acceleration = sensors(drive)
    third, second = cf.ThirdOrder(TAU), cf.SecondOrderInertial(TAU)
    return {
        "GPS held": held(gps),
        "integrated twice": integrated(drive, acceleration),
        "second order": answer(second, gps, acceleration, GPS_DELAY),
        "third order, delay not told": answer(third, gps, acceleration, 0.0),
        "third order": answer(third, gps, acceleration, GPS_DELAY),
    }


def answer(design: cf.LinearFilter, gps: Array, acceleration: Array, delay: float) -> Answer:
    """Run one of the library's filters."""
    estimate = design.estimate(gps, acceleration, fs=FS, delay=delay)
    bias = estimate.bias if design.order == 3 else np.full(gps.shape, np.nan)
    return Answer(estimate.position, estimate.velocity, bias)


def held(gps: Array) -> Answer:
    """Hold the last fix, and as velocity the difference of the last two."""
    fixes = np.flatnonzero(np.isfinite(gps[:, 0]))
    velocity = np.diff(gps[fixes], axis=0, prepend=gps[fixes[:1]]) / GPS_PERIOD
    last = np.searchsorted(fixes, np.arange(gps.shape[0]), side="right") - 1
    known = (last >= 0)[:, None]
    missing = np.full(gps.shape, np.nan)
    return Answer(np.where(known, gps[fixes][last], np.nan), np.where(known, velocity[last], np.nan), missing)


def integrated(drive: Drive, acceleration: Array) -> Answer:
    """Integrate twice from the true start."""
    velocity = drive.velocity[0] + T * np.cumsum(acceleration, axis=0)
    position = drive.position[0] + T * np.cumsum(velocity, axis=0)
    return Answer(position, velocity, np.full(velocity.shape, np.nan))


def position(drive: Drive) -> Table:
    """Return RMS errors in the plane after the start."""
    return {name: errors(drive, each) for name, each in answers(drive).items()}


def errors(drive: Drive, found: Answer) -> dict[str, float]:
    """Return RMS errors in the plane; of a bias also after what time it stays within a fifth."""
    late = drive.t >= LATE
    row = {
        "position / m": rms(found.position[late] - drive.position[late]),
        "velocity / (m/s)": rms(found.velocity[late] - drive.velocity[late]),
    }
    off = np.linalg.norm(found.bias - BIAS, axis=1)
    if np.isfinite(off[-1]):
        row["bias / (m/s²)"] = rms(found.bias[late] - BIAS)
        inside = off <= 0.2 * np.linalg.norm(BIAS)
        row["bias within 20 % from / s"] = (
            float(drive.t[np.flatnonzero(~inside)[-1] + 1]) if inside[-1] else np.nan
        )
    return row


def rms(error: Array) -> float:
    """Return the root mean square of the length of a vector."""
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def bias_rise(x: Array) -> Array:
    """Return the share of a bias that the filter has found after x time constants: three lags in a row."""
    return 1.0 - np.exp(-x) * (1.0 + x + x**2 / 2.0)


def bias_found() -> Table:
    """Compare the estimate of a bias, all else perfect and at rest, with the closed form."""
    x = np.array([1.0, 2.0, 4.0, 6.0, 8.0])
    still = np.zeros(round(10.0 * TAU * FS))
    estimate = cf.ThirdOrder(TAU).estimate(still, np.ones(still.size), fs=FS, initial=0.0)
    seen = estimate.bias[np.round(x * TAU * FS).astype(int) - 1]
    return {
        f"after {each:g} tau": {"share found": float(share), "closed form": float(exact)}
        for each, share, exact in zip(x, seen, bias_rise(x), strict=True)
    }


def taus(drive: Drive) -> Table:
    """Return the error in position over the time constant."""
    gps, acceleration = sensors(drive)
    return {
        f"tau = {tau:g} s": {
            f"{name} / m": errors(drive, answer(kind(tau), gps, acceleration, delay))["position / m"]
            for name, kind, delay in (
                ("second order", cf.SecondOrderInertial, GPS_DELAY),
                ("delay not told", cf.ThirdOrder, 0.0),
                ("third order", cf.ThirdOrder, GPS_DELAY),
            )
        }
        for tau in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
    }
