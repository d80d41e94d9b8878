"""Estimators of the tilt with the regulator's gain, at work and as linear systems."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

import compfilt as cf
from compfilt.design import luenberger, observer_poles
from edge_cube import ACCELEROMETER, RATE, TILT, WHEEL, Array, T


class Compensator(NamedTuple):
    """What lies between the readings y and the current u, as a linear system: z⁺ = F z + G y, u = H z + D y."""

    F: Array
    G: Array
    H: Array
    D: Array


class Running(Protocol):
    """An estimator at work."""

    def estimate(self, y: Array) -> Array:
        """Return what the regulator multiplies with its gain."""

    def advance(self, current: float) -> None:
        """Go on to the next sample."""


class Scheme(NamedTuple):
    """An estimator with the regulator's gain, at work and as a linear system; the poles if it is an observer."""

    gain: Array
    start: Callable[[], Running]
    compensator: Compensator
    poles: npt.NDArray[np.complex128] = np.empty(0, dtype=complex)


class Known:
    """The tilt is known, the rates are measured."""

    def estimate(self, y: Array) -> Array:
        """Return φ, u_K, u_R."""
        return y.take((TILT, RATE, WHEEL))

    def advance(self, current: float) -> None:
        """Do nothing."""


class Fused:
    """The tilt comes from a complementary filter."""

    def __init__(self, design: cf.LinearFilter) -> None:
        self._filter = design.stream(fs=1.0 / T, initial=0.0)

    def estimate(self, y: Array) -> Array:
        """Return φ, u_K, u_R."""
        return np.array((self._filter.update(y[ACCELEROMETER], y[RATE]), y[RATE], y[WHEEL]))

    def advance(self, current: float) -> None:
        """Do nothing."""


class Observed:
    """All states come from an observer."""

    def __init__(self, observer: cf.Observer, rows: Sequence[int], *, filtered: bool) -> None:
        self._stream = observer.stream()
        self._rows = list(rows)
        self._filtered = filtered
        self._predicted = np.zeros(len(observer.A))

    def estimate(self, y: Array) -> Array:
        """Return the states after, or before, the correction with the readings."""
        corrected = self._stream.correct(y[self._rows])
        return corrected if self._filtered else self._predicted

    def advance(self, current: float) -> None:
        """Predict with the current that flows until the next sample."""
        self._predicted = self._stream.predict([current])


def known(gain: Array) -> Scheme:
    """Regulate with the true tilt."""
    D = np.zeros((1, 5))
    D[:, [TILT, RATE, WHEEL]] = -gain
    return Scheme(gain, Known, Compensator(np.zeros((0, 0)), np.zeros((0, 5)), np.zeros((1, 0)), D))


def fused(gain: Array, design: cf.LinearFilter) -> Scheme:
    """Regulate with the tilt of a complementary filter; as a linear system: the backward Euler rule of order 1 or 2."""
    k1, k2 = (*design.coefficients, 0.0)[:2]
    L = np.array([[T * (k1 + T * k2)], [T * k2]]) / (1.0 + T * (k1 + T * k2))
    A, C = np.array([[1.0, T], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    F, G = A - L @ C @ A, np.zeros((2, 5))
    G[:, [ACCELEROMETER]] = L
    G[:, [RATE]] = T * (np.eye(2) - L @ C) @ np.eye(2, 1)
    D = -gain[:, :1] @ G[:1]
    D[:, [RATE, WHEEL]] -= gain[:, 1:]
    used = slice(design.order)
    linear = Compensator(F[used, used], G[used], -gain[:, :1] @ F[:1, used], D)
    return Scheme(gain, lambda: Fused(design), linear)


class Model(NamedTuple):
    """What an observer believes: A, B, C, which readings y are, and what the regulator multiplies the states with."""

    A: Array
    B: Array
    C: Array
    rows: Sequence[int]
    gain: Array


def observed(model: Model, Q: Array, R: Array, *, filtered: bool = True) -> Scheme:
    """Regulate with an observer whose gain comes from the weights Q and R."""
    A, B, C, rows, gain = model
    L = luenberger(A, C, Q, R)
    observer = cf.Observer(A, B, C, L)
    correction = observer.correction if filtered else np.zeros_like(L)
    S = np.eye(5)[list(rows)]
    H, D = -gain @ (np.eye(len(A)) - correction @ C), -gain @ correction @ S
    linear = Compensator(A - L @ C + B @ H, L @ S + B @ D, H, D)
    return Scheme(gain, lambda: Observed(observer, rows, filtered=filtered), linear, observer_poles(A, C, L))
