"""The units of data sheets, and how SI becomes them."""

import math
from typing import Final, NamedTuple

from compfilt.constants import STANDARD_GRAVITY
from compfilt.noise.fit import TERMS

__all__ = ["ONE_SIDED", "SHEETS", "Quantity", "Sheet"]

DEGREE: Final = 180.0 / math.pi
HOUR: Final = 3600.0
ONE_SIDED: Final = math.sqrt(2.0)
"""A one-sided density in unit/√Hz is so many times the two-sided one: it counts the power of negative frequencies too."""


class Quantity(NamedTuple):
    """What a data sheet calls a number, its unit, and the factor from SI."""

    title: str
    unit: str
    factor: float


class Sheet(NamedTuple):
    """The quantities of one kind of sensor.

    Attributes
    ----------
    mean, step, line
        Of the signal itself.
    density
        One-sided, from the two-sided density in SI.
    terms
        Of the fitted terms, by their names.
    """

    mean: Quantity
    step: Quantity
    line: Quantity
    density: Quantity
    terms: dict[str, Quantity]


def _terms(*quantities: Quantity) -> dict[str, Quantity]:
    return dict(zip(TERMS, quantities, strict=True))


MICRO_G: Final = 1e6 / STANDARD_GRAVITY

SHEETS: Final = {
    "rad/s": Sheet(
        Quantity("bias", "deg/s", DEGREE),
        Quantity("resolution", "deg/s", DEGREE),
        Quantity("line", "deg/s", DEGREE),
        Quantity("noise density", "(deg/s)/√Hz", ONE_SIDED * DEGREE),
        _terms(
            Quantity("angle random walk", "deg/√h", DEGREE * math.sqrt(HOUR)),
            Quantity("bias instability", "deg/h", DEGREE * HOUR),
            Quantity("rate random walk", "(deg/h)/√h", DEGREE * HOUR * math.sqrt(HOUR)),
        ),
    ),
    "m/s^2": Sheet(
        Quantity("mean", "m/s²", 1.0),
        Quantity("resolution", "mg", 1e-3 * MICRO_G),
        Quantity("line", "mg", 1e-3 * MICRO_G),
        Quantity("noise density", "µg/√Hz", ONE_SIDED * MICRO_G),
        _terms(
            Quantity("velocity random walk", "(m/s)/√h", math.sqrt(HOUR)),
            Quantity("bias instability", "µg", MICRO_G),
            Quantity("bias random walk", "µg/√h", MICRO_G * math.sqrt(HOUR)),
        ),
    ),
}
"""By the unit of the signal."""
