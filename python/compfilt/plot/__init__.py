"""Pictures: one file a kind. Needs matplotlib and tsdownsample: the extra ``plot``.

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
    import tsdownsample as _tsdownsample  # noqa: F401
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] not in {"matplotlib", "tsdownsample"}:
        raise
    message = "compfilt.plot needs the extra \"plot\": pip install 'compfilt[plot]'"
    raise ModuleNotFoundError(message, name=error.name) from error

from compfilt.plot.allan import allan
from compfilt.plot.bode import bode
from compfilt.plot.design import design, save_design
from compfilt.plot.files import ENDINGS
from compfilt.plot.poles import poles
from compfilt.plot.responses import bias_response, step_response
from compfilt.plot.results import attitude, result, save
from compfilt.plot.spectra import spectra, spectrum

__all__ = [
    "ENDINGS",
    "allan",
    "attitude",
    "bias_response",
    "bode",
    "design",
    "poles",
    "result",
    "save",
    "save_design",
    "spectra",
    "spectrum",
    "step_response",
]
