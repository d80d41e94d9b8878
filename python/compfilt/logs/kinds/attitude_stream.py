"""An attitude filter's stream and results in the axes of the log."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from compfilt import AttitudeEstimate, AttitudeStream, State
from compfilt.angles import quaternion_to_angles

__all__ = ["LogAttitude", "LogAttitudeStream", "turned"]

Values = npt.NDArray[np.floating[Any]]

SIGNS = {3: (1.0, -1.0, -1.0), 4: (1.0, 1.0, -1.0, -1.0)}
"""The turn by 180° about x, which leads from ``frd`` to ``flu`` and back: of vectors, and of both sides of a quaternion."""


def turned(values: Values, axes: str) -> Values:
    """Bring vectors (n, 3) or quaternions (n, 4) from the axes of the log to those of the filter, ``flu``, or back.

    It only changes signs, so that nothing is rounded.
    """
    if axes == "flu":
        return values
    # Zero, not -0.
    return values * np.array(SIGNS[values.shape[-1]], values.dtype) + values.dtype.type(0.0)


@dataclass
class LogAttitude:
    """What an attitude filter says about a block, in the axes of the log."""

    estimate: AttitudeEstimate
    axes: str

    @cached_property
    def quaternion(self) -> Values:
        """From body to world, (n, 4): with ``frd`` both have z down."""
        return turned(self.estimate.quaternion, self.axes)

    @cached_property
    def angles(self) -> Values:
        """Roll, pitch and yaw in rad, (n, 3), float64."""
        return quaternion_to_angles(self.quaternion)

    @cached_property
    def up(self) -> Values:
        """The world's up in body axes, (n, 3): it points up with ``frd`` as well."""
        return turned(self.estimate.up, self.axes)

    @cached_property
    def gyro_bias(self) -> Values:
        """What the gyro reads too much, in rad/s, (n, 3)."""
        return turned(self.estimate.gyro_bias, self.axes)

    @property
    def at_rest(self) -> npt.NDArray[np.uint8]:
        """1 where the body rests, otherwise 0."""
        return self.estimate.at_rest.view(np.uint8)

    @property
    def flags(self) -> npt.NDArray[np.uint8]:
        """A set of :class:`compfilt.Flags` a sample."""
        return self.estimate.flags

    @property
    def counts(self) -> dict[str, int]:
        """How many samples carry each flag."""
        return self.estimate.counts


@dataclass
class LogAttitudeStream:
    """A stream of an attitude filter that takes and gives the axes of the log.

    Not the outputs alone are turned: with ``frd`` a level body would look upside down to the filter, and there the smallest turn
    that levels it, and with it the first heading, would hang on the noise.
    """

    stream: AttitudeStream
    axes: str

    def estimate(
        self, gyr: Values, acc: Values, mag: Values | None = None, t: npt.ArrayLike | None = None
    ) -> LogAttitude:
        """Run over a block, (n, 3) each; the state is carried on."""
        gyr, acc = turned(gyr, self.axes), turned(acc, self.axes)
        mag = None if mag is None else turned(mag, self.axes)
        return LogAttitude(self.stream.estimate(gyr, acc, mag, t), self.axes)

    def reset(self) -> None:
        """Forget the state: wait for the first measurement."""
        self.stream.reset()

    @property
    def state(self) -> State:
        """The state between two samples, in the axes of the filter; set it to continue from there."""
        return self.stream.state

    @state.setter
    def state(self, value: State) -> None:
        self.stream.state = value
