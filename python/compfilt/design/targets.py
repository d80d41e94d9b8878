"""Gains from how fast the filter shall be."""

from collections.abc import Callable

import numpy as np

from compfilt._core import LinearFilter
from compfilt.checks import positive
from compfilt.design import speed
from compfilt.design.family import family
from compfilt.design.result import Designed

__all__ = ["from_bias_time", "from_cutoff", "from_settling_time"]


def from_cutoff(
    cutoff: float,
    *,
    kind: str = "first_order",
    order: int | None = None,
    split: int | None = None,
    derivative_order: int | None = None,
) -> Designed:
    """Return the design with Butterworth poles whose low-pass stays below -3 dB from a frequency on.

    Parameters
    ----------
    cutoff : float
        In Hz, as `compfilt.design.cutoff` has it.
    kind, order, split, derivative_order
        As in `from_spectra`.

    Returns
    -------
    Designed
        Without a prediction: `assess` adds it.

    Raises
    ------
    ValueError
        If a number breaks its rule.

    Examples
    --------
    >>> from compfilt.design import from_cutoff
    >>> round(from_cutoff(0.5).design.tau, 4)
    0.3183
    """
    wanted = positive("cutoff", cutoff)
    return _scaled(lambda design: wanted / speed.cutoff(design), kind, order, split, derivative_order)


def from_settling_time(
    time: float,
    *,
    within: float = 0.02,
    kind: str = "first_order",
    order: int | None = None,
    split: int | None = None,
    derivative_order: int | None = None,
) -> Designed:
    """Return the design with Butterworth poles that forgets a wrong start in a wanted time.

    Parameters
    ----------
    time : float
        In s, as `compfilt.design.settling_time` has it.
    within : float
        The share of the initial error that may be left. Default 2 %.
    kind, order, split, derivative_order
        As in `from_spectra`.

    Returns
    -------
    Designed
        Without a prediction: `assess` adds it.

    Raises
    ------
    ValueError
        If a number breaks its rule.

    Examples
    --------
    >>> from compfilt.design import from_settling_time
    >>> round(from_settling_time(2.0).design.tau, 4)
    0.5112
    """
    wanted = positive("time", time)
    return _scaled(
        lambda design: speed.settling_time(design, within) / wanted, kind, order, split, derivative_order
    )


def from_bias_time(
    time: float,
    *,
    within: float = 0.1,
    kind: str = "pi",
    order: int | None = None,
    derivative_order: int | None = None,
) -> Designed:
    """Return the design with Butterworth poles that learns the bias of the derivative in a wanted time.

    Parameters
    ----------
    time : float
        In s, as `compfilt.design.bias_time` has it.
    within : float
        The share of the bias by which the estimate may be off then. Default 10 %.
    kind, order, derivative_order
        As in `from_spectra`; a kind that estimates the bias.

    Returns
    -------
    Designed
        Without a prediction: `assess` adds it.

    Raises
    ------
    ValueError
        If a number breaks its rule, or the kind does not estimate the bias.

    Examples
    --------
    >>> from compfilt.design import bias_time, from_bias_time
    >>> round(bias_time(from_bias_time(20.0).design), 6)
    20.0
    """
    wanted = positive("time", time)
    return _scaled(
        lambda design: speed.bias_time(design, within) / wanted, kind, order, None, derivative_order
    )


def _scaled(
    factor: Callable[[LinearFilter], float],
    kind: str,
    order: int | None,
    split: int | None,
    derivative_order: int | None,
) -> Designed:
    """Scale the member with omega0 = 1 rad/s in time."""
    chosen = family(kind, order, split, derivative_order)
    omega0 = factor(chosen.butterworth(1.0))
    if not np.isfinite(omega0):
        raise ValueError("the wanted speed must be within what floating point can hold")
    return Designed(chosen.butterworth(omega0))
