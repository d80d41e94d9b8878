"""An accelerometer array in the place of a filter's stream: every sample by itself."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from compfilt import AccelerometerArray, Flags

__all__ = ["ArrayEstimate", "ArrayStream"]

Values = npt.NDArray[np.floating]


@dataclass(frozen=True)
class ArrayEstimate:
    """What an accelerometer array says about a block.

    Attributes
    ----------
    gravity : ndarray, shape (n, 3), or None
        In m/s², body axes.
    angular_acceleration : ndarray, shape (n, axes)
        In rad/s², about some of the body axes.
    body_rate : ndarray, shape (n, 3), or None
        In rad/s, body axes.
    flags : ndarray of uint8, shape (n,)
        A set of :class:`compfilt.Flags` a sample.
    """

    gravity: Values | None
    angular_acceleration: Values
    body_rate: Values | None
    flags: npt.NDArray[np.uint8]

    @property
    def counts(self) -> dict[str, int]:
        """How many samples carry each flag."""
        return {str(flag.name).lower(): int(np.count_nonzero(self.flags & flag)) for flag in Flags}


@dataclass(frozen=True)
class ArrayStream:
    """An accelerometer array that is used like a stream, but has no state to carry.

    Parameters
    ----------
    array
        The array.
    rate_known
        Whether the body rate goes into gravity and the angular acceleration.
    gravity
        Whether to compute gravity.
    axes
        About which body axes to compute the angular acceleration: some of "xyz".
    """

    array: AccelerometerArray
    rate_known: bool
    gravity: bool
    axes: str

    def estimate(self, acc: Values, gyr: Values | None = None, t: object = None) -> ArrayEstimate:  # noqa: ARG002
        """Run over a block: acc (n, s, 3); gyr (n, s, 3) of every sensor, or (n, 3) of the body."""
        body_rate, incomplete = self._body_rate(gyr, len(acc))
        known = body_rate if self.rate_known else None
        gravity = self.array.gravity(acc, known) if self.gravity else None
        turn = np.empty((len(acc), 0), acc.dtype)
        if self.axes:
            turn = self.array.angular_acceleration(acc, known, axes=self.axes)
        results = turn if gravity is None else np.hstack([gravity, turn])
        flags = incomplete * np.uint8(Flags.SENSOR_MISSING)
        flags |= np.isnan(results).any(axis=1) * np.uint8(Flags.MEASUREMENT_MISSING)
        return ArrayEstimate(gravity, turn, body_rate, flags)

    def _body_rate(self, gyr: Values | None, rows: int) -> tuple[Values | None, npt.NDArray[np.bool_]]:
        """Bring what the gyros say to one rate, and tell where one of several is missing."""
        incomplete = np.zeros(rows, np.bool_)
        if gyr is None:
            return None, incomplete
        if gyr.ndim == 3:
            incomplete[:] = ~np.isfinite(gyr).all(axis=(1, 2))
            return self.array.body_rate(gyr), incomplete
        known = np.isfinite(gyr).all(axis=1, keepdims=True)
        return np.where(known, gyr, gyr.dtype.type(np.nan)), incomplete

    def reset(self) -> None:
        """Do nothing: there is no state."""
