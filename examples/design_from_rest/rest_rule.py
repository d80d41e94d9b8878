"""The gains by the noise at rest, and how one sees that it is not all there is."""

from types import SimpleNamespace

import numpy as np
from scipy import signal

import compfilt as cf
from compfilt.design import Designed, check_residual, from_densities, from_spectra, residual_sigma
from rest_trials import Array, Trial

SEGMENT = 4096
"""Samples in a segment of a spectrum: 14 s."""


def tilt_at_rest(trial: Trial) -> Array:
    """Return the two angles by which the measured vertical leaves its mean at rest, in rad."""
    force = trial.acc[: trial.rest]
    up = force.mean(axis=0)
    across = np.linalg.svd(np.eye(3) - np.outer(up, up) / (up @ up))[0][:, :2]
    return force @ across / np.linalg.norm(up)


def spectrum(values: Array, fs: float) -> SimpleNamespace:
    """Return the mean spectrum of all channels, one-sided."""
    frequency, density = signal.welch(values, fs, nperseg=min(SEGMENT, len(values)), axis=0)
    return SimpleNamespace(frequency=frequency, density=density.mean(axis=1))


def white(values: Array, fs: float) -> float:
    """Return the two-sided density of the noise in unit/√Hz, as if it were white."""
    return float(np.sqrt(np.mean(values.var(axis=0)) / fs))


def by_densities(trial: Trial) -> Designed:
    """Choose the time constant in closed form: r/q."""
    angle, rate = tilt_at_rest(trial), trial.gyro[: trial.rest]
    return from_densities(measurement=white(angle, trial.fs), derivative=white(rate, trial.fs), fs=trial.fs)


def by_spectra(trial: Trial) -> Designed:
    """Choose the time constant with the least predicted error."""
    angle, rate = tilt_at_rest(trial), trial.gyro[: trial.rest]
    return from_spectra(
        measurement=spectrum(angle, trial.fs), derivative=spectrum(rate, trial.fs), fs=trial.fs
    )


def residuals(trial: Trial, design: cf.LinearFilter) -> Array:
    """Return the angles from the estimated to the measured vertical, about two axes across it, in rad."""
    up = cf.Mahony.from_design(design).estimate(trial.gyro, trial.acc, fs=trial.fs).up
    unit = trial.acc / np.linalg.norm(trial.acc, axis=1, keepdims=True)
    turn = np.cross(up, unit)
    # Two of the three components are independent; all three have the same sum of squares as two.
    return np.sqrt(1.5) * turn


def explained(trial: Trial, design: cf.LinearFilter) -> tuple[float, float, tuple[str, ...]]:
    """Return by what factor the residual exceeds what the noise explains, at rest and in motion, and the warnings."""
    noise = {
        "fs": trial.fs,
        "measurement": spectrum(tilt_at_rest(trial), trial.fs),
        "derivative": spectrum(trial.gyro[: trial.rest], trial.fs),
    }
    expected = residual_sigma(design, **noise)
    found = residuals(trial, design)
    rest, motion = found[: trial.rest], found[trial.moves]
    ratios = (float(np.sqrt(np.mean(each**2))) / expected for each in (rest, motion))
    return (*ratios, check_residual(design, motion, **noise))
