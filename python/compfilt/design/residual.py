"""What the measurement leaves against the estimate, compared with what the noise explains."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy.signal import welch  # type: ignore[import-untyped]

from compfilt._core import LinearFilter
from compfilt.design.prediction import NoiseModel, deviation, grid, integral
from compfilt.design.running import Rule, Running, rate_for
from compfilt.design.source import Noise

__all__ = ["check_residual", "residual_sigma"]

TOLERATED = 1.5
"""How many times the explained residual may be measured before it is told."""

SEGMENT = 8.0
"""Time constants of the slowest pole in a segment of the residual's spectrum."""


def residual_sigma(
    design: LinearFilter,
    *,
    fs: float,
    measurement: Noise,
    derivative: Noise = 0.0,
    walk: float | Sequence[float] = 0.0,
    rule: Rule = "backward_euler",
) -> float:
    """Return the standard deviation of measurement minus estimate that the noise of both signals explains.

    It needs no truth: what the filter follows cancels.

    Parameters
    ----------
    design : LinearFilter
        Any linear design but `RateFilter`.
    fs, measurement, derivative, walk, rule
        As in `predict`.

    Returns
    -------
    float
        In the measurement's unit.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the rule does not go with the design.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt.design import residual_sigma
    >>> round(residual_sigma(cf.FirstOrder(5.0), fs=100.0, measurement=0.01, derivative=0.002), 4)
    0.0999
    """
    noise = NoiseModel.of(measurement, derivative, walk, 0.0)
    running = Running(design, rate_for(design, fs), rule)
    if noise.measurement.frequency is None:
        own = noise.measurement.white**2 * fs * running.residual_variance()
    else:
        frequency = grid(running, noise.measurement.frequency)
        own = integral(1.0 - running.responses(frequency)[0], noise.measurement, frequency)
    parts = noise.predict(design, fs, rule).parts
    return float(np.sqrt(own + deviation(running, noise.derivative, 1) ** 2 + parts["walk"] ** 2))


def check_residual(
    design: LinearFilter,
    residual: npt.ArrayLike,
    *,
    fs: float,
    measurement: Noise,
    derivative: Noise = 0.0,
    walk: float | Sequence[float] = 0.0,
    rule: Rule = "backward_euler",
) -> tuple[str, ...]:
    """Say whether the noise explains what a filter does on a recording; no truth is needed.

    An accelerometer at rest tells the noise of its angle and nothing of the accelerations of a motion. If they lie in its
    band, the residual, measurement minus estimate, is larger than the noise explains, and gains that were chosen for
    the noise are wrong there.

    Parameters
    ----------
    design : LinearFilter
        The design that filtered the recording.
    residual : array_like, shape (n,) or (n, channels)
        Measurement minus estimate; wrapped, if it is an angle. Rows with NaN are left out.
    fs, measurement, derivative, walk, rule
        As in `predict`.

    Returns
    -------
    tuple of str
        Warnings, a sentence each; empty where the noise explains the residual.

    Raises
    ------
    ValueError
        If the residual has no rows, or a number breaks its rule.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> from compfilt.design import check_residual
    >>> rng, t = np.random.default_rng(0), np.arange(20_000) / 100.0
    >>> angle, rate = rng.normal(0.0, 0.1, t.size), rng.normal(0.0, 0.02, t.size)
    >>> design, noise = cf.FirstOrder(5.0), {"fs": 100.0, "measurement": 0.01, "derivative": 0.002}
    >>> check_residual(design, angle - design.filter(angle, rate, fs=100.0), **noise)
    ()
    >>> shaken = angle + np.sin(2 * np.pi * 1.5 * t)
    >>> (warning,) = check_residual(design, shaken - design.filter(shaken, rate, fs=100.0), **noise)
    >>> warning
    'the residual is 7.1 times what the noise explains, most of it near 1.5 Hz: motion or vibration is in the measurement'
    """
    values = np.asarray(residual, float)
    if values.ndim not in {1, 2}:
        raise ValueError(f"residual must have the shape (n,) or (n, channels), got {values.shape}")
    values = values[:, np.newaxis] if values.ndim == 1 else values
    values = values[np.isfinite(values).all(axis=1)]
    if not values.size:
        raise ValueError("residual must have rows without NaN")
    explained = residual_sigma(
        design, fs=fs, measurement=measurement, derivative=derivative, walk=walk, rule=rule
    )
    ratio = float(np.sqrt(np.mean(values**2))) / explained if explained else np.inf
    if ratio <= TOLERATED:
        return ()
    longest = SEGMENT * 2.0 * np.pi / float(np.abs(design.poles).min())
    frequency, density = welch(values, fs, nperseg=min(values.shape[0], max(int(longest * fs), 16)), axis=0)
    # Per octave, so that a broad band counts as much as a line.
    loudest = frequency[int(np.argmax(frequency * density.mean(axis=1)))]
    size = f"{ratio:.2g} times what the noise explains, most of it near {loudest:.2g} Hz"
    return (f"the residual is {size}: motion or vibration is in the measurement",)
