"""Pictures of designs: the lines are what closed forms and SciPy say."""

import doctest
import importlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib import pyplot as plt
from scipy import signal

import compfilt as cf
from compfilt import plot
from compfilt.noise import AllanCurve, Spectrum
from compfilt.plot.averages import averages

plt.switch_backend("agg")


@pytest.fixture(autouse=True)
def closed():
    """Leave no figure open."""
    yield
    plt.close("all")


def line(axes, label):
    (found,) = [each for each in axes.lines if each.get_label() == label]
    return found.get_xydata().T


def test_bode_is_scipys():
    """s^2 + 2 s + 1 with low = (2 s + 1)/(s + 1)^2, the PI form."""
    magnitude, phase = plot.bode(cf.PiForm(kp=2.0, ki=1.0)).axes
    for label, numerator in (("low", [2.0, 1.0]), ("high", [1.0, 0.0, 0.0])):
        f, decibel = line(magnitude, label)
        _, expected = signal.freqs(numerator, [1.0, 2.0, 1.0], 2.0 * np.pi * f)
        np.testing.assert_allclose(decibel, 20.0 * np.log10(np.abs(expected)), atol=1e-9)
        np.testing.assert_allclose(
            np.exp(1j * np.radians(line(phase, label)[1])), expected / np.abs(expected), atol=1e-9
        )
    np.testing.assert_allclose(line(magnitude, "low + high")[1], 0.0, atol=1e-9)


def test_the_discrete_poles_are_those_of_the_samples():
    """What the filter does with an impulse obeys the recurrence of the poles that are drawn."""
    design, fs = cf.Butterworth(2.0, order=3), 10.0
    (axes,) = plot.poles(design, fs=fs).axes
    drawn = next(each for each in axes.lines if each.get_marker() == "x").get_xydata()
    impulse = np.zeros(40)
    impulse[0] = 1.0
    answer = design.filter(impulse, np.zeros(40), fs=fs, initial=0.0)
    left = np.convolve(np.poly(drawn[:, 0] + 1j * drawn[:, 1]).real, answer)[4:40]
    assert np.abs(left).max() < 1e-12


def test_multiple_poles_are_counted():
    (axes,) = plot.poles(cf.Chain([3.0, 3.0, 1.0])).axes
    assert [text.get_text() for text in axes.texts] == ["×3"]


def test_responses_are_the_closed_forms():
    tau = 0.5
    t, step = line(plot.step_response(cf.FirstOrder(tau), fs=2000.0).axes[0], "estimate")
    np.testing.assert_allclose(step, 1.0 - np.exp(-t / tau), atol=1e-3)
    (bias,) = plot.bias_response(cf.FirstOrder(tau), fs=2000.0).axes[0].lines[:1]
    assert bias.get_ydata()[-1] == pytest.approx(tau, rel=1e-2)
    (left,) = plot.bias_response(cf.PiForm(2.0, 1.0), fs=2000.0).axes[0].lines[:1]
    assert abs(left.get_ydata()[-1]) < 1e-2


def test_the_spectrum_that_comes_out():
    """Between the least and the greatest of some neighbours the closed form hardly changes."""
    f = np.linspace(0.0, 50.0, 5001)
    spectra = Spectrum(f, np.full(f.size, 4e-4)), Spectrum(f, np.full(f.size, 1e-4))
    figure = plot.spectra(*spectra, cf.FirstOrder(2.0), unit="rad")
    (found,) = [each for each in figure.axes[0].lines if each.get_label().startswith("output")]
    x, y = found.get_xydata().T
    omega = 2.0 * np.pi * x * 2.0
    np.testing.assert_allclose(y, (4e-4 + 1e-4 * 4.0) / (1.0 + omega**2), rtol=2e-3)
    over = figure.axes[1]
    np.testing.assert_allclose(line(over, "|LP|², right axis")[1], 1.0 / (1.0 + omega**2), rtol=2e-3)
    np.testing.assert_allclose(line(over, "|HP|², right axis")[1], omega**2 / (1.0 + omega**2), rtol=2e-3)
    # A decade is as high on both axes.
    assert np.divide(*over.get_ylim()) == pytest.approx(np.divide(*figure.axes[0].get_ylim()))
    with pytest.raises(ValueError, match=r"^derivative must be the spectrum of one channel"):
        plot.spectra(spectra[0], Spectrum(f, np.ones((f.size, 3))), cf.FirstOrder(2.0))


