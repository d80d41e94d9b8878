"""Gains, from what is known of the noise or from what is wanted. Needs SciPy: the extra ``design``."""

try:
    import scipy as _scipy  # type: ignore[import-untyped]  # noqa: F401 - a message of our own where it is missing
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] != "scipy":
        raise
    message = "compfilt.design needs the extra \"design\": pip install 'compfilt[design]'"
    raise ImportError(message) from error

from compfilt.design.densities import from_densities
from compfilt.design.observer import luenberger, observer_poles
from compfilt.design.prediction import Prediction, predict
from compfilt.design.result import Designed
from compfilt.design.sensitivity import GainSensitivity
from compfilt.design.spectra import from_spectra

__all__ = [
    "Designed",
    "GainSensitivity",
    "Prediction",
    "from_densities",
    "from_spectra",
    "luenberger",
    "observer_poles",
    "predict",
]
