"""Spectra, lines and steps against closed forms: what was put in is found, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import noises
from compfilt import noise
from compfilt.noise.welch import degrees_of_freedom, white_density


@given(st.floats(1e-6, 1e3), st.floats(1.0, 1e4), st.integers(0, 2**32 - 1))
def test_white_noise_has_its_density(density, fs, seed):
    """Two-sided N² is one-sided 2 N², flat."""
    x = noises.white(density, fs, 8192, np.random.default_rng(seed))
    found = noise.spectrum(x, fs=fs, segment=64 / fs)
    np.testing.assert_allclose(np.mean(found.density[2:-2]), 2.0 * density**2, rtol=0.1)
    np.testing.assert_allclose(white_density(found, x.size / fs), density, rtol=0.1)


@given(st.floats(0.01, 0.49), st.integers(0, 2**32 - 1))
def test_all_the_power_is_there(frequency, seed):
    """Parseval: the density integrates to the variance, of noise and of a line."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=16_384) + 3.0 * np.sin(
        2.0 * np.pi * frequency * np.arange(16_384) + rng.uniform(0, 6)
    )
    found = noise.spectrum(x, fs=1.0, segment=256)
    assert np.sum(found.density) * found.frequency[1] == pytest.approx(np.mean((x - x.mean()) ** 2), rel=0.15)


def test_channels_are_analysed_each_by_itself():
    x = np.random.default_rng(0).normal(size=(1000, 3))
    both = noise.spectrum(x, fs=10.0)
    for channel in range(3):
        alone = noise.spectrum(x[:, channel], fs=10.0).density
        np.testing.assert_allclose(both.density[:, channel], alone, rtol=1e-12)


def test_the_degrees_of_freedom_are_those_of_the_scatter():
    """The variance of a chi-square variate over its mean squared is 2 / degrees of freedom."""
    rng = np.random.default_rng(0)
    density = np.array(
        [noise.spectrum(rng.normal(size=4096), fs=1.0, segment=256).density[4:-4] for _ in range(50)]
    )
    scatter = 2.0 * density.mean() ** 2 / density.var()
    assert degrees_of_freedom(4096.0, 256.0) == pytest.approx(scatter, rel=0.08)


# ---------------------------------------------------------------------------------------------------------------- lines


@pytest.mark.parametrize("kind", ["white", "random walk", "low-pass", "rounded"])
def test_noise_alone_has_no_lines(kind):
    """At a false-alarm rate of 2 %, 150 recordings show 3 on average; more than 9 of them would be luck of one in a thousand."""
    rng = np.random.default_rng(4)
    runs, rate, found = 150, 0.02, 0
    for _ in range(runs):
        x = rng.normal(size=6000)
        if kind == "random walk":
            x += 0.05 * np.cumsum(rng.normal(size=x.size))
        if kind == "low-pass":
            x = np.convolve(x, 0.8 ** np.arange(60), mode="same")
        if kind == "rounded":
            x = np.round(x / 1.5)
        found += bool(noise.find_lines(x, fs=100.0, false_alarm=rate))
    assert found <= stats.binom.isf(1e-3, runs, 1.5 * rate)


@given(st.floats(15.0, 240.0), st.floats(0.05, 1.0), st.integers(0, 2**32 - 1))
def test_a_line_is_found_where_it_is_and_as_strong(frequency, amplitude, seed):
    rng = np.random.default_rng(seed)
    t = np.arange(30_000) / 500.0
    x = noises.white(0.001, 500.0, t.size, rng) + amplitude * np.sin(
        2.0 * np.pi * frequency * t + rng.uniform(0, 6)
    )
    strongest = max(noise.find_lines(x, fs=500.0), key=lambda line: line.rms)
    assert strongest.frequency == pytest.approx(frequency, abs=0.1)
    assert strongest.rms == pytest.approx(amplitude / np.sqrt(2.0), rel=0.05)


def test_several_lines_on_a_slope():
    """Weak lines beside a strong one, above noise that falls with the frequency."""
    rng = np.random.default_rng(1)
    t = np.arange(100_000) / 400.0
    x = noises.white(1e-3, 400.0, t.size, rng) + noises.walk(0.02, 400.0, t.size, rng)
    for frequency, amplitude in ((31.0, 0.02), (62.0, 0.005), (150.5, 0.003)):
        x += amplitude * np.sin(2.0 * np.pi * frequency * t)
    assert [round(line.frequency, 1) for line in noise.find_lines(x, fs=400.0)] == [31.0, 62.0, 150.5]


# ---------------------------------------------------------------------------------------------------------------- steps


@given(st.floats(1e-6, 1e3), st.floats(0.3, 100.0), st.booleans(), st.integers(0, 2**32 - 1))
def test_a_step_is_found(step, width, single, seed):
    """In units of the step, from noise that hardly shows it to noise far above it; in single precision too."""
    counts = np.round(np.random.default_rng(seed).normal(40.0, width, 5000))
    x = counts * step
    found = noise.find_step(x.astype(np.float32) if single else x)
    assert found == pytest.approx(step, rel=1e-3)


def test_no_step_is_invented():
    rng = np.random.default_rng(0)
    for values in (rng.normal(size=5000), rng.uniform(size=100), np.zeros(100), np.exp(np.arange(100) % 7)):
        assert noise.find_step(values) is None


# --------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fs": 0.0}, "fs must be positive and finite, not 0"),
        ({"fs": np.nan}, "fs must be positive and finite, not nan"),
        ({"x": np.zeros(10)}, "x must have at least 64 samples, not 10"),
        ({"x": np.full(100, np.nan)}, "x must be finite: cut the recording where samples are missing"),
    ],
)
@pytest.mark.parametrize("function", [noise.spectrum, noise.find_lines, noise.allan])
def test_what_cannot_be_is_refused(function, change, message):
    arguments = {"x": np.random.default_rng(0).normal(size=100), "fs": 10.0} | change
    with pytest.raises(ValueError, match=f"^{message}$"):
        function(arguments.pop("x"), **arguments)


def test_a_false_alarm_rate_is_a_probability():
    with pytest.raises(ValueError, match=r"^false_alarm must lie between 0 and 1, not 1$"):
        noise.find_lines(np.zeros(100), fs=1.0, false_alarm=1.0)


def test_one_channel_is_one_channel():
    with pytest.raises(ValueError, match=r"^x must be one channel, shape \(n,\), got \(100, 3\)$"):
        noise.allan(np.zeros((100, 3)), fs=1.0)
