"""The gravity filter's tau from the densities: what docs/design.md says of it, against the filter itself."""

import numpy as np
import pytest

import compfilt as cf
from compfilt.design import from_densities, predict

FS = 100.0
R, Q = 2e-3, 1e-3


def low_pass(tau, zeta):
    """What small errors of the filter obey."""
    return cf.Butterworth(np.sqrt(2.0) / tau, 2, q=np.sqrt(0.5) / zeta, split=1)


def spread(tau, zeta):
    """The standard deviation of the vertical of the filter itself, at rest; it does not learn the bias."""
    rng, rows = np.random.default_rng(0), 200_000
    gyro = rng.normal(0.0, Q * np.sqrt(FS), (rows, 3))
    acc = 9.81 * (np.array([0.0, 0.0, 1.0]) + rng.normal(0.0, R * np.sqrt(FS), (rows, 3)))
    filter_ = cf.GravityFilter(tau=tau, zeta=zeta, rest_rate=1e-9)
    up = filter_.estimate(gyro, acc, fs=FS).up
    return np.sqrt(np.mean(up[int(20.0 * tau * FS) :, :2] ** 2))


@pytest.mark.parametrize(("tau", "zeta"), [(0.7, 0.5), (2.0, 0.5), (2.0, 0.8), (5.0, 0.8)])
def test_the_prediction_is_that_of_the_filter(tau, zeta):
    omega0 = np.sqrt(2.0) / tau
    closed = R**2 * omega0 / (4.0 * zeta) + Q**2 * (1.0 + 4.0 * zeta**2) / (4.0 * zeta * omega0)
    predicted = predict(low_pass(tau, zeta), fs=FS, measurement=R, derivative=Q).sigma
    assert predicted == pytest.approx(np.sqrt(closed), rel=0.02)  # it knows the sample rate
    assert spread(tau, zeta) == pytest.approx(predicted, rel=0.06)


@pytest.mark.parametrize("zeta", [0.5, 0.7, 1.0])
def test_the_best_tau(zeta):
    taus = np.geomspace(0.3, 10.0, 400)
    errors = [predict(low_pass(tau, zeta), fs=10.0 * FS, measurement=R, derivative=Q).sigma for tau in taus]
    best = np.sqrt(2.0 / (1.0 + 4.0 * zeta**2)) * R / Q
    assert taus[np.argmin(errors)] == pytest.approx(best, rel=0.02)


def test_with_the_default_damping_it_is_that_of_the_first_order():
    tau = from_densities(measurement=R, derivative=Q).design.tau
    zeta = cf.GravityFilter(tau=tau).zeta
    assert np.sqrt(2.0 / (1.0 + 4.0 * zeta**2)) * R / Q == pytest.approx(tau, rel=1e-12)
    middle = spread(tau, zeta)
    assert middle < 0.9 * spread(tau / 3.0, zeta)
    assert middle < 0.9 * spread(tau * 3.0, zeta)
