"""Numbers that several parts of the library know."""

from typing import Final

__all__ = ["HIGHEST_ORDER", "STANDARD_GRAVITY"]

STANDARD_GRAVITY: Final = 9.80665
"""One g in m/s², exact by definition."""

HIGHEST_ORDER: Final = 6
"""The highest order of a chain; the core refuses more."""
