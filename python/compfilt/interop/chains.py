"""Which chain a system is."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from compfilt._core import Chain
from compfilt.constants import HIGHEST_ORDER
from compfilt.interop.system import Matrix, Rule, System, of_design

__all__ = ["recognise"]

TOLERANCE = 1e-6
"""The share by which a response may differ from the chain's."""

Response = npt.NDArray[np.complex128]


def recognise(system: System, *, derivative_order: int | None = None, rule: Rule = "backward_euler") -> Chain:
    """Return the chain that has the poles and the responses of a system, whatever its states are.

    A system with one input is the low-pass from the measurement; the high-pass follows from it. One with two inputs is
    the whole filter. Its first output is level 0.

    Raises
    ------
    ValueError
        It is no chain; the message says why.
    """
    order, inputs = system.B.shape
    if not 1 <= order <= HIGHEST_ORDER:
        raise ValueError(f"system must have 1 to {HIGHEST_ORDER} states, got {order}")
    if inputs not in {1, 2}:
        raise ValueError(
            f"system must have one input, the measurement, or a second, the derivative, got {inputs}"
        )
    if not all(np.isfinite(part).all() for part in (system.A, system.B, system.C, system.D)):
        raise ValueError("system must be finite")
    system = replace(system, C=system.C[:1], D=system.D[:1])
    poles = _continuous_poles(system, rule)
    for pole in poles:
        if not np.isfinite(pole):
            raise ValueError("system must not have a pole at z = 0: no chain has one")
        if pole.real >= 0.0:
            value = pole if pole.imag else pole.real
            raise ValueError(f"system must be stable, it has a pole at {value:.6g} rad/s")
    omega = _frequencies(system, poles)
    wanted = _response(system, omega)
    try:
        chains = list(_chains(poles, inputs, derivative_order, rule))
    except ValueError as error:
        raise ValueError(f"system must be a chain: {error}") from None
    low_pass_fits = False
    for chain in chains:
        fs = 1.0 / system.dt if system.dt else None
        fits = _alike(_response(of_design(chain, fs=fs, rule=rule), omega), wanted)
        if fits[:inputs].all():
            return chain
        low_pass_fits |= bool(fits[0])
    raise ValueError(_why_not(system, low_pass_fits=low_pass_fits))


def _continuous_poles(system: System, rule: Rule) -> Response:
    """Return the poles in rad/s; those of a discrete system by the rule that made it."""
    # The poles of slow filters lie close to 1: what matters is their distance from it.
    distances = np.linalg.eigvals(_generator(system)).astype(np.complex128)
    if not system.dt:
        return distances
    with np.errstate(divide="ignore", invalid="ignore"):
        if rule == "matched":
            return np.asarray(np.log1p(distances) / system.dt)
        return np.asarray(distances / (1.0 + distances) / system.dt)


def _chains(poles: Response, inputs: int, derivative_order: int | None, rule: Rule) -> Iterator[Chain]:
    """Make every chain with these poles that can be meant."""
    coefficients = np.poly(poles).real[1:]
    order = coefficients.size
    orders = (
        range(1, order + 1)
        if derivative_order is None and inputs == 2
        else [1 if derivative_order is None else derivative_order]
    )
    for M in orders:
        splits = range(order, 0, -1) if M == 1 and rule == "backward_euler" else [order]
        yield from (Chain(coefficients, M, split) for split in splits)


def _frequencies(system: System, poles: Response) -> Matrix:
    """Return frequencies in rad/s around the poles, below half the sample rate."""
    slowest, fastest = np.abs(poles).min(), np.abs(poles).max()
    highest = 30.0 * fastest if not system.dt else min(30.0 * fastest, 0.9 * np.pi / system.dt)
    return np.geomspace(min(slowest / 30.0, highest), highest, 25)


def _response(system: System, omega: Matrix) -> Response:
    """Return the response from each input to output 0, (inputs, frequencies)."""
    from scipy.linalg import matrix_balance  # type: ignore[import-untyped]  # noqa: PLC0415 - who has a system has it

    # The levels of a slow filter differ by many powers of ten.
    A, (scale, _) = matrix_balance(_generator(system), permute=False, separate=True)
    B, C = system.B / scale[:, None], system.C[0] * scale
    points = np.expm1(1j * omega * system.dt) if system.dt else 1j * omega
    loops = points[:, None, None] * np.eye(A.shape[0]) - A
    return np.asarray(
        (C @ np.linalg.solve(loops, np.broadcast_to(B, (omega.size, *B.shape))) + system.D[0]).T
    )


def _generator(system: System) -> Matrix:
    """Return the matrix whose product with the state is its change."""
    return system.A - np.eye(system.A.shape[0]) if system.dt else system.A


def _alike(chain: Response, wanted: Response) -> npt.NDArray[np.bool_]:
    """Tell for each input whether the responses agree; a system with one input says nothing about the second."""
    chain = chain[: wanted.shape[0]]
    return np.asarray((np.abs(chain - wanted) <= TOLERANCE * np.abs(chain)).all(axis=1))


def _why_not(system: System, *, low_pass_fits: bool) -> str:
    gain = _response(system, np.zeros(1))[0, 0].real
    if abs(gain - 1.0) > TOLERANCE:
        return f"system must pass a constant measurement unchanged, its gain is {gain:.6g}"
    if low_pass_fits:
        text = (
            "system must pass with its second input what its first holds back: their branches must sum to 1"
        )
    else:
        text = (
            "system must have the last terms of its denominator as the numerator of its low-pass, as in "
            "(k_1 s + k_2)/(s^2 + k_1 s + k_2)"
        )
    return text + (", by the rule that is given" if system.dt else "")
