"""The error of an estimate, predicted from the noise of both signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.integrate import trapezoid  # type: ignore[import-untyped]

from compfilt._core import LinearFilter
from compfilt.checks import positive
from compfilt.design.running import Rule, Running, rate_for
from compfilt.design.source import BANDS, Noise, Source, as_source

__all__ = ["NoiseModel", "Prediction", "deviation", "grid", "integral", "predict"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Prediction:
    """How far an estimate is off in the steady state.

    Attributes
    ----------
    sigma : float
        Root mean square error of the estimate, in the measurement's unit: the root of the sum of squares of the parts.
    parts : mapping of str to float
        What each cause alone leaves, root mean square: "measurement", "derivative", "walk", "bias".
    fs : float
        Sample rate in Hz for which it holds.
    rule : str
        The rule for which it holds.
    """

    sigma: float
    parts: Mapping[str, float]
    fs: float
    rule: Rule


@dataclass(frozen=True)
class NoiseModel:
    """The errors of a measurement y and of its derivative u."""

    measurement: Source
    derivative: Source
    walk: tuple[float, ...] = ()
    bias: float = 0.0

    @classmethod
    def of(
        cls, measurement: Noise, derivative: Noise, walk: float | Sequence[float], bias: float
    ) -> "NoiseModel":
        """Check what the user gives."""
        return cls(
            as_source("measurement", measurement),
            as_source("derivative", derivative),
            walks(walk),
            positive("bias", abs(bias), zero=True),
        )

    def predict(self, design: LinearFilter, fs: float, rule: Rule = "backward_euler") -> Prediction:
        """Predict what a design makes of them."""
        running = Running(design, fs, rule)
        walk = sum(
            density**2 * running.variance_of_walk(times)
            for times, density in enumerate(self.walk, start=1)
            if density
        )
        parts = {
            "measurement": deviation(running, self.measurement, 0),
            "derivative": deviation(running, self.derivative, 1),
            "walk": float(np.sqrt(walk)),
            "bias": abs(self.bias * running.left_of_bias()),
        }
        return Prediction(float(np.linalg.norm(list(parts.values()))), parts, fs, rule)


def walks(walk: float | Sequence[float]) -> tuple[float, ...]:
    """Return the densities of all walks, the last one above 0."""
    densities = (walk,) if np.isscalar(walk) else tuple(walk)  # type: ignore[arg-type]
    checked = [positive("walk", density, zero=True) for density in densities]
    while checked and not checked[-1]:
        checked.pop()
    return tuple(checked)


def predict(
    design: LinearFilter,
    *,
    fs: float,
    measurement: Noise,
    derivative: Noise = 0.0,
    walk: float | Sequence[float] = 0.0,
    bias: float = 0.0,
    rule: Rule = "backward_euler",
) -> Prediction:
    """Predict the standard deviation of a design's estimate from the noise of both signals.

    It is that of the filter that runs at `fs`, computed from its own step: exactly for white noise and walks (Lyapunov's
    equation), by integration over the frequencies for spectra::

        σ² = ∫ |H_y|² S_y + |H_u|² S_u df + walk + bias²

    Parameters
    ----------
    design : LinearFilter
        Any linear design but `RateFilter`.
    fs : float
        Sample rate in Hz.
    measurement : float or Spectrum
        Noise of the measurement: two-sided density in unit/√Hz (σ/√fs for white noise of the standard deviation σ per
        sample; a one-sided density of a data sheet is √2 times as large), or a spectrum as `compfilt.noise` makes it,
        whose densities are one-sided.
    derivative : float or Spectrum
        Noise of the derivative in its own unit, likewise. Default 0.
    walk : float or sequence of float
        Two-sided density of the random walk of the derivative's bias, in the derivative's unit/s/√Hz. A sequence goes
        on: of the walk of the bias's slope, and so on. Default 0.
    bias : float
        A constant error of the derivative, in its unit. Default 0.
    rule : {"backward_euler", "matched"}
        How the design becomes gains.

    Returns
    -------
    Prediction
        σ and its parts. The part "walk" is infinite where the design does not follow a walking bias.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the rule does not go with the design.
    TypeError
        If an argument is of another kind.

    Examples
    --------
    An angle with 0.01 rad/√Hz and a gyro with 0.002 rad/s/√Hz whose bias is 0.001 rad/s, at 100 Hz:

    >>> import compfilt as cf
    >>> from compfilt.design import predict
    >>> prediction = predict(cf.FirstOrder(5.0), fs=100.0, measurement=0.01, derivative=0.002, bias=0.001)
    >>> {name: round(part, 5) for name, part in prediction.parts.items()}
    {'measurement': 0.00316, 'derivative': 0.00316, 'walk': 0.0, 'bias': 0.005}
    >>> round(prediction.sigma, 5)
    0.00671
    """
    noise = NoiseModel.of(measurement, derivative, walk, bias)
    return noise.predict(design, rate_for(design, fs), rule)


def deviation(running: Running, source: Source, which: int) -> float:
    """Return what the noise of the measurement (0) or of the derivative (1) leaves in the estimate."""
    if source.frequency is None:
        enters = (running.B_y, running.B_u)[which]
        return source.white * float(np.sqrt(running.fs * running.variance(enters)))
    frequency = grid(running, source.frequency)
    return float(np.sqrt(integral(running.responses(frequency)[which], source, frequency)))


def integral(response: npt.NDArray[np.complex128], source: Source, frequency: Array) -> float:
    """Return the variance that a noise has behind a response, over both sides of the spectrum."""
    return float(2.0 * trapezoid(np.abs(response) ** 2 * source.power_at(frequency), frequency))


def grid(running: Running, measured: Array) -> Array:
    """Return frequencies from far below the filter's slowest pole to half the sample rate."""
    highest = 0.5 * running.fs
    slowest = float(np.abs(running.design.poles).min()) / (2.0 * np.pi)
    lowest = min(1e-3 * slowest, 0.1 * highest)
    points = int(BANDS * np.log10(highest / lowest)) + 2
    frequency = np.union1d(
        np.geomspace(lowest, highest, points), measured[(measured > lowest) & (measured < highest)]
    )
    return np.concatenate(([0.0], frequency))
