"""The numbers of the reproduction, and their tables."""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

import compfilt as cf
from seat_errors import Errors
from seat_filters import BETTER_FIRST_ORDER, ELEVEN, NINE
from seat_log import RATE
from seat_sample_rate import AtRate
from seat_turn import Turn, turn_errors


class Result(NamedTuple):
    """The numbers of the reproduction; `difference` is between (9) and (11) as published, static and driving."""

    errors: dict[str, Errors]
    difference: tuple[float, float]
    rates: list[AtRate]
    turn: Turn


def show(result: Result, out: Path) -> None:
    """Print the tables and write them."""
    table(
        out / "errors.csv",
        ["RMS roll error / deg", "static", "driving", "20 other drives"],
        [[name, *(f"{value:.2f}" for value in row)] for name, row in result.errors.items()],
    )
    static, driving = result.difference
    print(f"\nRMS of {NINE} minus {ELEVEN}: static {static:.3f} deg, driving {driving:.3f} deg")
    print(
        f"tau = {BETTER_FIRST_ORDER.tau} s is a = {cf.tau_to_alpha(BETTER_FIRST_ORDER.tau, RATE):.4f} at {RATE:.0f} Hz"
    )
    table(
        out / "rates.csv",
        ["RMS on the road / deg, at", "tau / s", "error (9)", "error (11)", "(9) minus (11)"]
        + [f"short {name}" for name in result.rates[0].short],
        [
            [f"{row.rate:.0f} Hz", f"{row.tau:.3f}"]
            + [f"{value:.2f}" for value in (row.first_order, row.pi, row.difference, *row.short.values())]
            for row in result.rates
        ],
    )
    t = result.turn.t
    table(
        out / "steady_turn.csv",
        ["roll in a steady turn / deg", "largest", "at its end", "largest after it"],
        [
            [name, *(f"{np.degrees(value):.2f}" for value in turn_errors(t, np.abs(roll)))]
            for name, roll in result.turn.roll.items()
        ],
    )


def table(path: Path, head: list[str], rows: list[list[str]]) -> None:
    """Write a table and print it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    first = max(len(row[0]) for row in [head, *rows])
    print()
    for row in [head, *rows]:
        cells = (f"{cell:>{len(name) + 3}}" for name, cell in zip(head[1:], row[1:], strict=True))
        print(f"{row[0]:<{first}}" + "".join(cells))
