"""The simulated child seat: exact motion, stated errors, the same log for the same seed."""

import math

import numpy as np
import pytest
from pyarrow import csv, parquet

from compfilt import motion, simulate
from compfilt.simulate import SensorErrors, child_seat

PERFECT = SensorErrors.none()
DEGREE = math.pi / 180.0


def test_columns():
    log = child_seat(duration=20.0, rate=50.0)
    assert list(log) == ["t", "ax", "ay", "az", "gx", "gy", "gz", "true_roll", "true_pitch"]
    assert {values.shape for values in log.values()} == {(1000,)}
    assert all(np.isfinite(values).all() for values in log.values())
    np.testing.assert_allclose(np.diff(log["t"]), 0.02, rtol=1e-9)


def test_the_seed_decides():
    first, again, other = (child_seat(duration=30.0, seed=seed) for seed in (3, 3, 4))
    for name, values in first.items():
        np.testing.assert_array_equal(values, again[name])
    assert not np.array_equal(first["gx"], other["gx"])
    assert not np.array_equal(first["true_roll"], other["true_roll"])


@pytest.mark.parametrize("derivative", [0, 1])
def test_derivatives_of_a_signal(derivative):
    signal = motion.Signal()
    signal.step(1.0, 2.0, 3.0)
    signal.pulse(2.0, 0.5, 1.0, -1.0)
    signal.sines(0.5, np.array([0.3, 0.1]), np.array([0.7, 2.0]), np.array([0.1, 2.0]))
    t, h = np.linspace(0.01, 6.0, 500), 1e-5
    slope = (signal.at(t + h)[derivative] - signal.at(t - h)[derivative]) / (2.0 * h)
    np.testing.assert_allclose(signal.at(t)[derivative + 1], slope, atol=2e-8 if derivative == 0 else 2e-3)


def drive():
    return simulate.seat_motion(120.0, np.random.default_rng(7))


def test_body_rates_give_back_the_angle_rates():
    moving, t = drive(), np.linspace(0.0, 120.0, 5000)
    (roll, roll_rate, _), (pitch, pitch_rate, _) = moving.roll.at(t), moving.pitch.at(t)
    p, q, r = motion.body_rates(moving, t).T
    np.testing.assert_allclose(
        p + np.tan(pitch) * (q * np.sin(roll) + r * np.cos(roll)), roll_rate, atol=1e-13
    )
    np.testing.assert_allclose(q * np.cos(roll) - r * np.sin(roll), pitch_rate, atol=1e-13)
    yaw_rate = moving.yaw_rate.at(t)[0]
    np.testing.assert_allclose((q * np.sin(roll) + r * np.cos(roll)) / np.cos(pitch), yaw_rate, atol=1e-13)
    assert np.abs(yaw_rate).max() > 0.1


def test_body_accelerations_are_the_derivative_of_the_rates():
    moving, t, h = drive(), np.linspace(0.0, 120.0, 5000), 1e-5
    slope = (motion.body_rates(moving, t + h) - motion.body_rates(moving, t - h)) / (2.0 * h)
    np.testing.assert_allclose(motion.body_accelerations(moving, t), slope, atol=1e-3)


def test_specific_force_from_rotation_matrices():
    moving, t = drive(), np.linspace(0.0, 120.0, 200)
    force = motion.specific_force(moving, t)
    rates, accelerations = motion.body_rates(moving, t), motion.body_accelerations(moving, t)
    arm = np.array([0.0, 0.0, moving.arm])
    speed, speed_rate, _ = moving.speed.at(t)
    shake = np.column_stack([signal.at(t)[0] for signal in moving.vibration])
    for i in range(t.size):
        roll, pitch = moving.roll.at(t[i : i + 1])[0][0], moving.pitch.at(t[i : i + 1])[0][0]
        x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
        y = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
        car = np.array([speed_rate[i], speed[i] * moving.yaw_rate.at(t)[0][i], 9.80665]) + shake[i]
        swing = np.cross(accelerations[i], arm) + np.cross(rates[i], np.cross(rates[i], arm))
        np.testing.assert_allclose(force[i], (y @ x).T @ car + swing, atol=1e-12)


