"""The predicted error against Monte Carlo runs of the filter itself, and against closed forms."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import signal

import compfilt as cf
from compfilt.design import assess, predict
from compfilt.design.running import Running
from designs import MATCHED, PLAIN

FS = 50.0
ROWS, CHANNELS = 1200, 250
SETTLED = 600

CASES = [case for case in PLAIN + MATCHED if not case.is_rate]
all_cases = pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)


@pytest.fixture(scope="module")
def white():
    """White noise of density 1, three of them."""
    rng = np.random.default_rng(4)
    return [rng.normal(0.0, np.sqrt(FS), size=(ROWS, CHANNELS)) for _ in range(3)]


def walk_of(noise, times):
    for _ in range(times):
        noise = np.cumsum(noise / FS, axis=0)
    return noise


def spread(case, measurement, derivative):
    estimate = case.design.filter(
        measurement, derivative, fs=FS, rule=case.rule, initial=np.zeros(measurement.shape[1])
    )
    return estimate[SETTLED:].std()


@all_cases
def test_every_part_is_that_of_a_monte_carlo(case, white):
    """Each cause alone, and all together, within 5 %."""
    y, u, w = white
    times = min(case.design.split - case.design.derivative_order, 2)
    walk = [0.0] * (times - 1) + [0.7] if times else 0.0
    noises = {
        "measurement": (0.02 * y, 0.0 * u),
        "derivative": (0.0 * y, 0.1 * u),
        "walk": (0.0 * y, 0.7 * walk_of(w, times) if times else 0.0 * u),
    }
    predicted = predict(case.design, fs=FS, measurement=0.02, derivative=0.1, walk=walk, rule=case.rule)
    for cause, signals in noises.items():
        assert predicted.parts[cause] == pytest.approx(spread(case, *signals), rel=0.05), cause
    together = spread(case, *(sum(noise) for noise in zip(*noises.values(), strict=True)))
    assert predicted.sigma == pytest.approx(together, rel=0.05)


@all_cases
def test_a_constant_bias_leaves_what_is_predicted(case):
    rows = 4000
    estimate = case.design.filter(np.zeros(rows), np.full(rows, 0.3), fs=FS, rule=case.rule, initial=0.0)
    predicted = predict(case.design, fs=FS, measurement=1.0, bias=-0.3, rule=case.rule)
    assert predicted.parts["bias"] == pytest.approx(abs(estimate[-1]), rel=1e-6, abs=1e-6)
    if case.design.split > case.design.derivative_order:
        assert predicted.parts["bias"] == 0.0  # and no rounding


@pytest.mark.parametrize("tau", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("fs", [20.0, 1000.0])
def test_first_order_in_closed_form(tau, fs):
    """x' = α (x + T u) + (1 - α) y with α = τ/(τ + T)."""
    alpha = tau / (tau + 1.0 / fs)
    predicted = predict(cf.FirstOrder(tau), fs=fs, measurement=0.3, derivative=0.2, bias=0.1)
    noise = fs * (1.0 - alpha) ** 2 / (1.0 - alpha**2)
    assert predicted.parts["measurement"] == pytest.approx(0.3 * np.sqrt(noise), rel=1e-10)
    drift = fs * (alpha / fs) ** 2 / (1.0 - alpha**2)
    assert predicted.parts["derivative"] == pytest.approx(0.2 * np.sqrt(drift), rel=1e-10)
    assert predicted.parts["bias"] == pytest.approx(0.1 * tau, rel=1e-8)


@all_cases
def test_a_flat_spectrum_is_a_density(case):
    flat = SimpleNamespace(frequency=np.linspace(0.0, FS / 2, 2001), density=np.full(2001, 2 * 0.3**2))
    by_spectrum = predict(case.design, fs=FS, measurement=flat, derivative=flat, rule=case.rule)
    by_density = predict(case.design, fs=FS, measurement=0.3, derivative=0.3, rule=case.rule)
    for name, part in by_density.parts.items():
        assert by_spectrum.parts[name] == pytest.approx(part, rel=0.01), name


@pytest.mark.parametrize("case", CASES[:4], ids=lambda case: case.name)
def test_coloured_noise(case, white):
    """Noise of the measurement through a resonance at 1.6 Hz, close to the filter's own cut-off."""
    b, a = [1.0], [1.0, -1.9, 0.94]
    noise = signal.lfilter(b, a, 0.02 * white[0], axis=0)
    frequency = np.linspace(0.0, FS / 2, 4001)
    density = 2 * (0.02 * np.abs(signal.freqz(b, a, frequency, fs=FS)[1])) ** 2
    spectrum = SimpleNamespace(frequency=frequency, density=density)
    predicted = predict(case.design, fs=FS, measurement=spectrum, rule=case.rule)
    assert predicted.sigma == pytest.approx(spread(case, noise, 0.0 * noise), rel=0.05)


