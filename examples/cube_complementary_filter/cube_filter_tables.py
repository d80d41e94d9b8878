"""Errors, and tables of them."""

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Table = dict[str, dict[str, float]]
"""Rows by name, cells by column."""


def rms(error: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))


def rms_degrees(error: Array) -> float:
    """Return the root mean square of an error in rad, in deg."""
    return float(np.degrees(rms(error)))


def columns_of(table: Table) -> list[str]:
    """Return the columns of all rows, in order."""
    return list(dict.fromkeys(name for row in table.values() for name in row))


def show(title: str, table: Table) -> None:
    """Print a table; a cell that a row does not have stays empty."""
    names, width = columns_of(table), max(map(len, [title, *table])) + 2
    print("\n" + title.ljust(width) + "".join(f"{name:>{len(name) + 3}}" for name in names))
    for row, cells in table.items():
        texts = (cell(cells.get(name)).rjust(len(name) + 3) for name in names)
        print(row.ljust(width) + "".join(texts))


def cell(number: float | None) -> str:
    """Write three digits of a number, nothing for none."""
    return "" if number is None else f"{number:.3g}"


def write(table: Table, path: Path) -> None:
    """Write a table to a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["case", *columns_of(table)], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"case": row, **cells} for row, cells in table.items())
