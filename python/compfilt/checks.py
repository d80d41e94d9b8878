"""What the numbers that come in must be."""

import numpy as np

__all__ = ["positive", "sample_rate"]

SLOWEST_RATE, FASTEST_RATE = 1e-12, 1e12
"""Hz. No sensor is slower or faster, and powers of what lies between them do not overflow."""


def positive(name: str, value: object, *, zero: bool = False) -> float:
    """Return a finite number above 0, or from 0 on.

    Raises
    ------
    ValueError
        If it is not.
    TypeError
        If it is not a number.

    Examples
    --------
    >>> positive("tau", 2)
    2.0
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    number = float(value)
    if not np.isfinite(number) or number < 0.0 or (number == 0.0 and not zero):
        rule = "finite and not negative" if zero else "positive and finite"
        raise ValueError(f"{name} must be {rule}, not {number:g}")
    return number


def sample_rate(name: str, value: object) -> float:
    """Return a sample rate in Hz that a sensor can have.

    Raises
    ------
    ValueError
        If it is not positive and finite, or beyond what any sensor has.
    TypeError
        If it is not a number.

    Examples
    --------
    >>> sample_rate("fs", 100)
    100.0
    """
    rate = positive(name, value)
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise ValueError(f"{name} must lie between {SLOWEST_RATE:g} and {FASTEST_RATE:g} Hz, not {rate:g}")
    return rate
