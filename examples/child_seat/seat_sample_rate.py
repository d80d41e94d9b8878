"""The paper's gains at other sample rates: which filter shows more of the short deviations."""

from typing import NamedTuple

import numpy as np

import compfilt as cf
from seat_errors import rms
from seat_filters import PAPER_PI, A, tilt_filter
from seat_log import Array, simulate


class AtRate(NamedTuple):
    """The paper's gains on the road at one sample rate: RMS values in deg."""

    rate: float
    tau: float
    first_order: float  # error
    pi: float  # error
    difference: float
    short: dict[str, float]  # what is shorter than a second, in each answer


def at_rate(rate: float) -> AtRate:
    """Run the paper's gains on the same drive, logged at another rate."""
    log = simulate(seed=0, rate=rate)
    tau = cf.alpha_to_tau(A, rate)
    rolls = {
        "truth": log.roll,
        "acc.": cf.tilt(log.acc)[:, 0],
        "(9)": tilt_filter(cf.FirstOrder(tau), log),
        "(11)": tilt_filter(PAPER_PI, log),
    }
    road = log.driving
    return AtRate(
        rate,
        tau,
        rms((rolls["(9)"] - log.roll)[road]),
        rms((rolls["(11)"] - log.roll)[road]),
        rms((rolls["(9)"] - rolls["(11)"])[road]),
        {name: rms(short_term(roll[road], rate)) for name, roll in rolls.items()},
    )


def short_term(roll: Array, rate: float) -> Array:
    """Return roll without its mean over the second around each sample."""
    width = round(rate) | 1
    return roll[width // 2 : -(width // 2)] - np.convolve(roll, np.full(width, 1.0 / width), "valid")
