"""What pictures of results are made of: lines of any length, shaded rest, flags as a rug."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from compfilt.flags import Flags

__all__ = ["draw_flags", "draw_legend", "draw_lines", "draw_rest", "set_flags", "spans", "thin", "with_unit"]

Array = npt.NDArray[np.float64]

POINTS = 4000
"""How many points of a line are drawn at most: more than a screen or a page can show."""

STYLES: tuple[dict[str, Any], ...] = (
    {"color": "black", "ls": "-", "lw": 1.0},
    {"color": "#0072b2", "ls": "--", "lw": 1.4},
    {"color": "#d55e00", "ls": ":", "lw": 1.8},
    {"color": "0.6", "ls": "-", "lw": 1.8},
)
"""Lines that can be told apart in black and white."""


TURNS = {"deg": 360.0, "rad": 2.0 * np.pi, "mrad": 2000.0 * np.pi}
"""A turn in the units of angles."""


REST = "at rest"


def draw_lines(
    axes: Axes, x: Array, lines: Mapping[str, Array], title: str, unit: str, *, wraps: bool = False
) -> None:
    """Draw lines that share an axis; angles that wrap are not joined where they jump by a turn."""
    for i, (name, values) in enumerate(lines.items()):
        rows = thin(values)
        points = np.stack([x[rows], values[rows]])
        if wraps and unit in TURNS:
            jumps = np.flatnonzero(np.abs(np.diff(points[1])) > 0.9 * TURNS[unit])
            points = np.insert(points, jumps + 1, np.nan, axis=1)
        axes.plot(*points, label=name, **STYLES[i % len(STYLES)])
    axes.set_ylabel(with_unit(title, unit))
    axes.grid(color="0.9", lw=0.6)
    axes.margins(x=0.0)


def draw_rest(axes: Axes, x: Array, rest: npt.NDArray[np.generic]) -> None:
    """Shade where the body rests."""
    found = [(start, end - start) for start, end in spans(x, rest)]
    if found:
        across = axes.get_xaxis_transform()
        axes.broken_barh(found, (0.0, 1.0), transform=across, color="0.85", lw=0.5, zorder=0.5, label=REST)


def draw_legend(axes: Axes, *, rest: bool) -> None:
    """Name what is drawn beside the axes, where nothing is hidden; the shaded rest only if asked for."""
    handles, labels = axes.get_legend_handles_labels()
    named = [pair for pair in zip(handles, labels, strict=True) if rest or pair[1] != REST]
    if named:
        axes.legend(*zip(*named, strict=True), loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def set_flags(flags: npt.NDArray[np.generic]) -> list[Flags]:
    """List the flags that are set on any sample."""
    return [flag for flag in Flags if (flags.astype(np.uint8) & flag).any()]


def draw_flags(axes: Axes, x: Array, flags: npt.NDArray[np.generic], shown: Sequence[Flags]) -> None:
    """Draw a row of ticks for each of the flags."""
    for row, flag in enumerate(shown):
        rows = np.flatnonzero(flags.astype(np.uint8) & flag)
        # One tick in each of as many places as a line has points.
        _, first = np.unique(rows * POINTS // flags.size, return_index=True)
        axes.plot(x[rows[first]], np.full(first.size, row), "|", color="black", ms=6.0, mew=0.8)
    names = [str(flag.name).lower().replace("_", " ") for flag in shown] or ["none"]
    axes.set_yticks(range(len(names)), names)
    axes.set(ylabel="flags", ylim=(len(names) - 0.5, -0.5))
    axes.margins(x=0.0)


def thin(values: Array) -> npt.NDArray[np.intp]:
    """Choose the rows that draw the same line: both ends, and of every stretch the least and the greatest value."""
    if values.size <= POINTS:
        return np.arange(values.size)
    width = -(-2 * values.size // (POINTS - 2))
    starts = np.arange(0, values.size, width)
    padded = np.full(starts.size * width, np.nan)
    padded[: values.size] = values
    stretches = padded.reshape(starts.size, width)
    missing = np.isnan(stretches)
    least = starts + np.where(missing, np.inf, stretches).argmin(axis=1)
    greatest = starts + np.where(missing, -np.inf, stretches).argmax(axis=1)
    return np.unique(np.concatenate([[0, values.size - 1], least, greatest]))


def spans(x: Array, rest: npt.NDArray[np.generic]) -> list[tuple[float, float]]:
    """Find from where to where the body rests.

    A sample lasts until the next one. Pauses that are too short to be seen are left out.
    """
    edges = np.flatnonzero(np.diff(rest.astype(np.bool_), prepend=False, append=False))
    starts, ends = x[edges[::2]], x[np.minimum(edges[1::2], x.size - 1)]
    if not starts.size:
        return []
    apart = np.flatnonzero(starts[1:] - ends[:-1] > (x[-1] - x[0]) / POINTS)
    firsts, lasts = np.append(0, apart + 1), np.append(apart, starts.size - 1)
    return list(zip(starts[firsts].tolist(), ends[lasts].tolist(), strict=True))


def with_unit(name: str, unit: str) -> str:
    """Write a quantity and its unit; nothing for plain numbers."""
    if unit in ("", "1"):
        return name
    return f"{name} / ({unit})" if "/" in unit else f"{name} / {unit}"
