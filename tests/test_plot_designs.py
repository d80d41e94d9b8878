"""Pictures of designs: the lines are what closed forms and SciPy say."""

import doctest
import importlib

import numpy as np
import pytest
from matplotlib import pyplot as plt
from scipy import signal

import compfilt as cf
from compfilt import plot
from compfilt.noise import AllanCurve, Spectrum

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
    f = np.linspace(0.0, 50.0, 5001)
    spectra = Spectrum(f, np.full(f.size, 4e-4)), Spectrum(f, np.full(f.size, 1e-4))
    figure = plot.spectra(*spectra, cf.FirstOrder(2.0), unit="rad")
    (found,) = [each for each in figure.axes[0].lines if each.get_label().startswith("output")]
    x, y = found.get_xydata().T
    np.testing.assert_allclose(y, (4e-4 + 1e-4 * 4.0) / (1.0 + (2.0 * np.pi * x * 2.0) ** 2), rtol=1e-9)
    with pytest.raises(ValueError, match=r"^derivative must be the spectrum of one channel"):
        plot.spectra(spectra[0], Spectrum(f, np.ones((f.size, 3))), cf.FirstOrder(2.0))


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
    with pytest.raises(ValueError, match=r"^fs must be positive and finite, got 0"):
        draw(cf.FirstOrder(1.0), fs=0.0)
    with pytest.raises(TypeError, match=r"^design must be a linear filter"):
        draw(3.0)


@pytest.mark.parametrize("name", ["allan", "bode", "poles", "responses", "results", "spectra"])
def test_examples(name):
    assert doctest.testmod(importlib.import_module(f"compfilt.plot.{name}")).failed == 0
