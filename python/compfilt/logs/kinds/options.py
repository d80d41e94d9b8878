"""The options that several kinds of filter share."""

from typing import Any

from compfilt.logs.designs import Design, parse_design
from compfilt.logs.table import Table
from compfilt.logs.units import ANGLE, Dimension

__all__ = ["angle_design", "angle_options", "stream_options"]


def stream_options(filter_: Table, levels: tuple[Dimension, ...]) -> dict[str, Any]:
    """Read the options that every stream takes; `levels` are the dimensions of initial values."""
    options: dict[str, Any] = {}
    if "rule" in filter_:
        options["rule"] = filter_.choice("rule", ("backward_euler", "matched"))
    if "initial" in filter_:
        listed = filter_.holds_list("initial")
        initial = filter_.quantities("initial", levels) if listed else filter_.quantity("initial", levels[0])
        options["initial"] = initial
    return options


def angle_design(filter_: Table) -> Design:
    """Read the table `design`: one that fuses an angle with its rate."""
    table = filter_.table("design")
    design = parse_design(table)
    table.close()
    if design.derivative_order != 1:
        kind = filter_.text("kind")
        table.fail(f"is for accelerations; {kind} takes one whose derivative is a rate", "kind")
    return design


def angle_options(filter_: Table, names: tuple[str, str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read the options of two filtered angles: those of the filter, and those of a stream of it."""
    structure: dict[str, Any] = {}
    if "rates" in filter_:
        structure["rates"] = filter_.choice("rates", ("output", "frozen"))
    if "at" in filter_:
        structure["at"] = _pair(filter_, "at", names)
    stream = stream_options(filter_, (ANGLE, ANGLE))
    if "initial" in stream:
        stream["initial"] = _pair(filter_, "initial", names)
    return structure, stream


def _pair(table: Table, key: str, names: tuple[str, str]) -> tuple[float, ...]:
    angles = table.quantities(key, (ANGLE, ANGLE))
    if len(angles) != 2:
        table.fail(f"must hold two angles, {names[0]} and {names[1]}", key)
    return angles
