"""Whether a measured spectrum is that of white noise."""

import numpy as np

from compfilt.design.source import Source

__all__ = ["colour"]

DEVIATIONS = 4.0
"""How many standard errors an octave has to differ by."""

TOLERATED = 1.2
"""A ratio of densities that no gain minds: the best gain of the first-order filter is in proportion to it."""

OVERLAP = 2.0
"""Neighbouring points of Welch's estimate share data: the variance of their mean is about so many times as large."""


def colour(source: Source) -> tuple[float, float]:
    """Return by what ratio the density of the loudest octave exceeds that of the quietest, and at which frequency.

    The ratio is that of densities in unit/√Hz, the frequency in Hz. The ratio is 1 where the difference can be chance. The standard error of an octave's mean is taken from the scatter of the
    points within it, by their median deviation: a line does not hide behind its own height.
    """
    if source.frequency is None or source.power is None:
        return 1.0, 0.0
    octave = np.floor(np.log2(source.frequency / source.frequency[0]))
    means, errors, places = [], [], []
    for each in np.unique(octave):
        points = source.power[octave == each]
        if points.size < 4:
            continue
        means.append(points.mean())
        scatter = 1.4826 * np.median(np.abs(points - np.median(points)))
        errors.append(scatter * np.sqrt(OVERLAP / points.size))
        places.append(source.frequency[octave == each][np.argmax(points)])
    if not means:
        return 1.0, 0.0
    quiet, loud = int(np.argmin(means)), int(np.argmax(means))
    apart = means[loud] - means[quiet] > DEVIATIONS * np.hypot(errors[loud], errors[quiet])
    ratio = float(np.sqrt(means[loud] / means[quiet])) if means[quiet] else np.inf
    return (ratio, float(places[loud])) if apart and ratio > TOLERATED else (1.0, 0.0)
