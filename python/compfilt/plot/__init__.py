"""Pictures: one file a kind. Needs matplotlib: the extra ``plot``.

Examples
--------
>>> import numpy as np
>>> import compfilt as cf
>>> from compfilt import plot
>>> estimate = cf.GravityFilter().estimate(np.zeros((300, 3)), np.tile([0.0, 0.0, 9.81], (300, 1)), fs=100.0)
>>> plot.attitude(estimate, fs=100.0).savefig("attitude.png")  # doctest: +SKIP
"""

try:
    import matplotlib as mpl  # noqa: F401 - a message of our own where it is missing
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] != "matplotlib":
        raise
    message = "compfilt.plot needs the extra \"plot\": pip install 'compfilt[plot]'"
    raise ModuleNotFoundError(message, name=error.name) from error

from compfilt.plot.results import ENDINGS, attitude, result, save

__all__ = ["ENDINGS", "attitude", "result", "save"]
