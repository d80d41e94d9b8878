"""How long a simulated log is."""

from compfilt.checks import positive, sample_rate

__all__ = ["samples_in"]

MOST = 1e12
"""Samples: no memory holds so many."""


def samples_in(duration: float, rate: float) -> int:
    """Return the number of samples in `duration` seconds at `rate` Hz.

    Raises
    ------
    ValueError
        One of them is not positive and finite, or there is no sample, or more than memory can hold.
    """
    samples = positive("duration", duration) * sample_rate("rate", rate)
    if not 0.5 < samples < MOST:
        raise ValueError(
            f"duration times rate must be at least one sample and less than {MOST:g}, not {samples:g}"
        )
    return round(samples)
