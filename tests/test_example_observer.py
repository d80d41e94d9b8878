"""The cube's observer: what the example says follows from the equations, and the analysis and the simulation agree."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("scipy")

from matplotlib import image
from scipy import linalg, signal

import edge_cube
import edge_designs
import edge_estimators
import edge_loops
import edge_simulation
import edge_study
from compfilt.motion import GRAVITY

OBSERVERS = [
    "observer, small Q",
    "observer, large Q",
    "Kalman",
    "Kalman, accelerometer",
    "Kalman, bias",
    "Kalman, bias, torque",
]
ALL = ["true tilt", "complementary, first order", "complementary, PI", *OBSERVERS]
all_schemes = pytest.mark.parametrize("name", ALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("observer")


@pytest.fixture(scope="module")
def results(load_example, folder):
    return load_example("cube_state_estimation").reproduce_edge(folder)


@pytest.fixture(scope="module")
def schemes():
    return edge_designs.schemes()


def same_set(got, expected, tolerance):
    """Each eigenvalue has its own partner."""
    left = list(expected)
    for one in got:
        nearest = min(left, key=lambda other: abs(other - one))
        assert abs(nearest - one) < tolerance
        left.remove(nearest)
    assert not left


def oscillation(x):
    """The two roots of the recurrence that a decaying or growing oscillation obeys."""
    (b, c), *_ = np.linalg.lstsq(np.column_stack((x[1:-1], x[:-2])), x[2:])
    return np.roots([1.0, -b, -c])


# -------------------------------------------------------------------------------------------------------------- the plant


def test_the_matrices_are_the_derivatives_of_the_equations():
    A, B = edge_cube.continuous(edge_cube.MODEL)
    h = 1e-6
    for i in range(3):
        step = h * np.eye(3)[i]
        slope = (
            edge_cube.derivative(edge_cube.MODEL, step, 0.0)
            - edge_cube.derivative(edge_cube.MODEL, -step, 0.0)
        ) / (2.0 * h)
        np.testing.assert_allclose(slope, A[:, i], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(edge_cube.derivative(edge_cube.MODEL, np.zeros(3), 1.0), B[:, 0], rtol=1e-12)


def test_the_matrices_over_a_sample_are_scipys():
    A, B = edge_cube.continuous(edge_cube.MODEL)
    wanted = signal.cont2discrete((A, B, np.eye(3), np.zeros((3, 1))), edge_cube.T)
    (got_A,), (got_B,) = edge_cube.discrete([edge_cube.MODEL])
    np.testing.assert_allclose(got_A, wanted[0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(got_B, wanted[1], rtol=1e-12, atol=1e-15)


def test_the_published_equations():
    """Gajamohan et al. write them for the wheel's speed against the body."""
    L, l_b, m_b, m_w, I_b, I_w = 0.085, 0.075, 0.419, 0.204, 3.34e-3, 0.57e-3
    C_b, C_w, K_m, g = 1.02e-3, 0.05e-3, 25.1e-3, GRAVITY
    tilt, rate, slip, current = 0.3, -1.0, 20.0, 0.7
    J = I_b + m_w * L**2
    gravity = (m_b * l_b + m_w * L) * g * math.sin(tilt)
    body = (gravity - K_m * current - C_b * rate + C_w * slip) / J
    wheel = (J + I_w) * (K_m * current - C_w * slip) / (I_w * J) - (gravity - C_b * rate) / J
    got = edge_cube.derivative(edge_cube.MODEL, np.array([tilt, rate, slip + rate]), current)
    np.testing.assert_allclose(got, [rate, body, body + wheel], rtol=1e-12)


def test_energy_is_kept_without_friction():
    free = replace(edge_cube.MODEL, body_friction=0.0, wheel_friction=0.0)
    x = np.array([0.4, 0.0, 30.0])

    def energy(x):
        return 0.5 * free.inertia * x[1] ** 2 + free.lever * GRAVITY * math.cos(x[0])

    start = energy(x)
    for _ in range(40):
        x = edge_cube.advance(free, x, 0.0)
    assert abs(x[0]) > 1.0
    assert x[2] == 30.0
    assert energy(x) == pytest.approx(start, rel=1e-6)


