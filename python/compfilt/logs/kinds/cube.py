"""The balancing cube: angles and rates from several inertial sensors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

import compfilt
from compfilt.logs.designs import Design
from compfilt.logs.kinds.base import Filter
from compfilt.logs.kinds.options import angle_design, angle_options
from compfilt.logs.kinds.sensors import Sensors, parse_sensors
from compfilt.logs.kinds.tilt import CUBE_ANGLES, angle_columns
from compfilt.logs.outputs import Offer, Output, absent_vector, offer_of, vector
from compfilt.logs.signals import Signal, parse_signal, refuse_shared
from compfilt.logs.table import Table
from compfilt.logs.units import ANGLE, ANGULAR_RATE, Dimension

__all__ = ["Cube", "parse_cube"]


@dataclass(frozen=True)
class Cube(Filter):
    """The cube's pipeline; `structure` holds its options, `stream` those of a stream of it, in SI."""

    design: Design
    sensors: Sensors
    wheels: Signal | None
    structure: Mapping[str, Any]
    stream: Mapping[str, Any]

    gives_gravity: ClassVar[bool] = True

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The sensors, and the wheels where there are any."""
        return self.sensors.signals + (() if self.wheels is None else (self.wheels,))

    @property
    def dimension(self) -> Dimension:
        """An angle."""
        return ANGLE

    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> Any:  # noqa: ANN401
        """Make a stream of the cube's pipeline."""
        cube = compfilt.Cube(self.sensors.array, self.design.build(), **self.structure)
        return cube.stream(fs=fs, dtype=dtype, **self.stream, **policy)

    def arguments(self, values: Sequence[npt.NDArray[np.floating]]) -> tuple[npt.NDArray[np.floating], ...]:
        """Put the gyros first, then the accelerometers and the wheels."""
        accelerometers, gyros = self.sensors.stack(values)
        return (gyros, accelerometers, *values[len(self.sensors.signals) :])

    def offer(self, estimate: Any, output: Output) -> Offer:  # noqa: ANN401
        """List the angles, their biases, and the vectors in body axes."""
        rate = output.unit.per_second(1)
        groups = angle_columns(estimate, output, CUBE_ANGLES)
        groups["body_rate"] = vector("body_rate", rate)
        groups["gravity"] = vector("gravity", output.gravity_unit)
        if self.wheels is None:
            return offer_of(groups, absent_vector("wheel_rate", "it takes [log] wheels"))
        return offer_of(groups | {"wheel_rate": vector("wheel_rate", rate)})


def parse_cube(log: Table, filter_: Table) -> Cube:
    """Read the sensors, the wheels, the design and its options."""
    design = angle_design(filter_)
    structure, stream = angle_options(filter_, CUBE_ANGLES)
    structure["gyro"] = filter_.choice("gyro", ("unknown", "known"), "unknown")
    sensors = parse_sensors(log, needs_gyros=True)
    refusal = sensors.refusal(rate_known=structure["gyro"] == "known")
    if refusal:
        log.fail(f"cannot be used: {refusal}", "sensors")
    wheels = parse_signal(log, "wheels", ANGULAR_RATE, 3) if "wheels" in log else None
    cube = Cube("cube", design, sensors, wheels, structure, stream)
    refuse_shared(log, cube.signals)
    return cube
