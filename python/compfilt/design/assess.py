"""From a design and the noise to everything that is told about it."""

from collections.abc import Sequence

import numpy as np

from compfilt._core import LinearFilter
from compfilt.design.prediction import NoiseModel
from compfilt.design.result import Designed
from compfilt.design.running import Rule, rate_for
from compfilt.design.sensitivity import sensitivity
from compfilt.design.source import Noise, Source
from compfilt.design.whiteness import colour

__all__ = ["assess", "assessed"]

FAST = 0.2
"""A pole times the sample period above which backward Euler's filter is visibly another than the continuous one."""


def assess(
    design: LinearFilter,
    *,
    fs: float,
    measurement: Noise,
    derivative: Noise = 0.0,
    walk: float | Sequence[float] = 0.0,
    bias: float = 0.0,
    rule: Rule = "backward_euler",
) -> Designed:
    """Say what a design that is chosen already makes of the noise: prediction, sensitivity to each gain, warnings.

    Parameters
    ----------
    design : LinearFilter
        Any linear design but `RateFilter`.
    fs, measurement, derivative, walk, bias, rule
        As in `predict`.

    Returns
    -------
    Designed

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the rule does not go with the design.
    TypeError
        If an argument is of another kind.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.design import assess
    >>> assessed = assess(cf.FirstOrder(5.0), fs=100.0, measurement=0.01, derivative=0.002)
    >>> [round(abs(gain.slope), 3) for gain in assessed.sensitivity]  # it is the best gain
    [0.0]
    """
    noise = NoiseModel.of(measurement, derivative, walk, bias)
    return assessed(design, noise, fs, rule)


def assessed(design: LinearFilter, noise: NoiseModel, fs: float | None, rule: Rule) -> Designed:
    """Predict the error and its sensitivities, and look for what the gains' assumptions do not hold for."""
    if fs is None:
        return Designed(design)
    fs = rate_for(design, fs)
    prediction = noise.predict(design, fs, rule)
    warnings = (
        *_against_the_rate(design, fs, rule),
        *_against_the_spectrum("measurement", noise.measurement, design, fs),
        *_against_the_spectrum("derivative", noise.derivative, design, fs),
    )
    changed = sensitivity(design, lambda other: noise.predict(other, fs, rule).sigma)
    return Designed(design, prediction, changed, warnings)


def _against_the_rate(design: LinearFilter, fs: float, rule: Rule) -> list[str]:
    fastest = float(np.abs(design.poles).max())
    if rule == "matched" or fastest <= FAST * fs:
        return []
    moved = fs * np.log1p(fastest / fs)
    return [
        f"the fastest pole, {fastest:.3g} rad/s, is fast for {fs:g} Hz: backward Euler moves it to {moved:.3g} rad/s"
    ]


def _against_the_spectrum(name: str, source: Source, design: LinearFilter, fs: float) -> list[str]:
    if source.frequency is None:
        return []
    found = []
    lowest, highest = float(source.frequency[0]), float(source.frequency[-1])
    slowest = float(np.abs(design.poles).min()) / (2.0 * np.pi)
    if slowest < lowest:
        found.append(
            f"the spectrum of the {name} begins at {lowest:.3g} Hz, above the filter's {slowest:.3g} Hz: what lies below "
            "is taken as flat; a longer recording would tell"
        )
    if highest < 0.45 * fs:
        found.append(
            f"the spectrum of the {name} ends at {highest:.3g} Hz, below half of fs = {fs:g} Hz: what lies above is taken "
            "as flat"
        )
    ratio, at = colour(source)
    if ratio > 1.0:
        found.append(
            f"the noise of the {name} is not white: its density at {at:.3g} Hz is {ratio:.2g} times that of its quietest "
            "octave, so closed forms for white noise do not hold"
        )
    return found
