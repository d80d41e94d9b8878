"""Random walk, bias instability and rate random walk from an Allan curve."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import linalg, optimize, special, stats  # type: ignore[import-untyped]

from compfilt.noise.covariance import covariance, shapes
from compfilt.noise.curves import AllanCurve, Array

__all__ = ["TERMS", "AllanFit", "Fitted", "fit_allan"]

TERMS = ("random_walk", "bias_instability", "rate_random_walk")
FEWEST_POINTS = 6
"""Octaves of averaging time that three noises are told apart in."""
LONGEST = 8.0
"""The longest averaging time that counts fits so many times into the recording."""
DOUBT = 1e-3
"""A curve that these noises would give with a smaller probability is not theirs."""
CERTAIN = 0.2
"""Once fast noise is known to be coloured, the fit begins where a curve at least as odd as this has this probability."""
ROUNDS = 3
SMALLEST = 1e-6
"""Where the search for a term begins that was 0, as a part of its largest possible power."""
STEPS, HALVINGS, PRECISION = 50, 20, 1e-6
"""Of the search for the least sum of squares."""


class Fitted(NamedTuple):
    """A coefficient and its confidence interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class AllanFit:
    """The noises that an Allan curve shows: σ²(τ) = N²/τ + (2 ln 2/π) B² + K² τ/3 (IEEE Std 952).

    Attributes
    ----------
    random_walk : Fitted or None
        N, the two-sided density of the white noise, in unit/√Hz: for a gyro in rad/s the angle random walk in rad/√s. The
        one-sided density of data sheets is √2 N.
    bias_instability : Fitted or None
        B, in the signal's unit. The flat part of the curve lies at 0.664 B.
    rate_random_walk : Fitted or None
        K, the two-sided density of the white noise that drives the bias, in unit/s/√Hz.
    upper : dict of str to float
        For each term that the curve does not show, and that is None: what it lies below, by the name of the term.
    level : float
        The probability with which an interval, or a bound, holds.
    best : tuple of float
        N, B, K of the fitted curve; a term that is not shown has its most likely value too.
    shortest : float
        The averaging time in s from which on the curve is that of these noises. It is more than one sample where faster noise is
        coloured, by a low-pass in the sensor or by vibration.
    consistent : bool
        Whether these noises would give such a curve at all.
    """

    random_walk: Fitted | None
    bias_instability: Fitted | None
    rate_random_walk: Fitted | None
    upper: dict[str, float]
    level: float
    best: tuple[float, float, float]
    shortest: float
    consistent: bool

    def deviation(self, tau: npt.ArrayLike) -> Array:
        """Return the fitted Allan deviation at averaging times in s, in the signal's unit."""
        times = np.atleast_1d(np.asarray(tau, np.float64))
        return np.sqrt(shapes(times) @ np.square(self.best)).reshape(np.shape(tau))


def fit_allan(curve: AllanCurve, *, level: float = 0.95) -> AllanFit:
    """Fit white noise, flicker and a random walk to an Allan curve.

    Least squares of the logarithms, weighted by what the points tell and have in common: the covariance of overlapping Allan
    variances of Gaussian noise (:mod:`compfilt.noise.covariance`), for the noises found. The intervals are those in which the sum
    of squares rises by the quantile of chi-square, the other terms fitted anew. A term that may as well be 0 is None and has an
    upper bound.

    Parameters
    ----------
    curve : AllanCurve
        From :func:`allan`: its first averaging time is one sample, and it knows the length of the recording.
    level : float
        Of the confidence intervals.

    Returns
    -------
    AllanFit
        The terms, each a Fitted or None.

    Raises
    ------
    ValueError
        The curve does not know its duration, is too short, or shows no noise; level is not between 0 and 1.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> white = np.random.default_rng(1).normal(0.0, 0.1, 100_000)
    >>> fit = noise.fit_allan(noise.allan(white, fs=100.0))
    >>> low, high = fit.random_walk.low, fit.random_walk.high
    >>> low < 0.01 < high
    True
    >>> fit.rate_random_walk is None, fit.upper["rate_random_walk"] < 1e-3
    (True, True)
    """
    if not 0.0 < level < 1.0:
        raise ValueError(f"level must lie between 0 and 1, not {level:g}")
    best = _best_search(_octaves(curve))
    found: dict[str, Fitted | None] = {}
    upper: dict[str, float] = {}
    for place, name in enumerate(TERMS):
        found[name], bound = best.interval(place, level)
        if bound is not None:
            upper[name] = bound
    n, b, k = best.coefficients.tolist()
    return AllanFit(
        found["random_walk"],
        found["bias_instability"],
        found["rate_random_walk"],
        upper,
        level,
        (n, b, k),
        float(best.tau[0]),
        best.probability > DOUBT,
    )


class _Points(NamedTuple):
    """The points of a curve that the fit looks at."""

    tau: Array
    variance: Array
    factors: npt.NDArray[np.int64]
    samples: int
    period: float


def _best_search(points: _Points) -> "_Search":
    """Fit from the shortest averaging time from which on the curve is that of these noises."""
    starts = range(len(points.tau) - FEWEST_POINTS + 1)
    if not starts:
        raise ValueError(
            f"curve is too short to fit: it needs {FEWEST_POINTS} octaves, up to an {LONGEST:g}th of the recording"
        )
    searches: list[_Search] = []
    for first in starts:
        searches.append(_Search(points, first))
        if searches[-1].probability > (CERTAIN if first else DOUBT):
            # What is left of the fast noise may be as large as the error of this point: of the next it is half of that.
            return _Search(points, first + 1) if first and first + 1 in starts else searches[-1]
    return max(searches, key=lambda search: search.probability)