@all_cases
def test_the_responses_are_the_library_s(case):
    frequency = np.array([0.01, 0.3, 2.0, 20.0])
    low, _ = case.design.frequency_response(2 * np.pi * frequency, fs=FS, rule=case.rule)
    ours, _ = Running(case.design, FS, case.rule).responses(frequency)
    np.testing.assert_allclose(ours, low, rtol=1e-9, atol=1e-12)


def test_the_spectrum_of_the_noise_package_is_taken():
    """Its density is one-sided and may have several channels."""
    noise = pytest.importorskip("compfilt.noise")
    density = 2 * 0.3**2 * np.ones((2001, 3)) * [0.5, 1.0, 1.5]
    measured = noise.Spectrum(np.linspace(0.0, FS / 2, 2001), density)
    by_spectrum = predict(cf.FirstOrder(1.0), fs=FS, measurement=measured)
    assert by_spectrum.sigma == pytest.approx(
        predict(cf.FirstOrder(1.0), fs=FS, measurement=0.3).sigma, rel=0.01
    )


def test_a_walk_that_is_not_followed_has_no_bound():
    assert predict(cf.FirstOrder(1.0), fs=FS, measurement=1.0, walk=1.0).sigma == np.inf
    assert predict(cf.Butterworth(1.0, 4, split=1), fs=FS, measurement=1.0, walk=1.0).sigma == np.inf
    assert predict(cf.PiForm(1.0, 1.0), fs=FS, measurement=1.0, walk=[0.0, 1.0]).sigma == np.inf
    assert np.isfinite(predict(cf.PiForm(1.0, 1.0), fs=FS, measurement=1.0, walk=[1.0, 0.0]).sigma)


@pytest.mark.parametrize("case", CASES[::3], ids=lambda case: case.name)
def test_the_slope_is_that_of_the_prediction(case):
    """From half and double the gain the slope's sign follows; a step of one percent gives its value."""
    design, noise = case.design, {"fs": FS, "measurement": 0.02, "derivative": 0.1, "rule": case.rule}
    for i, gain in enumerate(assess(design, **noise).sensitivity):

        def error(factor, which=i):
            gains = [k * factor if j == which else k for j, k in enumerate(design.coefficients)]
            return predict(cf.Chain(gains, design.derivative_order, design.split), **noise).sigma

        assert gain.value == design.coefficients[i]
        slope = np.log(error(1.01) / error(1 / 1.01)) / (2 * np.log(1.01))
        assert gain.slope == pytest.approx(slope, abs=2e-3)
        if np.isfinite(gain.doubled):
            assert gain.doubled == error(2.0)


def test_what_is_unstable_has_an_infinite_error():
    """k1 k2 > k3 is what the third order needs."""
    gains = assess(cf.ThirdOrder.from_gains(1.0, 1.0, 0.6), fs=FS, measurement=1.0).sensitivity
    assert gains[0].halved == np.inf
    assert np.isfinite(gains[0].doubled)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fs": 0.0}, "fs must be positive and finite"),
        ({"fs": np.nan}, "fs must be"),
        ({"measurement": -1.0}, "measurement must be finite and not negative"),
        ({"derivative": np.inf}, "derivative must be"),
        ({"walk": [1.0, -1.0]}, "walk must be"),
        ({"bias": np.nan}, "bias must be"),
        (
            {"measurement": SimpleNamespace(frequency=np.arange(3.0), density=np.ones(4))},
            "measurement must have one",
        ),
        ({"measurement": SimpleNamespace(frequency=np.arange(3.0), density=-np.ones(3))}, "not negative"),
        ({"measurement": SimpleNamespace(frequency=np.zeros(3), density=np.ones(3))}, "rising"),
    ],
)
def test_errors_name_the_argument(change, words):
    with pytest.raises(ValueError, match=words):
        predict(cf.FirstOrder(1.0), **{"fs": FS, "measurement": 1.0} | change)


@pytest.mark.parametrize(
    ("design", "change"),
    [(cf.RateFilter(1.0), {}), ("first_order", {}), (cf.FirstOrder(1.0), {"measurement": "0.1"})],
)
def test_wrong_kinds_of_arguments(design, change):
    with pytest.raises(TypeError):
        predict(design, **{"fs": FS, "measurement": 1.0} | change)
