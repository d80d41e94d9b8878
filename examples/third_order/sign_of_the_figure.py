"""The sign in the source's last figure."""

import numpy as np

import compfilt as cf
from figure_of_eight import FS, T
from position_filters import TAU
from third_order_tables import Array, Table


def as_drawn(direction: float) -> Array:
    """Run the last figure on a body at rest with perfect sensors, begun 0.01 m off; return s_c for 12 s.

    e = s_c - s_m is added three times, times `direction`: +1 as drawn, -1 as it should be. C_i = k/s.
    """
    k1, k2, k3 = cf.ThirdOrder(TAU).coefficients
    s, v, a = 0.01, 0.0, 0.0
    positions = np.empty(round(12.0 * FS))
    for n in range(positions.size):
        e = direction * s
        s, v, a = s + T * (v + k1 * e), v + T * (a + k2 * e), a + T * k3 * e
        positions[n] = s
    return positions


def sign() -> Table:
    """Return the roots of both loops, and the growth of the one as drawn."""
    k = np.array(cf.ThirdOrder(TAU).coefficients)
    table: Table = {}
    for name, direction in (("e = s_c - s_m, as drawn", 1.0), ("e = s_m - s_c", -1.0)):
        s = abs(as_drawn(direction))
        table[name] = {
            "largest Re s / (1/s)": float(np.max(np.roots([1.0, *(-direction * k)]).real)),
            "0.01 m after 12 s / m": float(s[-1]),
        }
        if direction > 0.0:
            table[name]["growth, last 4 s / (1/s)"] = float(np.log(s[-1] / s[-1 - round(4.0 * FS)]) / 4.0)
    return table
