"""Bode plots: what a filter takes of either signal at each frequency."""

from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from compfilt.plot.designs import DesignLike, check_rate, design_style, frequencies, label_of, named
from compfilt.plot.sheet import GRID, AxesLike, axes_for, draw_legend, figure_of

__all__ = ["BRANCHES", "bode"]

Rule = Literal["backward_euler", "matched"]
Complex = npt.NDArray[np.complex128]

BRANCHES = {"low": ("-", 1.2), "high": ("--", 1.2), "low + high": (":", 1.8)}
"""The branches: how their lines are drawn, and how wide."""

FLOOR = -80.0
"""Nothing below this many dB is shown."""


def bode(
    design: DesignLike, *, fs: float | None = None, rule: Rule = "backward_euler", ax: AxesLike | None = None
) -> Figure:
    """Draw magnitude and phase of the low branch, of the high branch and of their sum over the frequency.

    The low branch is the response to the measurement, the high branch that to the integrated derivative. In the rate
    filter they are the other way round: see its ``frequency_response``.

    Parameters
    ----------
    design : LinearFilter or mapping of str to LinearFilter
        What is drawn; several designs by their names are compared.
    fs : float, optional
        The sample rate in Hz. With it the discrete filters are drawn, up to half of fs, and the continuous ones thin and grey
        behind them.
    rule : {"backward_euler", "matched"}
        How the discrete filter is made; used with fs only.
    ax : Axes or two of them, optional
        Where to draw: the magnitude on the first, the phase on the second. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        fs is not positive and finite, or there are no designs, too many of them, or more than two axes.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> figure = plot.bode(cf.FirstOrder(tau=0.5), fs=100.0)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['magnitude / dB', 'phase / deg']
    """
    designs = named(design)
    check_rate(fs)
    axes = axes_for(ax, (1, 2), (7.5, 5.5))
    frequency = frequencies(designs.values(), fs)
    omega = 2.0 * np.pi * frequency
    for number, (name, each) in enumerate(designs.items()):
        style = design_style(number, frequency.size)
        if fs is not None:
            behind = {"color": "0.65", "lw": 0.8, "zorder": 1.5}
            _draw(axes, frequency, each.frequency_response(omega), behind, None)
        _draw(axes, frequency, each.frequency_response(omega, fs=fs, rule=rule), style, name)
    if fs is not None:
        axes[0].plot([], [], color="0.65", lw=0.8, label="continuous")
    _label(axes)
    return figure_of(axes)


def _draw(
    axes: list[Axes],
    frequency: npt.NDArray[np.float64],
    response: tuple[Complex, Complex],
    style: dict[str, Any],
    name: str | None,
) -> None:
    """Draw the branches of one filter; without a name they stand behind others that have one."""
    low, high = response
    for (branch, (dashes, width)), values in zip(BRANCHES.items(), (low, high, low + high), strict=True):
        label = None if name is None else label_of(name, branch)
        look = {"ls": dashes, "lw": width, "label": label} | style
        with np.errstate(divide="ignore"):
            axes[0].semilogx(frequency, 20.0 * np.log10(np.abs(values)), **look)
        for each in axes[1:]:
            each.semilogx(frequency, _phase(values, known_last=branch == "high"), **look)


def _phase(values: Complex, *, known_last: bool) -> npt.NDArray[np.float64]:
    """Return the phase in degrees without jumps, near 0 at the end where the branch lets everything pass."""
    phase = np.degrees(np.unwrap(np.angle(values)))
    end = phase[-1] if known_last else phase[0]
    return np.asarray(phase - 360.0 * np.round(end / 360.0))


def _label(axes: list[Axes]) -> None:
    bottom, top = axes[0].get_ylim()
    axes[0].set(ylabel="magnitude / dB", ylim=(max(bottom, FLOOR), top))
    for each in axes[1:]:
        each.set_ylabel("phase / deg")
        each.yaxis.set_major_locator(MultipleLocator(90.0))
    for each in axes:
        each.grid(**GRID)
        each.margins(x=0.0)
    axes[-1].set_xlabel("frequency / Hz")
    draw_legend(axes[0])