@given(size=st.integers(2, 3000), seed=st.integers(0, 2**32 - 1))
def test_averages_keep_the_power_and_the_lines(size, seed):
    random = np.random.default_rng(seed)
    f, density = np.arange(1.0, size + 1.0) * 0.01, random.exponential(size=size)
    density[random.integers(size)] = 1e3
    shown = averages(f, density)
    counts = np.diff(np.searchsorted(f, shown.frequency), append=size)
    assert shown.greatest.max() == 1e3
    assert shown.least.min() == density.min()
    assert np.all((shown.least <= shown.mean * (1 + 1e-12)) & (shown.mean <= shown.greatest * (1 + 1e-12)))
    assert counts.size <= np.ceil(50 * np.log10(size)) + 1
    # The groups are disjoint and leave no frequency out: their sums are the whole.
    group = np.floor(50.0 * np.log10(f))
    sizes = np.unique(group, return_counts=True)[1]
    assert sizes @ shown.mean == pytest.approx(density.sum())


def test_a_line_stands_out_of_the_spectrum_of_a_channel():
    f = np.linspace(0.0, 500.0, 50001)
    density = np.full(f.size, 4e-6)
    density[40000] = 4e-2
    figure, axes = plt.subplots()
    assert plot.spectrum(Spectrum(f, density), label="x", unit="m/s^2", ax=axes) is figure
    plot.spectrum(Spectrum(f, density), label="y", unit="m/s^2", ax=axes)
    assert axes.get_ylabel() == "one-sided density / ((m/s²)/√Hz)"
    assert len({each.get_marker() for each in axes.lines}) == 2
    x, y = line(axes, "x")
    assert x.size < 300
    assert y.min() == pytest.approx(2e-3)
    assert max(path.vertices[:, 1].max() for path in axes.collections[0].get_paths()) == pytest.approx(0.2)
    for wrong, message in (
        (np.ones((f.size, 3)), "noise must be the spectrum of one channel"),
        (np.ones(1), "noise must have frequencies above 0"),
    ):
        with pytest.raises(ValueError, match=message):
            plot.spectrum(Spectrum(f[: len(wrong)], wrong))


def test_the_sheet_has_what_the_single_pictures_have():
    drawn, fs = cf.PiForm(2.0, 1.0), 20.0
    sheet = plot.design(drawn, fs=fs, rule="matched").axes
    step, bias = (
        draw(drawn, fs=fs, rule="matched").axes[0] for draw in (plot.step_response, plot.bias_response)
    )
    magnitude, phase = plot.bode(drawn, fs=fs, rule="matched").axes
    single = [magnitude, plot.poles(drawn).axes[0], phase, step, bias]
    assert len(sheet) == len(single)
    for ours, theirs in zip(sheet, single, strict=True):
        assert ours.get_xlabel() == theirs.get_xlabel()
        assert ours.get_ylabel() == theirs.get_ylabel()
        for one, other in zip(ours.lines, theirs.lines, strict=True):
            np.testing.assert_array_equal(one.get_xydata(), other.get_xydata())
    assert not np.array_equal(
        line(plot.step_response(drawn, fs=fs).axes[0], "estimate"), line(step, "estimate")
    )


def test_too_many_samples_are_refused():
    with pytest.raises(
        ValueError, match=r"^fs \* duration must be at most 1e\+07 samples, got 8e\+07: choose a lower fs$"
    ):
        plot.step_response(cf.FirstOrder(1e4), fs=1000.0)


def test_allan_curves_share_axes():
    tau = np.geomspace(0.01, 100.0, 30)
    curve = AllanCurve(tau, 0.01 / tau**0.5, 0.009 / tau**0.5, 0.011 / tau**0.5)
    figure, axes = plt.subplots()
    assert plot.allan(curve, label="x", ax=axes) is figure
    plot.allan(curve, label="y", ax=axes)
    assert len({each.get_marker() for each in axes.lines}) == 2
    np.testing.assert_array_equal(line(axes, "x"), [curve.tau, curve.deviation])


@pytest.mark.parametrize("draw", [plot.bode, plot.poles, plot.step_response, plot.bias_response])
def test_several_designs_and_wrong_ones(draw):
    labels = draw({"a": cf.PiForm(2.0, 1.0), "b": cf.FirstOrder(1.0)}, fs=100.0).axes[0].get_legend()
    assert {text.get_text()[0] for text in labels.get_texts()} >= {"a", "b"}
    with pytest.raises(ValueError, match=r"^fs must be positive and finite, not 0"):
        draw(cf.FirstOrder(1.0), fs=0.0)
    with pytest.raises(TypeError, match=r"^design must be a linear filter"):
        draw(3.0)


@pytest.mark.parametrize("name", ["allan", "bode", "design", "poles", "responses", "results", "spectra"])
def test_examples(name):
    assert doctest.testmod(importlib.import_module(f"compfilt.plot.{name}")).failed == 0
