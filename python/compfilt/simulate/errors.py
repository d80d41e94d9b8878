"""What is wrong with an inertial sensor."""

import math
from dataclasses import dataclass, field, fields
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from compfilt.motion import Array

__all__ = ["ImuErrors", "TriadErrors", "Triple", "two_sided"]

Triple: TypeAlias = float | tuple[float, float, float]

NO_CROSS_AXIS = ((0.0, 0.0, 0.0),) * 3


def two_sided(density: float) -> float:
    """Return the two-sided density of white noise from the one-sided one that data sheets give: 1/√2 of it.

    A data sheet's noise density n says that the noise below the frequency f has the standard deviation n √f. An angle
    or velocity random walk in data sheets is two-sided already: 1 °/√h is 1/60 (°/s)/√Hz.

    Parameters
    ----------
    density
        In unit/√Hz.

    Examples
    --------
    >>> round(two_sided(0.005), 6)  # (deg/s)/√Hz, of a consumer's gyro
    0.003536
    """
    return density / math.sqrt(2.0)


@dataclass(frozen=True)
class TriadErrors:
    """The errors of a sensor with three axes, in the unit of its signal: rad/s of a gyro, m/s² of an accelerometer.

    Each is a number for all axes or one for each axis; 0 is none of it. The first three are the coefficients of the
    sensor's Allan curve, σ²(τ) = N²/τ + (2 ln 2/π) B² + K² τ/3, as `compfilt.noise.fit_allan` returns them.

    Parameters
    ----------
    random_walk
        N: the two-sided density of the white noise, unit/√Hz; of a gyro its angle random walk in rad/√s. `two_sided`
        makes it of a data sheet's noise density.
    bias_instability
        B, unit. Data sheets often call 0.664 B so, the lowest point of the Allan curve.
    rate_random_walk
        K: the two-sided density of the noise that drives the bias, unit/s/√Hz.
    bias
        What the sensor reads too much, from the first sample on.
    scale
        What it reads too much of what is there, as a share: 0.01 is 1 %.
    cross_axis
        (3, 3): the share of the true axis in each column that the sensor's axis in each row reads; 0 on the diagonal.
    resolution
        The distance between readings that it can give; 0 for all numbers.
    full_scale
        The largest reading of either sign.
    delay
        How late the sensor is, in s: one number.

    Raises
    ------
    ValueError
        A number is not finite, one that must not be is negative, or the shape is another.

    Examples
    --------
    >>> errors = TriadErrors(random_walk=1e-4, bias=(0.01, -0.02, 0.0))
    >>> errors.bias, errors.random_walk
    ((0.01, -0.02, 0.0), (0.0001, 0.0001, 0.0001))
    """

    random_walk: Triple = 0.0
    bias_instability: Triple = 0.0
    rate_random_walk: Triple = 0.0
    bias: Triple = 0.0
    scale: Triple = 0.0
    cross_axis: tuple[tuple[float, ...], ...] = NO_CROSS_AXIS
    resolution: Triple = 0.0
    full_scale: Triple = math.inf
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in (item.name for item in fields(self) if item.name not in {"cross_axis", "delay"}):
            object.__setattr__(self, name, _three(name, getattr(self, name)))
        cross_axis = np.asarray(self.cross_axis, dtype=np.float64)
        if cross_axis.shape != (3, 3) or not np.isfinite(cross_axis).all() or np.diag(cross_axis).any():
            raise ValueError("cross_axis must be three rows of three finite numbers with 0 on the diagonal")
        object.__setattr__(self, "cross_axis", tuple(tuple(row) for row in cross_axis.tolist()))
        if not (math.isfinite(self.delay) and self.delay >= 0.0):
            raise ValueError(f"delay must be finite and not negative, got {self.delay:g}")

    @property
    def sensitivity(self) -> Array:
        """The matrix, (3, 3), that takes the true signal to the reading without noise and bias."""
        return np.asarray(np.eye(3) + np.diag(self.each("scale")) + np.asarray(self.cross_axis))

    def each(self, name: str) -> Array:
        """Return an attribute as an array, one number for each axis."""
        return np.asarray(getattr(self, name), dtype=np.float64)


SIGNED = {"bias", "scale"}


def _three(name: str, value: npt.ArrayLike) -> tuple[float, ...]:
    numbers = np.asarray(value, dtype=np.float64)
    if numbers.shape not in {(), (3,)}:
        raise ValueError(f"{name} must be one number or three, got the shape {numbers.shape}")
    if name == "full_scale":
        if not (numbers > 0.0).all():
            raise ValueError(f"full_scale must be positive, got {value!r}")
    elif not np.isfinite(numbers).all():
        raise ValueError(f"{name} must be finite, got {value!r}")
    elif name not in SIGNED and (numbers < 0.0).any():
        raise ValueError(f"{name} must not be negative, got {value!r}")
    return tuple(np.broadcast_to(numbers, 3).tolist())


@dataclass(frozen=True)
class ImuErrors:
    """The errors of a gyro and an accelerometer.

    Attributes
    ----------
    gyro
        In rad/s.
    accelerometer
        In m/s².

    Examples
    --------
    >>> ImuErrors(gyro=TriadErrors(bias=0.01)).accelerometer == TriadErrors()
    True
    """

    gyro: TriadErrors = field(default_factory=TriadErrors)
    accelerometer: TriadErrors = field(default_factory=TriadErrors)
