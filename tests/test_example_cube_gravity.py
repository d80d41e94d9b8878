"""The reproduction of the cube's state estimation: its numbers against closed forms and plain loops."""

import csv
import itertools

import numpy as np
import pytest

import compfilt as cf
import corner_cube
import corner_filters
import corner_layouts
import corner_motion
import corner_noise
import corner_rates
import corner_sensors
import corner_slips
import corner_tables
from compfilt.motion import GRAVITY

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("cube") / "out"


@pytest.fixture(scope="module")
def tables(load_example, out):
    return load_example("cube_state_estimation").reproduce_corner(out)


@pytest.fixture(scope="module")
def far():
    return corner_motion.swing(corner_motion.FAR)


def derivative(values, dt):
    """The middle of every seven samples, to the sixth order."""
    weights = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / (60.0 * dt)
    return sum(w * values[i : len(values) - 6 + i] for i, w in enumerate(weights))


def smooth(t):
    """Where no piece of the motion begins or ends within the seven samples of a derivative."""
    return (t > 3.01)[3:-3]


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


def row(table, name):
    return np.array([value for value in table[name].values() if not isinstance(value, str)])


# The motion


def test_the_motion_is_a_rotation_about_the_pivot(far):
    u, phi2, phi3 = far.rate, *far.angles.T
    rates = derivative(far.angles, corner_motion.T)[smooth(far.t)]
    s1_31 = np.column_stack(
        (
            np.sin(phi3) * u[:, 0] + np.cos(phi3) * u[:, 1],
            u[:, 2] + np.tan(phi2) * (np.sin(phi3) * u[:, 1] - np.cos(phi3) * u[:, 0]),
        )
    )[3:-3][smooth(far.t)]
    np.testing.assert_allclose(s1_31, rates, atol=1e-8)
    # The vertical stands still in the world: its body components turn with -u.
    turning = derivative(far.gravity, corner_motion.T) + np.cross(u, far.gravity)[3:-3]
    np.testing.assert_allclose(turning[smooth(far.t)], 0.0, atol=1e-7)
    accelerations = derivative(u, corner_motion.T) - far.acceleration[3:-3]
    np.testing.assert_allclose(accelerations[smooth(far.t)], 0.0, atol=1e-7)


def test_the_sensors_feel_the_second_derivative_of_their_places(far):
    """In body axes the derivative of a vector v is dv/dt + u x v, taken twice."""
    place, u = corner_cube.POSITIONS[1], far.rate
    velocity = np.cross(u, place)
    felt = derivative(velocity, corner_motion.T) + np.cross(u, velocity)[3:-3]
    np.testing.assert_allclose(
        felt[smooth(far.t)],
        corner_sensors.accelerations(far, corner_cube.POSITIONS)[3:-3, 1][smooth(far.t)],
        atol=1e-8,
    )


def test_every_sensor_sees_the_axes_of_the_source():
    seen = np.array([[1, 1, 0]] * 2 + [[0, 1, 1]] * 2 + [[1, 0, 1]] * 2, dtype=bool)
    np.testing.assert_array_equal(corner_cube.SEEN, seen)  # (1.15) to (1.20)
    np.testing.assert_array_equal(seen.sum(axis=0), 4)  # (1.22)
    np.testing.assert_allclose(np.linalg.det(corner_cube.ROTATIONS), 1.0)
    on_face = np.isclose(abs(corner_cube.POSITIONS), 0.0) | np.isclose(
        abs(corner_cube.POSITIONS), corner_cube.EDGE
    )
    np.testing.assert_array_equal(on_face, ~seen)  # flat on the face across the axis it does not see


# Gravity while the cube swings


def test_perfect_sensors_give_gravity_to_rounding(tables):
    for way in ("array, rate unknown", "array, rate by the gyros"):
        assert row(tables.gravity, way)[:2].max() < 1e-13


def test_without_the_extraction_the_motion_is_taken_for_tilt(far, tables):
    """The reading of a sensor is gravity plus (1.9) at its place; the mean's is that at the mean place of its axis."""
    late = far.t >= corner_motion.LATE
    places = {
        "one sensor, 202 mm from the pivot": np.tile(corner_cube.POSITIONS[1], (3, 1)),
        "mean of the four channels": np.array(
            [corner_cube.POSITIONS[corner_cube.SEEN[:, axis]].mean(axis=0) for axis in range(3)]
        ),
    }
    for way, place in places.items():
        own = corner_sensors.accelerations(far, place)[:, range(3), range(3)]
        f1, f2, f3 = (far.gravity + own).T
        angles = np.column_stack((np.arctan2(-f3, np.hypot(f1, f2)), np.arctan2(f2, -f1)))
        expected = np.degrees(rms((angles - far.angles)[late], axis=0))
        np.testing.assert_allclose(row(tables.gravity, way)[:2], expected, rtol=1e-9)
        assert expected.min() > 5.0