def test_an_accelerometer_at_the_centre_of_percussion_feels_nothing_of_a_fall():
    free = replace(edge_cube.MODEL, body_friction=0.0, wheel_friction=0.0)
    felt = edge_cube.readings(free)[edge_cube.ACCELEROMETER]
    assert felt[0] == pytest.approx(1.0 - edge_cube.ARM * free.lever / free.inertia, rel=1e-12)
    x = np.array([[0.01], [0.0], [0.0]])
    assert edge_simulation.read(free, x, np.zeros(1))[edge_cube.ACCELEROMETER, 0] == pytest.approx(
        0.01 * felt[0], rel=1e-4
    )


# ------------------------------------------------------------------------------------------------- the linear analysis


@pytest.mark.parametrize("name", OBSERVERS)
def test_separation(schemes, name):
    """Without model error: the regulator's poles, the observer's, and the current's memory of one sample."""
    scheme, model = schemes[name], edge_designs.plain()
    regulated = np.linalg.eigvals(model.A - model.B @ edge_designs.regulator())
    (system,) = edge_loops.joint([edge_cube.MODEL], scheme.compensator)
    same_set(np.linalg.eigvals(system), [*regulated, *scheme.poles, 0.0], 1e-6)


def test_separation_before_the_correction_too():
    model, R = edge_designs.plain(), edge_cube.noise()[np.ix_(edge_cube.RATES, edge_cube.RATES)]
    scheme = edge_estimators.observed(model, 1e-6 * np.eye(3), R, filtered=False)
    regulated = np.linalg.eigvals(model.A - model.B @ edge_designs.regulator())
    (system,) = edge_loops.joint([edge_cube.MODEL], scheme.compensator)
    same_set(np.linalg.eigvals(system), [*regulated, *scheme.poles, 0.0], 1e-7)


@all_schemes
@pytest.mark.parametrize("plant", [edge_cube.MODEL, edge_cube.changed(torque_constant=0.7, lever=1.2)])
def test_small_motions_are_those_of_the_linear_system(schemes, name, plant):
    """The library's filter and observer in the loop, against powers of one matrix."""
    scheme, start = schemes[name], 1e-5
    runs = edge_simulation.simulate([edge_simulation.Case(scheme, plant, noise=0.0, start=start)], 2.0)
    (system,) = edge_loops.joint([plant], scheme.compensator)
    x = np.zeros(len(system))
    x[0] = start
    wanted = []
    for _ in range(len(runs.current)):
        wanted.append(x[:3])
        x = system @ x
    wanted = np.array(wanted)
    np.testing.assert_allclose(runs.states[:, :, 0], wanted, atol=2e-5 * np.abs(wanted).max())


@pytest.mark.parametrize(("name", "friction"), [("observer, small Q", 2e-3), ("observer, large Q", 4e-3)])
def test_the_growth_is_the_eigenvalues(schemes, name, friction):
    plant = edge_cube.sticky(friction)
    (system,) = edge_loops.joint([plant], schemes[name].compensator)
    values = np.linalg.eigvals(system)
    expected = values[np.argmax(np.abs(values))]
    assert abs(expected) > 1.0
    runs = edge_simulation.simulate([edge_simulation.Case(schemes[name], plant, noise=0.0, start=1e-9)], 10.0)
    same_set(oscillation(runs.states[250:, 0, 0]), [expected, expected.conj()], 1e-4)


@pytest.mark.parametrize("name", ["observer, small Q", "observer, large Q", "Kalman"])
def test_the_margin_parts_the_stable_from_the_unstable(schemes, name):
    factor = edge_loops.margin(schemes[name], "torque_constant", 0.1)
    cases = [
        edge_simulation.Case(
            schemes[name], edge_cube.changed(torque_constant=factor * side), noise=0.0, start=1e-3
        )
        for side in (1.1, 0.9)
    ]
    runs = edge_simulation.simulate(cases, 60.0)
    late = np.abs(runs.states[-500:, 0]).max(axis=0)
    assert late[0] < 1e-5
    assert not late[1] < 0.01


