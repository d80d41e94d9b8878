"""Gains from densities, spectra and wanted speeds, against Riccati's equation, searches and the filter itself."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg, signal

import compfilt as cf
from compfilt import design
from compfilt.design.densities import kalman_coefficients
from compfilt.design.family import KINDS, family
from compfilt.design.source import as_source
from compfilt.design.whiteness import colour
from compfilt.logs.recipe import load_recipe

RATIOS = st.floats(-3.0, 3.0).map(lambda exponent: 10.0**exponent)


def riccati(ratios):
    """The gains of the steady-state Kalman filter of a chain, by SciPy's solver."""
    order = len(ratios)
    F, H = np.diag(np.ones(order - 1), 1), np.eye(order)[:1]
    P = linalg.solve_continuous_are(F.T, H.T, np.diag(np.square(ratios)), [[1.0]])
    return P[:, 0]


# -------------------------------------------------------------------------------------------------------- densities


@pytest.mark.parametrize("order", range(1, 7))
@pytest.mark.parametrize("ratio", [1e-4, 1.0, 300.0])
def test_butterworth_is_the_kalman_filter_for_noise_at_the_last_level(order, ratio):
    """By Riccati's equation, and by the closed form: omega0 = (q/r)^(1/N)."""
    omega0 = ratio ** (1.0 / order)
    expected = cf.Butterworth(omega0, order).coefficients
    ratios = (0.0,) * (order - 1) + (ratio,)
    np.testing.assert_allclose(kalman_coefficients(ratios), expected, rtol=1e-9)
    scaled = riccati((0.0,) * (order - 1) + (1.0,)) * omega0 ** np.arange(1, order + 1)
    np.testing.assert_allclose(scaled, expected, rtol=1e-8)


@given(st.lists(RATIOS, min_size=1, max_size=6))
@settings(max_examples=60, deadline=None)
def test_noise_at_every_level(ratios):
    """The stable factor solves Riccati's equation, written out: K = P H, F P + P Fᵀ - P Hᵀ H P + Q = 0."""
    # In the filter's own units, where the equation is well conditioned.
    unit = ratios[-1] ** (1.0 / len(ratios))
    scale = unit ** np.arange(1, len(ratios) + 1)
    scaled = tuple(np.array(ratios) / scale)
    if max(scaled) > 1e2:
        return
    np.testing.assert_allclose(kalman_coefficients(tuple(ratios)) / scale, riccati(scaled), rtol=1e-5)


@given(RATIOS, RATIOS)
def test_first_order_and_pi_in_closed_form(q1, q2):
    (k,) = design.from_densities(measurement=2.0, derivative=2.0 * q1).design.coefficients
    assert k == pytest.approx(q1, rel=1e-12)
    pi = design.from_densities(measurement=2.0, derivative=2.0 * q1, walk=2.0 * q2, kind="pi").design
    assert pi.kp == pytest.approx(np.sqrt(q1**2 + 2.0 * q2), rel=1e-9)
    assert pi.ki == pytest.approx(q2, rel=1e-9)


def test_the_kinds_of_densities():
    third = design.from_densities(measurement=1e-2, derivative=0.1, walk=0.02, kind="third_order").design
    np.testing.assert_allclose(third.coefficients, riccati((0.0, 10.0, 2.0)), rtol=1e-9)
    inertial = design.from_densities(measurement=1e-2, derivative=0.09, kind="second_order_inertial").design
    assert isinstance(inertial, cf.SecondOrderInertial)
    np.testing.assert_allclose(inertial.coefficients, cf.SecondOrderInertial.butterworth(3.0).coefficients)
    chain = design.from_densities(
        measurement=1.0, derivative=3.0, walk=[0.5, 0.2], kind="chain", derivative_order=2
    ).design
    assert (chain.order, chain.derivative_order) == (4, 2)
    np.testing.assert_allclose(chain.coefficients, riccati((0.0, 3.0, 0.5, 0.2)), rtol=1e-9)


# ---------------------------------------------------------------------------------------------------------- spectra

MODELS = [
    {"kind": "first_order", "derivative": 2e-3},
    {"kind": "pi", "derivative": 2e-3, "walk": 1e-3},
    {"kind": "third_order", "derivative": 0.1, "walk": 0.01},
    {"kind": "second_order_inertial", "derivative": 0.1},
    {"kind": "chain", "derivative": 0.01, "walk": [0.01, 0.001], "derivative_order": 2},
]
all_models = pytest.mark.parametrize("model", MODELS, ids=lambda model: model["kind"])


