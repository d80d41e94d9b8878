"""A cube that swings about its edge, and the filter's sample rate and time constant."""

from typing import NamedTuple

import numpy as np

import compfilt as cf
from compfilt.motion import Signal
from cube_filter_tables import Array

FS = 100.0
T = 1.0 / FS
ALPHA = 0.98
TAU = cf.alpha_to_tau(ALPHA, FS)


class Swing(NamedTuple):
    """A cube that is lifted from its side and swings about its edge, as perfect sensors see it."""

    t: Array
    angle: Array
    """rad, at the samples."""
    rate: Array
    """rad/s, mean over the period that ends at the sample, as an integrating gyro delivers it."""
    acceleration: Array
    """rad/s², the change of `rate` over that period."""


def swing_of_the_edge() -> Swing:
    """Return 30 s of the motion; it starts at rest on the side, at -45°."""
    angle = Signal()
    angle.step(start=1.0, length=1.0, height=np.pi / 4)
    angle.sines(3.0, np.radians([8.0, 4.0, 2.0]), np.array([0.35, 0.8, 1.3]), np.array([0.0, 1.0, 2.0]))
    t = np.arange(-2, round(30.0 * FS)) * T
    value = angle.at(t)[0] - np.pi / 4
    rate = np.diff(value) / T
    return Swing(t[2:], value[2:], rate[1:], np.diff(rate) / T)