def test_noise_by_the_lyapunov_equation(results):
    for name in ("true tilt", *OBSERVERS):
        tilt, current = results.linear[name].noise
        simulated = results.swings[name]["no error"]
        assert simulated.tilt == pytest.approx(tilt, rel=0.15)
        assert simulated.current == pytest.approx(current, rel=0.06)


# ------------------------------------------------------------------------------------------------------- the oscillation


@pytest.mark.parametrize("name", ["observer, small Q", "observer, large Q"])
def test_the_amplitude_is_constant_and_the_friction_sets_it(results, schemes, name):
    weak, strong = edge_cube.DRY, replace(edge_cube.DRY, coulomb=2.0 * edge_cube.COULOMB)
    cases = [
        edge_simulation.Case(schemes[name], weak, noise=0.0),
        edge_simulation.Case(schemes[name], weak, noise=0.0, start=0.05),
        edge_simulation.Case(schemes[name], strong, noise=0.0),
    ]
    tilt = edge_simulation.simulate(cases, 60.0).states[:, 0]
    first, second = (np.sqrt(np.mean(part**2, axis=0)) for part in (tilt[1000:2000], tilt[2000:]))
    np.testing.assert_allclose(second, first, rtol=0.03)
    assert second[1] == pytest.approx(second[0], rel=0.03)
    assert second[2] == pytest.approx(2.0 * second[0], rel=0.05)
    cycle = results.linear[name].cycle
    assert second[0] == pytest.approx(cycle.tilt, rel=0.1)
    assert results.swings[name]["dry, noise / 10"].frequency == pytest.approx(cycle.frequency, rel=0.15)


@all_schemes
def test_the_wheel_rests_where_a_resting_state_exists(results, name):
    """Except for the slow PI form, which is still about to find its bias."""
    linear, swing = results.linear[name], results.swings[name]["dry, noise / 10"]
    if linear.resting_slip > 1.0:
        assert linear.cycle.frequency < 0.01
        assert math.degrees(swing.tilt) < 0.05
        if name != "complementary, PI":
            assert swing.slip == pytest.approx(linear.resting_slip, rel=0.06)
    else:
        assert linear.cycle.frequency > 0.2
        assert abs(swing.slip) < 0.3


def test_the_true_tilt_rests_where_current_and_friction_balance(results):
    """K_m K_3 carries the friction of the slip: τ = (-K_m K_3 - C_w) ψ̇."""
    per_speed = (
        -edge_cube.MODEL.torque_constant * edge_designs.regulator()[0, 2] - edge_cube.MODEL.wheel_friction
    )
    assert results.linear["true tilt"].resting_slip == pytest.approx(edge_cube.COULOMB / per_speed, rel=1e-9)


def test_the_direction_of_q_counts(results):
    """Any amount of Q = q I oscillates; torque noise of the friction's size does not."""
    ball, predicted, torque = (results.sweeps[name] for name in ("I", "I, predicted", "B Bᵀ"))
    for sweep in (ball, predicted):
        tilt = np.degrees([run.tilt for run in sweep.simulated])
        assert tilt.min() > 0.15
        assert 1.6 < tilt[0] / tilt[-1] < 2.0
        np.testing.assert_allclose([cycle.tilt for cycle in sweep.predicted], np.radians(tilt), rtol=0.1)
    quiet = torque.q >= 0.9 * 10.0**-2.5
    tilt = np.degrees([run.tilt for run in torque.simulated])
    assert tilt[quiet].max() < 0.01
    assert tilt[~quiet].min() > 0.15
    assert (edge_cube.COULOMB / edge_cube.MODEL.torque_constant) ** 2 > torque.q[quiet][0]


# ------------------------------------------------------------------------------------------------- what the source says


