"""What a change of a gain does to the error."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compfilt._core import Chain, LinearFilter

__all__ = ["GainSensitivity", "sensitivity"]

STEP = 1e-4
"""Of the logarithm of a gain, for the slope: the error of the difference is of its square."""


@dataclass(frozen=True)
class GainSensitivity:
    """How the error, predicted or measured, depends on one gain while the others stay.

    Attributes
    ----------
    gain : str
        "k1" to "k6".
    value : float
        The gain, in 1/s to the power of its number.
    slope : float
        d ln σ / d ln k: by how many percent the error grows if the gain grows by one percent. 0 at the best gain.
    halved, doubled : float
        The error with half and with twice the gain; infinite where the filter would be unstable.
    """

    gain: str
    value: float
    slope: float
    halved: float
    doubled: float


def sensitivity(
    design: LinearFilter, error_of: Callable[[LinearFilter], float], step: float = STEP
) -> tuple[GainSensitivity, ...]:
    """Return the sensitivity of an error to each gain."""

    def error(which: int, factor: float) -> float:
        gains = [k * factor if i == which else k for i, k in enumerate(design.coefficients)]
        try:
            changed = Chain(gains, design.derivative_order, design.split)
        except ValueError:  # Chain refuses what is unstable.
            return np.inf
        return error_of(changed)

    def slope(which: int) -> float:
        up, down = error(which, np.exp(step)), error(which, np.exp(-step))
        return (
            float(np.log(up / down) / (2.0 * step))
            if np.isfinite(up) and np.isfinite(down) and down
            else np.nan
        )

    return tuple(
        GainSensitivity(f"k{i + 1}", k, slope(i), error(i, 0.5), error(i, 2.0))
        for i, k in enumerate(design.coefficients)
    )