@all_models
def test_the_search_finds_the_closed_form_at_a_high_rate(model):
    closed = design.from_densities(measurement=1e-3, fs=20_000.0, **model)
    order = {"order": closed.design.order} if model["kind"] == "chain" else {}
    searched = design.from_spectra(measurement=1e-3, fs=20_000.0, **model, **order)
    np.testing.assert_allclose(searched.design.coefficients, closed.design.coefficients, rtol=0.01)
    assert searched.prediction.sigma <= closed.prediction.sigma * (1 + 1e-9)
    assert searched.warnings == ()


@pytest.mark.parametrize("rule", ["backward_euler", "matched"])
@all_models
def test_no_gain_near_by_is_better(model, rule):
    """At a low rate, where the closed form is not the best any more."""
    order = {"order": 4} if model["kind"] == "chain" else {}
    chosen = design.from_spectra(measurement=1e-3, fs=40.0, rule=rule, **model, **order)
    if chosen.design.order != family(model["kind"], **order).free:
        return
    for gain in chosen.sensitivity:
        assert abs(gain.slope) < 1e-3
        assert min(gain.halved, gain.doubled) > chosen.prediction.sigma


def test_a_search_over_all_matched_gains_is_the_discrete_kalman_filter():
    """Every gain is the matched gain of some poles, so the least error is that of Riccati's discrete equation."""
    fs, r, q1, q2 = 5.0, 1e-2, 2e-2, 1e-2
    T = 1.0 / fs
    A = np.array([[1.0, T], [0.0, 1.0]])
    enters = np.array([T * T, T])  # the walk's step counts in the same sample
    Q = np.diag([q1**2 * T, 0.0]) + np.outer(enters, enters) * q2**2 / T
    P = linalg.solve_discrete_are(A.T, np.eye(2)[:1].T, Q, [[r**2 * fs]])
    least = np.sqrt(P[0, 0] - P[0, 0] ** 2 / (P[0, 0] + r**2 * fs))
    chosen = design.from_spectra(measurement=r, derivative=q1, walk=q2, kind="pi", fs=fs, rule="matched")
    assert chosen.prediction.sigma == pytest.approx(least, rel=1e-3)


@pytest.mark.parametrize("split", [1, 2, 3])
def test_splits_and_orders(split):
    """On a grid of omega0 none is better."""
    noise = {"measurement": 0.05, "derivative": 0.02, "fs": 50.0}
    chosen = design.from_spectra(kind="butterworth", order=3, split=split, **noise)
    assert (chosen.design.order, chosen.design.split) == (3, split)
    grid = [
        design.predict(cf.Butterworth(omega0, 3, split=split), **noise).sigma
        for omega0 in chosen.design.omega0 * np.geomspace(0.01, 10.0, 61)
    ]
    assert chosen.prediction.sigma <= min(grid) * (1 + 1e-9)


def spectrum_of(noise, fs):
    frequency, density = signal.welch(noise, fs, nperseg=4096)
    return SimpleNamespace(frequency=frequency, density=density)


def test_coloured_noise_moves_the_gains_and_is_told():
    """A vibration of the measurement: the closed form for the mean density is much too slow."""
    rng, fs = np.random.default_rng(1), 200.0
    white = rng.normal(0.0, 0.05 * np.sqrt(fs), 400_000)
    shaken = white + 5.0 * np.sin(2 * np.pi * 30.0 * np.arange(white.size) / fs)
    measured = spectrum_of(shaken, fs)
    chosen = design.from_spectra(measurement=measured, derivative=0.05, fs=fs)
    density = np.sqrt(np.mean(measured.density) / 2)
    closed = design.from_densities(measurement=density, derivative=0.05).design
    in_white = design.predict(closed, measurement=measured, derivative=0.05, fs=fs).sigma
    assert chosen.prediction.sigma < 0.9 * in_white
    assert any("measurement is not white" in warning and "30.2 Hz" in warning for warning in chosen.warnings)
    # and what is predicted is what the filter has
    drift = rng.normal(0.0, 0.05 * np.sqrt(fs), white.size)
    error = chosen.design.filter(shaken, drift, fs=fs, initial=0.0)[20_000:]
    assert error.std() == pytest.approx(chosen.prediction.sigma, rel=0.05)


@pytest.mark.parametrize("seed", range(12))
def test_white_noise_counts_as_white(seed):
    noise = np.random.default_rng(seed).normal(size=100_000)
    assert colour(as_source("measurement", spectrum_of(noise, 100.0))) == (1.0, 0.0)