def weights_of(positions):
    """The least b with sum b r = 0 and sum b = 1, or None."""
    conditions = np.column_stack((positions, np.ones(len(positions)))).T
    b = np.linalg.pinv(conditions, rcond=1e-9) @ [0.0, 0.0, 0.0, 1.0]
    return b if np.allclose(conditions @ b, [0.0, 0.0, 0.0, 1.0], atol=1e-9) else None


def test_noise_gains_are_those_of_the_weights(tables):
    gains = [
        np.linalg.norm(weights_of(corner_cube.POSITIONS[corner_cube.SEEN[:, axis]])) for axis in range(3)
    ]
    assert tables.noise["array, rate unknown / σ"]["predicted"] == pytest.approx(rms(gains), rel=1e-12)
    for name, cells in tables.noise.items():
        assert cells["measured"] == pytest.approx(cells["predicted"], rel=0.015), name


def test_mean_of_six_gyros(tables):
    cells = tables.noise["u_K, mean of six gyros / one gyro's"]
    assert cells["measured"] == pytest.approx(1.0 / np.sqrt(6.0), rel=0.01)
    wheel = tables.noise["u_R = u_K + ψ̇ / (rad/s)"]
    variance = corner_sensors.GYRO_NOISE**2 / 6.0 + corner_noise.HALL_NOISE**2
    assert wheel["measured"] ** 2 == pytest.approx(variance, rel=0.02)


def test_noise_of_the_angles_is_the_gain_over_the_lever(tables):
    gain, sigma = corner_cube.ARRAY.noise_gain[0], corner_sensors.ACCELEROMETER_NOISE
    for angle, lever in (("φ2", GRAVITY), ("φ3", GRAVITY * np.sqrt(2.0 / 3.0))):
        measured = tables.noise[f"{angle} by the array / deg"]["measured"]
        assert measured == pytest.approx(np.degrees(gain * sigma / lever), rel=0.015)


# How many sensors, and where


def test_layouts(tables):
    for name, places in corner_layouts.THREE_AXES.items():
        weights = weights_of(np.array(places))
        gain = np.inf if weights is None else np.linalg.norm(weights)
        # Where the geometry does not give all of the motion, the library's gain is a little off.
        assert tables.layouts[name]["without rate"] == pytest.approx(gain, rel=3e-3), name


def test_what_the_source_says_of_the_number_of_sensors(tables):
    """Two in line with the pivot suffice, but not at one place; three only if special; with the rate any three."""
    layouts = tables.layouts
    assert layouts["two in line with the pivot"]["without rate"] == pytest.approx(np.sqrt(2.5), rel=3e-3)
    assert layouts["three in one plane with the pivot"]["without rate"] == pytest.approx(
        np.sqrt(3.0), rel=3e-3
    )
    assert layouts["four elsewhere"]["without rate"] == pytest.approx(np.sqrt(7.0))
    for name in ("two at one place (linearly dependent)", "two not in line with the pivot"):
        assert np.isinf(layouts[name]["with rate"])
        assert "another motion looks the same" in layouts[name]["message"]
    for name in ("three elsewhere", "six of two axes, centres of the faces"):
        assert np.isinf(layouts[name]["without rate"])
        assert layouts[name]["with rate"] < 1.0
        assert "takes the body rate of a gyro" in layouts[name]["message"]


def test_positions_without_a_solution_have_their_four_places_in_a_plane_beside_the_pivot(tables):
    grid = itertools.product((0.02, 0.04, 0.075, 0.11, 0.13), repeat=4)
    seen = corner_cube.SEEN[:, 0]
    none = sum(weights_of(corner_cube.on_faces(x[:2], x[2:])[seen]) is None for x in grid)
    assert tables.positions["without rate"]["none"] == none > 0
    assert tables.positions["with rate"]["none"] == 0


# The slips


