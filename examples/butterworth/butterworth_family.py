"""The filters of the paper, one for each Q: cut-off, poles, passband."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import compfilt as cf

Array = npt.NDArray[np.floating[Any]]
Complex = npt.NDArray[np.complex128]

DEGREE = np.pi / 180.0

OMEGA0 = 10.0  # rad/s
QUOTED = {1.0: 10.0, 0.625: 13.0, 0.1: 50.0, 0.01: 500.0}  # Q: the cut-off that the paper quotes, rad/s


class Response(NamedTuple):
    """One filter in the frequency domain: rad/s, and the peak of the low-pass in dB."""

    poles: Complex
    cutoff: float
    midpoint: float  # of the band edges by the paper's (16)
    peak: float


def butterworth(q: float) -> cf.Butterworth:
    """Return the paper's (14), (15)."""
    return cf.Butterworth(OMEGA0, q=q)


def response(q: float) -> Response:
    """Return what the paper says of a filter, as computed."""
    omega = np.geomspace(1.0, 1e4, 20_001)
    low = np.abs(butterworth(q).frequency_response(omega)[0])
    falls = low.argmax()
    return Response(
        butterworth(q).poles,
        float(np.interp(-np.sqrt(0.5), -low[falls:], omega[falls:])),
        OMEGA0 * np.sqrt(1.0 + 0.25 / q**2),
        20.0 * np.log10(low.max()),
    )
