"""Complementary filters: one definition, the same bits in the batch, in the stream and on the chip."""

from enum import IntFlag
from warnings import warn

from compfilt._core import (
    Butterworth,
    Chain,
    Estimate,
    FirstOrder,
    LinearFilter,
    PiForm,
    RateFilter,
    SecondOrderInertial,
    State,
    Stream,
    ThirdOrder,
    TiltEstimate,
    TiltFilter,
    TiltStream,
    __version__,
    _debug_build,
    alpha_to_tau,
    angle_rates,
    tau_to_alpha,
    tilt,
)

if _debug_build:
    warn("compfilt was built without optimisation: it is slow", RuntimeWarning, stacklevel=2)


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


__all__ = [
    "Butterworth",
    "Chain",
    "Estimate",
    "FirstOrder",
    "Flags",
    "LinearFilter",
    "PiForm",
    "RateFilter",
    "SecondOrderInertial",
    "State",
    "Stream",
    "ThirdOrder",
    "TiltEstimate",
    "TiltFilter",
    "TiltStream",
    "__version__",
    "alpha_to_tau",
    "angle_rates",
    "tau_to_alpha",
    "tilt",
]
