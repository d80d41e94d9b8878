"""The member of a family with the least error, whatever the error is."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize, minimize_scalar  # type: ignore[import-untyped]

from compfilt._core import LinearFilter
from compfilt.design.family import Family

__all__ = ["least"]

Array = npt.NDArray[np.float64]

A_DECADE = 8
"""Members with Butterworth poles that are tried per decade before the search begins."""

REACH = 6.0
"""How far a gain may move from the best of them, in logarithms: a factor of 400."""

NUDGE = 1e-5
"""By how much a logarithm is changed for a slope: far above the rounding of a predicted error."""


def least(
    kind: Family, error: Callable[[LinearFilter], float], slowest: float, fastest: float
) -> tuple[LinearFilter, bool]:
    """Return the member with the least error, and whether it lies at an end of the search.

    The error may have several minima over the time scale. So Butterworth poles from `slowest` to `fastest`, in rad/s, are
    tried first. The search over all gains begins at the best of them.
    """
    tried = np.geomspace(slowest, fastest, int(A_DECADE * np.log10(fastest / slowest)) + 2)
    errors = [error(kind.butterworth(float(omega0))) for omega0 in tried]
    best = int(np.argmin(errors))
    if kind.free == 1:
        around = tried[[max(best - 1, 0), min(best + 1, tried.size - 1)]]
        found = minimize_scalar(
            lambda logarithm: error(kind.butterworth(float(np.exp(logarithm)))),
            bounds=tuple(np.log(around)),
            method="bounded",
            options={"xatol": 1e-6},
        )
        return kind.butterworth(float(np.exp(found.x))), best in {0, tried.size - 1}
    start = kind.start(float(tried[best]))
    found = minimize(
        lambda logarithms: np.log(error(kind.member(logarithms))),
        start,
        method="L-BFGS-B",
        bounds=[(each - REACH, each + REACH) for each in start],
        options={"eps": NUDGE, "ftol": 1e-13, "gtol": 1e-7, "maxiter": 500},
    )
    at_end = best in {0, tried.size - 1} or bool(np.any(np.abs(found.x - start) > 0.999 * REACH))
    return kind.member(found.x), at_end