@pytest.mark.parametrize("pole", [0.5, -0.5, 0.98])
def test_coloured_noise_counts_as_coloured(pole):
    noise = signal.lfilter([1.0], [1.0, -pole], np.random.default_rng(2).normal(size=100_000))
    ratio, frequency = colour(as_source("measurement", spectrum_of(noise, 100.0)))
    assert ratio > 1.5
    assert (frequency > 20.0) == (pole < 0.0)


def test_what_the_spectra_do_not_tell_is_told():
    rng = np.random.default_rng(3)
    short = spectrum_of(rng.normal(0.0, 1.0, 20_000), 100.0)
    chosen = design.from_spectra(measurement=short, derivative=1e-6, fs=250.0)
    assert any("begins at 0.0244 Hz" in warning for warning in chosen.warnings)
    assert any("ends at 49.4 Hz" in warning for warning in chosen.warnings)
    fast = design.from_spectra(measurement=1e-3, derivative=1.0, fs=100.0)
    assert any("fast for 100 Hz" in warning for warning in fast.warnings)
    useless = design.from_spectra(measurement=1.0, derivative=1e-12, fs=100.0)
    assert any("end of the search" in warning for warning in useless.warnings)


# ------------------------------------------------------------------------------------------------------------ speed

SPEEDS = [("first_order", {}), ("pi", {}), ("third_order", {}), ("second_order_inertial", {})] + [
    ("butterworth", {"order": order, "split": split}) for order, split in ((3, 3), (4, 1), (6, 2))
]


@pytest.mark.parametrize(("kind", "keywords"), SPEEDS)
def test_the_cutoff_is_the_last_crossing(kind, keywords):
    chosen = design.from_cutoff(0.8, kind=kind, **keywords).design
    low, _ = chosen.frequency_response(2 * np.pi * np.array([0.8, *np.geomspace(0.801, 800.0, 200)]))
    assert abs(low[0]) == pytest.approx(np.sqrt(0.5), rel=1e-9)
    assert (abs(low[1:]) < np.sqrt(0.5)).all()


@pytest.mark.parametrize(("kind", "keywords"), SPEEDS)
@pytest.mark.parametrize("within", [0.02, 0.3])
def test_settling_is_that_of_the_filter(kind, keywords, within):
    chosen = design.from_settling_time(2.0, within=within, kind=kind, **keywords).design
    fs = 5000.0
    left = chosen.filter(np.zeros(40_000), np.zeros(40_000), fs=fs, initial=1.0)
    assert np.flatnonzero(abs(left) > within)[-1] / fs == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("kind", ["pi", "third_order"])
def test_the_bias_is_learnt_in_time(kind):
    chosen = design.from_bias_time(2.0, kind=kind).design
    fs = 5000.0
    bias = chosen.estimate(np.zeros(40_000), np.ones(40_000), fs=fs, initial=0.0).bias
    assert np.flatnonzero(abs(bias - 1.0) > 0.1)[-1] / fs == pytest.approx(2.0, rel=0.01)


def test_far_apart_poles_have_a_settling_time():
    """The slow pole leaves 1e-5 of the error: the fast one decides."""
    assert design.settling_time(cf.PiForm(100.0, 1e-3)) == pytest.approx(np.log(50.0) / 100.0, rel=1e-3)


# ---------------------------------------------------------------------------------------------------------- results


@pytest.mark.parametrize("kind", KINDS)
def test_the_recipe_line_is_the_design(kind, tmp_path):
    chosen = design.from_cutoff(0.37, kind=kind).design
    unit = "m/s^2" if chosen.derivative_order == 2 else "m/s"
    lines = [
        'measurement = { column = "y", unit = "m" }',
        f'derivative = {{ column = "u", unit = "{unit}" }}',
    ]
    result = design.Designed(chosen)
    table = "\n".join(f"{name} = {json.dumps(value)}" for name, value in result.parameters().items())
    path = tmp_path / "recipe.toml"
    path.write_text(
        "version = 1\n[log]\nrate = 100.0\n"
        + "\n".join(lines)
        + f'\n[filter]\n{table}\n[output]\ncolumns = ["flags"]\nunit = "m"\n',
        encoding="utf-8",
    )
    np.testing.assert_allclose(
        load_recipe(path).filter.design.build().coefficients, chosen.coefficients, rtol=1e-12
    )


