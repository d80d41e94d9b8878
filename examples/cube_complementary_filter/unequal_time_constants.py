"""§1.4, (22): unequal time constants of low-pass and high-pass."""

import numpy as np
import numpy.typing as npt

import compfilt as cf
from cube_filter_tables import Array, Table, rms_degrees
from swinging_cube import FS, TAU, Swing

RATIOS = (0.25, 0.5, 0.9, 1.0, 1.1, 2.0, 4.0)


def summed_response(ratio: float, omega: Array) -> npt.NDArray[np.complex128]:
    """Return LP with tau1 plus HP with tau2 = `ratio` tau1."""
    low, _ = cf.FirstOrder(TAU).frequency_response(omega)
    _, high = cf.FirstOrder(ratio * TAU).frequency_response(omega)
    return low + high


def unequal_error(swing: Swing, ratio: float) -> Array:
    """Return the error of (3) with tau2 = `ratio` tau1 and perfect sensors, in rad."""
    nothing = np.zeros(swing.t.size)
    low = cf.FirstOrder(TAU).filter(swing.angle, nothing, fs=FS, initial=swing.angle[0])
    high = cf.FirstOrder(ratio * TAU).filter(nothing, swing.rate, fs=FS, initial=0.0)
    return low + high - swing.angle


def unequal_taus(swing: Swing) -> Table:
    """Return how far LP + HP is from 1, and the error in angle that it makes."""
    omega = np.geomspace(1e-2, 1e2, 2001) / TAU
    table: Table = {}
    for ratio in RATIOS:
        middle = summed_response(ratio, np.array([1.0 / (TAU * np.sqrt(ratio))]))[0]
        error = unequal_error(swing, ratio)
        table[f"tau2/tau1 = {ratio:g}"] = {
            "|LP + HP| farthest from 1": abs(middle),
            "largest phase / deg": float(np.degrees(np.max(abs(np.angle(summed_response(ratio, omega)))))),
            "RMS error / deg": rms_degrees(error),
            "largest error / deg": float(np.degrees(np.max(abs(error)))),
        }
    return table
