"""The noise of a sensor: spectra, Allan deviation, what they tell. Needs SciPy and allantools: the extra ``noise``."""

try:
    import allantools as _allantools  # type: ignore[import-untyped]  # noqa: F401 - a message of our own
    import scipy as _scipy  # type: ignore[import-untyped]  # noqa: F401
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] not in {"allantools", "scipy"}:
        raise
    message = "compfilt.noise needs the extra \"noise\": pip install 'compfilt[noise]'"
    raise ModuleNotFoundError(message, name=error.name) from error

from compfilt.noise.curves import AllanCurve, Spectrum

__all__ = ["AllanCurve", "Spectrum"]
