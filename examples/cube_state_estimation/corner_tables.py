"""Errors, and tables of them."""

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Table = dict[str, dict[str, float | str]]
"""Rows by name, cells by column."""


def rms(values: Array | float) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def columns_of(table: Table) -> list[str]:
    """Return the columns of all rows, in order."""
    return list(dict.fromkeys(name for row in table.values() for name in row))


def cell(value: float | str | None) -> str:
    """Return the text of a cell."""
    if value is None:
        return ""
    return value if isinstance(value, str) else f"{value:.3g}"


def show(title: str, table: Table) -> None:
    """Print a table; a cell that a row does not have stays empty."""
    rows = [[title, *columns_of(table)]]
    rows += [[name, *(cell(cells.get(column)) for column in rows[0][1:])] for name, cells in table.items()]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    print()
    for first, *others in rows:
        texts = (
            f"   {text:<{width}}" if name == "message" else f"   {text:>{width}}"
            for name, text, width in zip(rows[0][1:], others, widths[1:], strict=True)
        )
        print((first.ljust(widths[0]) + "".join(texts)).rstrip())


def write(table: Table, path: Path) -> None:
    """Write a table to a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["case", *columns_of(table)], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"case": row, **cells} for row, cells in table.items())
