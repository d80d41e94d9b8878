"""Allan plots: what averaging does to the noise of a sensor, and the coefficients that a fit finds in it."""

from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt.plot.designs import COLORS, MARKERS
from compfilt.plot.sheet import GRID, axes_for, draw_legend, figure_of, with_unit, written

if TYPE_CHECKING:
    from compfilt.noise import AllanCurve  # SciPy is not needed to draw

__all__ = ["allan"]

Array = npt.NDArray[np.float64]


class Fitted(Protocol):
    """A coefficient of a fit."""

    @property
    def value(self) -> float:
        """The best value."""


class Fit(Protocol):
    """What is drawn of a fit: see ``compfilt.noise.fit_allan``."""

    @property
    def random_walk(self) -> Fitted | None:
        """N of white noise, two-sided density, in unit/√Hz."""

    @property
    def bias_instability(self) -> Fitted | None:
        """B of flicker noise, in the signal's unit."""

    @property
    def rate_random_walk(self) -> Fitted | None:
        """K of the random walk of the bias, in unit·√Hz."""

    def deviation(self, tau: Array) -> Array:
        """Return the fitted curve."""


def allan(
    curve: "AllanCurve",
    fit: Fit | None = None,
    *,
    label: str | None = None,
    unit: str = "",
    ax: Axes | None = None,
) -> Figure:
    """Draw an Allan deviation over the averaging time, with its confidence, and a fit with its coefficients.

    Several curves are compared by drawing one after the other on the same axes: each has a marker of its own.

    Parameters
    ----------
    curve : AllanCurve
        From :func:`compfilt.noise.allan`; its 68 % confidence is shaded.
    fit : AllanFit, optional
        From ``compfilt.noise.fit_allan``: drawn dashed, the measured points without a line; its coefficients stand in the legend as
        far as the curve shows them. N is a two-sided density; one-sided densities of data sheets are √2 times as large.
    label : str, optional
        The curve's name in the legend.
    unit : str
        That of the signal, such as "rad/s".
    ax : Axes, optional
        Where to draw. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        There are several axes.

    Examples
    --------
    White noise of 0.01 (rad/s)/√Hz:

    >>> import numpy as np
    >>> from compfilt import plot
    >>> from compfilt.noise import AllanCurve
    >>> tau = np.geomspace(0.01, 100.0, 30)
    >>> figure = plot.allan(AllanCurve(tau, 0.01 / tau**0.5, 0.009 / tau**0.5, 0.011 / tau**0.5), unit="rad/s")
    >>> figure.axes[0].get_ylabel()
    'Allan deviation / (rad/s)'
    """
    (axes,) = axes_for(ax, (1,), (7.5, 4.5))
    number = sum(line.get_gid() == "allan" for line in axes.lines) % len(COLORS)
    color, marker = COLORS[number], MARKERS[number] or "x"
    axes.fill_between(curve.tau, curve.low, curve.high, color=color, alpha=0.2, lw=0.0)
    look = {"color": color, "marker": marker, "ms": 4.0, "mfc": "white", "lw": 1.0 if fit is None else 0.0}
    axes.loglog(curve.tau, curve.deviation, label=label or "measured", gid="allan", **look)
    if fit is not None:
        coefficients = _coefficients(fit, written(unit)) or ["nothing found"]
        name = "\n".join(("fit: " + coefficients[0], *coefficients[1:]))
        axes.loglog(curve.tau, fit.deviation(curve.tau), color=color, ls="--", lw=1.6, label=name)
    axes.set(xlabel="averaging time τ / s", ylabel=with_unit("Allan deviation", unit))
    axes.grid(which="both", **GRID)
    draw_legend(axes)
    return figure_of([axes])


def _coefficients(fit: Fit, unit: str) -> list[str]:
    """Write the coefficients that the curve shows, with their units."""
    base = f"({unit})" if "/" in unit else unit
    found = (
        ("N", fit.random_walk, f"{base}/√Hz" if base else "/√Hz"),
        ("B", fit.bias_instability, unit),
        ("K", fit.rate_random_walk, f"{base}·√Hz" if base else "√Hz"),
    )
    return [f"{name} = {each.value:.2g} {of}".rstrip() for name, each, of in found if each is not None]