def test_printed_phi3_is_right_at_the_operating_point_only(far, tables):
    """There k1 and k3 see the same; beside it the printed one is half of φ3 and -1.06 of φ2."""
    still = corner_motion.stand()
    np.testing.assert_allclose(corner_slips.printed_phi3(still.gravity), np.pi / 4.0, rtol=1e-14)
    near = corner_motion.swing(1e-4)
    d2, d3 = (near.angles - still.angles).T
    np.testing.assert_allclose(
        corner_slips.printed_phi3(near.gravity) - np.pi / 4.0, 0.5 * d3 - 1.5 / np.sqrt(2.0) * d2, atol=1e-7
    )
    printed = np.arctan(np.sin(far.angles[:, 1]) / np.tan(far.angles[:, 0]))
    expected = np.degrees(rms(printed - far.angles[:, 1]))
    assert tables.slips["φ3 by (1.8) as printed, k3"]["far / deg"] == pytest.approx(expected, rel=1e-9)
    assert expected > 10.0


def test_arctan_loses_the_quadrant(tables):
    """Half of the attitudes are off by 180°."""
    cells = tables.slips["φ3 by (1.8) with k1"]
    assert cells["far / deg"] < 1e-12
    assert cells["everywhere / deg"] == pytest.approx(180.0 / np.sqrt(2.0), rel=1e-9)
    assert tables.slips["φ3 by atan2"]["everywhere / deg"] < 1e-12


def test_sum_without_its_weights_is_a_sixth(far, tables):
    expected = np.degrees(rms(np.arcsin(np.sin(far.angles[:, 0]) / 6.0) - far.angles[:, 0]))
    assert tables.slips["φ2, (1.12) without b_i: sum by 6"]["far / deg"] == pytest.approx(expected, rel=1e-9)
    assert tables.slips["φ2, (1.11) and (1.12) mended"]["far / deg"] < 1e-12
    assert tables.slips["φ2, (1.11) without = 0: plain mean"]["far / deg"] > 5.0


# The filters


def frozen_rates(rate):
    """(1.31) at the operating point: s2 = √(1/3), s3 = c3 = √(1/2)."""
    half = np.sqrt(0.5)
    matrix = np.array([[half, half, 0.0], [-0.5, 0.5, 1.0]])
    return rate @ matrix.T


def loop(tau, dt, measured, rates):
    """(12) of S0 for both angles, with rates of the angles or a function that makes them of the last ones."""
    alpha = tau / (tau + dt)
    angles = np.empty_like(measured)
    last = measured[0]
    for n, y in enumerate(measured):
        rate = rates(last, n) if callable(rates) else rates[n]
        last = angles[n] = alpha * (last + dt * rate) + (1.0 - alpha) * y
    return angles


def test_frozen_filter_is_the_plain_recurrence(far, tables):
    readings = corner_sensors.read(far, corner_sensors.VIBRATING)
    measured = cf.tilt(corner_cube.ARRAY.gravity(readings.acc), axes="cube")
    body_rate = np.einsum("sij,nsi->nj", corner_cube.ROTATIONS, readings.gyr) / 6.0
    angles = loop(corner_filters.TAU, corner_motion.T, measured, frozen_rates(body_rate))
    found = corner_filters.filtered(readings)["first order, frozen"]
    # The library starts with the first measurement before the first sample, as the loop does.
    np.testing.assert_allclose(found, angles, atol=1e-11)
    late = far.t >= corner_motion.LATE
    expected = np.degrees(rms((angles - far.angles)[late], axis=0))
    np.testing.assert_allclose(row(tables.filters, "first order, frozen")[2:], expected, rtol=1e-8)


def test_filter_at_its_own_output_is_the_plain_recurrence(far, tables):
    readings = corner_sensors.read(far, corner_sensors.VIBRATING)
    measured = cf.tilt(corner_cube.ARRAY.gravity(readings.acc), axes="cube")
    u = np.einsum("sij,nsi->nj", corner_cube.ROTATIONS, readings.gyr) / 6.0

    def rates(last, n):
        (s2, s3), (c2, c3) = np.sin(last), np.cos(last)
        return np.array([s3 * u[n, 0] + c3 * u[n, 1], u[n, 2] + s2 / c2 * (s3 * u[n, 1] - c3 * u[n, 0])])

    expected = loop(corner_filters.TAU, corner_motion.T, measured, rates)
    late = far.t >= corner_motion.LATE
    np.testing.assert_allclose(corner_filters.filtered(readings)["first order, output"], expected, atol=1e-10)
    np.testing.assert_allclose(
        row(tables.filters, "first order, output")[2:],
        np.degrees(rms((expected - far.angles)[late], axis=0)),
        rtol=1e-6,
    )


