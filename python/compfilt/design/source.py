"""The noise of one signal, as a density or as a spectrum."""

from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from compfilt.checks import positive

__all__ = ["MeasuredSpectrum", "Noise", "Source", "as_source"]

Array = npt.NDArray[np.float64]

BANDS = 60
"""Points a decade in which spectra are averaged and integrals taken."""


class MeasuredSpectrum(Protocol):
    """What `compfilt.noise.Spectrum` has: frequencies in Hz and one-sided power densities, (m,) or (m, channels)."""

    @property
    def frequency(self) -> Array:
        """In Hz."""

    @property
    def density(self) -> Array:
        """The signal's unit squared per Hz, one-sided."""


Noise: TypeAlias = "float | MeasuredSpectrum"
"""A two-sided density in unit/√Hz, or a measured spectrum."""


@dataclass(frozen=True)
class Source:
    """A noise: white of the two-sided density `white` in unit/√Hz, or by a spectrum.

    `frequency` in Hz and `power`, the two-sided power density in unit²/Hz, are averages over narrow bands; both are None
    for white noise.
    """

    white: float
    frequency: Array | None = None
    power: Array | None = None

    def power_at(self, frequency: Array) -> Array:
        """Return the two-sided power density; beyond the measured frequencies that of the nearest one."""
        if self.frequency is None or self.power is None:
            return np.full(frequency.shape, self.white**2)
        return np.interp(frequency, self.frequency, self.power)

    @property
    def silent(self) -> bool:
        """Whether there is no noise at all."""
        return self.white == 0.0


def as_source(name: str, noise: Noise) -> Source:
    """Check a density or a spectrum.

    Raises
    ------
    ValueError
        If it is negative or not finite, or the spectrum's shapes do not fit.
    TypeError
        If it is neither a number nor has `frequency` and `density`.
    """
    if not (hasattr(noise, "frequency") and hasattr(noise, "density")):
        return Source(positive(name, noise, zero=True))
    frequency, density = np.asarray(noise.frequency, float), np.asarray(noise.density, float)
    if density.ndim == 2:
        density = density.mean(axis=1)
    if frequency.ndim != 1 or density.shape != frequency.shape:
        raise ValueError(f"{name} must have one frequency for each row of its density")
    # The mean of the signal is not its noise.
    frequency, density = frequency[frequency > 0.0], density[frequency > 0.0]
    if frequency.size < 2 or not (np.diff(frequency) > 0.0).all():
        raise ValueError(f"{name} must have at least two rising frequencies above 0")
    if not (np.isfinite(density).all() and (density >= 0.0).all()):
        raise ValueError(f"{name} must have a finite density that is not negative")
    frequency, power = _in_bands(frequency, density / 2.0)
    return Source(float(np.sqrt(power.mean())), frequency, power)


def _in_bands(frequency: Array, power: Array) -> tuple[Array, Array]:
    """Average over bands of equal width on a logarithmic scale; where the spectrum is coarser it stays."""
    band = np.floor(BANDS * np.log10(frequency / frequency[0]))
    _, index = np.unique(band, return_inverse=True)
    counts = np.bincount(index)
    return np.bincount(index, frequency) / counts, np.bincount(index, power) / counts
