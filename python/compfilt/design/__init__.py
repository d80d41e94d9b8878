"""Gains: of observers from weights or covariances. Needs SciPy: the extra ``design``."""

try:
    import scipy as _scipy  # type: ignore[import-untyped]  # noqa: F401 - a message of our own where it is missing
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] != "scipy":
        raise
    message = "compfilt.design needs the extra \"design\": pip install 'compfilt[design]'"
    raise ImportError(message) from error

from compfilt.design.observer import luenberger, observer_poles

__all__ = ["luenberger", "observer_poles"]
