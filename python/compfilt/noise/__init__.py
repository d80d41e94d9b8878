"""The noise of a sensor: spectra, Allan deviation, what they tell. Needs SciPy and allantools: the extra ``noise``."""

try:
    import allantools as _allantools  # type: ignore[import-untyped]  # noqa: F401 - a message of our own
    import scipy as _scipy  # type: ignore[import-untyped]  # noqa: F401
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] not in {"allantools", "scipy"}:
        raise
    message = "compfilt.noise needs the extra \"noise\": pip install 'compfilt[noise]'"
    raise ModuleNotFoundError(message, name=error.name) from error

from compfilt.noise.channel import ChannelNoise
from compfilt.noise.curves import AllanCurve, Spectrum
from compfilt.noise.deviation import allan
from compfilt.noise.fit import AllanFit, Fitted, fit_allan
from compfilt.noise.lines import Line, find_lines
from compfilt.noise.motion import NotAtRest, Span, find_motion, longest_rest
from compfilt.noise.motors import Vibration, add_motors
from compfilt.noise.report import Densities, NoiseReport, analyse
from compfilt.noise.steps import find_step
from compfilt.noise.welch import spectrum

__all__ = [
    "AllanCurve",
    "AllanFit",
    "ChannelNoise",
    "Densities",
    "Fitted",
    "Line",
    "NoiseReport",
    "NotAtRest",
    "Span",
    "Spectrum",
    "Vibration",
    "add_motors",
    "allan",
    "analyse",
    "find_lines",
    "find_motion",
    "find_step",
    "fit_allan",
    "longest_rest",
    "spectrum",
]
