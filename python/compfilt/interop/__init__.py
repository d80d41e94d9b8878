"""Filters as systems of SciPy and of python-control, and back. The methods of the designs call these functions."""

from compfilt.interop.chains import recognise
from compfilt.interop.libraries import from_control, from_scipy, to_control, to_scipy
from compfilt.interop.system import System, of_design, of_observer

__all__ = [
    "System",
    "from_control",
    "from_scipy",
    "of_design",
    "of_observer",
    "recognise",
    "to_control",
    "to_scipy",
]
