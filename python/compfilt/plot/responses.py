"""Responses over time: how a filter follows a step, and what a constant error of the derivative leaves."""

from typing import Literal

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt._core import LinearFilter
from compfilt.plot.bins import Bins
from compfilt.plot.designs import DesignLike, check_rate, design_style, named, slowest
from compfilt.plot.sheet import GRID, axes_for, draw_legend, figure_of

__all__ = ["bias_response", "step_response"]

Rule = Literal["backward_euler", "matched"]
Array = npt.NDArray[np.float64]

MOST = 1_000_000
"""How many samples are filtered at most where no sample rate is given."""

TOO_MANY = 10**7
"""How many samples are filtered at most: a second, and some hundred megabytes."""


def step_response(
    design: DesignLike,
    *,
    fs: float | None = None,
    rule: Rule = "backward_euler",
    duration: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw what the filter says while the measurement steps from 0 to 1 and the derivative stays 0.

    It is what the filter's own code gives for these samples. A filter that trusts the derivative follows slowly.

    Parameters
    ----------
    design : LinearFilter or mapping of str to LinearFilter
        What is drawn; several designs by their names are compared.
    fs : float, optional
        The sample rate in Hz. Without it one so high that the sampling does not show.
    rule : {"backward_euler", "matched"}
        How the discrete filter is made.
    duration : float, optional
        How long in s. Without it eight times the longest time constant.
    ax : Axes, optional
        Where to draw. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        fs or duration is not positive and finite, fs * duration is above 10^7, or there are no designs, too many of them, or several axes.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> figure = plot.step_response(cf.FirstOrder(tau=0.5), fs=100.0)
    >>> figure.axes[0].get_xlabel()
    'time / s'
    """
    return _draw(design, "measurement", fs=fs, rule=rule, duration=duration, ax=ax)


def bias_response(
    design: DesignLike,
    *,
    fs: float | None = None,
    rule: Rule = "backward_euler",
    duration: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the error of the estimate that a constant error of the derivative leaves, for an error of 1 that starts at 0 s.

    The unit is that of the measurement per unit of the derivative, s^M for its M-th derivative: a gyro's bias of
    0.01 rad/s leaves a hundredth of what is drawn, in rad. Where the filter estimates the bias it tends to 0. It is what
    the filter's own code gives while the measurement stays 0.

    Parameters
    ----------
    design, fs, rule, duration, ax
        As in :func:`step_response`.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        As in :func:`step_response`, or the designs take derivatives of different order.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> figure = plot.bias_response(cf.PiForm(kp=2.0, ki=1.0), fs=100.0)
    >>> figure.axes[0].get_ylabel()
    'error per unit of bias / s'
    """
    return _draw(design, "derivative", fs=fs, rule=rule, duration=duration, ax=ax)


def _draw(
    design: DesignLike,
    stepped: Literal["measurement", "derivative"],
    *,
    fs: float | None,
    rule: Rule,
    duration: float | None,
    ax: Axes | None,
) -> Figure:
    designs = named(design)
    check_rate(fs)
    if duration is not None and not 0.0 < duration < np.inf:
        raise ValueError(f"duration must be positive and finite, got {duration}")
    orders = {each.derivative_order for each in designs.values()}
    if stepped == "derivative" and len(orders) > 1:
        raise ValueError(
            "design must hold designs that take the same derivative, as their responses share a unit"
        )
    (axes,) = axes_for(ax, (1,), (7.0, 3.5))
    lasts = 8.0 * slowest(designs.values()) if duration is None else duration
    alone = "estimate" if stepped == "measurement" else None
    if fs is not None and fs * lasts > TOO_MANY:
        raise ValueError(
            f"fs * duration must be at most {TOO_MANY:g} samples, got {fs * lasts:.3g}: choose a lower fs"
        )
    for number, (name, each) in enumerate(designs.items()):
        x, y = _response(each, stepped, fs or _fast(each, lasts), rule, lasts)
        style = design_style(number, x.size)
        axes.plot(x, y, ls=("-", "--", "-.")[number % 3], lw=1.2, label=name or alone, **style)
    if stepped == "measurement":
        axes.axhline(1.0, color="0.5", ls=":", lw=1.2, label="measurement")
        axes.set_ylabel("estimate / step")
    else:
        axes.axhline(0.0, color="0.5", lw=0.8, zorder=0.5)
        axes.set_ylabel("error per unit of bias / " + _power_of_s(orders.pop()))
    axes.set_xlabel("time / s")
    axes.grid(**GRID)
    axes.margins(x=0.0)
    draw_legend(axes)
    return figure_of([axes])


def _response(
    design: LinearFilter,
    stepped: Literal["measurement", "derivative"],
    fs: float,
    rule: Rule,
    duration: float,
) -> tuple[Array, Array]:
    """Filter ones against zeros, from rest; a sample stands at the end of its step."""
    samples = max(2, round(duration * fs))
    ones, zeros = np.ones(samples), np.zeros(samples)
    measurement, derivative = (ones, zeros) if stepped == "measurement" else (zeros, ones)
    values = np.append(0.0, design.filter(measurement, derivative, fs=fs, rule=rule, initial=0.0))
    bins = Bins(["estimate"])
    bins.add(np.arange(samples + 1.0) / fs, {"estimate": values})
    return bins.line("estimate")


def _fast(design: LinearFilter, duration: float) -> float:
    """Return a rate of 200 samples in the shortest time constant, as far as that is not too many in all."""
    return float(min(200.0 * np.abs(design.poles).max(), MOST / duration))


def _power_of_s(order: int) -> str:
    return "s" if order == 1 else f"s$^{order}$"
