"""Spectra: the noise of a signal; that of both signals with the branches over it, and what comes out."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt._core import LinearFilter
from compfilt.plot.averages import Averages, averages, draw_density
from compfilt.plot.designs import COLORS, MARKERS, check_rate
from compfilt.plot.sheet import GRID, axes_for, draw_legend, figure_of, written

if TYPE_CHECKING:
    from compfilt.noise import Spectrum  # SciPy is not needed to draw

__all__ = ["spectra", "spectrum"]

Array = npt.NDArray[np.float64]


def spectrum(
    noise: "Spectrum", *, label: str | None = None, unit: str = "", ax: Axes | None = None
) -> Figure:
    """Draw the noise of one channel as data sheets give it: the root of its one-sided power density over the frequency.

    At most 50 points a decade are drawn, each the mean power around it. The pale band goes from the least to the greatest
    density there, so that a narrow line of a vibration stands out of it. Several channels are compared by drawing one after the
    other on the same axes.

    Parameters
    ----------
    noise : Spectrum
        From :func:`compfilt.noise.spectrum`, of one channel.
    label : str, optional
        The channel's name in the legend.
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
        The spectrum is not of one channel or has no frequency above 0, or there are several axes.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import plot
    >>> from compfilt.noise import Spectrum
    >>> frequency = np.linspace(0.0, 50.0, 501)
    >>> figure = plot.spectrum(Spectrum(frequency, np.full(501, 1e-6)), unit="rad/s")
    >>> figure.axes[0].get_ylabel()
    'one-sided density / ((rad/s)/√Hz)'
    """
    _check("noise", noise)
    (axes,) = axes_for(ax, (1,), (7.5, 4.5))
    number = sum(line.get_gid() == "spectrum" for line in axes.lines) % len(COLORS)
    above = noise.frequency > 0.0
    if not above.any():
        raise ValueError("noise must have frequencies above 0")
    power = averages(noise.frequency[above], noise.density[above])
    look = {"color": COLORS[number], "marker": MARKERS[number], "ms": 4.0, "mfc": "white", "lw": 1.0}
    every = (number * 2, len(MARKERS) * 2)
    amplitudes = Averages(power.frequency, *(np.sqrt(values) for values in power[1:]))
    draw_density(axes, amplitudes, label=label, gid="spectrum", markevery=every, **look)
    axes.set(xlabel="frequency / Hz", ylabel=f"one-sided density / ({_base(unit)}/√Hz)")
    axes.grid(which="both", **GRID)
    axes.margins(x=0.0)
    draw_legend(axes)
    return figure_of([axes])


def spectra(
    measurement: "Spectrum",
    derivative: "Spectrum",
    design: LinearFilter,
    *,
    unit: str = "",
    fs: float | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the noise of both signals as it reaches the estimate, what comes out, and over them what each branch lets through.

    With the spectra S_y of the measurement and S_u of its M-th derivative the output has ``|LP|² S_y + |HP|² S_u/ω^(2M)``.
    Its standard deviation over the frequencies drawn stands in the legend. The branches ``|LP|²`` and ``|HP|²`` have the axis on the
    right, on which a decade is as high as on the left: the best filter crosses over about where the noises cross.

    At most 50 points a decade are drawn, each the mean power around it; the pale bands go from the least to the greatest
    density there, so that a narrow line of a vibration stands out of them.

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
    ax : Axes, optional
        Where to draw. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        A spectrum is not of one channel, the frequencies do not overlap, fs is not positive and finite, or there are several
        axes.

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
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['power density / (rad²/Hz)', 'power that a branch lets through']
    """
    check_rate(fs)
    frequency, of_y, of_u = _common(measurement, derivative, fs)
    omega = 2.0 * np.pi * frequency
    low, high = (np.abs(branch) ** 2 for branch in design.frequency_response(omega, fs=fs))
    integrated = of_u / omega ** (2 * design.derivative_order)
    output = low * of_y + high * integrated
    deviation = float(np.sqrt(np.sum((output[1:] + output[:-1]) / 2.0 * np.diff(frequency))))
    (axes,) = axes_for(ax, (1,), (8.0, 5.5))
    lines: tuple[tuple[Array, str, str, str, float], ...] = (
        (of_y, "measurement", "0.6", "-", 1.2),
        (integrated, "derivative, integrated", "0.6", "--", 1.2),
        (output, f"output, σ = {deviation:.2g} {unit}".rstrip(), "black", "-", 1.8),
    )
    for values, label, color, dashes, width in lines:
        draw_density(axes, averages(frequency, values), color=color, ls=dashes, lw=width, label=label)
    squared = f"{_base(unit)}²" if unit else "1"
    axes.set(xlabel="frequency / Hz", ylabel=f"power density / ({squared}/Hz)")
    axes.grid(**GRID)
    axes.margins(x=0.0)
    _draw_branches(axes, frequency, low, high)
    return figure_of([axes])


def _draw_branches(axes: Axes, frequency: Array, low: Array, high: Array) -> None:
    """Draw the power of the branches over the spectra, and name all lines above them."""
    right = axes.twinx()
    dotted: Any = (0, (1, 1))
    for values, label, color, dashes in (
        (low, "|LP|², right axis", "#0072b2", "-."),
        (high, "|HP|², right axis", "#d55e00", dotted),
    ):
        shown = averages(frequency, values)
        right.loglog(shown.frequency, shown.mean, color=color, ls=dashes, lw=1.6, label=label)
    bottom, top = axes.get_ylim()
    right.set(ylabel="power that a branch lets through", ylim=(2.0 * bottom / top, 2.0))
    right.margins(x=0.0)
    named = [each.get_legend_handles_labels() for each in (axes, right)]
    handles, labels = ([*left, *over] for left, over in zip(*named, strict=True))
    # Above the axes: the right axis has its numbers where other pictures have the legend.
    axes.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False)


def _common(measurement: "Spectrum", derivative: "Spectrum", fs: float | None) -> tuple[Array, Array, Array]:
    """Return the frequencies above 0 that both spectra have, and both densities there."""
    _check("measurement", measurement)
    _check("derivative", derivative)
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


def _check(name: str, noise: "Spectrum") -> None:
    if noise.density.shape != noise.frequency.shape:
        raise ValueError(
            f"{name} must be the spectrum of one channel, got a density of shape {noise.density.shape}"
        )


def _base(unit: str) -> str:
    """Write a unit so that a power of it, or a quotient, can be written behind it."""
    return f"({written(unit)})" if "/" in unit else written(unit) or "1"
