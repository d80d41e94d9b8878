"""The linear filters by others: loops compiled by numba, and scipy.signal.lfilter."""

from typing import Any

import numba
import numpy as np
from scipy.signal import lfilter, ss2tf

import compfilt as cf
from timing import Call, Signal

Gains = tuple[Any, ...]


@numba.njit
def first_order(y: Signal, u: Signal, out: Signal, shifts: Gains, gains: Gains) -> None:
    """Predict and correct."""
    x = y[0]
    for n in range(y.size):
        x += shifts[0] * u[n]
        x += gains[0] * (y[n] - x)
        out[n] = x


@numba.njit
def pi(y: Signal, u: Signal, out: Signal, shifts: Gains, gains: Gains) -> None:
    """The same with the bias of the input."""
    dt = shifts[0]
    x0, x1 = y[0], y[0] * 0
    for n in range(y.size):
        x0 += dt * (x1 + u[n])
        innovation = y[n] - x0
        x0 += gains[0] * innovation
        x1 += gains[1] * innovation
        out[n] = x0


@numba.njit
def split_1_of_2(y: Signal, u: Signal, out: Signal, shifts: Gains, gains: Gains) -> None:
    """The level above decays by itself."""
    dt, damping = shifts
    x0, x1 = y[0], y[0] * 0
    for n in range(y.size):
        x1 *= damping
        x0 += dt * (x1 + u[n])
        innovation = y[n] - x0
        x0 += gains[0] * innovation
        x1 += gains[1] * innovation
        out[n] = x0


@numba.njit
def butterworth_4(y: Signal, u: Signal, out: Signal, shifts: Gains, gains: Gains) -> None:
    """A chain of four integrators, fed at the first."""
    d1, d2, d3, _ = shifts
    x0, x1, x2, x3 = y[0], y[0] * 0, y[0] * 0, y[0] * 0
    for n in range(y.size):
        x0 += d1 * (u[n] + x1) + d2 * x2 + d3 * x3
        x1 += d1 * x2 + d2 * x3
        x2 += d1 * x3
        innovation = y[n] - x0
        x0 += gains[0] * innovation
        x1 += gains[1] * innovation
        x2 += gains[2] * innovation
        x3 += gains[3] * innovation
        out[n] = x0


@numba.njit
def third_order(y: Signal, u: Signal, out: Signal, shifts: Gains, gains: Gains) -> None:
    """A chain of three integrators, fed at the second."""
    d1, d2, _ = shifts
    x0, x1, x2 = y[0], y[0] * 0, y[0] * 0
    for n in range(y.size):
        x0 += d1 * x1 + d2 * (u[n] + x2)
        x1 += d1 * (u[n] + x2)
        innovation = y[n] - x0
        x0 += gains[0] * innovation
        x1 += gains[1] * innovation
        x2 += gains[2] * innovation
        out[n] = x0


LOOPS = {
    "first order": first_order,
    "PI": pi,
    "Butterworth 2, split 1": split_1_of_2,
    "Butterworth 4": butterworth_4,
    "third order": third_order,
}


def levels_after(design: cf.LinearFilter, fs: float, before: Signal, *, y: float | None, u: float) -> Signal:
    """The levels that one step of the filter makes of others; without y it is predicted only."""
    stream = design.stream(fs=fs, initial=before)
    if y is None:
        stream.predict(u)
    else:
        stream.update(y, u)
    return stream.state.levels[:, 0]


def numba_loop(name: str, design: cf.LinearFilter, fs: float, signals: tuple[Signal, Signal, Signal]) -> Call:
    """The loop with the gains of the design, which are what a step from rest makes of a measurement of 1."""
    y, u, out = signals
    rest = np.zeros(design.order)
    shifts = 1 / fs ** np.arange(1, design.order + 1)
    if design.split != design.order:
        shifts[1] = levels_after(design, fs, np.eye(design.order)[1], y=None, u=0.0)[1]
    gains = levels_after(design, fs, rest, y=1.0, u=0.0)
    loop = LOOPS[name]
    arguments = y, u, out, tuple(shifts.astype(y.dtype)), tuple(gains.astype(y.dtype))
    return lambda: loop(*arguments)


def two_lfilters(design: cf.LinearFilter, fs: float, signals: tuple[Signal, Signal, Signal]) -> Call:
    """One lfilter for each branch, and a sum. The coefficients are those of the filter's own step."""
    y, u, out = signals
    rest, unit = np.zeros(design.order), np.eye(design.order)
    A = np.column_stack([levels_after(design, fs, level, y=0.0, u=0.0) for level in unit])
    B = np.column_stack(
        [
            levels_after(design, fs, rest, y=1.0, u=0.0),
            levels_after(design, fs, rest, y=0.0, u=1.0),
        ]
    )
    branches = [ss2tf(A, B, A[:1], B[:1], input=i) for i in range(2)]
    (low, below), (high, _) = ((b[0].astype(y.dtype), a.astype(y.dtype)) for b, a in branches)
    return lambda: np.add(lfilter(low, below, y), lfilter(high, below, u), out=out)
