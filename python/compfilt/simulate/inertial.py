"""An inertial sensor's readings of a known motion."""

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from compfilt.checks import sample_rate
from compfilt.motion import Array, Motion, mean_rates, specific_force
from compfilt.simulate.errors import ImuErrors, TriadErrors
from compfilt.simulate.length import samples_in
from compfilt.simulate.noise import flicker, random_walk, white

__all__ = ["LOG_UNITS", "imu", "imu_log", "triad"]

LOG_UNITS = (
    {"t": "s"} | dict.fromkeys(("ax", "ay", "az"), "m/s^2") | dict.fromkeys(("gx", "gy", "gz"), "rad/s")
)
LOG_UNITS |= {"true_roll": "rad", "true_pitch": "rad"}


def triad(truth: npt.ArrayLike, *, fs: float, errors: TriadErrors, seed: int = 0) -> Array:
    """Return what a sensor with three axes reads of a known signal.

    The effects come in this order: delay; scale and cross axes; bias, white noise, flicker and random walk, which add
    up; resolution; full scale. Each noise has random numbers of its own: changing one leaves the others as they are.

    Parameters
    ----------
    truth
        (n, 3), in the unit of `errors`. A missing sample (NaN) gives a missing reading.
    fs
        Sample rate in Hz.
    errors
        What is wrong with the sensor.
    seed
        The same seed gives the same noise.

    Returns
    -------
    ndarray
        (n, 3), float64.

    Raises
    ------
    ValueError
        The shape or the sample rate cannot be.

    Notes
    -----
    A delay by a part of a sample takes the cubic polynomial through the four nearest samples of the truth; before the
    first sample it was what it is there.

    Examples
    --------
    >>> import numpy as np
    >>> errors = TriadErrors(bias=(0.1, 0.0, 0.0), scale=0.5, resolution=1.0)
    >>> triad([[0.3, 0.3, 10.0]], fs=100.0, errors=errors)
    array([[ 1.,  0., 15.]])
    """
    return _read("truth", truth, fs, errors, np.random.SeedSequence(seed))


def imu(
    gyro: npt.ArrayLike, accelerometer: npt.ArrayLike, *, fs: float, errors: ImuErrors, seed: int = 0
) -> tuple[Array, Array]:
    """Return what a gyro and an accelerometer read of a known motion: `triad` for each.

    Parameters
    ----------
    gyro
        The true rate, (n, 3) in rad/s.
    accelerometer
        The true specific force, (n, 3) in m/s².
    fs
        Sample rate in Hz.
    errors
        Those of both sensors.
    seed
        The same seed gives the same noise.

    Returns
    -------
    gyro, accelerometer : ndarray
        (n, 3) each.

    Raises
    ------
    ValueError
        The shapes or the sample rate cannot be.

    Examples
    --------
    At rest, a drifting gyro is all that there is:

    >>> import numpy as np
    >>> errors = ImuErrors(gyro=TriadErrors(random_walk=1e-3, bias=0.02))
    >>> still, up = np.zeros((6000, 3)), np.tile([0.0, 0.0, 9.80665], (6000, 1))
    >>> gyro, accelerometer = imu(still, up, fs=100.0, errors=errors)
    >>> gyro.mean(axis=0).round(2), bool((accelerometer == up).all())
    (array([0.02, 0.02, 0.02]), True)
    """
    if np.shape(gyro) != np.shape(accelerometer):
        raise ValueError(
            f"gyro and accelerometer must have one shape, got {np.shape(gyro)} and {np.shape(accelerometer)}"
        )
    first, second = np.random.SeedSequence(seed).spawn(2)
    return (
        _read("gyro", gyro, fs, errors.gyro, first),
        _read("accelerometer", accelerometer, fs, errors.accelerometer, second),
    )


