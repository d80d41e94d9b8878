"""Units by name, their dimension, and the factor to SI.

The core knows SI only: s, rad, rad/s, m, m/s². Everything else is multiplied by one factor on the way in and divided by
it on the way out. Angles count as a dimension of their own, so that a rate in Hz is not taken for a rate in rad/s, and so
does the magnetic field, of which only the direction counts.
"""

import difflib
import math
import re
from typing import NamedTuple

from compfilt.constants import STANDARD_GRAVITY

__all__ = [
    "ACCELERATION",
    "ANGLE",
    "ANGULAR_ACCELERATION",
    "ANGULAR_RATE",
    "DIMENSIONLESS",
    "LENGTH",
    "MAGNETIC_FIELD",
    "STANDARD_GRAVITY",
    "TIME",
    "VELOCITY",
    "Dimension",
    "Unit",
    "UnitError",
    "parse_quantity",
    "parse_unit",
]


class UnitError(ValueError):
    """A unit or quantity that does not exist, or one of another dimension than was asked for."""


class Dimension(NamedTuple):
    """Powers of metre, second, radian and tesla.

    Examples
    --------
    >>> LENGTH.per_second(2) == ACCELERATION
    True
    >>> str(ANGULAR_RATE)
    'an angular rate'
    """

    length: int
    time: int
    angle: int
    field: int = 0

    def per_second(self, times: int) -> "Dimension":
        """Return the dimension of the derivative of that order."""
        return self._replace(time=self.time - times)

    def __str__(self) -> str:
        powers = zip(("m", "s", "rad", "T"), self, strict=True)
        formula = " ".join(f"{base}^{power}" for base, power in powers if power)
        return _NAMES.get(self, f"a quantity in {formula}")


DIMENSIONLESS = Dimension(0, 0, 0)
TIME = Dimension(0, 1, 0)
LENGTH = Dimension(1, 0, 0)
VELOCITY = LENGTH.per_second(1)
ACCELERATION = LENGTH.per_second(2)
ANGLE = Dimension(0, 0, 1)
ANGULAR_RATE = ANGLE.per_second(1)
ANGULAR_ACCELERATION = ANGLE.per_second(2)
FREQUENCY = DIMENSIONLESS.per_second(1)
MAGNETIC_FIELD = Dimension(0, 0, 0, 1)

_NAMES = {
    DIMENSIONLESS: "a dimensionless number",
    TIME: "a time",
    LENGTH: "a length",
    VELOCITY: "a velocity",
    ACCELERATION: "an acceleration",
    ANGLE: "an angle",
    ANGULAR_RATE: "an angular rate",
    ANGULAR_ACCELERATION: "an angular acceleration",
    FREQUENCY: "a frequency",
    MAGNETIC_FIELD: "a magnetic field",
}


class Unit(NamedTuple):
    """A unit: one of it is `factor` of the SI unit of its dimension.

    Examples
    --------
    >>> parse_unit("km/h").to_si(36.0)
    10.0
    >>> parse_unit("ms").from_si(0.02)
    20.0
    """

    name: str
    dimension: Dimension
    factor: float

    def to_si(self, value: float) -> float:
        """Convert a number of this unit to SI."""
        return value * self.factor

    def from_si(self, value: float) -> float:
        """Convert a number of the SI unit to this unit."""
        return value / self.factor

    def per_second(self, times: int) -> "Unit":
        """Return the unit of the derivative of that order: ``deg/s^2`` of ``deg``."""
        suffix = {0: "", 1: "/s"}.get(times, f"/s^{times}")
        return Unit(self.name + suffix, self.dimension.per_second(times), self.factor)


_DEGREE = math.pi / 180.0

_UNITS = {
    name: Unit(name, dimension, factor)
    for dimension, units in {
        DIMENSIONLESS: {"1": 1.0},
        TIME: {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
        LENGTH: {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "ft": 0.3048},
        VELOCITY: {
            "m/s": 1.0,
            "mm/s": 1e-3,
            "cm/s": 1e-2,
            "km/h": 1 / 3.6,
            "ft/s": 0.3048,
            "kn": 1852 / 3600,
        },
        ACCELERATION: {
            "m/s^2": 1.0,
            "cm/s^2": 1e-2,
            "g": STANDARD_GRAVITY,
            "mg": 1e-3 * STANDARD_GRAVITY,
            "ft/s^2": 0.3048,
        },
        ANGLE: {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE},
        ANGULAR_RATE: {
            "rad/s": 1.0,
            "mrad/s": 1e-3,
            "deg/s": _DEGREE,
            "dps": _DEGREE,
            "mdps": 1e-3 * _DEGREE,
            "rpm": math.pi / 30.0,
        },
        ANGULAR_ACCELERATION: {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
        FREQUENCY: {"Hz": 1.0, "kHz": 1e3, "1/s": 1.0},
        DIMENSIONLESS.per_second(2): {"1/s^2": 1.0},
        MAGNETIC_FIELD: {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "gauss": 1e-4, "mgauss": 1e-7},
    }.items()
    for name, factor in units.items()
}

_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def parse_unit(name: str, expected: Dimension | None = None) -> Unit:
    """Find a unit by its name.

    Parameters
    ----------
    name
        As it is written in a recipe; ``m/s^2``, ``m/s²`` and ``m/s2`` are the same, and so are ``us`` and ``µs``.
    expected
        The dimension that the unit must have; any if ``None``.

    Raises
    ------
    UnitError
        The unit is unknown, or it is one of another dimension.

    Examples
    --------
    >>> parse_unit("deg/s", ANGULAR_RATE).dimension == ANGULAR_RATE
    True
    """
    unit = _UNITS.get(_normalise(name))
    if unit is None:
        raise UnitError(f'there is no unit "{name}"{_nearest(name, expected)}; {_offer(expected)}')
    if expected is not None and unit.dimension != expected:
        raise UnitError(f'"{name}" is {unit.dimension}, but {_offer(expected)}')
    return unit


def parse_quantity(text: str, expected: Dimension) -> float:
    """Read a number with its unit, and return it in SI.

    Raises
    ------
    UnitError
        The text is not a number with a unit, or the unit does not fit.

    Examples
    --------
    >>> parse_quantity("20 ms", TIME)
    0.02
    """
    match = _QUANTITY.fullmatch(text)
    if match is None or not match[2]:
        raise UnitError(f'"{text}" is not a number with a unit, as in {_example(expected)}')
    return parse_unit(match[2], expected).to_si(float(match[1]))


def _normalise(name: str) -> str:
    """Bring the spellings of one unit together."""
    name = name.strip().replace("²", "^2").replace("µ", "u").replace("μ", "u").replace("°", "deg")
    return re.sub(r"/s2$", "/s^2", name)


def _known(expected: Dimension | None) -> list[str]:
    return [unit.name for unit in _UNITS.values() if expected in (None, unit.dimension)]


def _nearest(name: str, expected: Dimension | None) -> str:
    """Suggest a unit of the right dimension that is written nearly so."""
    folded = {known.lower(): known for known in _known(expected)}
    found = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=0.6)
    return f' (did you mean "{folded[found[0]]}"?)' if found else ""


def _offer(expected: Dimension | None) -> str:
    """Say what would have been right."""
    known = ", ".join(_known(expected))
    if expected is None:
        return f"the known ones are {known}"
    return f"{expected} is expected here: {known}" if known else f"{expected} is expected here"


def _example(expected: Dimension) -> str:
    known = _known(expected)
    return f'"1 {known[0]}"' if known else '"1 m"'
