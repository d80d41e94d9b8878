"""The noise of one channel of a sensor at rest."""

from dataclasses import dataclass

import numpy as np

from compfilt.noise.curves import AllanCurve, Array, Spectrum
from compfilt.noise.deviation import allan
from compfilt.noise.fit import AllanFit, fit_allan
from compfilt.noise.lines import Line, find_lines
from compfilt.noise.steps import find_step
from compfilt.noise.welch import spectrum, white_density

__all__ = ["ChannelNoise", "analyse_channel"]

APART = 1.15
"""Densities of spectrum and Allan curve that are further apart are not those of white noise."""
COARSE = 1.0
"""A step that is more than so many standard deviations of the noise hides it."""


@dataclass(frozen=True)
class ChannelNoise:
    """What one channel shows.

    Attributes
    ----------
    name : str
        As ``"gyro x"``.
    unit : str
        Of the signal: ``"rad/s"`` or ``"m/s^2"``.
    mean, std : float
        Of all samples, in that unit. The mean of a gyro at rest is its bias.
    spectrum : Spectrum
        Welch's, one-sided.
    white : float
        The level of its upper half: two-sided, in unit/√Hz. If the noise is white down to the random walk, it is N of the fit.
    curve : AllanCurve or None
        The overlapping Allan deviation; None of a channel that always reads the same.
    fit : AllanFit or None
        The noises that the curve shows; None where there is no curve, or it is too short.
    lines : tuple of Line
        Vibration and hum.
    step : float or None
        The resolution, in the signal's unit, where it can be seen.
    notes : tuple of str
        What makes these numbers doubtful.
    """

    name: str
    unit: str
    mean: float
    std: float
    spectrum: Spectrum
    white: float
    curve: AllanCurve | None
    fit: AllanFit | None
    lines: tuple[Line, ...]
    step: float | None
    notes: tuple[str, ...]

    @property
    def density(self) -> float:
        """The two-sided density of the white noise that slow filters see, in unit/√Hz: N of the fit, or else `white`."""
        if self.fit is not None and self.fit.random_walk is not None:
            return self.fit.random_walk.value
        return self.white


def analyse_channel(name: str, unit: str, x: Array, fs: float) -> ChannelNoise:
    """Say all that one channel of a sensor at rest shows."""
    found = spectrum(x, fs=fs)
    white = float(white_density(found, len(x) / fs))
    step, lines = find_step(x), find_lines(x, fs=fs)
    if np.ptp(x) == 0.0:
        why = ("always reads the same: it is stuck, or its resolution hides its noise",)
        return ChannelNoise(name, unit, float(x.mean()), 0.0, found, white, None, None, (), None, why)
    curve = allan(x, fs=fs)
    fit, notes = None, []
    try:
        fit = fit_allan(curve)
    except ValueError as error:
        notes.append(f"no noises can be told apart: {error}")
    notes += _doubts(x, fit, white, step, fs)
    return ChannelNoise(
        name, unit, float(x.mean()), float(x.std()), found, white, curve, fit, lines, step, tuple(notes)
    )


def _doubts(x: Array, fit: AllanFit | None, white: float, step: float | None, fs: float) -> list[str]:
    doubts = []
    # From sample to sample, so that no drift counts.
    noise = float(np.std(np.diff(x)) / np.sqrt(2.0))
    if step is not None and step > COARSE * noise:
        doubts.append(
            f"its resolution hides the noise: a step is {step / noise:.1f} standard deviations, so that the density is that of "
            "rounding, or none"
        )
    if fit is None:
        return doubts
    if not fit.consistent:
        doubts.append(
            "white noise, flicker and a random walk do not make this Allan curve: take the numbers with care"
        )
    walk = fit.random_walk
    if walk is not None and not 1.0 / APART < white / walk.value < APART:
        slow = "less" if white < walk.value else "more"
        doubts.append(
            f"its noise is coloured: the upper half of the spectrum has {white / walk.value:.2f} times the density of the Allan "
            f"curve, {slow} than slow filters see" + (", as behind a low-pass" if white < walk.value else "")
        )
    elif fit.shortest > 1.5 / fs:
        doubts.append(f"averaged over less than {fit.shortest:.2g} s its noise is not white")
    return doubts