def test_a_small_q_does_not_bring_the_tilts_poles_near_the_circle(results):
    """They go to the stable pole of the pendulum and to the mirrored unstable one; only the wheel's is slow."""
    A = edge_designs.plain().A
    own = np.sort(np.linalg.eigvals(A).real)
    np.testing.assert_allclose(
        np.sort(results.schemes["observer, small Q"].poles.real),
        np.sort([own[0], 1.0 / own[2], own[1]]),
        atol=4e-3,
    )
    kalman = np.abs(results.schemes["Kalman"].poles)
    assert (kalman > 0.97).sum() == 2


def test_how_wrong_the_model_may_be(results):
    small, large, kalman = (
        results.linear[name] for name in ("observer, small Q", "observer, large Q", "Kalman")
    )
    assert small.motor[0] < 0.7
    assert small.lever > 1.7
    assert large.motor[1] < 1.5
    assert large.inertia[0] > 0.65
    assert 0.18 < small.common < 0.22
    assert 0.17 < large.common < 0.21
    assert kalman.common > 0.25


def test_what_a_large_q_costs(results):
    small, large = results.linear["observer, small Q"], results.linear["observer, large Q"]
    assert 5.0 < large.noise[1] / small.noise[1] < 8.0
    assert large.noise[0] < small.noise[0]
    assert results.fallen["observer, large Q"] >= 20.0


def test_what_cures(results):
    together = {name: math.degrees(one["together"].tilt) for name, one in results.swings.items()}
    assert together["observer, small Q"] > 0.3
    assert together["observer, large Q"] > 0.15
    assert max(together[name] for name in OBSERVERS[2:]) < 0.06
    bias = {name: abs(one["bias 1 °/s"].slip) for name, one in results.swings.items()}
    assert bias["Kalman"] > 70.0
    assert bias["Kalman, bias"] < 3.0
    offset = {name: abs(one["offset 1°"].slip) for name, one in results.swings.items()}
    assert offset["complementary, first order"] > 80.0
    assert max(offset[name] for name in OBSERVERS) < 1.0


def test_the_accelerometer_adds_nothing_here(results):
    for what in edge_study.SCENARIOS:
        with_it, without = (results.swings[name][what] for name in ("Kalman, accelerometer", "Kalman"))
        assert with_it.tilt == pytest.approx(without.tilt, rel=0.03)


def test_what_the_rates_cannot_tell(results):
    said = results.refusals
    assert said["torque on the body"] == "(A, C) must be observable: C does not see the mode 1"
    assert all(text.startswith("accepted") for name, text in said.items() if name != "torque on the body")


def test_that_model_is_unobservable_by_its_null_vector():
    """A tilt and the lean that undoes it: x(k+1) = x(k), and both rates are 0."""
    model = edge_designs.with_lean(edge_designs.plain())
    v = np.array([1.0, 0.0, 0.0, -1.0])
    np.testing.assert_allclose(model.A @ v, v, atol=1e-12)
    np.testing.assert_array_equal(model.C @ v, 0.0)


def test_pi_form_is_the_kalman_filter_without_a_plant():
    """In the limit of a small period, from the same noises."""
    A, R = np.array([[1.0, edge_cube.T], [0.0, 1.0]]), (edge_cube.ACCELEROMETER_NOISE / GRAVITY) ** 2
    Q = np.diag([(edge_cube.GYRO_NOISE * edge_cube.T) ** 2, edge_cube.BIAS_WALK**2])
    P = linalg.solve_discrete_are(A.T, np.eye(2, 1), Q, [[R]])
    L = A @ P[:, :1] / (P[0, 0] + R)
    np.testing.assert_allclose(L[:, 0] / edge_cube.T, edge_designs.pi_from_noise().coefficients, rtol=0.01)


def test_the_figure(results, folder):
    path = folder / "observer.png"
    height, width, _ = image.imread(path).shape
    assert results
    assert (width, height) == (1000, 1100)
    assert path.stat().st_size < 150_000
