"""The attitude filters that a recipe can name, and their parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import compfilt
from compfilt.logs.designs import Design
from compfilt.logs.kinds.attitude_stream import turned
from compfilt.logs.kinds.options import angle_design
from compfilt.logs.table import Table
from compfilt.logs.units import ACCELERATION, ANGULAR_RATE, TIME

__all__ = ["Method", "parse_method"]

_GRAVITY = (
    "tau",
    "zeta",
    "gyro_delay",
    "advance",
    "heading_tau",
    "acc_range",
    "rest_time",
    "rest_rate",
    "rest_force",
    "rest_drift",
    "bias_limit",
)

_METHODS = {
    "gravity": (*_GRAVITY, "order", "split"),
    "self_calibrating": _GRAVITY,
    "mahony": ("kp", "ki", "form", "bias_limit", "acc_range"),
}

_DIMENSIONS = {
    "tau": TIME,
    "gyro_delay": TIME,
    "advance": TIME,
    "heading_tau": TIME,
    "rest_time": TIME,
    "rest_rate": ANGULAR_RATE,
    "bias_limit": ANGULAR_RATE,
    "rest_force": ACCELERATION,
    "rest_drift": ACCELERATION,
    "acc_range": ACCELERATION,
}


@dataclass(frozen=True)
class Method:
    """An attitude filter as a recipe names it, with its parameters in SI; `design` gives the gains of Mahony's.

    Examples
    --------
    >>> Method("gravity", {"tau": 2.0}).build()
    GravityFilter(tau=2.0, order=2, split=1, zeta=0.5)
    """

    name: str
    parameters: Mapping[str, Any]
    design: Design | None = None

    def build(self) -> compfilt.Mahony | compfilt.GravityFilter:
        """Make the filter.

        Raises
        ------
        ValueError
            A parameter breaks its rule; the text comes from the library and names both.
        """
        if self.name != "mahony":
            return compfilt.GravityFilter(self_calibrating=self.name == "self_calibrating", **self.parameters)
        if self.design is not None:
            return compfilt.Mahony.from_design(self.design.build(), **self.parameters)
        return compfilt.Mahony(**self.parameters)

    @property
    def linear(self) -> Design | None:
        """The design that small errors of Mahony's filter obey; the gravity filters have none.

        Raises
        ------
        ValueError
            As `build`.
        """
        if self.name != "mahony" or self.design is not None:
            return self.design
        filter_ = compfilt.Mahony(**self.parameters)
        if filter_.ki > 0.0:
            return Design("pi", "PiForm", {"kp": filter_.kp, "ki": filter_.ki})
        return Design("first_order", "FirstOrder", {"tau": 1.0 / filter_.kp})

    def with_design(self, design: Design) -> "Method":
        """Return Mahony's filter with the gains of a design in place of its own."""
        others = {name: value for name, value in self.parameters.items() if name not in {"kp", "ki"}}
        return replace(self, parameters=others, design=design)

    @property
    def finds_rest(self) -> bool:
        """Whether it looks for rest."""
        return self.name != "mahony"

    @property
    def finds_bias(self) -> bool:
        """Whether it estimates the gyro's bias."""
        filter_ = self.build()
        return not isinstance(filter_, compfilt.Mahony) or filter_.ki > 0.0


def parse_method(filter_: Table, axes: str) -> Method:
    """Read `method` and the parameters of that method, leaving the table's other keys alone."""
    name = filter_.choice("method", tuple(_METHODS), "gravity")
    design = None
    if name == "mahony":
        ways = {key: key in filter_ for key in ("design", "kp", "ki")}
        if ways["design"] == (ways["kp"] or ways["ki"]):
            filter_.fail('method = "mahony" takes either kp, with ki or without it, or design')
        if ways["design"]:
            design = angle_design(filter_)
        else:
            filter_.number("kp")
    parameters = {key: _parameter(filter_, key) for key in _METHODS[name] if key in filter_}
    if name == "self_calibrating" and "calibration" in filter_:
        parameters["calibration"] = _in_the_filters_axes(filter_.matrix("calibration"), axes)
    return Method(name, parameters, design)


def _parameter(table: Table, name: str) -> object:
    """Read one parameter in the form that its name asks for."""
    match name:
        case "order" | "split":
            return table.get(name, table.as_integer)
        case "form":
            return table.choice(name, ("explicit", "passive", "direct"))
        case _ if name in _DIMENSIONS:
            return table.quantity(name, _DIMENSIONS[name])
        case _:
            return table.number(name)


def _in_the_filters_axes(matrix: tuple[tuple[float, ...], ...], axes: str) -> list[list[float]]:
    """Turn both sides of a matrix that takes body vectors to body vectors."""
    rows: list[list[float]] = turned(turned(np.array(matrix), axes).T, axes).T.tolist()
    return rows
