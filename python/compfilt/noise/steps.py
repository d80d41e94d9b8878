"""The resolution of a sensor: the step between the values that it can give."""

import numpy as np
import numpy.typing as npt

from compfilt.noise.signals import channel

__all__ = ["find_step"]

LOOKED_AT = 1 << 18
"""Samples; a resolution that so many do not show does no harm."""
MOST_VALUES = 1 << 14
"""Of a signal with more different values the noise is far above the step."""


def find_step(x: npt.ArrayLike) -> float | None:
    """Find the step of which all differences of a signal are whole multiples.

    Parameters
    ----------
    x : array_like, shape (n,)
        One channel.

    Returns
    -------
    float or None
        The step in the signal's unit; None where the values lie on no grid, or on one too fine to matter.

    Raises
    ------
    ValueError
        The signal is too short or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> fine = np.random.default_rng(1).normal(0.0, 1.0, 10_000)
    >>> noise.find_step(fine), round(noise.find_step(np.round(fine / 0.3) * 0.3), 9)
    (None, 0.3)
    """
    values = np.unique(channel("x", x)[:LOOKED_AT])
    if not 1 < len(values) < MOST_VALUES:
        return None
    # Single precision, in which many sensors are logged, moves a value by 6e-8 of it.
    slack = 2e-7 * float(np.abs(values).max())
    apart = np.diff(values)
    apart = apart[apart > 2.0 * slack]
    if not len(apart):
        return None
    step = float(apart.min())
    # A mean over the differences that are a few steps wide is more exact than the least of them.
    near = apart[apart < 10.5 * step]
    step = float(near.sum() / np.round(near / step).sum())
    whole = np.round(apart / step)
    return step if (np.abs(apart - whole * step) < slack + 0.02 * step).all() else None
