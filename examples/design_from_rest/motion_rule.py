"""The gains by the recording in motion: with truth, and without."""

from types import SimpleNamespace

import numpy as np
from scipy import signal

import compfilt as cf
from compfilt.design import AttitudeRecording, Designed, from_recordings, from_spectra
from rest_trials import Array, Trial

REFERENCE = cf.FirstOrder(20.0)
"""The slow filter against whose vertical the accelerometer is compared."""

SEGMENT = 2**14
"""Samples in a segment of the spectrum in motion: 57 s."""


def recording(trial: Trial, *, truth: bool) -> AttitudeRecording:
    """Return the trial for the search, scored in motion."""
    counts = trial.moves & np.isfinite(trial.up).all(axis=1) if truth else trial.moves
    return AttitudeRecording(trial.gyro, trial.acc, trial.fs, trial.up if truth else None, counts)


def with_truth(trial: Trial) -> Designed:
    """Return the best time constant."""
    return from_recordings([recording(trial, truth=True)], folds=2)


def with_the_offline_estimate(trial: Trial) -> Designed:
    """Choose the time constant against the smoother's vertical: no truth is used."""
    return from_recordings([recording(trial, truth=False)], folds=2)


def by_spectra_in_motion(trial: Trial) -> Designed:
    """Choose the time constant by spectra in motion: no truth is used.

    What the accelerometer's vertical is off against the gyro's, d, holds both errors: S_d = S_y + S_u/ω². The
    acceleration's part of it falls towards low frequencies, where speeds are bounded; the gyro's rises. So ω² S_d is
    nowhere below S_u, and nearest to it where it is least.
    """
    frequency, density = difference(trial)
    omega = 2.0 * np.pi * frequency
    octave = np.floor(2.0 * np.log2(frequency / frequency[0]))
    rate = min(np.mean((omega**2 * density)[octave == each]) for each in np.unique(octave[frequency < 1.0]))
    measurement = np.maximum(density - rate / omega**2, 1e-3 * density)
    return from_spectra(
        measurement=SimpleNamespace(frequency=frequency, density=measurement),
        derivative=float(np.sqrt(rate / 2.0)),
        fs=trial.fs,
    )


def difference(trial: Trial) -> tuple[Array, Array]:
    """Return the one-sided spectrum of d in motion, from the innovation of a slow filter divided by its high-pass."""
    quaternion = cf.Mahony.from_design(REFERENCE).estimate(trial.gyro, trial.acc, fs=trial.fs).quaternion
    level = horizontal(quaternion, trial.acc / np.linalg.norm(trial.acc, axis=1, keepdims=True))
    frequency, density = signal.welch(level[trial.rest :], trial.fs, nperseg=SEGMENT, axis=0, detrend=False)
    _, high = REFERENCE.frequency_response(2.0 * np.pi * frequency[1:], fs=trial.fs)
    return frequency[1:], density[1:].mean(axis=1) / np.abs(high) ** 2


def horizontal(quaternion: Array, vector: Array) -> Array:
    """Return the two horizontal components in the world of a vector in body axes."""
    w, x, y, z = quaternion.T
    first = np.column_stack((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)))
    second = np.column_stack((2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)))
    return np.column_stack((np.sum(first * vector, axis=1), np.sum(second * vector, axis=1)))


def error(trial: Trial, design: cf.LinearFilter) -> float:
    """Return BROAD's inclination error in motion, in deg."""
    return float(np.degrees(np.sqrt(np.nanmean(recording(trial, truth=True).squared_errors(design)))))
