"""Recipes: what a log holds, which filter it goes through, and what comes out. TOML, checked to the last key."""

import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from compfilt.logs.errors import RecipeError
from compfilt.logs.kinds import KINDS, Filter
from compfilt.logs.outputs import Output
from compfilt.logs.policy import Gap, Policy, parse_policy
from compfilt.logs.readers.base import Columns
from compfilt.logs.table import Table
from compfilt.logs.units import ACCELERATION, TIME, Unit, parse_unit

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["Clock", "Gap", "Policy", "Recipe", "load_recipe", "parse_recipe"]

VERSION = 1
"""The form of recipe that this release reads."""


@dataclass(frozen=True)
class Clock:
    """Where the time of a sample comes from: a column, or a constant rate in Hz.

    Without a unit, the column must tell it.
    """

    column: str | None
    unit: Unit | None
    rate: float | None


@dataclass(frozen=True)
class Recipe:
    """A whole recipe.

    Attributes
    ----------
    source
        Its name, for messages.
    clock, filter, policy, output
        What it says.
    digest
        The SHA-256 of what it says: comments, order and spacing do not count.
    """

    source: str
    clock: Clock
    filter: Filter
    policy: Policy
    output: Output
    digest: str
    separator: str | None = None

    @property
    def columns(self) -> Columns:
        """What is read of a log."""
        time = () if self.clock.column is None else (self.clock.column,)
        return Columns(self.signal_columns, time, self.output.keep, self.separator)

    @property
    def signal_columns(self) -> tuple[str, ...]:
        """The columns of the filter's signals, without repetition."""
        return tuple(dict.fromkeys(column for signal in self.filter.signals for column in signal.used))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The columns that are read for the filter, the time among them, without repetition."""
        clock = (self.clock.column,) if self.clock.column is not None else ()
        return tuple(dict.fromkeys(clock + self.signal_columns))


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
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise RecipeError(f"{source}: not TOML: {error}") from None
    root = Table(source, "", values)
    version = root.get("version", root.as_integer)
    if version != VERSION:
        root.fail(f"is {version}, but this release reads version {VERSION}", "version")
    filter_table, log_table = root.table("filter"), root.table("log")
    output_table = root.table("output")
    policy_table = root.table("policy") if "policy" in root else Table(source, "policy", {})
    root.close()
    # The filter comes first: it says which signals the log must hold and in which dimension.
    filter_ = KINDS[filter_table.choice("kind", tuple(KINDS))](log_table, filter_table)
    clock = _clock(log_table, needed=filter_.has_state)
    recipe = Recipe(
        source,
        clock,
        filter_,
        parse_policy(
            policy_table,
            filter_.signals,
            times=clock.column is not None,
            rate=clock.rate is not None,
            holds=filter_.has_state,
        ),
        _output(output_table, filter_),
        _digest(values),
        _separator(log_table),
    )
    for table in (log_table, filter_table, policy_table, output_table):
        table.close()
    return recipe


def _digest(values: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()


def _clock(log: Table, *, needed: bool) -> Clock:
    """Read the time: exactly one of a column and a rate, or nothing where it is not needed."""
    given = [key for key in ("time", "rate") if key in log]
    if not given and not needed:
        return Clock(None, None, None)
    if len(given) != 1:
        log.fail('needs either time = { column = "t", unit = "s" } or rate = 100.0 (Hz)')
    if "rate" in log:
        rate = log.number("rate")
        if rate <= 0.0:
            log.fail(f"must be positive, not {rate:g}", "rate")
        return Clock(None, None, rate)
    time = log.table("time")
    column = time.text("column")
    clock = Clock(column, time.unit("unit", TIME) if "unit" in time else None, None)
    time.close()
    return clock


def _separator(log: Table) -> str | None:
    """Read what stands between the fields of a text log, where the file's ending does not tell it."""
    if "separator" not in log:
        return None
    separator = log.text("separator")
    if len(separator) != 1 or not separator.isascii() or separator in '\r\n"':
        log.fail('must be one character, such as ";" or "\\t"', "separator")
    return separator


def _output(output: Table, filter_: Filter) -> Output:
    """Read what to write."""
    unit = filter_.default_unit
    if unit is None or "unit" in output:
        unit = output.unit("unit", filter_.dimension)
    gravity_unit = parse_unit("m/s^2")
    if filter_.gives_gravity and "gravity_unit" in output:
        gravity_unit = output.unit("gravity_unit", ACCELERATION)
    columns = output.texts("columns")
    if not columns:
        output.fail("is empty: name at least one", "columns")
    keep = output.texts("keep", ())
    for key, names in (("columns", columns), ("keep", keep)):
        if len(set(names)) != len(names):
            output.fail("names a column twice", key)
    return Output(columns, unit, gravity_unit, keep)