def test_linearisation_error_is_the_wrong_rate_behind_the_filter(far, tables):
    """The frozen filter's error obeys (1.30) with the error of the rate as its only input, and grows with the square."""
    mean_rate = np.diff(far.angles, axis=0, prepend=far.angles[:1]) / corner_motion.T
    wrong = frozen_rates(far.rate) - mean_rate
    error = loop(corner_filters.TAU, corner_motion.T, np.zeros_like(wrong), wrong)[
        far.t >= corner_motion.LATE
    ]
    table = tables.operating_point
    np.testing.assert_allclose(row(table, "swing of 30°")[:2], np.degrees(rms(error, axis=0)), rtol=1e-9)
    small, twice = (row(table, f"swing of {size}°") for size in ("2.5", "5"))
    np.testing.assert_allclose(twice[:2] / small[:2], 4.0, rtol=0.03)


def test_at_its_own_output_only_half_a_sample_is_left(tables):
    """A rate at the end of a period is not its mean: (T/2) φ̈ too much goes in, and the output grows with the motion."""
    near = corner_motion.swing(np.radians(2.5))
    rates = np.gradient(near.angles, corner_motion.T, axis=0)
    input_error = 0.5 * corner_motion.T * np.gradient(rates, corner_motion.T, axis=0)
    error = loop(corner_filters.TAU, corner_motion.T, np.zeros_like(input_error), input_error)[
        near.t >= corner_motion.LATE
    ]
    np.testing.assert_allclose(
        row(tables.operating_point, "swing of 2.5°")[2:], np.degrees(rms(error, axis=0)), rtol=0.01
    )
    small, twice = (row(tables.operating_point, f"swing of {size}°") for size in ("2.5", "5"))
    np.testing.assert_allclose(twice[2:] / small[2:], 2.0, rtol=0.02)


def test_near_both_matrices_do_and_far_only_one(tables):
    filters = {name: row(tables.filters, name) for name in tables.filters}
    for design in ("first order", "PI"):
        frozen, output = filters[f"{design}, frozen"], filters[f"{design}, output"]
        assert np.max(frozen[:2]) < 0.3
        assert np.min(frozen[2:]) > 15.0 * np.max(output[2:])
        assert np.max(output) < 0.2
    best = np.max(filters["PI, output"])
    for alone in ("accelerometers alone", "gyros alone", "first order, one sensor, 202 mm from the pivot"):
        assert np.all(filters[alone] > best)


def test_steady_turn_has_its_closed_form(tables):
    """τ (ΔΦ0 - ΔΦ) u_K with u_K = φ̇1 d; an integral part takes it for a bias."""
    phi2, phi3 = np.array(corner_cube.OPERATING_POINT) + corner_filters.TURN_OFFSET
    down = np.array([np.cos(phi2) * np.cos(phi3), -np.cos(phi2) * np.sin(phi3), np.sin(phi2)])
    left = np.degrees(corner_filters.TAU * frozen_rates(corner_filters.TURN_RATE * down))
    np.testing.assert_allclose(row(tables.turn, "first order, frozen, closed form"), left, rtol=1e-12)
    np.testing.assert_allclose(row(tables.turn, "first order, frozen"), left, rtol=1e-9)
    for name in ("first order, output", "PI, frozen", "PI, output"):
        np.testing.assert_allclose(row(tables.turn, name), 0.0, atol=1e-6)


def test_vibration_shifts_the_mean_of_phi2(tables):
    """To second order, by half of the trace of φ2's curvature times the covariance of the force."""
    still = corner_motion.stand()
    force = corner_cube.ARRAY.gravity(
        corner_sensors.read(still, corner_sensors.Errors(noise=1.0, vibration=1.0)).acc
    )
    covariance = np.cov(force.T)

    def phi2(f):
        return np.arctan2(-f[2], np.hypot(f[0], f[1]))

    at, h, axes = force.mean(axis=0), 1e-3, np.eye(3)
    curvature = np.array(
        [
            [
                (
                    phi2(at + h * (a + b))
                    - phi2(at + h * (a - b))
                    - phi2(at - h * (a - b))
                    + phi2(at - h * (a + b))
                )
                / (4.0 * h**2)
                for a in axes
            ]
            for b in axes
        ]
    )
    cells = tables.vibration["vibration times 1"]
    shift = np.degrees(0.5 * np.sum(curvature * covariance))
    found = cells["φ2: mean error / deg"] - cells["φ2 of the mean force: error / deg"]
    assert found == pytest.approx(shift, rel=0.03)
    assert abs(cells["φ2 of the mean force: error / deg"]) < 0.2 * abs(found)
    twice = tables.vibration["vibration times 2"]["φ2: mean error / deg"]
    assert twice == pytest.approx(4.0 * cells["φ2: mean error / deg"], rel=0.15)