def _octaves(curve: AllanCurve) -> _Points:
    """Choose an averaging time in every octave: those between have next to nothing to add."""
    if curve.duration is None:
        raise ValueError("curve must know the duration of the recording")
    period = float(curve.tau[0])
    every = np.round(curve.tau / period).astype(np.int64)
    top = math.floor(math.log2(max(curve.duration / period / LONGEST, 1.0)))
    wanted = 2.0 ** np.arange(top + 1)
    nearest = np.unique(np.abs(np.log(every)[None, :] - np.log(wanted)[:, None]).argmin(axis=1))
    variance = curve.deviation[nearest] ** 2
    if not variance.all():
        raise ValueError("curve shows no noise: some of its deviations are 0")
    return _Points(curve.tau[nearest], variance, every[nearest], round(curve.duration / period), period)


class _Search:
    """The fit from one of the points on.

    Attributes
    ----------
    coefficients
        N, B, K of the best fit.
    probability
        With which these noises would fit as badly.
    """

    def __init__(self, points: _Points, first: int) -> None:
        self.tau = points.tau[first:]
        self._observed = np.log(points.variance[first:])
        variances = shapes(self.tau)
        # In units of what each term would be at most, if it made the curve alone.
        self._units = (points.variance[first:, None] / variances).min(axis=0)
        self._shapes = variances * self._units
        self._factors, self._samples, self._period = points.factors[first:], points.samples, points.period
        self._power, _ = optimize.nnls(self._shapes / points.variance[first:, None], np.ones(len(self.tau)))
        for _ in range(ROUNDS):
            self._weigh()
            self._power, self._least = self._minimise({})
        self.coefficients = np.sqrt(self._power * self._units)
        free = len(self.tau) - np.count_nonzero(self._power)
        self.probability = float(stats.chi2.sf(self._least, free))

    def _weigh(self) -> None:
        """Take the weights of the noises found so far."""
        model = self._shapes @ self._power
        power = self._power * self._units
        common = covariance(self._factors, self._samples, self._period, power) / np.outer(model, model)
        half = 1.0 / np.diag(common)
        # The mean and the variance of the logarithm of a chi-square variate of 2 · half degrees of freedom.
        self._bias = special.digamma(half) - np.log(half)
        scale = np.sqrt(special.polygamma(1, half) / np.diag(common))
        root = linalg.cholesky(common * np.outer(scale, scale), lower=True)
        self._whitened = linalg.solve_triangular(root, np.eye(len(root)), lower=True)

    def _residuals(self, model: Array) -> Array:
        apart = self._observed - self._bias - np.log(np.maximum(model, np.finfo(float).tiny))
        return np.asarray(self._whitened @ apart)

    def _minimise(self, fixed: dict[int, float]) -> tuple[Array, float]:
        """Fit all terms but those that are fixed: Gauss and Newton's steps, in each the best that is not negative."""
        free = [place for place in range(len(TERMS)) if place not in fixed]
        power = np.maximum(self._power, SMALLEST)
        for place, value in fixed.items():
            power[place] = value
        residuals = self._residuals(self._shapes @ power)
        least = float(residuals @ residuals)
        for _ in range(STEPS):
            slopes = self._whitened @ (self._shapes[:, free] / (self._shapes @ power)[:, None])
            wanted, _ = optimize.nnls(slopes, residuals + slopes @ power[free])
            whole, before = power.copy(), least
            for halvings in range(HALVINGS):
                power[free] = whole[free] + (wanted - whole[free]) / 2.0**halvings
                residuals = self._residuals(self._shapes @ power)
                least = float(residuals @ residuals)
                if least <= before:
                    break
            if before - least < PRECISION:
                break
        return power, least

    def _rise(self, place: int, value: float) -> float:
        """Return by how much the sum of squares rises with a coefficient at a value."""
        return self._minimise({place: value**2 / float(self._units[place])})[1] - self._least

    def interval(self, place: int, level: float) -> tuple[Fitted | None, float | None]:
        """Return a term with its interval, or its upper bound where it may as well be 0."""
        value = float(self.coefficients[place])
        both = float(stats.chi2.ppf(level, 1))
        if self._rise(place, 0.0) <= both:
            one_sided = float(stats.norm.ppf(level)) ** 2
            return None, self._crossing(place, value, one_sided)
        low = optimize.brentq(lambda at: self._rise(place, at) - both, 0.0, value, rtol=1e-4)
        return Fitted(value, float(low), self._crossing(place, value, both)), None

    def _crossing(self, place: int, value: float, limit: float) -> float:
        """Find where, above the best value, the sum of squares has risen by the limit."""
        below = max(value, SMALLEST * float(np.sqrt(self._units[place])))
        above = 1.1 * below
        while self._rise(place, above) < limit:
            below, above = above, 1.3 * above
        if self._rise(place, below) >= limit:
            return below
        return float(optimize.brentq(lambda at: self._rise(place, at) - limit, below, above, rtol=1e-4))
