"""Poles: how fast the errors of a filter vanish, and whether they swing."""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt.plot.designs import COLORS, DesignLike, check_rate, named
from compfilt.plot.sheet import GRID, axes_for, draw_legend, figure_of

__all__ = ["poles"]

Complex = npt.NDArray[np.complex128]

MARKERS = ("x", "o", "s", "^", "D", "v")

ONE = 1e-3
"""Poles that are nearer to each other, relative to the largest, count as one that is there several times."""


def poles(
    design: DesignLike, *, fs: float | None = None, rule: str = "backward_euler", ax: Axes | None = None
) -> Figure:
    """Draw the poles in the s-plane; with fs those of the discrete filter in the z-plane, with the unit circle.

    Parameters
    ----------
    design : LinearFilter or mapping of str to LinearFilter
        What is drawn; several designs by their names are compared.
    fs : float, optional
        The sample rate in Hz.
    rule : {"backward_euler", "matched"}
        How the discrete filter is made; used with fs only.
    ax : Axes, optional
        Where to draw. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        fs is not positive and finite, the rule is unknown, or there are no designs, too many of them, or several axes.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> figure = plot.poles(cf.Butterworth(omega0=2.0))
    >>> figure.axes[0].get_xlabel()
    'real part / (rad/s)'
    """
    designs = named(design)
    check_rate(fs)
    (axes,) = axes_for(ax, (1,), (5.5, 4.5))
    found = {
        name: each.poles if fs is None else _discrete(each.poles, fs, rule) for name, each in designs.items()
    }
    if fs is not None:
        turn = np.linspace(0.0, 2.0 * np.pi, 361)
        axes.plot(np.cos(turn), np.sin(turn), color="0.5", ls="--", lw=0.8, label="unit circle")
    for number, (name, values) in enumerate(found.items()):
        places, counts = _distinct(values)
        look: dict[str, Any] = {
            "color": COLORS[number],
            "mfc": "none",
            "ms": 7.0,
            "mew": 1.4,
            "label": name or None,
        }
        axes.plot(places.real, places.imag, ls="none", marker=MARKERS[number], **look)
        for place, count in zip(places, counts, strict=True):
            if count > 1:
                # Those of several designs may be at one place: each has a line of its own.
                at, shift = (place.real, place.imag), (7.0, 5.0 + 12.0 * number)
                axes.annotate(f"{name} ×{count}".strip(), at, xytext=shift, textcoords="offset points")
    _label(axes, np.concatenate(list(found.values())), discrete=fs is not None)
    return figure_of([axes])


def _discrete(continuous: Complex, fs: float, rule: str) -> Complex:
    """Return where a rule puts the poles in the z-plane."""
    if rule == "backward_euler":
        return 1.0 / (1.0 - continuous / fs)
    if rule == "matched":
        return np.exp(continuous / fs)
    raise ValueError(f'rule must be "backward_euler" or "matched", got "{rule}"')


def _distinct(values: Complex) -> tuple[Complex, list[int]]:
    """Return the places of poles, and how many are at each: multiple roots are never quite equal."""
    groups: list[list[complex]] = []
    for value in values:
        near = [group for group in groups if abs(group[0] - value) <= ONE * np.abs(values).max()]
        if near:
            near[0].append(complex(value))
        else:
            groups.append([complex(value)])
    return np.array([np.mean(group) for group in groups]), [len(group) for group in groups]


def _label(axes: Axes, values: Complex, *, discrete: bool) -> None:
    """Show the axes through 0, a round circle as one, and some room around the poles."""
    for line in (axes.axhline, axes.axvline):
        line(0.0, color="0.5", lw=0.8, zorder=0.5)
    unit = "" if discrete else " / (rad/s)"
    axes.set(xlabel=f"real part{unit}", ylabel=f"imaginary part{unit}")
    if not discrete:
        reach = 1.25 * np.abs(values).max()
        axes.update_datalim([(-reach, -0.7 * reach), (0.25 * reach, 0.7 * reach)])
        axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(**GRID)
    draw_legend(axes)
