"""The committed reference vectors through the library, in one call and sample by sample."""

import numpy as np
import pytest

import compfilt as cf
from designs import assert_same_bits
from test_vectors_made import VECTORS, make

MAKERS = {
    "first_order": cf.FirstOrder,
    "pi_form": cf.PiForm,
    "butterworth": cf.Butterworth,
    "third_order": cf.ThirdOrder,
    "third_order_butterworth": cf.ThirdOrder.butterworth,
    "second_order_inertial": cf.SecondOrderInertial,
    "second_order_inertial_butterworth": cf.SecondOrderInertial.butterworth,
    "chain": cf.Chain,
    "rate_filter": cf.RateFilter,
}
PARAMETERS = {"tau": float, "kp": float, "ki": float, "omega0": float, "q": float, "order": int, "split": int}
OPTIONS = {"rule": str, "input": str, "period": float, "delay": float, "gap_cap": float}

FILES = {path.name: make.read(path) for path in sorted(VECTORS.glob("*.csv"))}
TILT = [name for name, (header, _) in FILES.items() if "axes" in header]
LINEAR = [name for name in FILES if name not in TILT]

linear_files = pytest.mark.parametrize("name", LINEAR)


def design_of(header):
    kind = header["design"]
    if kind == "chain":
        coefficients = [float(k) for k in header["coefficients"].split(",")]
        return cf.Chain(coefficients, int(header["derivative_order"]))
    named = ("order", "split") if kind == "butterworth" else ()
    keys = [key for key in PARAMETERS if key in header and (key not in ("order", "split") or key in named)]
    return MAKERS[kind](**{key: PARAMETERS[key](header[key]) for key in keys})


def options_of(header):
    return {key: kind(header[key]) for key, kind in OPTIONS.items() if key in header}


def rate_of(header):
    return None if header["dt"] == "variable" else 1 / float(header["dt"])


def zeros(design):
    return np.zeros(design.order)


def by_estimate(name):
    """All levels in one call; with times and the file's zero state where the steps vary."""
    header, columns = FILES[name]
    design = design_of(header)
    y, u, dt = columns["y"], columns["u"], columns["dt"]
    if rate_of(header):
        return design.estimate(y, u, fs=rate_of(header), initial=zeros(design), **options_of(header)).levels
    # A first sample of no length shifts nothing: it repeats the start, and the file's first step follows it.
    t = np.concatenate([[0.0], np.cumsum(dt)])
    before = np.concatenate([[np.nan], y]), np.concatenate([[np.nan], u])
    levels = design.estimate(*before, t=t, initial=zeros(design), **options_of(header)).levels
    return levels[:, 1:]


def by_updates(name, dtype=float):
    """All levels, one sample at a time, with the file's own steps."""
    header, columns = FILES[name]
    design = design_of(header)
    stream = design.stream(dtype=dtype, initial=zeros(design), **options_of(header))
    levels = []
    for y, u, dt in zip(columns["y"], columns["u"], columns["dt"], strict=True):
        stream.update(y, u, dt)
        levels.append(stream.state.levels[:, 0])
    return np.array(levels).T


def assert_agrees(levels, name, tolerance):
    _, columns = FILES[name]
    expected = [columns[key] for key in columns if key.startswith("level")]
    assert len(expected) == len(levels)
    for level, (got, want) in enumerate(zip(levels, expected, strict=True)):
        scale = max(1.0, np.abs(want).max())
        np.testing.assert_allclose(got, want, rtol=0, atol=tolerance * scale, err_msg=f"level {level}")


def test_every_file_is_used():
    assert sorted(LINEAR + TILT) == sorted(path.name for path in VECTORS.glob("*.csv"))
    assert len(LINEAR) > 50
    assert len(TILT) == 2


@linear_files
def test_header_is_the_design(name):
    header, _ = FILES[name]
    design = design_of(header)
    assert design.order == int(header["order"])
    assert design.derivative_order == int(header["derivative_order"])
    if "coefficients" in header:
        expected = [float(k) for k in header["coefficients"].split(",")]
        np.testing.assert_allclose(design.coefficients, expected, rtol=1e-14)
        assert design.split == int(header["split"])


@linear_files
def test_estimate(name):
    assert_agrees(by_estimate(name), name, float(FILES[name][0]["tolerance"]))


@linear_files
def test_updates(name):
    assert_agrees(by_updates(name), name, float(FILES[name][0]["tolerance"]))


@linear_files
def test_updates_are_the_estimate_bit_for_bit(name):
    """With fs, and with times whose differences are the steps."""
    header, columns = FILES[name]
    design = design_of(header)
    y, u = columns["y"], columns["u"]
    t = np.cumsum(columns["dt"])
    fs = rate_of(header)
    clock = {"fs": fs} if fs else {"t": t}
    whole = design.estimate(y, u, initial=zeros(design), **clock, **options_of(header))
    stream = design.stream(fs=fs, initial=zeros(design), **options_of(header))
    steps = [None] * len(t) if fs else np.diff(t, prepend=t[0])
    for n in range(len(y)):
        assert_same_bits(stream.update(y[n], u[n], steps[n]), whole.levels[0, n])
        assert_same_bits(stream.state.levels[:, 0], whole.levels[:, n])
    assert stream.state.levels.shape == (design.order, 1)


@linear_files
def test_single_precision(name):
    """A thousandth of the size: coarse, but a wrong rule or option shows."""
    assert_agrees(by_updates(name, np.float32), name, 1e-3)


@pytest.mark.parametrize("name", TILT)
def test_tilt(name):
    header, columns = FILES[name]
    gyr = np.column_stack([columns[key] for key in ("gx", "gy", "gz")])
    acc = np.column_stack([columns[key] for key in ("ax", "ay", "az")])
    tilt = cf.TiltFilter(design_of(header), axes=header["axes"], rates=header["rates"])
    estimate = tilt.estimate(gyr, acc, fs=rate_of(header), initial=(0.0, 0.0), rule=header["rule"])
    expected = np.column_stack([columns["roll"], columns["pitch"]])
    tolerance = float(header["tolerance"]) * max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(estimate.levels[0], expected, rtol=0, atol=tolerance)
    np.testing.assert_allclose(estimate.angles, expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "name", ["missing_pi.csv", "missing_split_2_1.csv", "missing_matched_third_order.csv"]
)
def test_gaps_are_flagged(name):
    header, columns = FILES[name]
    design = design_of(header)
    estimate = design.estimate(columns["y"], columns["u"], fs=100.0, **options_of(header))
    missing = np.isnan(columns["y"])
    assert missing.any()
    np.testing.assert_array_equal(estimate.flags, np.where(missing, cf.Flags.MEASUREMENT_MISSING, 0))
    assert estimate.counts["measurement_missing"] == missing.sum()
