"""Spectra: the noise of both signals, what each branch lets through, and what comes out."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt._core import LinearFilter
from compfilt.plot.designs import check_rate
from compfilt.plot.sheet import GRID, AxesLike, axes_for, draw_legend, figure_of

if TYPE_CHECKING:
    from compfilt.noise import Spectrum  # SciPy is not needed to draw

__all__ = ["spectra"]

Array = npt.NDArray[np.float64]


def spectra(
    measurement: "Spectrum",
    derivative: "Spectrum",
    design: LinearFilter,
    *,
    unit: str = "",
    fs: float | None = None,
    ax: AxesLike | None = None,
) -> Figure:
    """Draw the noise of both signals as it reaches the estimate, over the power that each branch lets through.

    With the spectra S_y of the measurement and S_u of its M-th derivative the output has ``|LP|² S_y + |HP|² S_u/ω^(2M)``.
    Its standard deviation over the frequencies drawn stands in the legend.

    Parameters
    ----------
    measurement, derivative : Spectrum
        The noise of the two signals, each recorded at rest, from :func:`compfilt.noise.spectrum`: one-sided power densities of
        one channel, in unit²/Hz and (unit/s^M)²/Hz. Drawn where the frequencies of both overlap.
    design : LinearFilter
        The filter. Not a rate filter, whose branches take the other signal.
    unit : str
        That of the measurement, such as "rad".
    fs : float, optional
        The sample rate in Hz of the discrete filter by backward Euler; the continuous one where it is left out.
    ax : Axes or two of them, optional
        Where to draw: the spectra on the first, the power of the branches on the second. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        A spectrum is not of one channel, the frequencies do not overlap, fs is not positive and finite, or there are more
        than two axes.

    Examples
    --------
    White noise of 0.02 rad and of 0.01 rad/s, both sampled at 100 Hz:

    >>> import numpy as np
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> from compfilt.noise import Spectrum
    >>> frequency = np.linspace(0.0, 50.0, 501)
    >>> angle = Spectrum(frequency, np.full(501, 2 * 0.02**2 / 100))
    >>> rate = Spectrum(frequency, np.full(501, 2 * 0.01**2 / 100))
    >>> figure = plot.spectra(angle, rate, cf.FirstOrder(tau=2.0), unit="rad")
    >>> figure.axes[0].get_ylabel()
    'power density / (rad²/Hz)'
    """
    check_rate(fs)
    frequency, of_y, of_u = _common(measurement, derivative, fs)
    omega = 2.0 * np.pi * frequency
    low, high = (np.abs(branch) ** 2 for branch in design.frequency_response(omega, fs=fs))
    integrated = of_u / omega ** (2 * design.derivative_order)
    output = low * of_y + high * integrated
    deviation = float(np.sqrt(np.sum((output[1:] + output[:-1]) / 2.0 * np.diff(frequency))))
    axes = axes_for(ax, (1, 2), (8.0, 6.0))
    dotted: Any = (0, (1, 1))
    lines: tuple[tuple[Array, str, str, Any, float], ...] = (
        (of_y, "measurement", "0.6", "-", 1.0),
        (integrated, "derivative, integrated", "0.6", "--", 1.0),
        (low * of_y, "through the low branch", "#0072b2", "-.", 1.2),
        (high * integrated, "through the high branch", "#d55e00", dotted, 1.4),
        (output, f"output, σ = {deviation:.2g} {unit}".rstrip(), "black", "-", 1.6),
    )
    for values, label, color, dashes, width in lines:
        axes[0].loglog(frequency, values, color=color, ls=dashes, lw=width, label=label)
    axes[0].set_ylabel(f"power density / ({_squared(unit)}/Hz)")
    for each in axes[1:]:
        each.loglog(frequency, low, color="#0072b2", ls="-.", lw=1.2, label="|LP|²")
        each.loglog(frequency, high, color="#d55e00", ls=dotted, lw=1.4, label="|HP|²")
        each.set_ylabel("power of the branch")
    _finish(axes)
    return figure_of(axes)


def _common(measurement: "Spectrum", derivative: "Spectrum", fs: float | None) -> tuple[Array, Array, Array]:
    """Return the frequencies above 0 that both spectra have, and both densities there."""
    for name, each in (("measurement", measurement), ("derivative", derivative)):
        if each.density.shape != each.frequency.shape:
            raise ValueError(
                f"{name} must be the spectrum of one channel, got a density of shape {each.density.shape}"
            )
    top = min(measurement.frequency[-1], derivative.frequency[-1], np.inf if fs is None else fs / 2.0)
    bottom = max(
        each.frequency[each.frequency > 0.0].min(initial=np.inf) for each in (measurement, derivative)
    )
    # The finer of the two grids, so that no narrow line of a spectrum is lost.
    finer = max((measurement, derivative), key=lambda each: np.count_nonzero(each.frequency <= top))
    frequency = finer.frequency[(finer.frequency >= bottom) & (finer.frequency <= top)]
    if frequency.size < 2:
        raise ValueError("measurement and derivative must have spectra whose frequencies overlap")
    of_y, of_u = (np.interp(frequency, each.frequency, each.density) for each in (measurement, derivative))
    return frequency, of_y, of_u


def _finish(axes: list[Axes]) -> None:
    for each in axes:
        each.grid(**GRID)
        each.margins(x=0.0)
        draw_legend(each)
    axes[-1].set_xlabel("frequency / Hz")


def _squared(unit: str) -> str:
    """Write the square of a unit."""
    if not unit:
        return "1"
    return f"({unit})²" if "/" in unit else f"{unit}²"
