"""The gyro's unit and the sample rate: what one factor between them can mean."""

from typing import NamedTuple

import numpy as np

from compfilt.logs.check.survey import Survey
from compfilt.logs.check.turning import SURE, Fit, Trial
from compfilt.logs.units import ANGULAR_RATE, Unit, parse_unit

__all__ = ["GyroScale", "read_scale"]

SAME = 0.15
"""How far a factor may be off, as a logarithm, before it is wrong: a body's own motion pulls at it."""
UNITS = ("rad/s", "deg/s", "mrad/s", "mdps", "rpm")


class GyroScale(NamedTuple):
    """What makes rad/s of the claimed unit.

    Attributes
    ----------
    factor, error
        The factor as measured, and its standard error; 1 and infinity where nothing is known.
    unit
        The unit that explains it; None if none does.
    claimed
        Whether the claim explains it.
    """

    factor: float
    error: float
    unit: Unit | None
    claimed: bool

    @property
    def known(self) -> bool:
        """Whether the log says anything."""
        return np.isfinite(self.error)


def read_scale(survey: Survey, trials: list[tuple[Trial, Fit]]) -> GyroScale:
    """Choose the unit of the gyro."""
    claimed = survey.claims.triads["gyro"].unit
    base = claimed if claimed is not None else parse_unit("rad/s", ANGULAR_RATE)
    usable = [
        (trial, fit)
        for trial, fit in trials
        if trial.unturned_margin > SURE and trial.sure and fit.scale > 0.0 and fit.scale_error < 0.1 * fit.scale
    ]
    if not usable:
        return GyroScale(1.0, np.inf, claimed, claimed is not None)
    trial, fit = min(usable, key=lambda pair: pair[1].scale_error / pair[1].scale)
    off = abs(np.log(fit.scale))
    if off < max(SAME, 5.0 * fit.scale_error / fit.scale):
        return GyroScale(fit.scale, fit.scale_error, base, claimed=True)
    units = [parse_unit(name, ANGULAR_RATE) for name in UNITS]
    near = min(units, key=lambda unit: abs(np.log(fit.scale * base.factor / unit.factor)))
    unit = near if abs(np.log(fit.scale * base.factor / near.factor)) < SAME else None
    return GyroScale(fit.scale, fit.scale_error, unit, claimed=False)
