"""Two angles of a body, from one gyro and one accelerometer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import compfilt
from compfilt.logs.designs import Design
from compfilt.logs.kinds.base import Filter
from compfilt.logs.kinds.options import angle_design, angle_options
from compfilt.logs.outputs import Channel, Offer, Output, offer_of
from compfilt.logs.signals import Signal, parse_signal
from compfilt.logs.table import Table
from compfilt.logs.units import ACCELERATION, ANGLE, ANGULAR_RATE, Dimension

__all__ = ["CUBE_ANGLES", "Tilt", "angle_columns", "angle_names", "parse_tilt"]

CUBE_ANGLES = ("phi2", "phi3")
"""The names of the angles with the cube's axes."""


@dataclass(frozen=True)
class Tilt(Filter):
    """A tilt filter; `structure` holds its options, `stream` those of a stream of it, in SI."""

    design: Design
    accelerometer: Signal
    gyro: Signal
    structure: Mapping[str, Any]
    stream: Mapping[str, Any]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The accelerometer and the gyro."""
        return (self.accelerometer, self.gyro)

    @property
    def dimension(self) -> Dimension:
        """An angle."""
        return ANGLE

    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> Any:  # noqa: ANN401
        """Make a stream of the tilt filter."""
        tilt = compfilt.TiltFilter(self.design.build(), **self.structure)
        return tilt.stream(fs=fs, dtype=dtype, **self.stream, **policy)

    def arguments(self, values: Sequence[npt.NDArray[np.floating]]) -> tuple[npt.NDArray[np.floating], ...]:
        """Put the gyro first."""
        accelerometer, gyro = values
        return gyro, accelerometer

    def offer(self, estimate: Any, output: Output) -> Offer:  # noqa: ANN401
        """List the angles and their biases."""
        return offer_of(angle_columns(estimate, output, angle_names(self.structure["axes"])))


def angle_names(axes: str) -> tuple[str, str]:
    """Return what the two angles are called with these axes."""
    return CUBE_ANGLES if axes == "cube" else ("roll", "pitch")


def angle_columns(
    estimate: Any,  # noqa: ANN401 - a TiltEstimate or a CubeEstimate
    output: Output,
    names: tuple[str, str],
) -> dict[str, tuple[Channel, ...]]:
    """List two angles; `bias` stands for both of theirs, where the design estimates one."""
    angles = [Channel(name, "angles", np.s_[:, i], output.unit) for i, name in enumerate(names)]
    groups: dict[str, tuple[Channel, ...]] = {angle.name: (angle,) for angle in angles}
    if getattr(estimate, "bias", None) is not None:
        rate = output.unit.per_second(1)
        biases = [Channel(f"{name}_bias", "bias", np.s_[:, i], rate) for i, name in enumerate(names)]
        groups["bias"] = tuple(biases)
    return groups


def parse_tilt(log: Table, filter_: Table) -> Tilt:
    """Read the two sensors, their axes, the design and its options."""
    design = angle_design(filter_)
    axes = log.choice("axes", ("flu", "frd", "cube"))
    structure, stream = angle_options(filter_, angle_names(axes))
    return Tilt(
        "tilt",
        design,
        parse_signal(log, "accelerometer", ACCELERATION, 3),
        parse_signal(log, "gyro", ANGULAR_RATE, 3),
        {"axes": axes} | structure,
        stream,
    )
