r"""What the points of an Allan curve have in common.

The Allan variance at :math:`\tau = mT` is the mean of :math:`z_m^2` over the recording, where :math:`z_m` is the second difference of
the angle over :math:`m` samples, divided by :math:`\sqrt 2\,\tau`. For Gaussian noise the covariance of two such means is twice the
mean of the squared cross-covariance of :math:`z_m` and :math:`z_n`, and that is a sum of values of the angle's generalised
covariance: :math:`-N^2|t|/2` of white noise in the rate, :math:`B^2 t^2 \ln|t| / 2\pi` of flicker, :math:`K^2|t|^3/12` of a random walk.

References
----------
C. A. Greenhall, W. J. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003, of which this is the form
for two averaging times and a mixture of noises.
"""

import numpy as np
import numpy.typing as npt
from scipy.integrate import trapezoid  # type: ignore[import-untyped]

from compfilt.noise.curves import Array

__all__ = ["covariance", "shapes"]

SECOND_DIFFERENCE = ((0, 1.0), (1, -2.0), (2, 1.0))
FINE, COARSE = 48, 160
"""How many lags are looked at around each kink, and in all."""

Whole = npt.NDArray[np.int64]


def shapes(tau: Array) -> Array:
    """Return the Allan variances of white noise, flicker and a random walk of one unit each, (m, 3)."""
    return np.column_stack((1.0 / tau, np.full_like(tau, 2.0 * np.log(2.0) / np.pi), tau / 3.0))


def covariance(factors: Whole, samples: int, period: float, power: Array) -> Array:
    """Return the covariance of the overlapping Allan variances at some averaging times.

    Parameters
    ----------
    factors
        (m,) averaging times in samples.
    samples
        How many there are.
    period
        Seconds between them.
    power
        N², B² and K².
    """
    matrix = np.empty((len(factors), len(factors)))
    for row, short in enumerate(factors):
        for column in range(row, len(factors)):
            matrix[row, column] = matrix[column, row] = _pair(
                int(short), int(factors[column]), samples, period, power
            )
    return matrix


def _pair(short: int, long: int, samples: int, period: float, power: Array) -> float:
    many = np.array([samples + 1 - 2 * short, samples + 1 - 2 * long])
    lags = _lags(short, long)
    # So many pairs of starts, t of the short and t + lag of the long averaging time, the recording has.
    pairs = np.minimum(many[0], many[1] - lags) - np.maximum(0, -lags)
    common = _cross_covariance(short, long, lags, period, power)
    return float(2.0 * trapezoid(np.maximum(pairs, 0) * common**2, lags) / (many[0] * many[1]))


def _lags(short: int, long: int) -> Array:
    """Return the lags, in samples, at which the cross-covariance tells its course: it has kinks, and fades beyond them."""
    kinks = [
        np.linspace(-2 * short - step * long, 4 * short - step * long, FINE + 1)
        for step, _ in SECOND_DIFFERENCE
    ]
    whole = np.linspace(-6 * long, 4 * long + 2 * short, COARSE + 1)
    return np.unique(np.round(np.concatenate([*kinks, whole])))


def _cross_covariance(short: int, long: int, lags: Array, period: float, power: Array) -> Array:
    total = np.zeros_like(lags)
    for i, a in SECOND_DIFFERENCE:
        for j, b in SECOND_DIFFERENCE:
            total += a * b * _generalised(np.abs(lags + j * long - i * short) * period, power)
    return total / (2.0 * short * long * period**2)


def _generalised(t: Array, power: Array) -> Array:
    white, flicker, walk = power
    logarithm = np.log(np.where(t > 0.0, t, 1.0))
    return np.asarray(-white / 2.0 * t + flicker / (2.0 * np.pi) * t**2 * logarithm + walk / 12.0 * t**3)
