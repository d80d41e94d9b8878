"""What K_P and K_I are, and the third-order filter for position: C(s) of order one to three.

    python examples/third_order/reproduce.py [FOLDER]

prints tables and writes them, with figures, to FOLDER, by default ``out`` beside this file. The source is the note
"互补滤波深层原理" (S3 in docs/derivations.md).
"""

import sys
from pathlib import Path

from figure_of_eight import drive_an_eight
from orders_of_c import orders
from pi_gains import pi_controller, same_filter
from position_filters import bias_found, position, taus
from sign_of_the_figure import sign
from third_order_figures import draw_orders, draw_position, draw_slips
from third_order_tables import Table, show, write


def main() -> None:
    """Reproduce and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "out"
    for name, table in reproduce(out).items():
        show(name, table)
    print(f"\nfigures and tables: {out}")


def reproduce(out: Path) -> dict[str, Table]:
    """Compute everything, write tables and figures to `out`, and return the tables."""
    out.mkdir(parents=True, exist_ok=True)
    drive = drive_an_eight()
    tables = {
        "orders": orders(),
        "gains": same_filter(drive),
        "pi_controller": pi_controller(),
        "position": position(drive),
        "bias": bias_found(),
        "taus": taus(drive),
        "sign": sign(),
    }
    for name, table in tables.items():
        write(table, out / f"{name}.csv")
    draw_position(drive, out / "third_order.png")
    draw_orders(out / "orders.png")
    draw_slips(out / "slips.png")
    return tables


if __name__ == "__main__":
    main()
