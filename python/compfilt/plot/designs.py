"""What the pictures of designs share: their names, the frequencies and the times that show all of them."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from compfilt._core import LinearFilter
from compfilt.checks import positive

__all__ = [
    "COLORS",
    "MARKERS",
    "DesignLike",
    "check_rate",
    "design_style",
    "frequencies",
    "label_of",
    "named",
    "slowest",
]

Array = npt.NDArray[np.float64]

DesignLike = LinearFilter | Mapping[str, LinearFilter]
"""A design, or several by the names that the legend gives them."""

MARKERS = ("", "o", "s", "^", "D", "v")
COLORS = ("black", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "0.5")


def named(design: DesignLike) -> dict[str, LinearFilter]:
    """Return designs by their names; one alone has the name "".

    Raises
    ------
    ValueError
        There are none, or more than can be told apart.
    TypeError
        One is not a design.
    """
    designs = dict(design) if isinstance(design, Mapping) else {"": design}
    if not 1 <= len(designs) <= len(MARKERS):
        raise ValueError(f"design must hold 1 to {len(MARKERS)} designs, got {len(designs)}")
    for each in designs.values():
        if not isinstance(each, LinearFilter):
            raise TypeError(f"design must be a linear filter or a mapping of them, got {type(each).__name__}")
    return designs


def design_style(number: int, points: int) -> dict[str, Any]:
    """Return colour and markers that tell one of several designs from the others, also in black and white."""
    every = max(points // 8, 1)
    offset = number * every // len(MARKERS)
    return {
        "color": COLORS[number],
        "marker": MARKERS[number],
        "ms": 4.0,
        "mfc": "white",
        "markevery": (offset, every),
    }


def label_of(name: str, what: str) -> str:
    """Name a line of one of several designs."""
    return f"{name}: {what}" if name else what


def check_rate(fs: float | None) -> None:
    """Raise ValueError if the sample rate is not one."""
    if fs is not None:
        positive("fs", fs)


def frequencies(designs: Iterable[LinearFilter], fs: float | None) -> Array:
    """Return frequencies in Hz, from far below all poles to far above; with fs up to half of it."""
    speeds = np.concatenate([np.abs(each.poles) for each in designs]) / (2.0 * np.pi)
    low, high = speeds.min() / 100.0, speeds.max() * 100.0
    if fs is not None:
        low, high = min(low, fs / 200.0), fs / 2.0
    return np.geomspace(low, high, 400)


def slowest(designs: Iterable[LinearFilter]) -> float:
    """Return the longest time constant of all modes in s."""
    return float(max(1.0 / -each.poles.real.max() for each in designs))
