"""What all pictures share: where they are drawn, lines that can be told apart in black and white, labels with units."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["GRID", "STYLES", "AxesLike", "axes_for", "draw_legend", "figure_of", "with_unit", "written"]

AxesLike = Axes | Sequence[Axes]

STYLES: tuple[dict[str, Any], ...] = (
    {"color": "black", "ls": "-", "lw": 1.0},
    {"color": "#0072b2", "ls": "--", "lw": 1.4},
    {"color": "#d55e00", "ls": ":", "lw": 1.8},
    {"color": "0.6", "ls": "-", "lw": 1.8},
)
"""Lines that can be told apart in black and white."""

GRID: dict[str, Any] = {"color": "0.9", "lw": 0.6}


def axes_for(
    ax: AxesLike | None, counts: Iterable[int], size: tuple[float, float] = (7.0, 4.5)
) -> list[Axes]:
    """Return the axes that were given, or as many as the last of the counts, one below the other, on a new figure.

    Raises
    ------
    ValueError
        There are as many as no picture of this kind has.
    """
    allowed = list(counts)
    if ax is None:
        from matplotlib import pyplot as plt  # noqa: PLC0415 - only this needs windows

        figure = plt.figure(figsize=size, layout="constrained")
        return list(figure.subplots(allowed[-1], sharex=True, squeeze=False)[:, 0])
    given = list(np.ravel(np.array(ax, dtype=object)))
    if len(given) not in allowed:
        rule = " or ".join(("no", "one", "two")[count] if count < 3 else str(count) for count in allowed)
        raise ValueError(f"ax must be {rule} axes, got {len(given)}")
    return given


def figure_of(axes: Sequence[Axes]) -> Figure:
    """Return the figure that axes are on, whatever is between them."""
    figure: Figure = axes[0].figure.figure
    return figure


def draw_legend(axes: Axes, *, without: Iterable[str] = ()) -> None:
    """Name what is drawn beside the axes, where nothing is hidden."""
    hidden = set(without)
    handles, labels = axes.get_legend_handles_labels()
    named = [pair for pair in zip(handles, labels, strict=True) if pair[1] not in hidden]
    if named:
        axes.legend(*zip(*named, strict=True), loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def with_unit(name: str, unit: str) -> str:
    """Write a quantity and its unit; nothing for plain numbers."""
    if unit in ("", "1"):
        return name
    return f"{name} / ({written(unit)})" if "/" in unit else f"{name} / {written(unit)}"


def written(unit: str) -> str:
    """Write the powers of a unit above the line."""
    return unit.replace("^2", "²").replace("^3", "³")
