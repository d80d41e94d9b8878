"""The complementary filters of the cube: angle, rate, the rule for choosing them, and unequal time constants.

    python examples/cube_complementary_filter/reproduce.py [FOLDER]

prints tables and writes them, with figures, to FOLDER, by default ``out`` beside this file. The noise is taken from real
recordings where they are at hand (``COMPFILT_RECORDINGS`` names their folder), otherwise from a simulated one. Equation
numbers are those of "Komplementär-Filter" (S0 in docs/derivations.md).
"""

import sys
from pathlib import Path

from angle_and_rate_filters import checks, rates
from cube_filter_figures import draw_rates, draw_rule, draw_unequal
from cube_filter_tables import Table, show, write
from rule_at_rest import still_phases
from rule_in_motion import in_motion
from rule_recordings import noise_records
from swinging_cube import swing_of_the_edge
from unequal_time_constants import unequal_taus


def main() -> None:
    """Reproduce and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out"
    for name, table in reproduce(out).items():
        show(name, table)
    print(f"\nfigures and tables: {out}")


def reproduce(out: Path) -> dict[str, Table]:
    """Compute everything, write tables and figures to `out`, and return the tables."""
    out.mkdir(parents=True, exist_ok=True)
    swing = swing_of_the_edge()
    source, trials = noise_records()
    still_table, rules = still_phases(source)
    tables = {
        "checks": checks(swing),
        "rates": rates(swing),
        "unequal_taus": unequal_taus(swing),
        "still": still_table,
        "motion": in_motion(trials),
    }
    for name, table in tables.items():
        write(table, out / f"{name}.csv")
    draw_rule(source.recording, rules, out / "cube_complementary_filter.png")
    draw_rates(swing, out / "rates.png")
    draw_unequal(swing, out / "unequal_taus.png")
    return tables


if __name__ == "__main__":
    main()
