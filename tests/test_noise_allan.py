"""Allan deviations and what is fitted to them, against the definition, Greenhall and simulated noises of known coefficients."""

import allantools
import numpy as np
import pytest

import noises
from compfilt import noise
from compfilt.noise.covariance import covariance, shapes
from compfilt.noise.fit import TERMS

FS = 10.0


def by_definition(x, factor):
    """Half the mean square of the difference of neighbouring means, at every place."""
    means = np.convolve(x, np.full(factor, 1.0 / factor), mode="valid")
    return np.sqrt(np.mean((means[factor:] - means[:-factor]) ** 2) / 2.0)


def test_the_curve_is_the_definition():
    x = np.random.default_rng(1).normal(5.0, 1.0, 1000) + noises.walk(0.1, FS, 1000, np.random.default_rng(2))
    curve = noise.allan(x, fs=FS)
    assert curve.tau[0] == 1.0 / FS
    assert curve.tau[-1] <= 25.0
    assert curve.duration == 100.0
    expected = [by_definition(x, round(tau * FS)) for tau in curve.tau]
    np.testing.assert_allclose(curve.deviation, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda rng: noises.white(0.2, FS, 200_000, rng), lambda tau: 0.2 / np.sqrt(tau)),
        (
            lambda rng: noises.flicker(0.2, 200_000, rng),
            lambda tau: 0.2 * np.sqrt(2 * np.log(2) / np.pi) + 0 * tau,
        ),
        (lambda rng: noises.walk(0.2, FS, 200_000, rng), lambda tau: 0.2 * np.sqrt(tau / 3.0)),
    ],
    ids=["white", "flicker", "walk"],
)
def test_closed_forms(make, expected):
    """Where averaging is over many samples, and the recording is many times as long."""
    curve = noise.allan(make(np.random.default_rng(3)), fs=FS)
    part = (curve.tau > 3.0) & (curve.tau < 100.0)
    np.testing.assert_allclose(curve.deviation[part], expected(curve.tau[part]), rtol=0.1)


def test_the_interval_of_the_curve_covers_the_truth():
    rng, hits, runs = np.random.default_rng(5), 0, 150
    for _ in range(runs):
        curve = noise.allan(noises.white(1.0, 1.0, 1024, rng), fs=1.0)
        at = int(np.abs(curve.tau - 64.0).argmin())
        hits += curve.low[at] <= 1.0 / np.sqrt(curve.tau[at]) <= curve.high[at]
    assert 0.57 < hits / runs < 0.79


# ----------------------------------------------------------------------------------------------------------- covariance


@pytest.mark.parametrize(("place", "alpha"), [(0, 0), (1, -1), (2, -2)], ids=["white", "flicker", "walk"])
def test_the_variances_are_greenhalls(place, alpha):
    """Equivalent degrees of freedom of a mean of squares: twice its mean squared over its variance."""
    factors, samples, power = np.array([32, 256, 2048, 4096]), 20_000, np.eye(3)[place]
    mean = shapes(factors / FS) @ power
    freedom = 2.0 * mean**2 / np.diag(covariance(factors, samples, 1.0 / FS, power))
    expected = [allantools.edf_greenhall(alpha, 2, m, samples + 1, overlapping=True) for m in factors]
    np.testing.assert_allclose(freedom, expected, rtol=0.03)


def test_the_covariances_are_those_of_many_recordings():
    factors, count, runs = np.array([1, 4, 16, 48]), 512, 1500
    rng = np.random.default_rng(6)
    variances = []
    for _ in range(runs):
        x = noises.white(1.0, 1.0, count, rng) + noises.walk(0.05, 1.0, count, rng)
        variances.append([by_definition(x, factor) ** 2 for factor in factors])
    expected = covariance(factors, count, 1.0, np.array([1.0, 0.0, 0.05**2]))
    found = np.cov(np.transpose(variances))
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=0.12)
    np.testing.assert_allclose(found[0, 1] / scale[0, 1], expected[0, 1] / scale[0, 1], atol=0.08)


# ------------------------------------------------------------------------------------------------------------------ fit


