"""Recipes: what a log holds, which filter it goes through, and what comes out. TOML, checked to the last key."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compfilt.logs.designs import KINDS, Design, parse_design
from compfilt.logs.errors import RecipeError
from compfilt.logs.table import Table
from compfilt.logs.units import ACCELERATION, ANGLE, ANGULAR_RATE, TIME, Dimension, Unit

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["Clock", "Filter", "Gap", "Output", "Policy", "Recipe", "Signal", "load_recipe", "parse_recipe"]

VERSION = 1
"""The form of recipe that this release reads."""

FLAGS = "flags"
"""The output column that says what happened to each sample; it has no unit."""


@dataclass(frozen=True)
class Clock:
    """Where the time of a sample comes from: a column, or a constant rate in Hz."""

    column: str | None
    unit: Unit | None
    rate: float | None


@dataclass(frozen=True)
class Signal:
    """One input of the filter: its columns, their unit, and a factor for each column."""

    name: str
    columns: tuple[str, ...]
    unit: Unit
    scale: tuple[float, ...]


@dataclass(frozen=True)
class Filter:
    """The filter: its kind, its design, and the options that are passed on as they are, in SI.

    `structure` holds the options of the filter itself (axes, rates, at), `stream` those of a stream of it.
    """

    kind: str
    design: Design
    structure: Mapping[str, Any]
    stream: Mapping[str, Any]


@dataclass(frozen=True)
class Gap:
    """What to do when two samples lie further apart than `longer_than` seconds."""

    longer_than: float
    do: str


@dataclass(frozen=True)
class Policy:
    """What to do with what is not there. `hold`: seconds for which the last derivative stands in for a missing one."""

    missing: str
    hold: float | None
    gap: Gap | None


@dataclass(frozen=True)
class Output:
    """The columns to write, their unit, and the input columns to carry along."""

    columns: tuple[str, ...]
    unit: Unit
    keep: tuple[str, ...]


@dataclass(frozen=True)
class Recipe:
    """A whole recipe. `measurement` is the absolute signal, `derivative` the one that is integrated."""

    source: str
    clock: Clock
    measurement: Signal
    derivative: Signal
    filter: Filter
    policy: Policy
    output: Output

    @property
    def inputs(self) -> tuple[str, ...]:
        """The columns that the filter reads, without repetition."""
        clock = (self.clock.column,) if self.clock.column is not None else ()
        return tuple(dict.fromkeys(clock + self.measurement.columns + self.derivative.columns))


def load_recipe(path: str | Path) -> Recipe:
    """Read a recipe from a file.

    Parameters
    ----------
    path
        A TOML file; its form is described in the documentation, "Recipes".

    Raises
    ------
    RecipeError
        The file cannot be read, is not TOML, or holds a key that is unknown, missing or wrong.
    """
    path = Path(path)
    try:
        return parse_recipe(path.read_text(encoding="utf-8"), str(path))
    except OSError as error:
        raise RecipeError(f"{path}: the recipe cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise RecipeError(f"{path}: the recipe is not a text in UTF-8") from None


def parse_recipe(text: str, source: str = "recipe") -> Recipe:
    """Read a recipe from its text; `source` is the name to use in messages.

    Raises
    ------
    RecipeError
        The text is not TOML, or holds a key that is unknown, missing or wrong.
    """
    try:
        root = Table(source, "", tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{source}: not TOML: {error}") from None
    version = root.get("version", root.as_integer)
    if version != VERSION:
        root.fail(f"is {version}, but this release reads version {VERSION}", "version")
    filter_table, log_table = root.table("filter"), root.table("log")
    output_table = root.table("output")
    policy_table = root.table("policy") if "policy" in root else Table(source, "policy", {})
    root.close()
    # The filter comes first: it says which signals the log must hold and in which dimension.
    if filter_table.choice("kind", (*KINDS, "tilt")) == "tilt":
        recipe = _tilt(source, log_table, filter_table, policy_table, output_table)
    else:
        recipe = _linear(source, log_table, filter_table, policy_table, output_table)
    for table in (log_table, filter_table, policy_table, output_table):
        table.close()
    return recipe


def _linear(source: str, log: Table, filter_: Table, policy: Table, output: Table) -> Recipe:
    """Read a recipe for two columns fused by a linear design."""
    design = parse_design(filter_)
    clock = _clock(log)
    measurement = _signal(log, "measurement", None, 1)
    dimension = measurement.unit.dimension
    derivative = _signal(log, "derivative", dimension.per_second(design.derivative_order), 1)
    # No filter of the core has more than a few levels: the core refuses what does not fit.
    levels = tuple(dimension.per_second(level) for level in range(8))
    stream = _stream_options(filter_, levels)
    for key, read in (("period", dimension), ("delay", TIME)):
        if key in filter_:
            stream[key] = filter_.quantity(key, read)
    if "input" in filter_:
        stream["input"] = filter_.choice("input", ("sample", "trapezoid"))
    unit = output.unit("unit", dimension) if "unit" in output else measurement.unit
    return Recipe(
        source,
        clock,
        measurement,
        derivative,
        Filter(design.kind, design, {}, stream),
        _policy(policy, clock),
        _output(output, unit),
    )


def _tilt(source: str, log: Table, filter_: Table, policy: Table, output: Table) -> Recipe:
    """Read a recipe for roll and pitch from an accelerometer and a gyro."""
    design_table = filter_.table("design")
    design = parse_design(design_table)
    design_table.close()
    if design.derivative_order != 1:
        design_table.fail("is for accelerations; tilt takes one whose derivative is a rate", "kind")
    structure: dict[str, Any] = {"axes": log.choice("axes", ("flu", "frd", "cube"))}
    if "rates" in filter_:
        structure["rates"] = filter_.choice("rates", ("output", "frozen"))
    if "at" in filter_:
        structure["at"] = _pair(filter_, "at")
    clock = _clock(log)
    stream = _stream_options(filter_, (ANGLE, ANGLE))
    if "initial" in stream:
        stream["initial"] = _pair(filter_, "initial")
    return Recipe(
        source,
        clock,
        _signal(log, "accelerometer", ACCELERATION, 3),
        _signal(log, "gyro", ANGULAR_RATE, 3),
        Filter("tilt", design, structure, stream),
        _policy(policy, clock),
        _output(output, output.unit("unit", ANGLE)),
    )


def _pair(table: Table, key: str) -> tuple[float, ...]:
    """Read two angles, roll and pitch."""
    angles = table.quantities(key, (ANGLE, ANGLE))
    if len(angles) != 2:
        table.fail("must hold two angles, roll and pitch", key)
    return angles


def _clock(log: Table) -> Clock:
    """Read the time: exactly one of a column and a rate."""
    if ("time" in log) == ("rate" in log):
        log.fail('needs either time = { column = "t", unit = "s" } or rate = 100.0 (Hz)')
    if "rate" in log:
        rate = log.number("rate")
        if rate <= 0.0:
            log.fail(f"must be positive, not {rate:g}", "rate")
        return Clock(None, None, rate)
    time = log.table("time")
    clock = Clock(time.text("column"), time.unit("unit", TIME), None)
    time.close()
    return clock


def _signal(log: Table, name: str, dimension: Dimension | None, width: int) -> Signal:
    """Read a signal of one column (`column = "a"`) or of several (`columns = ["a", "b", "c"]`)."""
    table = log.table(name)
    columns = (table.text("column"),) if width == 1 else table.texts("columns")
    if len(columns) != width:
        table.fail(f"must name {width} columns, not {len(columns)}", "columns")
    if len(set(columns)) != width:
        table.fail("names a column twice", "columns")
    unit = table.unit("unit", dimension)
    scale = (1.0,) * width
    if "scale" in table:
        scale = (table.number("scale"),) if width == 1 else table.numbers("scale")
    if len(scale) != width or 0.0 in scale:
        table.fail(f"must hold {width} factors, none of them 0", "scale")
    table.close()
    return Signal(name, columns, unit, scale)


def _stream_options(filter_: Table, levels: tuple[Dimension, ...]) -> dict[str, Any]:
    """Read the options that every stream takes."""
    options: dict[str, Any] = {}
    if "rule" in filter_:
        options["rule"] = filter_.choice("rule", ("backward_euler", "matched"))
    if "initial" in filter_:
        listed = isinstance(filter_.get("initial", lambda _, value: value), list)
        initial = filter_.quantities("initial", levels) if listed else filter_.quantity("initial", levels[0])
        options["initial"] = initial
    return options


def _policy(policy: Table, clock: Clock) -> Policy:
    """Read what to do with missing samples and gaps."""
    missing = policy.choice("missing", ("coast", "raise"), "coast")
    hold = policy.quantity("hold", TIME) if "hold" in policy else None
    if "gap" not in policy:
        return Policy(missing, hold, None)
    if clock.column is None:
        policy.fail("needs [log] time: a constant rate has no gaps", "gap")
    table = policy.table("gap")
    gap = Gap(table.quantity("longer_than", TIME), table.choice("do", ("reset", "coast", "fail")))
    table.close()
    if gap.longer_than <= 0.0:
        table.fail("must be positive", "longer_than")
    return Policy(missing, hold, gap)


def _output(output: Table, unit: Unit) -> Output:
    """Read what to write."""
    columns = output.texts("columns")
    if not columns:
        output.fail("is empty: name at least one", "columns")
    keep = output.texts("keep", ())
    for key, names in (("columns", columns), ("keep", keep)):
        if len(set(names)) != len(names):
            output.fail("names a column twice", key)
    return Output(columns, unit, keep)
