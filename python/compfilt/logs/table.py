"""A TOML table that is read key by key and says exactly what is wrong with it."""

import difflib
import math
from collections.abc import Callable, Mapping
from typing import Final, NoReturn, TypeVar

from compfilt.logs.errors import RecipeError
from compfilt.logs.units import Dimension, Unit, UnitError, parse_quantity, parse_unit

__all__ = ["MISSING", "Table"]

Value = TypeVar("Value")


class _Missing:
    """Stands for "there is no default": the key is required."""


MISSING: Final = _Missing()


class Table:
    """One table of a recipe.

    Every key that is asked for counts as known; `close` refuses the others. The messages name the file and the
    key: ``seat.toml: [filter] tau must be a number, not a string``.

    Parameters
    ----------
    source
        The recipe's name, for messages.
    path
        The table's name with its parents: ``log.time``; empty for the recipe itself.
    values
        What TOML made of it.
    """

    def __init__(self, source: str, path: str, values: Mapping[str, object]) -> None:
        self.source = source
        self.path = path
        self._values = values
        self._asked: list[str] = []

    def __contains__(self, key: str) -> bool:
        self._asked.append(key)
        return key in self._values

    def fail(self, message: str, key: str = "") -> NoReturn:
        """Raise a RecipeError that names the file, this table and the key."""
        place = " ".join(part for part in (f"[{self.path}]" if self.path else "", key) if part)
        raise RecipeError(f"{self.source}: {place}{' ' if place else ''}{message}")

    def get(
        self, key: str, read: Callable[[str, object], Value], default: Value | _Missing = MISSING
    ) -> Value:
        """Read one key, or return the default; without a default the key is required."""
        if key in self:
            return read(key, self._values[key])
        if isinstance(default, _Missing):
            strangers = [name for name in self._values if name not in self._asked]
            self.fail("is missing" + _suggest(key, strangers, 'is it the key "{}"?'), key)
        return default

    def text(self, key: str, default: str | _Missing = MISSING) -> str:
        """Read a string."""
        return self.get(key, self.as_text, default)

    def choice(self, key: str, choices: tuple[str, ...], default: str | _Missing = MISSING) -> str:
        """Read a string that must be one of `choices`."""
        text = self.text(key, default)
        if text not in choices:
            known = ", ".join(f'"{choice}"' for choice in choices)
            self.fail(f'has no choice "{text}"{_suggest(text, choices)}; there are {known}', key)
        return text

    def texts(self, key: str, default: tuple[str, ...] | _Missing = MISSING) -> tuple[str, ...]:
        """Read a list of strings."""
        return self.get(key, lambda key, value: tuple(self._list(key, value, self.as_text)), default)

    def numbers(self, key: str, default: tuple[float, ...] | _Missing = MISSING) -> tuple[float, ...]:
        """Read a list of numbers."""
        return self.get(key, lambda key, value: tuple(self._list(key, value, self.as_number)), default)

    def number(self, key: str, default: float | _Missing = MISSING) -> float:
        """Read a finite number."""
        return self.get(key, self.as_number, default)

    def unit(self, key: str, expected: Dimension | None = None) -> Unit:
        """Read the name of a unit; it is always required, since no unit can be guessed."""
        name = self.text(key)
        try:
            return parse_unit(name, expected)
        except UnitError as error:
            self.fail(f"is wrong: {error}", key)

    def quantity(self, key: str, dimension: Dimension, default: float | _Missing = MISSING) -> float:
        """Read a number in SI, or text such as "20 ms"; return it in SI."""
        return self.get(key, lambda key, value: self.as_quantity(key, value, dimension), default)

    def quantities(self, key: str, dimensions: tuple[Dimension, ...]) -> tuple[float, ...]:
        """Read a list of quantities, each of its own dimension; fewer may be given."""
        values = self.get(key, lambda key, value: self._list(key, value, lambda _, item: item))
        if len(values) > len(dimensions):
            self.fail(f"has {len(values)} values, but the filter has {len(dimensions)}", key)
        pairs = zip(values, dimensions, strict=False)
        return tuple(self.as_quantity(key, value, dimension) for value, dimension in pairs)

    def vector(self, key: str, dimension: Dimension) -> tuple[float, float, float]:
        """Read three quantities of one dimension, in SI."""
        values = self.get(key, lambda key, value: self._list(key, value, lambda _, item: item))
        if len(values) != 3:
            self.fail(f"must hold 3 values, not {len(values)}", key)
        x, y, z = (self.as_quantity(key, value, dimension) for value in values)
        return x, y, z

    def matrix(self, key: str) -> tuple[tuple[float, ...], ...]:
        """Read three rows of three numbers."""
        rows = self.get(key, lambda key, value: self._list(key, value, self._as_row))
        if [len(row) for row in rows] != [3, 3, 3]:
            self.fail("must hold 3 rows of 3 numbers", key)
        return tuple(rows)

    def holds_list(self, key: str) -> bool:
        """Tell whether a key holds a list, for those that may hold one value or several."""
        return isinstance(self.get(key, lambda _, value: value), list)

    def table(self, key: str) -> "Table":
        """Read a table below this one."""
        return self._below(key, self.get(key, self._as_mapping))

    def tables(self, key: str) -> list["Table"]:
        """Read the tables of an array below this one; messages count them from 1."""
        if not self.holds_list(key):
            self.fail(f"must be written [[{self._name(key)}]], one such table for each", key)
        values = self.get(key, lambda key, value: self._list(key, value, self._as_mapping))
        if not values:
            self.fail("is empty: give at least one", key)
        return [self._below(f"{key} #{number}", value) for number, value in enumerate(values, 1)]

    def close(self) -> None:
        """Refuse every key that nothing asked for."""
        for key in self._values:
            if key not in self._asked:
                known = sorted(set(self._asked))
                self.fail(f'has no key "{key}"{_suggest(key, known)}; there are {", ".join(known)}')

    def as_text(self, key: str, value: object) -> str:
        """Check that a value is text, and not empty."""
        if not isinstance(value, str) or not value:
            self.fail(f"must be a text, not {_kind(value)}", key)
        return value

    def as_number(self, key: str, value: object) -> float:
        """Check that a value is a finite number."""
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail(f"must be a number, not {_kind(value)}", key)
        if not math.isfinite(value):
            self.fail(f"must be finite, not {value}", key)
        return float(value)

    def as_integer(self, key: str, value: object) -> int:
        """Check that a value is a whole number."""
        if isinstance(value, bool) or not isinstance(value, int):
            self.fail(f"must be a whole number, not {_kind(value)}", key)
        return value

    def as_quantity(self, key: str, value: object, dimension: Dimension) -> float:
        """Check that a value is a number in SI or a quantity of the dimension."""
        if not isinstance(value, str):
            return self.as_number(key, value)
        try:
            return parse_quantity(value, dimension)
        except UnitError as error:
            self.fail(f"is wrong: {error}", key)

    def _name(self, key: str) -> str:
        return f"{self.path}.{key}" if self.path else key

    def _below(self, name: str, values: Mapping[str, object]) -> "Table":
        return Table(self.source, self._name(name), values)

    def _as_row(self, key: str, value: object) -> tuple[float, ...]:
        return tuple(self._list(key, value, self.as_number))

    def _as_mapping(self, key: str, value: object) -> Mapping[str, object]:
        if not isinstance(value, dict):
            self.fail(f"must be a table, not {_kind(value)}", key)
        return value

    def _list(self, key: str, value: object, read: Callable[[str, object], Value]) -> list[Value]:
        if not isinstance(value, list):
            self.fail(f"must be a list, not {_kind(value)}", key)
        return [read(key, item) for item in value]


def _suggest(name: str, known: tuple[str, ...] | list[str], form: str = 'did you mean "{}"?') -> str:
    """Name the known word that is written nearly so, in brackets."""
    found = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return f" ({form.format(found[0])})" if found else ""


def _kind(value: object) -> str:
    """Name a TOML value's type in plain words."""
    names = {
        bool: "a true or false",
        int: "a whole number",
        float: "a number",
        list: "a list",
        dict: "a table",
    }
    if isinstance(value, str):
        return f'the text "{value}"'
    return names.get(type(value), "a date or time")
