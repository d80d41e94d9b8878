"""Gravity and the angular acceleration from several accelerometers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from compfilt.logs.kinds.array_stream import ArrayEstimate, ArrayStream
from compfilt.logs.kinds.base import Filter
from compfilt.logs.kinds.sensors import Sensors, parse_sensors
from compfilt.logs.outputs import Channel, Offer, Output, absent_vector, offer_of, vector
from compfilt.logs.signals import Signal, parse_signal, refuse_shared
from compfilt.logs.table import Table
from compfilt.logs.units import ANGLE, ANGULAR_RATE, Dimension, Unit, parse_unit

__all__ = ["Array", "parse_array"]

Values = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Array(Filter):
    """An accelerometer array; the body rate comes from `gyro`, from gyros in the sensors, or is not there.

    `rate_known` says whether it goes into gravity and the angular acceleration.
    """

    sensors: Sensors
    gyro: Signal | None
    rate_known: bool

    has_state: ClassVar[bool] = False
    gives_gravity: ClassVar[bool] = True

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The sensors, and the gyro of the body where there is one."""
        return self.sensors.signals + (() if self.gyro is None else (self.gyro,))

    @property
    def dimension(self) -> Dimension:
        """An angle."""
        return ANGLE

    @property
    def default_unit(self) -> Unit:
        """The radian."""
        return parse_unit("rad")

    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> ArrayStream:  # noqa: ANN401, ARG002
        """Make a stream, which has no state."""
        gravity = not self.sensors.refusal(rate_known=self.rate_known)
        axes = "".join(axis for axis in "xyz" if axis not in self._axes_not_given())
        return ArrayStream(self.sensors.array, self.rate_known, gravity, axes)

    def _axes_not_given(self) -> dict[str, str]:
        """Return why for each axis about which the sensors do not give the angular acceleration."""
        refusals = {axis: self.sensors.refusal(rate_known=self.rate_known, about=axis) for axis in "xyz"}
        return {axis: refusal for axis, refusal in refusals.items() if refusal}

    def arguments(self, values: Sequence[Values]) -> tuple[Values, ...]:
        """Put the accelerometers first, then the gyros or the gyro, if there is any."""
        return (*self.sensors.stack(values), *values[len(self.sensors.signals) :])

    def offer(self, estimate: ArrayEstimate, output: Output) -> Offer:
        """List gravity, the angular acceleration about the axes that the geometry gives, and the body rate."""
        groups: dict[str, tuple[Channel, ...]] = {}
        absent: dict[str, str] = {}
        if estimate.gravity is not None:
            groups["gravity"] = vector("gravity", output.gravity_unit)
        else:
            absent |= absent_vector("gravity", self.sensors.refusal(rate_known=self.rate_known))
        name, refused = "angular_acceleration", self._axes_not_given()
        for axis, refusal in refused.items():
            absent |= {name: refusal, f"{name}_{axis}": refusal}
        if len(refused) < 3:
            axes = "".join(axis for axis in "xyz" if axis not in refused)
            groups[name] = vector(name, output.unit.per_second(2), axes)
        if estimate.body_rate is not None:
            groups["body_rate"] = vector("body_rate", output.unit.per_second(1))
        else:
            absent |= absent_vector("body_rate", "it takes [log] gyro, or a gyro in each of the sensors")
        return offer_of(groups, absent)


def parse_array(log: Table, filter_: Table) -> Array:
    """Read the sensors and where the body rate comes from."""
    sensors = parse_sensors(log, needs_gyros=False)
    gyro = parse_signal(log, "gyro", ANGULAR_RATE, 3) if "gyro" in log else None
    if gyro is not None and sensors.gyros:
        log.fail("is given, but the sensors have gyros as well: keep one of the two", "gyro")
    # A gyro of the body is there for this; those of the sensors may be there for the body rate only.
    choice = filter_.choice("gyro", ("unknown", "known"), "unknown" if gyro is None else "known")
    if choice == "known" and gyro is None and not sensors.gyros:
        filter_.fail(
            'is "known", but there is none: give [log] gyro, or a gyro in each of the sensors', "gyro"
        )
    array = Array("array", sensors, gyro, choice == "known")
    refuse_shared(log, array.signals)
    return array
