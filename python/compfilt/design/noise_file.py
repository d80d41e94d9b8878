"""The densities in what ``compfilt noise --json`` printed."""

import json
from pathlib import Path
from typing import NamedTuple

__all__ = ["Densities", "read_densities"]


class Densities(NamedTuple):
    """Two-sided densities in SI units, by the names that `from_densities` has, and the rate of their recording in Hz."""

    measurement: float
    derivative: float
    walk: float
    fs: float


def read_densities(path: str | Path) -> Densities:
    """Read them.

    Raises
    ------
    OSError
        The file cannot be read.
    ValueError
        It is something else; the message names it.
    """
    text = Path(path).read_bytes()
    try:
        report = json.loads(text)
        densities = report["densities"]
        measurement, derivative, walk = (
            float(densities[name]) for name in ("measurement", "derivative", "walk")
        )
        return Densities(measurement, derivative, walk, float(report["rate"]))
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        raise ValueError(f"{path}: must be what compfilt noise --json printed") from None
