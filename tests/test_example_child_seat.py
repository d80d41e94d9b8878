"""The reproduction of S2 (child seat): its numbers against closed forms and against the paper's (9) as a plain loop."""

import csv
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import compfilt as cf

pytest.importorskip("matplotlib")

SCRIPT = Path(__file__).parents[1] / "examples" / "child_seat" / "reproduce.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("example_child_seat", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("child_seat")


@pytest.fixture(scope="module")
def result(example, out):
    return example.reproduce(out)


@pytest.fixture(scope="module")
def log(example):
    return example.simulate(seed=0)


def angle_rates(roll, pitch, gyr):
    """Return the rate of roll that the body rates make, by S2's conversion."""
    p, q, r = gyr
    return p + np.tan(pitch) * (q * np.sin(roll) + r * np.cos(roll)), q * np.cos(roll) - r * np.sin(roll)


def test_the_first_order_answer_is_the_papers_9(example, log):
    a, dt = 0.8, 0.01
    measured = np.column_stack(
        (
            np.arctan2(log.acc[:, 1], log.acc[:, 2]),
            np.arctan2(-log.acc[:, 0], np.hypot(log.acc[:, 1], log.acc[:, 2])),
        )
    )
    angles, rolls = measured[0], [measured[0, 0]]
    for gyr, y in zip(log.gyr[1:], measured[1:], strict=True):
        angles = a * (angles + dt * np.array(angle_rates(*angles, gyr))) + (1.0 - a) * y
        rolls.append(angles[0])
    np.testing.assert_allclose(example.answers(log)[example.NINE], rolls, atol=1e-9)


def test_the_log_is_that_of_the_demo(log):
    with (SCRIPT.parents[1] / "demo" / "child_seat.csv").open(encoding="utf-8") as file:
        first = next(csv.DictReader(file))
    np.testing.assert_allclose(
        np.degrees(log.gyr[0]), [float(first[name]) for name in ("gx", "gy", "gz")], atol=1e-12
    )
    assert log.driving.sum() * 0.01 == pytest.approx(90.0, abs=0.02)


def test_the_gyro_drifts_and_the_rest_does_not(example, result):
    static = {name: errors.static for name, errors in result.errors.items()}
    assert static[example.GYRO] > 10.0
    assert max(static[name] for name in (example.ACCELEROMETER, example.NINE, example.ELEVEN)) < 0.6
    # The gains that count on the gyro carry its bias, 0.5 to 1 deg/s, as an error of tau b, or have to learn it.
    assert 0.5 * 2.8 < static[example.BETTER_NINE] < 1.0 * 2.8
    assert static[example.BETTER_ELEVEN] > static[example.ELEVEN]


@pytest.mark.parametrize("drive", ["driving", "other_drives"])
def test_on_the_road_only_better_gains_beat_the_accelerometer(example, result, drive):
    error = {name: getattr(errors, drive) for name, errors in result.errors.items()}
    accelerometer = error[example.ACCELEROMETER]
    for name in (example.NINE, example.ELEVEN):
        assert 0.97 * accelerometer < error[name] < accelerometer
    assert error[example.BETTER_NINE] < 0.75 * accelerometer
    assert error[example.BETTER_ELEVEN] < 0.5 * accelerometer
    for name in (example.BETTER_NINE, example.BETTER_ELEVEN):
        assert error[f"{name}, gx as it is"] > 1.2 * error[name]


def test_the_two_structures_agree_as_published(result):
    static, driving = result.difference
    assert static < 0.05
    assert driving < 0.2


def test_which_one_shows_more_is_a_matter_of_the_rate(result):
    # (9) has the corner 1/tau = fs (1 - a)/a = fs/4, (11) about k_p = 20 1/s: equal at 80 Hz.
    for row in result.rates:
        assert row.tau == pytest.approx(4.0 / row.rate)
        assert row.short["truth"] < row.short["(9)"] < row.short["acc."]
        if row.rate != 80.0:
            assert (row.short["(11)"] > row.short["(9)"]) == (row.rate < 80.0)
    assert min(result.rates, key=lambda row: row.difference).rate == 80.0


def test_short_term_keeps_the_fast_and_drops_the_slow(example):
    t = np.arange(3000) / 100
    assert np.std(example.short_term(np.sin(2.0 * np.pi * 10.0 * t), 100.0)) == pytest.approx(
        0.5**0.5, rel=0.02
    )
    assert np.abs(example.short_term(0.3 * t, 100.0)).max() < 1e-9


def test_the_steady_turn(example, result):
    # tau yaw_rate sin(pitch) for (9); a decaying difference of two exponentials for (11).
    false_rate = -60.0 * np.sin(np.radians(40.0))
    end = {name: np.degrees(roll[result.turn.t <= 10.0][-1]) for name, roll in result.turn.roll.items()}
    assert end["(9), a = 0.98, gx as it is"] == pytest.approx(0.49 * false_rate, rel=1e-6)
    assert end["(9), a = 0.98, gx as it is"] == pytest.approx(-18.9, abs=0.05)
    assert end["(9), a = 0.8, gx as it is"] == pytest.approx(0.04 * false_rate, rel=1e-6)
    assert np.abs(result.turn.roll["(9), a = 0.98, converted"]).max() < 1e-12
    slow, fast = 10.0 - np.sqrt(90.0), 10.0 + np.sqrt(90.0)  # the roots of s^2 + 20 s + 10
    t = np.linspace(0.0, 1.0, 10001)
    peak = np.max(-false_rate * (np.exp(-slow * t) - np.exp(-fast * t)) / (fast - slow))
    pi = np.degrees(result.turn.roll[f"{example.ELEVEN}, gx as it is"])
    assert -pi.min() == pytest.approx(peak, rel=0.02)
    assert pi.max() == pytest.approx(peak, rel=0.02)
    assert end[f"{example.ELEVEN}, gx as it is"] == pytest.approx(0.0, abs=0.02)


def test_the_gains_are_those_of_the_demo(example):
    recipes = SCRIPT.parents[1] / "demo"
    assert "tau = 2.8" in (recipes / "first_order.toml").read_text(encoding="utf-8")
    assert "kp = 0.1" in (recipes / "pi.toml").read_text(encoding="utf-8")
    assert cf.FirstOrder(2.8) == example.BETTER_FIRST_ORDER
    assert cf.PiForm(0.1, 0.005) == example.BETTER_PI


@pytest.mark.parametrize("name", ["child_seat", "steady_turn"])
def test_figures(result, out, name):
    assert result
    picture = (out / f"{name}.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert 5_000 < len(picture) <= 150_000


@pytest.mark.parametrize(("name", "rows"), [("errors", 9), ("rates", 6), ("steady_turn", 4)])
def test_tables_are_written_and_are_those_of_the_readme(result, out, name, rows):
    assert result
    with (out / f"{name}.csv").open(encoding="utf-8") as file:
        table = list(csv.reader(file))
    assert len(table) == rows + 1
    readme = (SCRIPT.parent / "README.md").read_text(encoding="utf-8").splitlines()
    lines = [line.split() for line in readme]
    for row in table:
        assert " ".join(row).split() in lines