def test_the_recipe_line_goes_into_a_tilt_recipe(tmp_path):
    chosen = design.from_densities(measurement=1e-3, derivative=2e-3, walk=1e-3, kind="pi")
    path = tmp_path / "recipe.toml"
    path.write_text(
        "version = 1\n[log]\nrate = 100.0\naxes = 'flu'\n"
        "gyro = { columns = ['gx', 'gy', 'gz'], unit = 'rad/s' }\n"
        "accelerometer = { columns = ['ax', 'ay', 'az'], unit = 'g' }\n"
        f"[filter]\nkind = 'tilt'\n{chosen.recipe_line()}\n[output]\ncolumns = ['roll']\nunit = 'deg'\n",
        encoding="utf-8",
    )
    assert load_recipe(path).filter.design.build() == chosen.design


@pytest.mark.parametrize(
    "each",
    [
        cf.SecondOrderInertial(2.0),
        cf.Butterworth(1.0, 2, q=0.3),
        cf.Butterworth(1.0, 3, split=1),
        cf.Chain([3.0, 3.0, 1.0], 2),
    ],
    ids=repr,
)
def test_parameters_of_designs_that_were_given(each):
    found = design.assess(each, fs=100.0, measurement=1.0, derivative=1.0)
    parameters = found.parameters()
    kind = parameters.pop("kind")
    made = {
        "second_order_inertial": cf.SecondOrderInertial,
        "butterworth": cf.Butterworth,
        "chain": cf.Chain,
    }[kind]
    assert made(**parameters).coefficients == pytest.approx(each.coefficients, rel=1e-14)


def test_json_and_table():
    chosen = design.from_densities(measurement=1e-3, derivative=2e-3, walk=1e-3, kind="pi", fs=5.0)
    told = json.loads(json.dumps(chosen.as_json(), allow_nan=False))
    assert told["design"] == {"kind": "pi", "kp": chosen.design.kp, "ki": chosen.design.ki}
    assert told["prediction"]["sigma"] == chosen.prediction.sigma
    assert len(told["sensitivity"]) == 2
    text = chosen.table("rad")
    assert "predicted error at 5 Hz / rad" in text
    assert "warning: the fastest pole" in text
    unbounded = design.assess(cf.FirstOrder(1.0), fs=5.0, measurement=1.0, walk=1.0).as_json()
    assert unbounded["prediction"]["sigma"] is None
    json.dumps(unbounded, allow_nan=False)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: design.from_densities(measurement=0.0, derivative=1.0),
            "measurement must be positive and finite",
        ),
        (lambda: design.from_densities(measurement=1.0), "derivative must be above 0"),
        (lambda: design.from_densities(measurement=1.0, derivative=1.0, kind="pi"), "walk must be above 0"),
        (lambda: design.from_densities(measurement=1.0, derivative=1.0, walk=1.0), "walk must be left out"),
        (lambda: design.from_densities(measurement=1.0, derivative=1.0, kind="butterworth"), "'chain'"),
        (
            lambda: design.from_densities(measurement=1.0, derivative=1.0, kind="kalman"),
            "kind must be one of",
        ),
        (
            lambda: design.from_densities(measurement=1.0, derivative=1.0, walk=[1.0] * 6, kind="chain"),
            "walk must have at most 5",
        ),
        (lambda: design.from_spectra(measurement=0.0, derivative=1.0, fs=1.0), "measurement must have noise"),
        (lambda: design.from_spectra(measurement=1.0, derivative=0.0, fs=1.0), "derivative must have noise"),
        (
            lambda: design.from_spectra(measurement=1.0, derivative=1.0, walk=1.0, fs=1.0),
            "walk must be left out for kind 'first_order'",
        ),
        (lambda: design.from_cutoff(-1.0), "cutoff must be"),
        (lambda: design.from_cutoff(1.0, kind="pi", order=3), "order does not belong"),
        (lambda: design.from_cutoff(1.0, kind="chain", order=7), "order must be a whole number from 1 to 6"),
        (
            lambda: design.from_cutoff(1.0, kind="chain", split=1, derivative_order=2),
            "split must be the order",
        ),
        (lambda: design.from_cutoff(1.0, kind="butterworth", derivative_order=2), "use 'chain'"),
        (lambda: design.from_settling_time(1.0, within=1.0), "within must be between 0 and 1"),
        (lambda: design.from_bias_time(1.0, kind="first_order"), "design must estimate the bias"),
    ],
)
def test_errors_name_the_argument(call, words):
    with pytest.raises(ValueError, match=words):
        call()
