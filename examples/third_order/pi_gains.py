"""What K_P and K_I are: the coefficients of a second-order filter, not the gains of the printed PI loop."""

import numpy as np

import compfilt as cf
from figure_of_eight import FS, Drive
from orders_of_c import DESIGNS, OMEGA0
from position_filters import TAU
from third_order_tables import Array, Complex, Table


def same_filter(drive: Drive) -> Table:
    """Filter one signal with designs that have the same coefficients; count the samples that differ in any bit."""
    rng = np.random.default_rng(1)
    angle = drive.position[:, 0] + rng.normal(0.0, 1.0, drive.t.size)
    pi, butterworth, third = cf.PiForm(20.0, 10.0), cf.Butterworth(OMEGA0), cf.ThirdOrder(TAU)
    pairs = {
        "PiForm(K_P, K_I), Chain([K_P, K_I])": (pi, cf.Chain(pi.coefficients)),
        "PiForm(K_P, K_I), Butterworth(ω0)": (cf.PiForm(*butterworth.coefficients), butterworth),
        "FirstOrder(τ), Chain([1/τ])": (cf.FirstOrder(TAU), cf.Chain([1.0 / TAU])),
        "ThirdOrder, Chain([k1, k2, k3])": (third, cf.Chain(third.coefficients, derivative_order=2)),
    }
    return {
        name: {"samples": drive.t.size, "that differ": int(np.sum(outputs[0] != outputs[1]))}
        for name, designs in pairs.items()
        for outputs in [[each.filter(angle, drive.acceleration[:, 0], fs=FS) for each in designs]]
    }


def printed_pi(omega: Array) -> Complex:
    """Return the note's U/R = C/(C + 1), which it compares with C/(C + s)."""
    k_p, k_i = DESIGNS["order 2, C = a + b/s"].coefficients
    c = k_p + k_i / (1j * omega)
    return c / (c + 1.0)


def pi_controller() -> Table:
    """Compare the PI loop as printed with the filter of the same two numbers."""
    design = DESIGNS["order 2, C = a + b/s"]
    table: Table = {}
    for factor in (0.01, 0.1, 1.0, 10.0, 100.0):
        omega = np.array([factor * OMEGA0])
        table[f"omega = {factor:g} omega0"] = {
            "|C/(C + s)|, LP": float(abs(design.frequency_response(omega)[0][0])),
            "|C/(C + 1)|, as printed": float(abs(printed_pi(omega)[0])),
        }
    return table
