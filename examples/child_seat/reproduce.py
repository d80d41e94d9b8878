"""The child seat of Iontchev, Miletiev and Hristov (S2): both filters with the paper's gains, against the truth.

    python examples/child_seat/reproduce.py [folder]

Prints the tables, and writes them and the figures to ``examples/child_seat/out/`` or to the folder.
"""

import sys
from pathlib import Path

from seat_errors import compare, rms
from seat_figures import draw_log, draw_turn
from seat_filters import ELEVEN, NINE, answers
from seat_log import simulate
from seat_sample_rate import at_rate
from seat_tables import Result, show
from seat_turn import steady_turn


def main() -> None:
    """Reproduce into the folder that is named, or beside this file."""
    reproduce(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out")


def reproduce(out: Path) -> Result:
    """Filter, compare, print, draw."""
    out.mkdir(parents=True, exist_ok=True)
    log = simulate(seed=0)
    rolls = answers(log)
    apart = rolls[NINE] - rolls[ELEVEN]
    result = Result(
        compare(log, rolls),
        (rms(apart[~log.driving]), rms(apart[log.driving])),
        [at_rate(rate) for rate in (25.0, 50.0, 80.0, 100.0, 200.0, 400.0)],
        steady_turn(),
    )
    show(result, out)
    draw_log(log, rolls, out / "child_seat.png")
    draw_turn(result.turn, out / "steady_turn.png")
    return result


if __name__ == "__main__":
    main()
