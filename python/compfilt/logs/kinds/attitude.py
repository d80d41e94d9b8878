"""The whole attitude of a body, from one gyro, one accelerometer and, where there is one, a magnetometer."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from compfilt.angles import angles_to_quaternion
from compfilt.logs.designs import Design
from compfilt.logs.kinds.attitude_methods import Method, parse_method
from compfilt.logs.kinds.attitude_stream import LogAttitude, LogAttitudeStream, turned
from compfilt.logs.kinds.base import Filter
from compfilt.logs.outputs import Channel, Offer, Output, absent_vector, offer_of, vector
from compfilt.logs.signals import Signal, parse_signal, refuse_shared
from compfilt.logs.table import Table
from compfilt.logs.units import (
    ACCELERATION,
    ANGLE,
    ANGULAR_RATE,
    DIMENSIONLESS,
    MAGNETIC_FIELD,
    Dimension,
    parse_unit,
)

__all__ = ["Attitude", "parse_attitude"]

ANGLES = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class Attitude(Filter):
    """An attitude filter; `stream` holds the options of a stream of it, in SI and in the filter's axes."""

    method: Method
    axes: str
    gyro: Signal
    accelerometer: Signal
    magnetometer: Signal | None
    stream: Mapping[str, Any]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The gyro, the accelerometer, and the magnetometer where there is one."""
        both = (self.gyro, self.accelerometer)
        return both if self.magnetometer is None else (*both, self.magnetometer)

    @property
    def dimension(self) -> Dimension:
        """An angle."""
        return ANGLE

    @property
    def title(self) -> str:
        """With the method."""
        return f'{super().title} and method = "{self.method.name}"'

    @property
    def linear(self) -> Design | None:
        """That of Mahony's filter."""
        return self.method.linear

    def with_design(self, design: Design) -> "Attitude":
        """Return the same filter with other gains of Mahony's."""
        return replace(self, method=self.method.with_design(design))

    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> LogAttitudeStream:  # noqa: ANN401
        """Make a stream of the attitude filter."""
        stream = self.method.build().stream(fs=fs, dtype=dtype, **self.stream, **policy)
        return LogAttitudeStream(stream, self.axes)

    def offer(self, estimate: LogAttitude, output: Output) -> Offer:  # noqa: ARG002
        """List the attitude in three ways, the bias and the rest."""
        number = parse_unit("1", DIMENSIONLESS)
        groups: dict[str, tuple[Channel, ...]] = {
            name: (Channel(name, "angles", np.s_[:, i], output.unit),) for i, name in enumerate(ANGLES)
        }
        groups["quaternion"] = tuple(
            Channel(f"q{part}", "quaternion", np.s_[:, i], number) for i, part in enumerate("wxyz")
        )
        groups["up"] = vector("up", number)
        absent = {"bias": 'it is the gyro\'s, and called "gyro_bias"'}
        if self.method.finds_bias:
            groups["gyro_bias"] = vector("gyro_bias", output.unit.per_second(1))
        else:
            absent |= absent_vector("gyro_bias", "Mahony's filter estimates it where ki is positive")
        if self.method.finds_rest:
            groups["at_rest"] = (Channel("at_rest", "at_rest", slice(None), None),)
        else:
            absent["at_rest"] = "Mahony's filter does not look for rest"
        return offer_of(groups, absent)


def parse_attitude(log: Table, filter_: Table) -> Attitude:
    """Read the sensors, their axes, the method and its options."""
    axes = log.choice("axes", ("flu", "frd"))
    method = parse_method(filter_, axes)
    gyro = parse_signal(log, "gyro", ANGULAR_RATE, 3)
    accelerometer = parse_signal(log, "accelerometer", ACCELERATION, 3)
    magnetometer = parse_signal(log, "magnetometer", MAGNETIC_FIELD, 3) if "magnetometer" in log else None
    if magnetometer is None and "heading_tau" in method.parameters:
        filter_.fail("needs [log] magnetometer: without one the heading is the gyro's", "heading_tau")
    stream = {"initial": _initial(filter_, axes)} if "initial" in filter_ else {}
    attitude = Attitude("attitude", method, axes, gyro, accelerometer, magnetometer, stream)
    refuse_shared(log, attitude.signals)
    return attitude


def _initial(filter_: Table, axes: str) -> tuple[float, ...]:
    """Read three angles or a quaternion, in the axes of the log; return the filter's quaternion."""
    given = filter_.get("initial", lambda _, value: value)
    if isinstance(given, list) and len(given) == 4:
        quaternion = np.array(filter_.numbers("initial"))
    else:
        angles = filter_.quantities("initial", (ANGLE,) * 3)
        if len(angles) != 3:
            filter_.fail("must hold roll, pitch and yaw, or the four parts of a quaternion", "initial")
        quaternion = angles_to_quaternion(*angles)
    return tuple(turned(quaternion, axes).tolist())
