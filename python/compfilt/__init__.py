"""Complementary filters: one definition, the same bits in the batch, in the stream and on the chip."""

from types import ModuleType
from warnings import warn

from compfilt._core import (
    AccelerometerArray,
    AttitudeEstimate,
    AttitudeStream,
    Butterworth,
    Chain,
    Estimate,
    FirstOrder,
    GravityFilter,
    LinearFilter,
    Mahony,
    Observer,
    ObserverEstimate,
    ObserverStream,
    PiForm,
    RateFilter,
    SecondOrderInertial,
    State,
    Stream,
    ThirdOrder,
    TiltEstimate,
    TiltFilter,
    TiltStream,
    __version__,
    _debug_build,
    alpha_to_tau,
    angle_rates,
    tau_to_alpha,
    tilt,
)
from compfilt.cube import Cube, CubeEstimate, CubeSample, CubeStream
from compfilt.delay import find_gyro_delay
from compfilt.flags import Flags

if _debug_build:
    warn("compfilt was built without optimisation: it is slow", RuntimeWarning, stacklevel=2)


__all__ = [
    "AccelerometerArray",
    "AttitudeEstimate",
    "AttitudeStream",
    "Butterworth",
    "Chain",
    "Cube",
    "CubeEstimate",
    "CubeSample",
    "CubeStream",
    "Estimate",
    "FirstOrder",
    "Flags",
    "GravityFilter",
    "LinearFilter",
    "Mahony",
    "Observer",
    "ObserverEstimate",
    "ObserverStream",
    "PiForm",
    "RateFilter",
    "SecondOrderInertial",
    "State",
    "Stream",
    "ThirdOrder",
    "TiltEstimate",
    "TiltFilter",
    "TiltStream",
    "__version__",
    "alpha_to_tau",
    "angle_rates",
    "find_gyro_delay",
    "tau_to_alpha",
    "tilt",
]


def __getattr__(name: str) -> ModuleType:
    """Import what needs more than NumPy when it is asked for."""
    if name in {"design", "noise", "plot", "simulate"}:
        from importlib import import_module  # noqa: PLC0415

        return import_module(f"compfilt.{name}")
    raise AttributeError(f"module 'compfilt' has no attribute {name!r}")
