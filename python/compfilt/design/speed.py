"""How fast a design is: its cut-off, and how long it takes to forget a wrong start and to learn a bias."""

import numpy as np
import numpy.typing as npt
from scipy.linalg import companion, expm  # type: ignore[import-untyped]
from scipy.optimize import brentq  # type: ignore[import-untyped]

from compfilt._core import LinearFilter

__all__ = ["bias_time", "cutoff", "settling_time"]

Array = npt.NDArray[np.float64]

DOUBLINGS = 14
"""A response is looked at on 2 to this power times for its last crossing."""


def cutoff(design: LinearFilter) -> float:
    """Return the frequency from which on the low-pass stays below -3 dB.

    That of the continuous filter. The low-pass of split = order peaks: for the Butterworth filter of order 2 the cut-off
    is at 2.06 omega0.

    Parameters
    ----------
    design : LinearFilter

    Returns
    -------
    float
        In Hz.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.design import cutoff
    >>> round(cutoff(cf.FirstOrder(tau=1.0)), 4)
    0.1592
    """
    # In units of the filter's own time, so that no square overflows.
    unit = design.coefficients[-1] ** (1.0 / design.order)
    ascending = _ascending(design) / unit ** np.arange(design.order, -1.0, -1.0)
    low = ascending * (np.arange(ascending.size) < design.split)
    roots = np.roots((2.0 * _squared(low) - _squared(ascending))[::-1])
    real = roots.real[(np.abs(roots.imag) <= 1e-7 * np.abs(roots)) & (roots.real > 0.0)]
    return float(unit * np.sqrt(real.max())) / (2.0 * np.pi)


def settling_time(design: LinearFilter, within: float = 0.02) -> float:
    """Return after what time no more than a share of an initial error of the estimate is left.

    That of the continuous filter. The other levels start right.

    Parameters
    ----------
    design : LinearFilter
    within : float
        The share, between 0 and 1. Default 2 %.

    Returns
    -------
    float
        In s.

    Raises
    ------
    ValueError
        If `within` breaks its rule.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.design import settling_time
    >>> round(settling_time(cf.FirstOrder(tau=1.0)), 3)
    3.912
    """
    return _last_time(design, design.split, within)


def bias_time(design: LinearFilter, within: float = 0.1) -> float:
    """Return after what time the estimated bias of the derivative stays within a share of the true one.

    That of the continuous filter, for a bias that appears at once.

    Parameters
    ----------
    design : LinearFilter
        One that estimates the bias: split = order > derivative order.
    within : float
        The share, between 0 and 1. Default 10 %.

    Returns
    -------
    float
        In s.

    Raises
    ------
    ValueError
        If the design has no level for the bias, or `within` breaks its rule.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.design import bias_time
    >>> round(bias_time(cf.PiForm(kp=2.0, ki=1.0)), 2)
    3.89
    """
    if design.split < design.order or design.order == design.derivative_order:
        raise ValueError(
            "design must estimate the bias: split = order, and an order above the derivative order"
        )
    return _last_time(design, design.order - design.derivative_order, within)


def _ascending(design: LinearFilter) -> Array:
    """Return a_0 ... a_N of B(s), a_N = 1."""
    return np.array([*design.coefficients[::-1], 1.0])


def _squared(ascending: Array) -> Array:
    """Return the coefficients in ω² of |p(jω)|²."""
    turned = ascending * 1j ** np.arange(ascending.size)
    return np.convolve(turned, turned.conj()).real[::2]


def _last_time(design: LinearFilter, degree: int, within: float) -> float:
    """Return when the inverse transform of Σ a_i s^(i-1) / B(s), over i from `degree` on, last exceeds `within`."""
    if not 0.0 < within < 1.0:
        raise ValueError(f"within must be between 0 and 1, not {within:g}")
    ascending = _ascending(design)
    # companion() has the highest power first, and the response begins at its first unit vector.
    matrix = companion(ascending[::-1])
    output = np.where(np.arange(1, ascending.size) >= degree, ascending[1:], 0.0)[::-1]
    # After this time even a multiple pole has decayed.
    step = (10.0 - np.log(within)) * design.order / np.abs(design.poles.real).min() / 2**DOUBLINGS
    left = _evenly(expm(matrix * step)) @ output
    last = int(np.flatnonzero(np.abs(left) > within)[-1])
    return float(
        brentq(
            lambda time: abs(float(expm(matrix * time)[:, 0] @ output)) - within,
            last * step,
            (last + 1) * step,
        )
    )


def _evenly(transition: Array) -> Array:
    """Return the state after 0, 1, 2, ... steps from the first unit vector, (2^DOUBLINGS, states)."""
    states = np.eye(transition.shape[0])[:1]
    for _ in range(DOUBLINGS):
        states = np.concatenate((states, states @ transition.T))
        transition = transition @ transition
    return states
