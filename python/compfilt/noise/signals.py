"""The checks of what comes in."""

import numpy as np
import numpy.typing as npt

from compfilt.noise.curves import Array

__all__ = ["channel", "channels"]

SHORTEST = 64
"""Samples: of less, no spectrum and no curve says anything."""


def channel(name: str, values: npt.ArrayLike) -> Array:
    """Return one channel, (n,) float64.

    Raises
    ------
    ValueError
        It has another shape, is too short, or holds a value that is not finite.
    """
    array = np.asarray(values, np.float64)
    if array.ndim != 1:
        raise ValueError(f"{name} must be one channel, shape (n,), got {array.shape}")
    return _checked(name, array)


def channels(name: str, values: npt.ArrayLike, *, width: int | None = None) -> Array:
    """Return a signal with time along axis 0, (n,) or (n, channels) float64.

    Raises
    ------
    ValueError
        It has another shape, is too short, or holds a value that is not finite.
    """
    array = np.asarray(values, np.float64)
    if width is not None and (array.ndim != 2 or array.shape[1] != width):
        raise ValueError(f"{name} must have the shape (n, {width}), got {array.shape}")
    if array.ndim not in (1, 2):
        raise ValueError(f"{name} must have the shape (n,) or (n, channels), got {array.shape}")
    return _checked(name, array)


def _checked(name: str, array: Array) -> Array:
    if len(array) < SHORTEST:
        raise ValueError(f"{name} must have at least {SHORTEST} samples, not {len(array)}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite: cut the recording where samples are missing")
    return array
