"""The lines of a recipe that are proposed: names from a log may hold quotes, line breaks, and whatever else TOML escapes."""

import json

import numpy as np

from compfilt.logs.check.claims import Triad
from compfilt.logs.check.source import Array
from compfilt.logs.units import Unit

__all__ = ["IN_FILTER", "clock", "mended", "toml_text", "turned_columns"]

IN_FILTER = '# in [filter], kind "attitude"'
"""Behind a line that belongs there."""


def toml_text(text: str) -> str:
    """Write a text as TOML has it, with what a terminal would act on escaped."""
    quoted = json.dumps(text, ensure_ascii=False)
    return "".join(letter if letter.isprintable() else _escaped(ord(letter)) for letter in quoted)


def _escaped(code: int) -> str:
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def clock(column: str, unit: Unit) -> str:
    """Write where the time comes from."""
    return f"time = {{ column = {toml_text(column)}, unit = {toml_text(unit.name)} }}"


def turned_columns(triad: Triad, matrix: Array) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return the columns in the right order and the sign of each."""
    order = np.argmax(np.abs(matrix), axis=1)
    return tuple(triad.columns[place] for place in order), tuple(
        float(matrix[row, place]) for row, place in enumerate(order)
    )


def mended(triad: Triad, matrix: Array, unit: str, factor: float = 1.0) -> str:
    """Write a signal of a recipe: the columns in the right order, with unit and scale."""
    columns, signs = turned_columns(triad, matrix)
    scales = dict(zip(triad.columns, triad.scale, strict=True))
    scale = [sign * scales[column] * factor for column, sign in zip(columns, signs, strict=True)]
    named = ", ".join(map(toml_text, columns))
    text = f"{{ columns = [{named}], unit = {toml_text(unit)}"
    if any(abs(value - 1.0) > 1e-9 for value in scale):
        text += f", scale = [{', '.join(f'{value:.6g}' for value in scale)}]"
    return text + " }"
