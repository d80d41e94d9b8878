"""The densities in what ``compfilt noise --json`` printed."""

import json
from pathlib import Path
from typing import NamedTuple

from compfilt.checks import positive, sample_rate

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
        It is something else, or a number in it breaks its rule; the message names the file.
    """
    text = Path(path).read_bytes()
    try:
        report = json.loads(text)
        found = {name: float(report["densities"][name]) for name in ("measurement", "derivative", "walk")}
        rate = float(report["rate"])
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        raise ValueError(f"{path}: must be what compfilt noise --json printed") from None
    try:
        checked = {name: positive(f"densities.{name}", number, zero=True) for name, number in found.items()}
        return Densities(**checked, fs=sample_rate("rate", rate))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
