"""examples/cube_complementary_filter against SciPy's filters, closed forms and the accuracy bench."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

import accuracy
import angle_and_rate_filters
import compfilt as cf
import design_rule
import rule_at_rest
import rule_in_motion
import rule_recordings
import swinging_cube
import unequal_time_constants

pytest.importorskip("matplotlib")

T, TAU, ALPHA = 0.01, 0.49, 0.98
TRIAL = rule_recordings.RECORDINGS / f"{rule_recordings.VIBRATING}.parquet"

needs_recordings = pytest.mark.skipif(
    not TRIAL.exists(), reason="no recordings: set COMPFILT_RECORDINGS to a folder of them"
)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("cube")


@pytest.fixture(scope="module")
def tables(load_example, out):
    return load_example("cube_complementary_filter").reproduce(out)


@pytest.fixture(scope="module")
def swing():
    return swinging_cube.swing_of_the_edge()


def rms_degrees(error):
    return np.degrees(np.sqrt(np.mean(error**2)))


def test_figures_and_tables_are_there(tables, out):
    for name in ("cube_complementary_filter", "rates", "unequal_taus"):
        content = (out / f"{name}.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        assert 20_000 < len(content) <= 150_000
    for name, table in tables.items():
        with (out / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            rows = {row.pop("case"): row for row in csv.DictReader(file)}
        assert rows.keys() == table.keys()
        for case, cells in table.items():
            assert {column: float(text) for column, text in rows[case].items() if text} == cells


def test_the_library_is_the_source(tables):
    assert pytest.approx(TAU) == swinging_cube.TAU
    for row in tables["checks"].values():
        assert row["largest relative difference"] < 1e-14


def test_the_angle_loop_is_equation_12(swing):
    """(12) as a digital filter: y_n = α y_(n-1) + α T u_n + (1 - α) m_n."""
    measured = swing.angle + 0.1
    expected = lfilter([1 - ALPHA], [1, -ALPHA], measured, zi=[ALPHA * measured[0]])[0]
    expected += lfilter([ALPHA * T], [1, -ALPHA], swing.rate)
    np.testing.assert_allclose(
        angle_and_rate_filters.angle_loop(measured, swing.rate), expected, rtol=0, atol=1e-12
    )


def test_the_motion_is_consistent(swing):
    np.testing.assert_allclose(swing.angle, -np.pi / 4 + T * np.cumsum(swing.rate), atol=1e-12)
    np.testing.assert_allclose(swing.rate, T * np.cumsum(swing.acceleration), atol=1e-12)


# Rates


@pytest.mark.parametrize(
    ("row", "gyro_taps", "gain"),
    [
        ("(30), cf.RateFilter", [ALPHA, -ALPHA], 1 - ALPHA),
        ("(29) as printed", [ALPHA, ALPHA], 1 - ALPHA),
        ("(26) as printed", [ALPHA, -ALPHA], (1 - ALPHA) ** 2),
    ],
)
def test_rates_of_the_three_equations(tables, swing, row, gyro_taps, gain):
    for column, (gyro, acceleration) in angle_and_rate_filters.rate_sensors(swing).items():
        rate = lfilter(gyro_taps, [1, -ALPHA], gyro)
        rate += lfilter([gain], [1, -ALPHA], T * np.cumsum(acceleration))
        expected = rms_degrees((rate - swing.rate)[swing.t >= 10])
        assert tables["rates"][row][column] == pytest.approx(expected, rel=1e-9, abs=1e-10)


def test_the_printed_slips_matter(tables):
    rates = tables["rates"]
    assert rates["(30), cf.RateFilter"]["none / (deg/s)"] < 1e-10
    assert rates["(29) as printed"]["none / (deg/s)"] > 500
    assert rates["(26) as printed"]["none / (deg/s)"] > 5


def test_what_a_bias_of_the_acceleration_leaves(swing):
    """A ramp behind the low-pass; tau times the bias; nothing: the filters are linear, so differences show it."""
    sensors = angle_and_rate_filters.rate_sensors(swing)
    without, with_bias = (
        angle_and_rate_filters.rate_answers(*sensors[name])
        for name in ("+ noise / (deg/s)", "+ bias / (deg/s)")
    )
    left = {name: with_bias[name] - without[name] for name in without}
    ramp = angle_and_rate_filters.ACCELERATION_BIAS * (swing.t - TAU + TAU * np.exp(-swing.t / TAU))
    np.testing.assert_allclose(
        left["(30), cf.RateFilter"], ramp, atol=2 * T * angle_and_rate_filters.ACCELERATION_BIAS
    )
    assert left["drift-free, cf.FirstOrder"][-1] == pytest.approx(
        TAU * angle_and_rate_filters.ACCELERATION_BIAS
    )
    assert left["drift-free, cf.PiForm"][-1] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_array_equal(left["gyro alone"], 0.0)


# Unequal time constants


@pytest.mark.parametrize("ratio", unequal_time_constants.RATIOS)
def test_unequal_taus(tables, swing, ratio):
    row = tables["unequal_taus"][f"tau2/tau1 = {ratio:g}"]
    s = 1j * np.geomspace(1e-2, 1e2, 2001) / TAU
    summed = (1 + 2 * ratio * TAU * s + ratio * (TAU * s) ** 2) / ((1 + TAU * s) * (1 + ratio * TAU * s))
    assert row["|LP + HP| farthest from 1"] == pytest.approx(2 * ratio / (1 + ratio))
    assert np.max(abs(abs(summed) - 1)) <= abs(2 * ratio / (1 + ratio) - 1) + 1e-12
    assert row["largest phase / deg"] == pytest.approx(np.degrees(np.max(abs(np.angle(summed)))), abs=1e-9)
    # (6) with two time constants
    low = lfilter([T], [T + TAU, -TAU], swing.angle, zi=[TAU / (T + TAU) * swing.angle[0]])[0]
    high = lfilter([ratio * TAU * T], [T + ratio * TAU, -ratio * TAU], swing.rate)
    error = low + high - swing.angle
    assert row["RMS error / deg"] == pytest.approx(rms_degrees(error), rel=1e-9, abs=1e-10)
    assert row["largest error / deg"] == pytest.approx(np.degrees(np.max(abs(error))), rel=1e-9, abs=1e-10)
    assert (row["RMS error / deg"] < 1e-10) == (ratio == 1.0)


# The design rule


def white(density, bias=0.0):
    return design_rule.Error(np.full(2, bias), np.linspace(1.0, 999.0, 500), np.full(500, density**2))


@pytest.mark.parametrize("tau", [0.1, 1.0, 10.0])
def test_the_rule_on_white_noise(tau):
    """r² / (2 tau) + q² tau / 2 and the bias tau b; the least at tau = r/q."""
    r, q, b = 0.02, 0.01, 0.003
    expected = r**2 / (2 * tau) + q**2 * tau / 2
    rule = design_rule.Rule(2000.0, white(r), white(q))
    assert rule.rms(tau) ** 2 == pytest.approx(expected, rel=0.02)
    biased = design_rule.Rule(2000.0, white(r), white(q, b))
    assert biased.rms(tau) ** 2 == pytest.approx(expected + (b * tau) ** 2, rel=0.02)
    step = np.log(design_rule.TAUS[1] / design_rule.TAUS[0])
    assert np.log(rule.best_tau()) == pytest.approx(np.log(r / q), abs=1.01 * step)


def test_the_spectrum_of_white_noise():
    rng = np.random.default_rng(0)
    found = design_rule.spectrum(0.5 + rng.normal(0.0, 0.3, (200_000, 2)), 200.0, 4.0)
    np.testing.assert_allclose(found.mean, 0.5, atol=5e-3)
    assert np.mean(found.density) == pytest.approx(0.3**2 / 200.0, rel=0.02)


def test_the_rule_predicts_what_the_filter_does():
    """On noise for which it is made, over a time long enough."""
    rng = np.random.default_rng(1)
    fs, r, q = 100.0, 0.003, 0.002
    angle, rate = (density * np.sqrt(fs) * rng.normal(size=(400_000, 2)) for density in (r, q))
    rule = design_rule.Rule(fs, design_rule.spectrum(angle, fs, 20.0), design_rule.spectrum(rate, fs, 20.0))
    for tau in (0.3, 1.5, 6.0):
        error = cf.FirstOrder(tau).filter(angle, rate, fs=fs, initial=0.0)
        assert rule.rms(tau) == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.1)


def test_without_recordings_a_simulated_one_is_used(monkeypatch, capsys):
    monkeypatch.setattr(rule_recordings, "RECORDINGS", Path("nowhere"))
    source, trials = rule_recordings.noise_records()
    assert "NO RECORDINGS" in capsys.readouterr().out
    table, _ = rule_at_rest.still_phases(source)
    calm, shaken = table["still, bias removed"], table["the same, offset removed"]
    # The densities of SensorErrors are one-sided, and the accelerometer's g is a radian of tilt.
    assert calm["r / (deg/√Hz)"] == pytest.approx(np.degrees(300e-6) / np.sqrt(2), rel=0.05)
    assert calm["q / (deg/s/√Hz)"] == pytest.approx(0.01 / np.sqrt(2), rel=0.05)
    assert shaken["tau / s"] > 2 * calm["tau / s"]
    motion = rule_in_motion.in_motion(trials)["simulated"]
    assert motion["tau best / s"] > 3 * motion["tau rest / s"]
    assert motion["error hindsight / deg"] < 1.05 * motion["error best / deg"] < motion["error rest / deg"]


@needs_recordings
def test_the_rule_holds_at_rest(tables):
    still = tables["still"]
    for row in (still["still, bias removed"], still["still, bias left in"]):
        assert row["predicted / deg"] == pytest.approx(row["same rest / deg"], rel=0.05)
    calm = still["still, bias removed"]
    assert calm["tau / s"] == pytest.approx(calm["r/q / s"], rel=0.25)
    # r = σ √T for white noise, from the recording itself
    recording = accuracy.read(TRIAL)
    rest = slice(0, round(25 * 2000 / 7))
    sigma = np.degrees(np.sqrt(np.mean(cf.tilt(recording.acc[rest]).var(axis=0))))
    assert calm["r / (deg/√Hz)"] == pytest.approx(sigma * np.sqrt(7 / 2000), rel=0.05)


@needs_recordings
def test_the_rule_at_rest_is_not_the_best_in_motion(tables):
    motion = tables["motion"]
    assert len(motion) >= 5
    for row in motion.values():
        assert 2.0 < row["tau rest / s"] < 4.0
        assert row["tau best / s"] > 1.5 * row["tau rest / s"]
        assert row["error best / deg"] < row["error rest / deg"]


@needs_recordings
def test_the_errors_in_motion_are_those_of_the_bench(tables):
    recording, row = accuracy.read(TRIAL), tables["motion"][rule_recordings.VIBRATING]
    bias = rule_recordings.still(rule_recordings.read(TRIAL)).gyr.mean(axis=0)
    for tau, error in (("tau rest / s", "error rest / deg"), ("tau best / s", "error best / deg")):
        tilt = cf.TiltFilter(cf.FirstOrder(row[tau]))
        angles = tilt.estimate(recording.gyr - bias, recording.acc, t=recording.t).angles
        expected = accuracy.inclination_error(recording, accuracy.up_of_angles(angles))
        assert row[error] == pytest.approx(expected, rel=1e-3)
