"""Two columns, a measurement and its derivative, fused by a linear design."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from compfilt.logs.designs import Design, parse_design
from compfilt.logs.kinds.base import Filter
from compfilt.logs.kinds.options import stream_options
from compfilt.logs.outputs import Channel, Offer, Output, offer_of
from compfilt.logs.signals import Signal, parse_signal
from compfilt.logs.table import Table
from compfilt.logs.units import TIME, Dimension, Unit

__all__ = ["Linear", "parse_linear"]


@dataclass(frozen=True)
class Linear(Filter):
    """A linear design on two columns; `stream` holds the options of a stream of it, in SI."""

    design: Design
    measurement: Signal
    derivative: Signal
    stream: Mapping[str, Any]

    @property
    def signals(self) -> tuple[Signal, ...]:
        """The measurement and its derivative."""
        return (self.measurement, self.derivative)

    @property
    def dimension(self) -> Dimension:
        """That of the measurement."""
        return self.measurement.unit.dimension

    @property
    def default_unit(self) -> Unit:
        """The measurement's unit."""
        return self.measurement.unit

    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> Any:  # noqa: ANN401
        """Make a stream of the design."""
        return self.design.build().stream(fs=fs, dtype=dtype, **self.stream, **policy)

    def offer(self, estimate: Any, output: Output) -> Offer:  # noqa: ANN401
        """List the levels, their names and the bias, as far as the design has them."""
        units = [output.unit.per_second(times) for times in range(len(np.asarray(estimate.levels)))]
        channels = [Channel(f"level{i}", "levels", i, unit) for i, unit in enumerate(units)]
        names = ["estimate", "position", "velocity"] if self.design.derivative_order == 2 else ["estimate"]
        places = {"estimate": 0, "position": 0, "velocity": 1}
        channels += [Channel(name, "levels", places[name], units[places[name]]) for name in names]
        if getattr(estimate, "bias", None) is not None:
            unit = output.unit.per_second(self.design.derivative_order)
            channels.append(Channel("bias", "bias", slice(None), unit))
        return offer_of({channel.name: (channel,) for channel in channels})


def parse_linear(log: Table, filter_: Table) -> Linear:
    """Read the two signals, the design and its options."""
    design = parse_design(filter_)
    measurement = parse_signal(log, "measurement", None, 1)
    dimension = measurement.unit.dimension
    derivative = parse_signal(log, "derivative", dimension.per_second(design.derivative_order), 1)
    # No filter of the core has more than a few levels: the core refuses what does not fit.
    levels = tuple(dimension.per_second(level) for level in range(8))
    stream = stream_options(filter_, levels)
    for key, read in (("period", dimension), ("delay", TIME)):
        if key in filter_:
            stream[key] = filter_.quantity(key, read)
    if "input" in filter_:
        stream["input"] = filter_.choice("input", ("sample", "trapezoid"))
    return Linear(design.kind, design, measurement, derivative, stream)
