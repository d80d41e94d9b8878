"""Several inertial sensors on one body: where they sit, how they are turned, and which columns they have."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

import compfilt
from compfilt.logs.signals import Signal, parse_signal
from compfilt.logs.table import Table
from compfilt.logs.units import ACCELERATION, ANGULAR_RATE, LENGTH

__all__ = ["Sensors", "parse_sensors"]

Values = npt.NDArray[np.floating]
Vector = tuple[float, float, float]
Matrix = tuple[tuple[float, ...], ...]
Value = TypeVar("Value")

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Sensors:
    """The accelerometers of an array, in order, and a gyro beside each of them or none at all."""

    array: compfilt.AccelerometerArray
    accelerometers: tuple[Signal, ...]
    gyros: tuple[Signal, ...]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """All accelerometers, then all gyros."""
        return self.accelerometers + self.gyros

    def stack(self, values: Sequence[Values]) -> Iterator[Values]:
        """Bring values in the order of `signals` together: the accelerometers' and the gyros', each (n, s, 3)."""
        count = len(self.accelerometers)
        for start in range(0, len(self.signals), count):
            yield np.stack(values[start : start + count], axis=1)

    def refusal(self, *, rate_known: bool, about: str = "") -> str:
        """Say why the sensors do not give gravity, or the angular acceleration about an axis; nothing if they do."""
        acc, gyr = np.empty((0, *self.array.positions.shape)), np.empty((0, 3)) if rate_known else None
        try:
            if about:
                self.array.angular_acceleration(acc, gyr, axes=about)
            else:
                self.array.gravity(acc, gyr)
        except ValueError as error:
            helps = self.gyros and not rate_known and not self.refusal(rate_known=True, about=about)
            return f'{error}; gyro = "known" in [filter] uses it' if helps else str(error)
        return ""


class _Sensor(NamedTuple):
    """One table of the recipe."""

    position: Vector
    rotation: Matrix
    accelerometer: Signal
    gyro: Signal | None
    noise: Vector | None


def parse_sensors(log: Table, *, needs_gyros: bool) -> Sensors:
    """Read the tables `[[log.sensors]]`, one a sensor."""
    tables = log.tables("sensors")
    sensors = [_sensor(table, number, needs_gyros) for number, table in enumerate(tables, 1)]
    gyros = _of_all(tables, "gyro", [sensor.gyro for sensor in sensors])
    noise = _of_all(tables, "noise", [sensor.noise for sensor in sensors])
    try:
        array = compfilt.AccelerometerArray(
            [sensor.position for sensor in sensors],
            rotations=[sensor.rotation for sensor in sensors],
            channels=[[column is not None for column in sensor.accelerometer.columns] for sensor in sensors],
            noise=noise or None,
        )
    except ValueError as error:
        log.fail(f"cannot be used: {error}", "sensors")
    return Sensors(array, tuple(sensor.accelerometer for sensor in sensors), gyros)


def _sensor(table: Table, number: int, needs_gyro: bool) -> _Sensor:
    """Read the table of one sensor."""
    owner = f"sensor {number}"
    sensor = _Sensor(
        table.vector("position", LENGTH),
        _rotation(table) if "rotation" in table else IDENTITY,
        parse_signal(table, "accelerometer", ACCELERATION, 3, owner=owner, may_skip=True),
        parse_signal(table, "gyro", ANGULAR_RATE, 3, owner=owner) if needs_gyro or "gyro" in table else None,
        _noise(table) if "noise" in table else None,
    )
    table.close()
    return sensor


def _rotation(table: Table) -> Matrix:
    """Read from body to sensor axes, f_sensor = S f_body."""
    rotation = table.matrix("rotation")
    try:
        # One sensor at the pivot: nothing can be wrong with it but the rotation.
        compfilt.AccelerometerArray([[0.0, 0.0, 0.0]], rotations=[rotation])
    except ValueError:
        table.fail(
            "must hold the sensor's three axes in body axes, one a row: orthogonal and of length 1",
            "rotation",
        )
    return rotation


def _noise(table: Table) -> Vector:
    """Read the standard deviation of the channels: one for all three, or one each."""
    if table.holds_list("noise"):
        noise = table.vector("noise", ACCELERATION)
    else:
        noise = (table.quantity("noise", ACCELERATION),) * 3
    if min(noise) <= 0.0:
        table.fail("must be positive", "noise")
    return noise


def _of_all(tables: Sequence[Table], key: str, values: Sequence[Value | None]) -> tuple[Value, ...]:
    """Return what every sensor has under a key, or nothing if none has it."""
    given = tuple(value for value in values if value is not None)
    if given and len(given) < len(values):
        tables[values.index(None)].fail(
            "is missing, but other sensors have one: give it to all or to none", key
        )
    return given
