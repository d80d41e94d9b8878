"""§1.3 and 1.4: the design rule as a number, from the spectra of both errors to a time constant."""

from typing import NamedTuple

import numpy as np
from scipy import integrate, signal

import compfilt as cf
from cube_filter_tables import Array

TAUS = np.geomspace(0.05, 100.0, 67)
"""Where the error is looked at over tau, in s: twenty a decade."""


class Error(NamedTuple):
    """The error of one signal on all axes: its mean, and the rest's two-sided density, averaged over the axes."""

    mean: Array
    frequency: Array
    density: Array


def spectrum(error: Array, fs: float, seconds: float) -> Error:
    """Take the spectrum of an error, (n, axes), in pieces of `seconds`."""
    mean, length = error.mean(axis=0), min(round(seconds * fs), error.shape[0])
    frequency, density = signal.welch(
        error - mean, fs, nperseg=length, detrend=False, axis=0, return_onesided=False
    )
    chosen = slice(1, length // 2)
    return Error(mean, frequency[chosen], density[chosen].mean(axis=1))


def centred(error: Error) -> Error:
    """Return the error without its mean."""
    return error._replace(mean=np.zeros_like(error.mean))


class Rule(NamedTuple):
    """S0's design rule for the first-order filter as a number: errors of the angle and of its rate in, tau out."""

    fs: float
    angle: Error
    rate: Error

    def rms(self, tau: float) -> float:
        """Return the predicted RMS error in rad: the root of ∫ |LP|² S_y + |HP|² S_u/ω² df and what the means leave."""
        fine = np.geomspace(1e-4, 0.5 * self.fs, 500)
        frequency = np.unique(np.concatenate((fine, self.angle.frequency, self.rate.frequency)))
        low, high = cf.FirstOrder(tau).frequency_response(2.0 * np.pi * frequency, fs=self.fs)
        s = self.fs * (1.0 - np.exp(-2j * np.pi * frequency / self.fs))
        angle, rate = (np.interp(frequency, each.frequency, each.density) for each in (self.angle, self.rate))
        noise = 2.0 * integrate.trapezoid(abs(low) ** 2 * angle + abs(high / s) ** 2 * rate, frequency)
        return float(np.sqrt(noise + np.mean((self.angle.mean + tau * self.rate.mean) ** 2)))

    def best_tau(self) -> float:
        """Return the tau with the least predicted error."""
        return float(min(TAUS, key=self.rms))
