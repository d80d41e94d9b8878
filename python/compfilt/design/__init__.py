"""Gains, from what is known of the noise or from what is wanted. Needs SciPy: the extra ``design``."""

try:
    import scipy as _scipy  # type: ignore[import-untyped]  # noqa: F401 - a message of our own where it is missing
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] != "scipy":
        raise
    message = "compfilt.design needs the extra \"design\": pip install 'compfilt[design]'"
    raise ModuleNotFoundError(message, name=error.name) from error

from compfilt.design.assess import assess
from compfilt.design.densities import from_densities
from compfilt.design.observer import luenberger, observer_poles
from compfilt.design.prediction import Prediction, predict
from compfilt.design.recording import (
    AttitudeRecording,
    LinearRecording,
    Recording,
    TiltRecording,
    from_recordings,
)
from compfilt.design.residual import check_residual, residual_sigma
from compfilt.design.result import Designed
from compfilt.design.sensitivity import GainSensitivity
from compfilt.design.spectra import from_spectra
from compfilt.design.speed import bias_time, cutoff, settling_time
from compfilt.design.targets import from_bias_time, from_cutoff, from_settling_time

__all__ = [
    "AttitudeRecording",
    "Designed",
    "GainSensitivity",
    "LinearRecording",
    "Prediction",
    "Recording",
    "TiltRecording",
    "assess",
    "bias_time",
    "check_residual",
    "cutoff",
    "from_bias_time",
    "from_cutoff",
    "from_densities",
    "from_recordings",
    "from_settling_time",
    "from_spectra",
    "luenberger",
    "observer_poles",
    "predict",
    "residual_sigma",
    "settling_time",
]
