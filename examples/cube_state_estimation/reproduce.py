"""The states of the cube: angles and rates on a corner from six inertial sensors, the tilt on an edge from an observer.

    python examples/cube_state_estimation/reproduce.py [FOLDER]

prints tables and writes figures, and the tables of the corner, to FOLDER, by default ``out`` beside this file. Equation
numbers are those of "Erfassung der Zustandsgrößen" (S1 in docs/derivations.md), where not said otherwise.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from corner_figures import draw_angles, draw_geometry, draw_rates
from corner_filters import filters, operating_point, rectified, turn
from corner_gravity import gravity
from corner_layouts import layouts, positions
from corner_motion import FAR, NEAR, swing
from corner_noise import noise
from corner_rates import rate_taus, rates
from corner_slips import slips
from corner_tables import Table, show, write
from edge_designs import plain, refusals, schemes
from edge_figure import draw
from edge_loops import analyse
from edge_study import Results, compare, fall, sweep
from edge_tables import print_tables


class Corner(NamedTuple):
    """The tables of sections 1.1 to 1.3, as printed."""

    gravity: Table
    noise: Table
    layouts: Table
    positions: Table
    slips: Table
    filters: Table
    operating_point: Table
    turn: Table
    vibration: Table
    rates: Table
    rate_taus: Table


class Reproduction(NamedTuple):
    """The numbers of both halves."""

    corner: Corner
    edge: Results


def main() -> None:
    """Reproduce and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out"
    corner, edge = reproduce(out)
    for title, table in corner._asdict().items():
        show(title, table)
    print()
    print_tables(edge)
    print(f"\nfigures and tables: {out}")


def reproduce(out: Path) -> Reproduction:
    """Compute everything, write tables and figures to `out`, and return the numbers."""
    return Reproduction(reproduce_corner(out), reproduce_edge(out))


def reproduce_corner(out: Path) -> Corner:
    """Do sections 1.1 to 1.3, on the corner: tables and figures into `out`."""
    out.mkdir(parents=True, exist_ok=True)
    near, far = swing(NEAR), swing(FAR)
    tables = Corner(
        gravity=gravity(far),
        noise=noise(),
        layouts=layouts(),
        positions=positions(),
        slips=slips(near, far),
        filters=filters(near, far),
        operating_point=operating_point(),
        turn=turn(),
        vibration=rectified(),
        rates=rates(far),
        rate_taus=rate_taus(far),
    )
    for name, table in tables._asdict().items():
        write(table, out / f"{name}.csv")
    draw_angles(near, far, out / "cube_state_estimation.png")
    draw_geometry(far, out / "geometry.png")
    draw_rates(far, tables.rate_taus, out / "rates.png")
    return tables


def reproduce_edge(out: Path) -> Results:
    """Do section 1.4, on the edge: the figure into `out`."""
    out.mkdir(parents=True, exist_ok=True)
    every, shape = schemes(), plain().B @ plain().B.T
    results = Results(
        every,
        {name: analyse(scheme) for name, scheme in every.items()},
        compare(every),
        {
            "I": sweep(np.eye(3)),
            "I, predicted": sweep(np.eye(3), filtered=False),
            "B Bᵀ": sweep(shape),
        },
        fall(every),
        refusals(),
    )
    draw(results, out / "observer.png")
    return results


if __name__ == "__main__":
    main()
