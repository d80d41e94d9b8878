"""Gains from noise densities in closed form."""

from collections.abc import Sequence

import numpy as np

from compfilt.checks import positive
from compfilt.constants import HIGHEST_ORDER
from compfilt.design.assess import assessed
from compfilt.design.family import family
from compfilt.design.prediction import NoiseModel, walks
from compfilt.design.result import Designed
from compfilt.design.running import Rule

__all__ = ["from_densities"]


def from_densities(
    *,
    measurement: float,
    derivative: float = 0.0,
    walk: float | Sequence[float] = 0.0,
    kind: str = "first_order",
    derivative_order: int | None = None,
    fs: float | None = None,
    bias: float = 0.0,
    rule: Rule = "backward_euler",
) -> Designed:
    """Return the gains with the least error for white noise and random walks: those of the steady-state Kalman filter.

    The quantity is a chain of N integrators, driven by noise where the derivative's errors enter: its white noise of the
    density q_1 at level M, its random walks q_2, q_3, ... at the levels above. With r the density of the measurement,
    the polynomial B(s) = s^N + k_1 s^(N-1) + ... + k_N is the stable factor of ::

        B(s) B(-s) = s^N (-s)^N (1 + Σ (q_j/r)² / (s (-s))^(M-1+j))

    First order: k_1 = q_1/r. PI: k_2 = q_2/r, k_1 = √(q_1²/r² + 2 q_2/r). With noise at the last level alone it is the
    Butterworth filter of omega0 = (q/r)^(1/N).

    All densities are two-sided: r = σ/√fs for white noise of the standard deviation σ per sample. A one-sided density, as
    most data sheets have it, is √2 times as large.

    Parameters
    ----------
    measurement : float
        r, density of the measurement's noise in unit/√Hz, above 0.
    derivative : float
        q_1, density of the derivative's noise in its unit/√Hz: of the gyro in (rad/s)/√Hz, for example. Default 0.
    walk : float or sequence of float
        q_2, density of the random walk of the derivative's bias, in its unit/s/√Hz; in a sequence q_2, q_3, ...
        Default 0.
    kind : {"first_order", "pi", "third_order", "second_order_inertial", "chain"}
        "first_order" and "second_order_inertial" take no walk, "pi" and "third_order" one; a "chain" is as long as the
        walks ask for.
    derivative_order : int, optional
        M of a "chain": which derivative of the measurement the second signal is. Default 1.
    fs : float, optional
        Sample rate in Hz at which the filter will run. With it the error is predicted for that rate.
    bias : float
        A constant error of the derivative, for the prediction: "first_order" leaves bias·τ of it. Default 0.
    rule : {"backward_euler", "matched"}
        How the design becomes gains, for the prediction.

    Returns
    -------
    Designed

    Raises
    ------
    ValueError
        If a density is negative, not finite, or 0 where the kind needs it.
    TypeError
        If an argument is of another kind.

    Examples
    --------
    >>> from compfilt.design import from_densities
    >>> chosen = from_densities(measurement=1e-3, derivative=2e-3, walk=1e-3, kind="pi", fs=200.0)
    >>> [round(gain, 3) for gain in chosen.design.coefficients]
    [2.449, 1.0]
    >>> round(chosen.prediction.sigma, 5)
    0.00156
    """
    r = positive("measurement", measurement)
    q = (positive("derivative", derivative, zero=True), *walks(walk))
    if kind == "butterworth":
        raise ValueError(
            "kind must not be 'butterworth': a 'chain' with noise at its last level alone is one"
        )
    if kind == "chain":
        first = family(kind, HIGHEST_ORDER, None, derivative_order).derivative_order
        if first + len(q) - 1 > HIGHEST_ORDER:
            raise ValueError(
                f"walk must have at most {HIGHEST_ORDER - first} densities with derivative_order {first}"
            )
        model = family(kind, first + len(q) - 1, None, first)
    else:
        model = family(kind, None, None, derivative_order)
    wanted = model.walks_absorbed + 1
    if len(q) > wanted:
        raise ValueError(
            f"walk must be left out for kind {kind!r}, which has no level for it: use 'pi' or 'chain'"
        )
    if len(q) < wanted or not q[-1]:
        name, other = ("walk", "bias") if wanted > 1 else ("derivative", "settling")
        raise ValueError(
            f"{name} must be above 0 for kind {kind!r}: without it the best gain is 0; a wanted {other} time chooses one"
        )
    levels = (0.0,) * (model.derivative_order - 1) + q
    try:
        design = model.of_coefficients(kalman_coefficients(tuple(each / r for each in levels)))
    except (ArithmeticError, np.linalg.LinAlgError):
        raise ValueError("the ratios of the densities must be within what floating point can hold") from None
    return assessed(design, NoiseModel.of(r, q[0], q[1:], bias), fs, rule)


def kalman_coefficients(ratios: tuple[float, ...]) -> tuple[float, ...]:
    """Return k_1 ... k_N of the steady-state Kalman filter of a chain driven by noise at its levels.

    `ratios` has the density of the noise at each level, as a ratio to the measurement's; the last one is above 0. The
    stable factor has the roots -√x for the roots x of the polynomial in x = s².
    """
    order = len(ratios)
    # In units of the filter's own time, so that the coefficients are of one size.
    unit = ratios[-1] ** (1.0 / order)
    if not np.isfinite([unit, *ratios]).all():
        raise OverflowError
    scaled = [(ratio / unit ** (level + 1)) ** 2 for level, ratio in enumerate(ratios)]
    polynomial = [1.0, *((-1.0) ** (level + 1) * ratio for level, ratio in enumerate(scaled))]
    poles = -np.sqrt(np.roots(polynomial).astype(complex))
    coefficients = np.poly(poles).real[1:]
    return tuple(float(k) * unit ** (i + 1) for i, k in enumerate(coefficients))
