"""Designs and observers as state-space systems, in matrices of NumPy."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from compfilt._core import LinearFilter, Observer, RateFilter
from compfilt.checks import positive

__all__ = ["Rule", "System", "of_design", "of_observer"]

Matrix: TypeAlias = npt.NDArray[np.float64]
Rule = Literal["backward_euler", "matched"]

INPUTS = ("measurement", "derivative")


@dataclass(frozen=True)
class System:
    """A linear system: x' = A x + B v in continuous time, x(n+1) = A x(n) + B v(n) in discrete time; y = C x + D v.

    Attributes
    ----------
    dt
        The sample period in seconds; 0 in continuous time, None in discrete time with a period that is not stated.
    inputs, outputs, states
        Their names; none where they are not known.
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    dt: float | None
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


def of_design(
    design: LinearFilter, *, fs: float | None = None, rule: Rule = "backward_euler", all_levels: bool = False
) -> System:
    """Return a design as a system from (measurement, derivative) to level 0, or to all levels.

    In continuous time the states are the levels. In discrete time they are the levels before the sample, what
    ``initial`` is to ``filter``, and the outputs those after it.
    """
    outputs = design.level_names if all_levels else design.level_names[:1]
    if isinstance(design, RateFilter):
        states: tuple[str, ...] = ("rate_minus_gyro", "integral")
        parts = _rate_filter(design) if fs is None else _sampled_rate_filter(design, fs, rule)
    else:
        states = design.level_names
        parts = _continuous(design) if fs is None else _sampled(design, fs, rule)
    A, B, C, D = parts
    count = len(outputs)
    return System(A, B, C[:count], D[:count], 0.0 if fs is None else 1.0 / fs, INPUTS, outputs, states)


def _continuous(design: LinearFilter) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Write down the observer on a chain of integrators, its polynomial split between low-pass and high-pass."""
    order, split = design.order, design.split
    descending = (1.0, *design.coefficients)
    A = np.diag(np.ones(order - 1), 1)
    B = np.zeros((order, 2))
    B[design.derivative_order - 1, 1] = 1.0
    for i in range(order):
        # The coefficient of s^power corrects level i with the innovation if the low-pass has it; otherwise the
        # one of the next power damps level i.
        power = order - 1 - i
        if power < split and (i > 0 or split == order):
            B[i, 0] = descending[i + 1]
            A[i, 0] -= descending[i + 1]
        if i > 0 and power + 1 >= split:
            A[i, 1] -= descending[i]
    return A, B, np.eye(order), np.zeros((order, 2))


def _sampled(design: LinearFilter, fs: float, rule: Rule) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Read the matrices off the filter: each column is what one sample makes of a unit level or of a unit input.

    So they hold the filter's own numbers, by either rule.
    """
    order = design.order
    start = np.hstack((np.eye(order), np.zeros((order, 2))))
    measurement, derivative = np.zeros((2, 1, order + 2))
    measurement[0, order] = derivative[0, order + 1] = 1.0
    levels = design.estimate(measurement, derivative, fs=fs, rule=rule, initial=start).levels
    A, B = np.hsplit(np.asarray(levels, dtype=np.float64)[:, 0, :], [order])
    return A, B, A, B


def _rate_filter(design: RateFilter) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Take the rate from the gyro as a state: the filter differentiates the gyro, a system must not."""
    k = 1.0 / design.tau
    A = np.array([[-k, k], [0.0, 0.0]])
    B = np.array([[-k, 0.0], [0.0, 1.0]])
    return A, B, np.array([[1.0, 0.0]]), np.array([[1.0, 0.0]])


def _sampled_rate_filter(design: RateFilter, fs: float, rule: Rule) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """Do the same at a sample rate: the start at 1 without inputs shows what the integral's share is."""
    rates = design.estimate(
        [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]], fs=fs, rule=rule, initial=[[0.0, 0.0, 1.0]]
    ).levels
    gyro, acceleration, integral = np.asarray(rates, dtype=np.float64).ravel().tolist()
    C = np.array([[gyro, integral]])
    D = np.array([[gyro, acceleration]])
    A = np.array([[gyro, integral], [0.0, 1.0]])
    B = np.array([[-integral, acceleration], [0.0, 1.0 / fs]])
    return A, B, C, D


def of_observer(
    observer: Observer, *, fs: float | None = None, output: Literal["filtered", "predicted"] = "filtered"
) -> System:
    """Return an observer as a system from (y, u) to its estimate after or before the sample's correction.

    The state is the estimate before the correction, what ``initial`` is to ``run``.
    """
    A, B, C, L = observer.A, observer.B, observer.C, observer.L
    n, m, p = A.shape[0], B.shape[1], C.shape[0]
    if output == "predicted":
        before, direct = np.eye(n), np.zeros((n, p))
    elif output == "filtered":
        direct = observer.correction
        if not np.isfinite(direct).all():
            raise ValueError(
                "output must be 'predicted': this observer has no filtered estimate, its A is singular"
            )
        before = np.eye(n) - direct @ C
    else:
        raise ValueError(f"output must be 'filtered' or 'predicted', got {output!r}")
    names = tuple(f"x{i}" for i in range(n))
    return System(
        A - L @ C,
        np.hstack((L, B)),
        before,
        np.hstack((direct, np.zeros((n, m)))),
        None if fs is None else 1.0 / positive("fs", fs),
        (*(f"y{i}" for i in range(p)), *(f"u{i}" for i in range(m))),
        tuple(f"{name}_{output}" for name in names),
        names,
    )
