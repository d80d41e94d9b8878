"""What pictures of results are made of: lines of any length, shaded rest, flags as a rug."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from compfilt.flags import Flags
from compfilt.plot.bins import Bins
from compfilt.plot.sheet import STYLES, with_unit

__all__ = ["MISSING", "REST", "draw_flags", "draw_lines", "draw_rest", "set_flags", "spans"]

Array = npt.NDArray[np.float64]

TURNS = {"deg": 360.0, "rad": 2.0 * np.pi, "mrad": 2000.0 * np.pi}
"""A turn in the units of angles."""

REST = "at rest"
MISSING = "no value"


def draw_lines(
    axes: Axes, bins: Bins, lines: Mapping[str, str], title: str, unit: str, *, wraps: bool = False
) -> None:
    """Draw columns that share an axis, each with its label; bars along the bottom tell where one has no value.

    Angles that wrap are not joined where they jump by a turn. A value between two gaps is a dot.
    """
    for i, (name, label) in enumerate(lines.items()):
        style = STYLES[i % len(STYLES)]
        points = np.stack(bins.line(name))
        if wraps and unit in TURNS:
            jumps = np.flatnonzero(np.abs(np.diff(points[1])) > 0.9 * TURNS[unit])
            points = np.insert(points, jumps + 1, np.nan, axis=1)
        axes.plot(*points, label=label, **style)
        gaps = np.pad(np.isnan(points[1]), 1, constant_values=True)
        alone = gaps[:-2] & ~gaps[1:-1] & gaps[2:]
        if alone.any():
            axes.plot(*points[:, alone], ".", ms=2.0, color=style["color"])
    _draw_spans(axes, bins, bins.missing(lines), height=0.02, color="black", label=MISSING, zorder=3.0)
    axes.set_ylabel(with_unit(title, unit))
    axes.grid(color="0.9", lw=0.6)
    axes.margins(x=0.0)


def draw_rest(axes: Axes, bins: Bins) -> None:
    """Shade where the body rests."""
    _draw_spans(axes, bins, bins.at_rest, height=1.0, color="0.85", label=REST, zorder=0.5)


def _draw_spans(
    axes: Axes,
    bins: Bins,
    marked: npt.NDArray[np.bool_],
    *,
    height: float,
    color: str,
    label: str,
    zorder: float,
) -> None:
    """Draw bars from the bottom of the axes; one of a single sample is a line of its own width."""
    found = [(start, end - start) for start, end in spans(bins.starts, marked)]
    if found:
        across = axes.get_xaxis_transform()
        axes.broken_barh(
            found, (0.0, height), transform=across, color=color, lw=0.8, zorder=zorder, label=label
        )


def set_flags(flags: npt.NDArray[np.uint8]) -> list[Flags]:
    """List the flags that are set on any sample."""
    return [flag for flag in Flags if (flags & flag).any()]


def draw_flags(axes: Axes, bins: Bins) -> None:
    """Draw a row of ticks for each of the flags that are set."""
    shown = set_flags(bins.flags)
    for row, flag in enumerate(shown):
        times = bins.starts[:-1][(bins.flags & flag) != 0]
        axes.plot(times, np.full(times.size, row), "|", color="black", ms=6.0, mew=0.8)
    names = [str(flag.name).lower().replace("_", " ") for flag in shown] or ["none"]
    axes.set_yticks(range(len(names)), names)
    axes.set(ylabel="flags", ylim=(len(names) - 0.5, -0.5))
    axes.margins(x=0.0)
    axes.update_datalim([(time, 0.0) for time in bins.starts[[0, -1]]])  # also where no flag is
    axes.autoscale_view(scaley=False)


def spans(starts: Array, marked: npt.NDArray[np.bool_]) -> list[tuple[float, float]]:
    """Find from where to where bins are marked; each lasts until the next one starts, and the last start is the end."""
    edges = np.flatnonzero(np.diff(marked, prepend=False, append=False))
    return list(zip(starts[edges[::2]].tolist(), starts[edges[1::2]].tolist(), strict=True))
