"""The Butterworth filter of Jeon (S4): its simulation for Q = 1, 0.1, 0.01, and its experiment as a simulation.

    python examples/butterworth/reproduce.py [folder]

Prints the tables, and writes them and the figures to ``examples/butterworth/out/`` or to the folder.
"""

import sys
from pathlib import Path

import numpy as np

from butterworth_experiment import experiment
from butterworth_family import QUOTED, response
from butterworth_figures import draw_experiment, draw_run, draw_summary
from butterworth_simulation import (
    AS_READ,
    FEW_RUNS,
    READINGS,
    RUNS,
    SIMULATED,
    expected_rms,
    one_run,
    pooled,
    simulate,
)
from butterworth_tables import Result, show


def main() -> None:
    """Reproduce into the folder that is named, or beside this file."""
    reproduce(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out")


def reproduce(out: Path) -> Result:
    """Simulate, compare, print, draw."""
    out.mkdir(parents=True, exist_ok=True)
    sweep = {q: expected_rms(q) for q in np.geomspace(0.003, 30.0, 201).tolist()}
    result = Result(
        {q: response(q) for q in QUOTED},
        simulate(AS_READ, RUNS),
        {q: expected_rms(q) for q in SIMULATED},
        min(sweep, key=sweep.__getitem__),
        {name: pooled(simulate(noise, FEW_RUNS)) for name, noise in READINGS.items()},
        experiment(),
    )
    show(result, out)
    draw_summary(result, sweep, out / "butterworth.png")
    draw_run(one_run(), out / "angles.png")
    draw_experiment(result.experiment, out / "experiment.png")
    return result


if __name__ == "__main__":
    main()
