"""The answers that are compared: each sensor alone, and both filters with the paper's gains and with better ones."""

import numpy as np

import compfilt as cf
from compfilt.motion import GRAVITY
from seat_log import RATE, Array, Log

A = 0.8  # the paper's weight of the gyro in (9)
PAPER_PI = cf.PiForm(kp=20.0, ki=10.0)  # the paper's gains in (11)

# Those of examples/demo, which choose_gains.py there found on the drives of seeds 1 to 8.
BETTER_FIRST_ORDER = cf.FirstOrder(tau=2.8)
BETTER_PI = cf.PiForm(kp=0.1, ki=0.005)

GYRO, ACCELEROMETER = "gyro alone", "accelerometer alone"
NINE, ELEVEN = "(9), a = 0.8", "(11), K_P = 20, K_I = 10"
BETTER_NINE, BETTER_ELEVEN = "(9), tau = 2.8 s", "(11), K_P = 0.1, K_I = 0.005"


def answers(log: Log) -> dict[str, Array]:
    """Return roll in rad by each sensor alone and by both filters, with the paper's gains and with better ones."""
    first_order = cf.FirstOrder(cf.alpha_to_tau(A, RATE))
    return {
        # A time constant of thirty years leaves the gyro, from the first angle of the accelerometer on.
        GYRO: tilt_filter(cf.FirstOrder(1e9), log),
        ACCELEROMETER: cf.tilt(log.acc)[:, 0],
        "the same by (6), (7)": printed_roll(log.acc),
        NINE: tilt_filter(first_order, log),
        ELEVEN: tilt_filter(PAPER_PI, log),
        BETTER_NINE: tilt_filter(BETTER_FIRST_ORDER, log),
        BETTER_ELEVEN: tilt_filter(BETTER_PI, log),
        "(9), tau = 2.8 s, gx as it is": unconverted(BETTER_FIRST_ORDER, log),
        "(11), K_P = 0.1, K_I = 0.005, gx as it is": unconverted(BETTER_PI, log),
    }


def tilt_filter(design: cf.LinearFilter, log: Log) -> Array:
    """Filter with the body rates converted at the filter's own angles, as the paper demands; return roll."""
    return cf.TiltFilter(design).estimate(log.gyr, log.acc, t=log.t).roll


def unconverted(design: cf.LinearFilter, log: Log) -> Array:
    """Filter roll with the rate about the forward axis of the body in place of the rate of roll."""
    return design.filter(cf.tilt(log.acc)[:, 0], log.gyr[:, 0], t=log.t)


def printed_roll(acc: Array) -> Array:
    """Return roll by the paper's (6) and (7), in axes forward, left, up."""
    ahead, left = acc[:, 0] / GRAVITY, acc[:, 1] / GRAVITY
    return np.asarray(np.arcsin(left / np.cos(np.arcsin(-ahead))))
