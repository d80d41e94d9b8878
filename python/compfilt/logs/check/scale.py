"""The gyro's unit and the sample rate: what one factor between them can mean."""

from typing import NamedTuple

import numpy as np

from compfilt.logs.check.fit import Fit
from compfilt.logs.check.survey import Survey
from compfilt.logs.check.turning import SURE, WILD, Trial
from compfilt.logs.units import ANGULAR_RATE, Unit, parse_unit

__all__ = ["GyroScale", "read_scale"]

SAME = 0.15
"""How far a factor may be off, as a logarithm, before it is wrong: a body's own motion pulls at it."""
APART = 0.35
"""The same for one of the two usual units to explain a factor: ranges of sensors lie apart by 2."""
EXACT = 0.04
"""The same for a rare unit, which raw counts may come near by chance: 16.4 of them are a degree per second."""
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
        Whether the claim explains it; nothing is to be changed then.
    """

    factor: float
    error: float
    unit: Unit | None
    claimed: bool

    @property
    def known(self) -> bool:
        """Whether the log says anything."""
        return bool(np.isfinite(self.error))


def read_scale(survey: Survey, trials: list[tuple[Trial, Fit]], carried: float | None) -> GyroScale:
    """Choose the unit of the gyro: by the trials, or else by the scale that carries gravity from rest to rest."""
    claimed = survey.claims.triads["gyro"].unit
    base = claimed if claimed is not None else parse_unit("rad/s", ANGULAR_RATE)
    usable = [
        (trial, fit)
        for trial, fit in trials
        if trial.unturned_margin > SURE
        and trial.sure
        and fit.scale > 0.0
        and fit.scale_error < 0.1 * fit.scale
    ]
    if usable:
        fit = min((fit for _, fit in usable), key=lambda fit: fit.scale_error / fit.scale)
        factor, error = fit.scale, fit.scale_error
    elif carried is not None:
        factor, error = carried, 0.1 * carried
    elif wild := [
        trial
        for trial, _ in trials
        if trial.scale < 1.0 and trial.claimed_margin > SURE and trial.claimed_angle > WILD
    ]:
        factor, error = wild[0].scale, 0.3 * wild[0].scale
    else:
        return GyroScale(1.0, np.inf, claimed, claimed is not None)
    if abs(np.log(factor)) < max(SAME, 5.0 * error / factor if usable else SAME):
        return GyroScale(factor, error, base, claimed=True)
    units = [parse_unit(name, ANGULAR_RATE) for name in UNITS]
    near = min(units, key=lambda unit: abs(np.log(factor * base.factor / unit.factor)))
    unit = (
        near
        if abs(np.log(factor * base.factor / near.factor)) < (APART if near.name in UNITS[:2] else EXACT)
        else None
    )
    return GyroScale(factor, error, unit, claimed=False)
