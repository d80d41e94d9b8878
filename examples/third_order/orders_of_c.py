"""C(s) = k_1 + k_2/s + k_3/s² of order one to three: C/(C + s) and s/(C + s)."""

import numpy as np

import compfilt as cf
from third_order_tables import Array, Complex, Table

OMEGA0 = 1.0
DESIGNS: dict[str, cf.LinearFilter] = {
    "order 1, C = c": cf.FirstOrder(1.0 / OMEGA0),
    "order 2, C = a + b/s": cf.PiForm(np.sqrt(2.0) * OMEGA0, OMEGA0**2),
    "order 3, C = a + b/s + c/s²": cf.ThirdOrder.butterworth(OMEGA0),
}
"""All with Butterworth poles, so that their corners are comparable."""


def closed_forms(design: cf.LinearFilter, omega: Array) -> tuple[Complex, Complex]:
    """Return C/(C + s) and s/(C + s) as the source has them."""
    s = 1j * omega
    c = sum(k / s**i for i, k in enumerate(design.coefficients))
    return c / (c + s), s / (c + s)


def orders() -> Table:
    """Compare the library's responses with the source's, and say what the order changes."""
    omega = OMEGA0 * np.geomspace(1e-8, 1e3, 11001)
    table: Table = {}
    for name, design in DESIGNS.items():
        low, high = design.frequency_response(omega)
        low_by_c, high_by_c = closed_forms(design, omega)
        above = omega > OMEGA0
        table[name] = {
            "LP, off C/(C + s)": float(np.max(abs(low - low_by_c))),
            "HP, off s/(C + s)": float(np.max(abs(high - high_by_c))),
            "LP + HP, off 1": float(np.max(abs(low + high - 1.0))),
            "LP peak / dB": float(decibel_of(np.max(abs(low)))),
            "LP at -3 dB / omega0": float(omega[above][np.argmax(abs(low[above]) < np.sqrt(0.5))] / OMEGA0),
            "HP at 0.1 omega0 / dB": float(decibel_of(np.interp(0.1 * OMEGA0, omega, abs(high)))),
        }
    return table


def decibel_of(response: Complex | float) -> Array:
    """Return the magnitude in dB."""
    return 20.0 * np.log10(np.abs(response))
