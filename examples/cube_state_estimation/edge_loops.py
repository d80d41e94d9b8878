"""The joint loop of plant, estimator and regulator as a linear system: eigenvalues, margins, noise, limit cycle."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import linalg

from edge_cube import (
    ACCELEROMETER,
    COULOMB,
    MODEL,
    PUSHLESS,
    Array,
    Cube,
    T,
    changed,
    discrete,
    noise,
    readings,
    sticky,
)
from edge_designs import plain
from edge_estimators import Compensator, Scheme


def joint(cubes: Sequence[Cube], compensator: Compensator) -> Array:
    """Return the transition matrices of plant and compensator: φ, u_K, u_R, the last current, the compensator's z."""
    A3, B3 = discrete(cubes)
    F, G, H, D = compensator
    C = np.array([readings(cube) for cube in cubes])
    B = np.pad(B3, ((0, 0), (0, 1), (0, 0)))
    B[:, 3] = 1.0
    whole = np.zeros((len(cubes), 4 + len(F), 4 + len(F)))
    whole[:, :3, :3] = A3
    whole[:, :4, :4] += B @ D @ C
    whole[:, :4, 4:] = B @ H
    whole[:, 4:, :4] = G @ C
    whole[:, 4:, 4:] = F
    return whole


def radius(cubes: Sequence[Cube], scheme: Scheme) -> Array:
    """Return the size of the largest eigenvalue of each closed loop."""
    sizes: Array = np.abs(np.linalg.eigvals(joint(cubes, scheme.compensator))).max(axis=1)
    return sizes


def first(wanted: npt.NDArray[np.bool_], values: Array) -> float:
    """Return the first of the values for which this holds, or NaN."""
    return float(values[np.argmax(wanted)]) if wanted.any() else float("nan")


def margin(scheme: Scheme, name: str, furthest: float) -> float:
    """Return the factor, between 1 and `furthest`, from which on a wrong `name` makes the loop unstable, or NaN."""
    factors = np.geomspace(1.0, furthest, 200)
    return first(radius([changed(**{name: factor}) for factor in factors], scheme) >= 1.0, factors)


def common_margin(scheme: Scheme) -> float:
    """Return the share by which five numbers of the plant may all be wrong, up or down, until one choice is unstable."""
    names = ("lever", "inertia", "wheel", "wheel_friction", "torque_constant")
    signs = list(itertools.product((-1.0, 1.0), repeat=len(names)))
    shares = np.arange(0.01, 0.61, 0.01)
    cubes = [
        changed(**dict(zip(names, 1.0 + share * np.array(sign), strict=True)))
        for share, sign in itertools.product(shares, signs)
    ]
    return first((radius(cubes, scheme) >= 1.0).reshape(len(shares), -1).any(axis=1), shares)


def linear_noise(scheme: Scheme) -> tuple[float, float]:
    """Return the RMS of the tilt and of the current that the sensors' noise makes without model error."""
    _, G, H, D = scheme.compensator
    (system,) = joint([MODEL], scheme.compensator)
    entry = np.vstack((plain().B @ D, D, G))
    P = linalg.solve_discrete_lyapunov(system, entry @ noise() @ entry.T)
    out = np.hstack((D @ readings(MODEL), H))
    current = out @ P @ out.T + D @ noise() @ D.T
    return float(np.sqrt(P[0, 0])), float(np.sqrt(current[0, 0]))


def resting_slip(scheme: Scheme) -> float:
    """Return the steady speed of the wheel against the body, rad/s, that a constant friction of -`COULOMB` leaves.

    Dry friction opposes the speed, so a negative result contradicts itself: no such state exists.
    """
    _, G, _, D = scheme.compensator
    felt = np.zeros((5, 1))
    felt[[ACCELEROMETER, PUSHLESS]] = readings(MODEL)[ACCELEROMETER, 3]
    B = plain().B
    entry = np.vstack((B + B @ D @ felt, D @ felt, G @ felt))
    (system,) = joint([MODEL], scheme.compensator)
    state = np.linalg.solve(np.eye(len(system)) - system, -COULOMB / MODEL.torque_constant * entry)
    return float(state[2, 0] - state[1, 0])


class Cycle(NamedTuple):
    """A limit cycle: the viscous friction that would do the same, N m s/rad; Hz; RMS tilt, rad."""

    friction: float
    frequency: float
    tilt: float


def harmonic_balance(scheme: Scheme) -> Cycle:
    """Return the limit cycle that dry friction makes, by its describing function; at 0 Hz there is none.

    For a slip of amplitude a, friction of ±τ acts as a viscous friction 4 τ/(π a). Where that puts an eigenvalue on
    the unit circle the oscillation neither grows nor decays; below that amplitude it grows, above it decays.
    """
    low, high = 1e-5, 1.0
    for _ in range(2):
        grid = np.geomspace(low, high, 120)
        k = max(1, int(np.argmax(radius([sticky(friction) for friction in grid], scheme) >= 1.0)))
        low, high = float(grid[k - 1]), float(grid[k])
    values, vectors = np.linalg.eig(joint([sticky(high)], scheme.compensator)[0])
    largest = int(np.argmax(np.abs(values)))
    tilt, rate, wheel = vectors[:3, largest]
    slip = 4.0 * COULOMB / (np.pi * high)
    return Cycle(
        high,
        float(abs(np.angle(values[largest])) / (2.0 * np.pi * T)),
        float(abs(tilt) / abs(wheel - rate) * slip / np.sqrt(2.0)),
    )


class Linear(NamedTuple):
    """What the linear analysis says of one scheme."""

    radius: float
    common: float
    motor: tuple[float, float]
    lever: float
    inertia: tuple[float, float]
    noise: tuple[float, float]
    resting_slip: float
    cycle: Cycle


def analyse(scheme: Scheme) -> Linear:
    """Put together the linear analysis of one scheme."""
    return Linear(
        float(radius([MODEL], scheme)[0]),
        common_margin(scheme),
        (margin(scheme, "torque_constant", 0.1), margin(scheme, "torque_constant", 10.0)),
        margin(scheme, "lever", 10.0),
        (margin(scheme, "inertia", 0.1), margin(scheme, "inertia", 10.0)),
        linear_noise(scheme),
        resting_slip(scheme),
        harmonic_balance(scheme),
    )
