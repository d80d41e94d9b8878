"""What happened to a sample."""

from enum import IntFlag

import numpy as np

__all__ = ["Flags"]


class Flags(IntFlag):
    """What happened to a sample: a set of bits in ``Estimate.flags``.

    Attributes
    ----------
    MEASUREMENT_MISSING
        The measurement was missing (NaN or infinite): the sample is predicted only.
    DERIVATIVE_HELD
        The derivative was missing: the last one was held.
    DERIVATIVE_MISSING
        It has been missing for longer than ``hold``: it counted as zero.
    NOT_STARTED
        No measurement has come yet: the output is NaN.
    RESTARTED
        The filter started anew: after an overflow, or after a gap in a log.
    SENSOR_MISSING
        A sensor of several was missing: its part was left out.
    MAGNETOMETER_MISSING
        The magnetometer was missing: yaw was predicted only.
    AMBIGUOUS
        The measured direction is opposite to the estimated one: which way to turn is not known.

    Examples
    --------
    >>> import compfilt as cf
    >>> flags = cf.FirstOrder(1.0).estimate([0.0, float("nan")], [0.0, 0.0], fs=10.0).flags
    >>> cf.Flags(flags[1]) == cf.Flags.MEASUREMENT_MISSING
    True
    """

    MEASUREMENT_MISSING = 1
    DERIVATIVE_HELD = 2
    DERIVATIVE_MISSING = 4
    NOT_STARTED = 8
    RESTARTED = 16
    SENSOR_MISSING = 32
    MAGNETOMETER_MISSING = 64
    AMBIGUOUS = 128

    @classmethod
    def _missing_(cls, value: object) -> "Flags":
        """Take numpy's integers too: combinations of flags are looked up by value."""
        return cls(int(value)) if isinstance(value, np.integer) else cls(super()._missing_(value))
