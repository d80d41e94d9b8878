"""Gains from the first seconds of rest, against the best ones in motion, and how to come near them without truth.

    python examples/design_from_rest/reproduce.py [FOLDER]

prints the tables and writes them to FOLDER, by default ``out`` beside this file. It needs the recordings of BROAD:
``COMPFILT_RECORDINGS`` names their folder. Without them it says so and does nothing.
"""

import csv
import sys
from pathlib import Path

import numpy as np

from compfilt.design import from_recordings
from motion_rule import by_spectra_in_motion, error, recording, with_the_offline_estimate, with_truth
from rest_rule import by_densities, by_spectra, explained
from rest_trials import RECORDINGS, Trial, trials

Table = dict[str, dict[str, float]]
"""Rows by name, cells by column."""


def main() -> None:
    """Choose, score and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out"
    if not any(RECORDINGS.glob("*.parquet")):
        print(f"NO RECORDINGS in {RECORDINGS}: nothing is reproduced")
        return
    for name, table in reproduce(out, trials()).items():
        show(name, table)
    print(f"\ntables: {out}")


def reproduce(out: Path, chosen: list[Trial]) -> dict[str, Table]:
    """Compute the tables, write them to `out` and return them."""
    out.mkdir(parents=True, exist_ok=True)
    tables: dict[str, Table] = {"rest": {}, "motion": {}, "all": {}}
    for trial in chosen:
        tables["rest"][trial.name], tables["motion"][trial.name] = rows(trial)
    tables["all"] = summary(chosen, tables["motion"])
    for name, table in tables.items():
        write(table, out / f"{name}.csv")
    return tables


def rows(trial: Trial) -> tuple[dict[str, float], dict[str, float]]:
    """Return what the rest says of a trial, and what every choice has in motion."""
    closed, searched = by_densities(trial), by_spectra(trial)
    assert closed.prediction is not None
    assert searched.prediction is not None
    at_rest, in_motion, _ = explained(trial, searched.design)
    rest = {
        "rest / s": trial.rest / trial.fs,
        "r/q / s": 1.0 / closed.design.coefficients[0],
        "tau / s": 1.0 / searched.design.coefficients[0],
        "predicted / deg": float(np.degrees(searched.prediction.sigma)),
        "residual/noise, rest": at_rest,
        "residual/noise, motion": in_motion,
    }
    choices = {
        "best": with_truth(trial),
        "rest": searched,
        "spectra in motion": by_spectra_in_motion(trial),
        "offline estimate": with_the_offline_estimate(trial),
    }
    motion = {}
    for name, choice in choices.items():
        motion |= {
            f"tau {name} / s": 1.0 / choice.design.coefficients[0],
            f"error {name} / deg": error(trial, choice.design),
        }
    return rest, motion


def summary(chosen: list[Trial], motion: Table) -> Table:
    """Return the mean error over the trials of every choice, and its ratio to the best."""
    table: Table = {}
    best = np.array([row["error best / deg"] for row in motion.values()])
    for name in ("best", "rest", "spectra in motion", "offline estimate"):
        errors = np.array([row[f"error {name} / deg"] for row in motion.values()])
        table[name] = ratios(errors, best)
    for name, truth in (("one tau for all, truth", True), ("one tau for all, offline estimate", False)):
        design = from_recordings([recording(trial, truth=truth) for trial in chosen]).design
        errors = np.array([error(trial, design) for trial in chosen])
        table[name] = {"tau / s": 1.0 / design.coefficients[0]} | ratios(errors, best)
    return table


def ratios(errors: np.ndarray, best: np.ndarray) -> dict[str, float]:
    """Return the mean error in deg, and how much larger than the best the errors are."""
    ratio = errors / best
    return {
        "mean error / deg": float(errors.mean()),
        "median ratio": float(np.median(ratio)),
        "worst ratio": float(ratio.max()),
    }


def show(title: str, table: Table) -> None:
    """Print a table."""
    names = list(dict.fromkeys(name for row in table.values() for name in row))
    width = max(map(len, [title, *table])) + 2
    print("\n" + title.ljust(width) + "".join(f"{name:>{len(name) + 2}}" for name in names))
    for row, cells in table.items():
        texts = (f"{cells[name]:.3g}" if name in cells else "" for name in names)
        print(
            row.ljust(width)
            + "".join(f"{text:>{len(name) + 2}}" for text, name in zip(texts, names, strict=True))
        )


def write(table: Table, path: Path) -> None:
    """Write a table to a CSV file."""
    names = list(dict.fromkeys(name for row in table.values() for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["case", *names], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"case": row, **cells} for row, cells in table.items())


if __name__ == "__main__":
    main()