# The rate


def test_accelerometer_bias_makes_the_rate_filter_drift_and_the_pair_not():
    still = corner_motion.stand()
    found = corner_rates.rate_answers(
        corner_sensors.read(still, corner_sensors.Errors(accelerometer_bias=1.0))
    )
    beta, tau, t = corner_rates.bias_of_the_array(), corner_rates.RATE_TAU, still.t[-1] + corner_motion.T
    ramp = found["S0 (30): mean and array, 0.1 s"][-1]
    np.testing.assert_allclose(ramp, beta * (t - tau + tau * np.exp(-t / tau)), rtol=1e-9)
    np.testing.assert_allclose(found["drift-free: mean and array, 0.1 s"][-1], tau * beta, rtol=1e-9)


def test_the_rate_filter_takes_the_gyro_bias_away_and_the_pair_does_not():
    still = corner_motion.stand()
    found = corner_rates.rate_answers(corner_sensors.read(still, corner_sensors.Errors(gyro_bias=1.0)))
    bias = found["mean of six gyros"][-1]
    assert rms(bias) > np.radians(0.1)
    np.testing.assert_allclose(found["S0 (30): mean and array, 0.1 s"][-1], 0.0, atol=1e-12)
    np.testing.assert_allclose(found["drift-free: mean and array, 0.1 s"][-1], bias, rtol=1e-9)


def test_noise_of_the_drift_free_rate(tables):
    """x = c (x + T u) + (1 - c) y, where u is the mean of two samples of the array's acceleration."""
    gains = corner_cube.ARRAY.angular_acceleration_noise_gain
    array = rms(gains) * corner_sensors.ACCELEROMETER_NOISE
    for tau in corner_rates.RATE_TAUS[:-1]:  # the last has too few time constants in the record
        c = tau / (tau + corner_motion.T)
        driven = (corner_motion.T * array * c) ** 2 / (1.0 - c**2) * 0.5 * (1.0 + c)
        for column, gyro in (
            ("one", corner_sensors.GYRO_NOISE),
            ("mean", corner_sensors.GYRO_NOISE / np.sqrt(6.0)),
        ):
            measured = ((1.0 - c) * gyro) ** 2 / (1.0 - c**2)
            cells = tables.rate_taus[f"tau = {1e3 * tau:g} ms"]
            expected = np.degrees(np.sqrt(driven + measured))
            assert cells[f"{column}, noise / (deg/s)"] == pytest.approx(expected, rel=0.06)


def test_what_the_rate_is_worth(tables):
    rates = {name: row(tables.rates, name) for name in tables.rates}
    perfect, noise, biased, vibrating, drifting = np.array(list(rates.values())).T
    assert np.max(perfect) < 1e-3
    names = list(rates)
    one, mean = names.index("one gyro"), names.index("mean of six gyros")
    assert noise[mean] == pytest.approx(noise[one] / np.sqrt(6.0), rel=0.01)
    filtered = names.index("S0 (30): mean and array, 0.1 s")
    assert drifting[filtered] > 100.0 * drifting[mean]
    assert vibrating[names.index("drift-free: mean and array, 0.1 s")] > biased[mean]


# What is written


def test_tables_and_figures_are_written(out, tables, capsys):
    for name, table in tables._asdict().items():
        with (out / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        assert [each["case"] for each in rows] == list(table)
        for each, cells in zip(rows, table.values(), strict=True):
            assert {column: each[column] for column in cells} == {
                column: str(value) for column, value in cells.items()
            }
        corner_tables.show(name, table)
        assert capsys.readouterr().out.count("\n") == len(table) + 2
    for name in ("cube_state_estimation", "geometry", "rates"):
        picture = (out / f"{name}.png").read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert 5_000 < len(picture) <= 150_000
