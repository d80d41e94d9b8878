"""The numbers of the reproduction, and their tables."""

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from butterworth_experiment import Experiment, experiment_errors
from butterworth_family import QUOTED, Array, Complex, Response
from butterworth_simulation import ANGLES, SIMULATED, expected_rms


class Result(NamedTuple):
    """The numbers of the reproduction; RMS errors in deg."""

    responses: dict[float, Response]
    rms: dict[float, Array]  # of phi, theta, psi
    expected: dict[float, float]  # from the frequency response
    best_q: float
    readings: dict[str, dict[float, float]]
    experiment: Experiment


def show(result: Result, out: Path) -> None:
    """Print the tables and write them."""
    table(
        out / "responses.csv",
        ["Q", "poles / (rad/s)", "-3 dB / (rad/s)", "quoted / (rad/s)", "midpoint / (rad/s)", "peak / dB"],
        [
            [
                f"{q:g}",
                poles(row.poles),
                f"{row.cutoff:.1f}",
                f"{QUOTED[q]:g}",
                f"{row.midpoint:.1f}",
                f"{row.peak:.2f}",
            ]
            for q, row in result.responses.items()
        ],
    )
    table(
        out / "simulation.csv",
        ["Q", *(f"RMS of {angle} / deg" for angle in ANGLES), "expected / deg"],
        [
            [f"{q:g}", *(f"{value:.3f}" for value in row), f"{result.expected[q]:.3f}"]
            for q, row in result.rms.items()
        ],
    )
    print(f"\nThe least RMS error is at Q = {result.best_q:.2f}: {expected_rms(result.best_q):.3f} deg")
    table(
        out / "readings.csv",
        ["RMS / deg if the noise is", *(f"Q = {q:g}" for q in SIMULATED), "paper's order"],
        [
            [name, *(f"{value:.3f}" for value in row.values()), "yes" if papers_order(row) else "no"]
            for name, row in result.readings.items()
        ],
    )
    rest = result.experiment.t > 16.0
    table(
        out / "experiment.csv",
        ["error / deg, Q = 0.625", "RMS", "largest", "largest at rest"],
        [
            [name]
            + [f"{value:.2f}" for value in (np.sqrt(np.mean(e**2)), np.abs(e).max(), np.abs(e[rest]).max())]
            for name, e in experiment_errors(result.experiment).items()
        ],
    )


def poles(values: Complex) -> str:
    """Write a pair of poles."""
    first, second = values
    if first.imag:
        return f"{first.real:.2f} +- {abs(first.imag):.2f}j"
    return f"{first.real:.2f} {second.real:.2f}"


def papers_order(rms: dict[float, float]) -> bool:
    """Tell whether a smaller Q gave a smaller error."""
    return rms[0.01] < rms[0.1] < rms[1.0]


def table(path: Path, head: list[str], rows: list[list[str]]) -> None:
    """Write a table and print it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    print()
    for first, *cells in [head, *rows]:
        print(
            f"{first:<{widths[0]}}" + "".join(f"{c:>{w + 3}}" for c, w in zip(cells, widths[1:], strict=True))
        )