def test_the_terms_of_a_long_recording():
    """A hundred thousand seconds show all three."""
    rng, truth = np.random.default_rng(7), (0.01, 0.002, 5e-5)
    count = 500_000
    x = noises.white(truth[0], 5.0, count, rng) + noises.flicker(truth[1], count, rng)
    fit = noise.fit_allan(noise.allan(x + noises.walk(truth[2], 5.0, count, rng), fs=5.0))
    assert fit.consistent
    assert fit.upper == {}
    for name, value in zip(TERMS, truth, strict=True):
        fitted = getattr(fit, name)
        assert fitted.low < value < fitted.high
        assert fitted.value == pytest.approx(value, rel=0.3)
    expected = np.sqrt(shapes(np.array([0.2, 30.0, 3000.0])) @ np.square(truth))
    np.testing.assert_allclose(fit.deviation([0.2, 30.0, 3000.0]), expected, rtol=0.15)


def test_the_intervals_cover_the_truth_as_often_as_they_say():
    """A bound covers it too. 80 recordings, of which the count has a standard deviation of 5 % and 2.4 %."""
    rng, truth, runs = np.random.default_rng(8), (0.01, 0.004, 1e-3), 80
    covered = {0.68: np.zeros(3), 0.95: np.zeros(3)}
    for _ in range(runs):
        x = noises.white(truth[0], FS, 8192, rng) + noises.flicker(truth[1], 8192, rng)
        curve = noise.allan(x + noises.walk(truth[2], FS, 8192, rng), fs=FS)
        for level, count in covered.items():
            fit = noise.fit_allan(curve, level=level)
            for place, name in enumerate(TERMS):
                low, high = getattr(fit, name)[1:] if name not in fit.upper else (0.0, fit.upper[name])
                count[place] += low <= truth[place] <= high
    for level, low, high in ((0.68, 0.56, 0.82), (0.95, 0.88, 1.0)):
        part = covered[level] / runs
        assert (low <= part).all(), part
        assert (part <= high).all(), part


def test_white_noise_alone_shows_nothing_else():
    """A term that is not there is None, with a bound, and seldom anything else."""
    rng, shown = np.random.default_rng(9), 0
    for _ in range(30):
        fit = noise.fit_allan(noise.allan(noises.white(0.01, FS, 4096, rng), fs=FS))
        for name in TERMS[1:]:
            fitted = getattr(fit, name)
            shown += fitted is not None
            assert fitted is not None or 0.0 < fit.upper[name] < 0.02
        assert fit.random_walk.value == pytest.approx(0.01, rel=0.1)
    assert shown <= 4


def test_a_walk_alone_is_one():
    x = noises.walk(0.01, FS, 50_000, np.random.default_rng(10))
    fit = noise.fit_allan(noise.allan(x, fs=FS))
    assert fit.rate_random_walk.low < 0.01 < fit.rate_random_walk.high
    assert fit.bias_instability is None


def test_noise_that_is_coloured_when_fast():
    """Behind a low-pass the curve is that of white noise from some averaging time on only."""
    rng = np.random.default_rng(11)
    x = noises.white(0.01, 100.0, 200_000, rng)
    smooth = np.convolve(x, np.full(10, 0.1), mode="valid")
    fit = noise.fit_allan(noise.allan(smooth, fs=100.0))
    assert fit.consistent
    assert fit.shortest > 0.1
    assert fit.random_walk.value == pytest.approx(0.01, rel=0.05)


def test_units_only_scale():
    x = noises.white(0.01, FS, 5000, np.random.default_rng(12)) + noises.walk(
        2e-3, FS, 5000, np.random.default_rng(13)
    )
    small, large = (noise.fit_allan(noise.allan(factor * x, fs=FS)) for factor in (1.0, 1e6))
    np.testing.assert_allclose(np.array(large.best) / 1e6, small.best, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(np.array(large.random_walk) / 1e6, small.random_walk, rtol=1e-3)


def test_a_curve_that_is_none_is_refused():
    curve = noise.allan(np.random.default_rng(0).normal(size=100), fs=1.0)
    with pytest.raises(
        ValueError, match=r"^curve is too short to fit: it needs 6 octaves, up to an 8th of the rec"
    ):
        noise.fit_allan(curve)
    long = noise.allan(np.random.default_rng(0).normal(size=1000), fs=1.0)
    with pytest.raises(ValueError, match=r"^level must lie between 0 and 1, not 1$"):
        noise.fit_allan(long, level=1.0)
    with pytest.raises(ValueError, match=r"^curve must know the duration of the recording$"):
        noise.fit_allan(noise.AllanCurve(long.tau, long.deviation, long.low, long.high))
    with pytest.raises(ValueError, match=r"^curve shows no noise"):
        noise.fit_allan(noise.allan(np.arange(1000) % 2.0 * 0.0, fs=1.0))