def test_the_gyro_of_a_perfect_sensor_integrates_to_the_truth():
    log = child_seat(duration=100.0, rate=100.0, seed=2, errors=PERFECT)
    p, q, r = (log[name] * DEGREE for name in ("gx", "gy", "gz"))
    roll, pitch = log["true_roll"] * DEGREE, log["true_pitch"] * DEGREE
    # The angles in the middle of each interval, so that the rule is of second order.
    middle_roll, middle_pitch = (roll[1:] + roll[:-1]) / 2.0, (pitch[1:] + pitch[:-1]) / 2.0
    p, q, r = p[1:], q[1:], r[1:]
    roll_rate = p + np.tan(middle_pitch) * (q * np.sin(middle_roll) + r * np.cos(middle_roll))
    pitch_rate = q * np.cos(middle_roll) - r * np.sin(middle_roll)
    np.testing.assert_allclose(np.cumsum(roll_rate) * 0.01, roll[1:] - roll[0], atol=0.005 * DEGREE)
    np.testing.assert_allclose(np.cumsum(pitch_rate) * 0.01, pitch[1:] - pitch[0], atol=0.005 * DEGREE)


def test_a_perfect_accelerometer_at_rest_reads_the_tilt():
    log = child_seat(duration=150.0, seed=0, errors=PERFECT)
    roll = np.arctan2(log["ay"], log["az"]) / DEGREE
    pitch = np.arctan2(-log["ax"], np.hypot(log["ay"], log["az"])) / DEGREE
    resting = (log["t"] > 20.0) & (log["t"] < 26.0)
    np.testing.assert_allclose(roll[resting], 20.0, atol=1e-9)
    np.testing.assert_allclose(pitch[resting], -4.0, atol=1e-9)
    driving = log["t"] > 70.0
    assert np.abs(roll - log["true_roll"])[driving].max() > 5.0  # what the filter is for


def test_the_sensors_errors_are_those_stated():
    errors = SensorErrors(gyro_walk=0.0, gyro_decimals=None, accelerometer_decimals=None)
    log, perfect = (child_seat(duration=100.0, rate=200.0, seed=1, errors=each) for each in (errors, PERFECT))
    for name in ("gx", "gy", "gz"):
        difference = log[name] - perfect[name]
        assert 0.5 <= abs(difference.mean()) <= 1.0
        assert difference.std() == pytest.approx(0.01 * math.sqrt(100.0), rel=0.03)
    for name in ("ax", "ay", "az"):
        difference = log[name] - perfect[name]
        assert 0.002 <= abs(difference.mean()) <= 0.004
        assert difference.std() == pytest.approx(300e-6 * math.sqrt(100.0), rel=0.03)


def test_the_bias_walks():
    errors = SensorErrors(gyro_noise=0.0, gyro_bias=0.0, gyro_walk=0.1, gyro_decimals=None)
    log, perfect = (child_seat(duration=400.0, rate=50.0, seed=1, errors=each) for each in (errors, PERFECT))
    walk = np.stack([log[name] - perfect[name] for name in ("gx", "gy", "gz")])
    assert np.diff(walk).std() == pytest.approx(0.1 / math.sqrt(50.0), rel=0.03)


def test_the_logger_writes_so_many_decimals():
    log = child_seat(duration=10.0)
    np.testing.assert_array_equal(log["gx"], np.round(log["gx"], 2))
    np.testing.assert_array_equal(log["ax"], np.round(log["ax"], 4))
    assert not np.array_equal(log["gx"], np.round(log["gx"], 1))


@pytest.mark.parametrize(
    "wrong", [{"duration": 0.0}, {"duration": math.nan}, {"rate": -1.0}, {"rate": math.inf}]
)
def test_what_cannot_be_simulated(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=f"^{name} must be positive and finite"):
        child_seat(**wrong)


def test_a_log_of_no_sample():
    with pytest.raises(ValueError, match="at least one sample"):
        child_seat(duration=0.001, rate=10.0)


def test_an_endless_drive_is_refused_before_it_is_drawn():
    with pytest.raises(ValueError, match="duration of a drive must be at most"):
        child_seat(duration=1e12, rate=1e-11)


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_files(tmp_path, ending):
    log = child_seat(duration=5.0)
    path = tmp_path / f"seat.{ending}"
    simulate.write(log, path)
    read = csv.read_csv(path) if ending == "csv" else parquet.read_table(path)
    assert read.column_names == list(log)
    for name, values in log.items():
        np.testing.assert_array_equal(read.column(name).to_numpy(), values)
    if ending == "parquet":
        assert read.schema.field("gx").metadata[b"unit"] == b"deg/s"
        assert read.schema.field("true_roll").metadata[b"unit"] == b"deg"