def imu_log(
    *,
    duration: float,
    rate: float = 100.0,
    seed: int = 0,
    errors: ImuErrors | None = None,
    motion: Motion | None = None,
) -> dict[str, Array]:
    """Simulate a log of an inertial sensor, at rest or on an exact motion.

    Parameters
    ----------
    duration
        Length of the log in seconds.
    rate
        Samples per second. The gyro's sample is the mean rate over the interval that ends with it, as an integrating
        sensor gives; the accelerometer's is the value at the instant.
    seed
        The same seed gives the same log.
    errors
        Those of both sensors; a perfect one by default. Delays are exact here: the motion is known at every time.
    motion
        What the sensor goes through; level and at rest by default. `seat_motion` draws one.

    Returns
    -------
    dict of str to ndarray
        Columns of one length in SI units: ``t`` in s, ``ax ay az`` in m/s², ``gx gy gz`` in rad/s,
        ``true_roll true_pitch`` in rad.

    Raises
    ------
    ValueError
        `duration` or `rate` is not positive and finite, or the log would hold no sample.

    Examples
    --------
    >>> log = imu_log(duration=10.0, rate=50.0)
    >>> len(log["t"]), log["az"][0].item()
    (500, 9.80665)
    """
    samples = samples_in(duration, rate)
    motion, errors = motion or Motion(), errors or ImuErrors()
    t = np.arange(samples) / rate
    gyro = mean_rates(motion, t - errors.gyro.delay, rate)
    accelerometer = specific_force(motion, t - errors.accelerometer.delay)
    in_time = ImuErrors(replace(errors.gyro, delay=0.0), replace(errors.accelerometer, delay=0.0))
    gyro, accelerometer = imu(gyro, accelerometer, fs=rate, errors=in_time, seed=seed)
    columns = {"t": t}
    columns |= {name: accelerometer[:, i] for i, name in enumerate(("ax", "ay", "az"))}
    columns |= {name: gyro[:, i] for i, name in enumerate(("gx", "gy", "gz"))}
    return columns | {"true_roll": motion.roll.at(t)[0], "true_pitch": motion.pitch.at(t)[0]}


def _read(
    name: str, truth: npt.ArrayLike, fs: float, errors: TriadErrors, seeds: np.random.SeedSequence
) -> Array:
    signal = np.asarray(truth, dtype=np.float64)
    if signal.ndim != 2 or signal.shape[1] != 3 or not signal.size:
        raise ValueError(f"{name} must have the shape (n, 3), got {signal.shape}")
    fs = sample_rate("fs", fs)
    readings = _sensed(_delayed(signal, errors.delay * fs), errors.sensitivity)
    readings += errors.each("bias") + _noise(signal.shape[0], fs, errors, seeds)
    return _digital(readings, errors.each("resolution"), errors.each("full_scale"))


def _noise(samples: int, fs: float, errors: TriadErrors, seeds: np.random.SeedSequence) -> Array:
    """Return the sum of the noises; what is not there costs nothing."""
    first, second, third = map(np.random.default_rng, seeds.spawn(3))
    total = np.zeros((samples, 3))
    if (density := errors.each("random_walk")).any():
        total += white(samples, density, fs, first)
    if (instability := errors.each("bias_instability")).any():
        total += flicker(samples, instability, second)
    if (density := errors.each("rate_random_walk")).any():
        total += random_walk(samples, density, fs, third)
    return total


def _delayed(signal: Array, samples: float) -> Array:
    """Return the signal so many samples ago, by Lagrange's polynomial through one later and three earlier ones."""
    if samples == 0.0 or signal.shape[0] == 1:
        return signal
    whole = min(math.floor(samples), signal.shape[0])
    part = samples - math.floor(samples)
    weights = (
        -part * (1.0 - part) * (2.0 - part) / 6.0,
        (1.0 - part) * (1.0 + part) * (2.0 - part) / 2.0,
        part * (1.0 + part) * (2.0 - part) / 2.0,
        -part * (1.0 + part) * (1.0 - part) / 6.0,
    )
    before = np.repeat(signal[:1], whole + 2, axis=0)
    after = 2.0 * signal[-1:] - signal[-2:-1]
    padded = np.concatenate((before, signal, after))
    rows = signal.shape[0]
    # padded[i + whole + 2] is signal[i]; node j lies 1 - j samples after the one `whole` samples ago.
    return sum(
        (weight * padded[3 - j : 3 - j + rows] for j, weight in enumerate(weights) if weight),
        np.zeros_like(signal),
    )


def _sensed(signal: Array, sensitivity: Array) -> Array:
    """Return the product with the matrix; what an axis does not read may be missing."""
    readings = signal * np.diag(sensitivity)
    for i, j in np.argwhere(sensitivity - np.diag(np.diag(sensitivity))):
        readings[:, i] += sensitivity[i, j] * signal[:, j]
    return readings


def _digital(readings: Array, resolution: Array, full_scale: Array) -> Array:
    """Round to the resolution, then cut at the last step within the full scale."""
    for axis, (step, largest) in enumerate(zip(resolution.tolist(), full_scale.tolist(), strict=True)):
        column = readings[:, axis]
        if step > 0.0:
            np.multiply(np.round(column / step), step, out=column)
        # The last step may be the full scale itself but for rounding.
        limit = math.floor(largest / step + 1e-9) * step if step > 0.0 and math.isfinite(largest) else largest
        np.clip(column, -limit, limit, out=column)
    return readings
