"""The reproduction of S2 (child seat): its numbers against closed forms and against the paper's (9) as a plain loop."""

import csv
from pathlib import Path

import numpy as np
import pytest

import compfilt as cf
import seat_filters
import seat_log
import seat_sample_rate

pytest.importorskip("matplotlib")

FOLDER = Path(__file__).parents[1] / "examples" / "child_seat"


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("child_seat")


@pytest.fixture(scope="module")
def result(load_example, out):
    return load_example("child_seat").reproduce(out)


@pytest.fixture(scope="module")
def log():
    return seat_log.simulate(seed=0)


def angle_rates(roll, pitch, gyr):
    """Return the rate of roll that the body rates make, by S2's conversion."""
    p, q, r = gyr
    return p + np.tan(pitch) * (q * np.sin(roll) + r * np.cos(roll)), q * np.cos(roll) - r * np.sin(roll)


def test_the_first_order_answer_is_the_papers_9(log):
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
    np.testing.assert_allclose(seat_filters.answers(log)[seat_filters.NINE], rolls, atol=1e-9)


def test_the_log_is_that_of_the_demo(log):
    with (FOLDER.parent / "demo" / "child_seat.csv").open(encoding="utf-8") as file:
        first = next(csv.DictReader(file))
    np.testing.assert_allclose(
        np.degrees(log.gyr[0]), [float(first[name]) for name in ("gx", "gy", "gz")], atol=1e-12
    )
    assert log.driving.sum() * 0.01 == pytest.approx(90.0, abs=0.02)


def test_the_gyro_drifts_and_the_rest_does_not(result):
    static = {name: errors.static for name, errors in result.errors.items()}
    assert static[seat_filters.GYRO] > 10.0
    assert (
        max(static[name] for name in (seat_filters.ACCELEROMETER, seat_filters.NINE, seat_filters.ELEVEN))
        < 0.6
    )
    # The gains that count on the gyro carry its bias, 0.5 to 1 deg/s, as an error of tau b, or have to learn it.
    assert 0.5 * 2.8 < static[seat_filters.BETTER_NINE] < 1.0 * 2.8
    assert static[seat_filters.BETTER_ELEVEN] > static[seat_filters.ELEVEN]


@pytest.mark.parametrize("drive", ["driving", "other_drives"])
def test_on_the_road_only_better_gains_beat_the_accelerometer(result, drive):
    error = {name: getattr(errors, drive) for name, errors in result.errors.items()}
    accelerometer = error[seat_filters.ACCELEROMETER]
    for name in (seat_filters.NINE, seat_filters.ELEVEN):
        assert 0.97 * accelerometer < error[name] < accelerometer
    assert error[seat_filters.BETTER_NINE] < 0.75 * accelerometer
    assert error[seat_filters.BETTER_ELEVEN] < 0.5 * accelerometer
    for name in (seat_filters.BETTER_NINE, seat_filters.BETTER_ELEVEN):
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


def test_short_term_keeps_the_fast_and_drops_the_slow():
    t = np.arange(3000) / 100
    assert np.std(seat_sample_rate.short_term(np.sin(2.0 * np.pi * 10.0 * t), 100.0)) == pytest.approx(
        0.5**0.5, rel=0.02
    )
    assert np.abs(seat_sample_rate.short_term(0.3 * t, 100.0)).max() < 1e-9


def test_the_steady_turn(result):
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
    pi = np.degrees(result.turn.roll[f"{seat_filters.ELEVEN}, gx as it is"])
    assert -pi.min() == pytest.approx(peak, rel=0.02)
    assert pi.max() == pytest.approx(peak, rel=0.02)
    assert end[f"{seat_filters.ELEVEN}, gx as it is"] == pytest.approx(0.0, abs=0.02)


def test_the_gains_are_those_of_the_demo():
    recipes = FOLDER.parent / "demo"
    assert "tau = 2.8" in (recipes / "first_order.toml").read_text(encoding="utf-8")
    assert "kp = 0.1" in (recipes / "pi.toml").read_text(encoding="utf-8")
    assert cf.FirstOrder(2.8) == seat_filters.BETTER_FIRST_ORDER
    assert cf.PiForm(0.1, 0.005) == seat_filters.BETTER_PI


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
    readme = (FOLDER / "README.md").read_text(encoding="utf-8").splitlines()
    lines = [line.split() for line in readme]
    for row in table:
        assert " ".join(row).split() in lines
