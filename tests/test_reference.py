"""The reference against closed forms, and SPEC's closed forms against the reference."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import reference as ref

DESIGNS = {
    "first order": ref.first_order(0.7),
    "pi": ref.pi_form(2.0, 1.5),
    "butterworth 2, q 0.1": ref.butterworth(3.0, 2, q=0.1),
    "butterworth 2": ref.butterworth(3.0),
    "butterworth 3": ref.butterworth(3.0, 3),
    "butterworth 4": ref.butterworth(3.0, 4),
    "butterworth 6": ref.butterworth(3.0, 6),
    "third order": ref.third_order(0.6),
    "third order butterworth": ref.third_order_butterworth(2.0),
    "inertial": ref.second_order_inertial(0.6),
    "inertial butterworth": ref.second_order_inertial_butterworth(2.0),
    "chain 4, 3": ref.chain((6.0, 13.0, 12.0, 4.0), derivative_order=3),
}
SPLITS = {f"split {n}, {m}": ref.butterworth(3.0, n, split=m) for n in (2, 3, 4, 5) for m in range(1, n)}
ALL = {**DESIGNS, **SPLITS}

designs = pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS.keys())
all_designs = pytest.mark.parametrize("design", ALL.values(), ids=ALL.keys())
steps = pytest.mark.parametrize("dt", [0.001, 0.05, 0.8])


def signals(count, seed=1):
    rng = np.random.default_rng(seed)
    return rng.normal(size=count), rng.normal(size=count), rng.uniform(0.002, 0.2, count)


def error_transition(gain, phi):
    """(I - L C) phi."""
    return phi - np.outer(gain, phi[0])


# ---------------------------------------------------------------------------------------------------------- continuous


@pytest.mark.parametrize(
    ("design", "coefficients"),
    [
        (ref.first_order(0.5), (2.0,)),
        (ref.pi_form(3.0, 4.0), (3.0, 4.0)),
        (ref.butterworth(3.0), (math.sqrt(2) * 3, 9.0)),
        (ref.butterworth(3.0, 2, q=0.1), (math.sqrt(2) * 3 / 0.1, 9.0)),
        (ref.butterworth(3.0, 3), (6.0, 18.0, 27.0)),
        (ref.third_order(0.5), (6.0, 12.0, 8.0)),
        (ref.third_order_butterworth(3.0), (6.0, 18.0, 27.0)),
        (ref.second_order_inertial(0.5), (4.0, 4.0)),
        (ref.second_order_inertial_butterworth(3.0), (math.sqrt(2) * 3, 9.0)),
    ],
)
def test_coefficients(design, coefficients):
    assert_allclose(design.coefficients, coefficients, rtol=1e-14)


@pytest.mark.parametrize("order", range(1, 9))
def test_butterworth_poles_lie_evenly_on_the_circle(order):
    angles = math.pi * (2 * np.arange(1, order + 1) + order - 1) / (2 * order)
    expected = np.poly(3.0 * np.exp(1j * angles)).real
    assert_allclose(ref.butterworth(3.0, order).polynomial, expected, rtol=1e-13)


@all_designs
def test_state_space_has_the_poles_and_the_two_responses(design):
    _, B, kappa = ref.matrices(design)
    A = ref.closed_loop(design)
    assert_allclose(np.poly(A), design.polynomial, rtol=1e-9)
    for omega in (0.1, 2.0, 30.0):
        s = 1j * omega
        inside = s * np.eye(design.order) - A
        low = np.linalg.solve(inside, kappa)[0]
        high = np.linalg.solve(inside, B)[0] * s**design.derivative_order
        assert_allclose([low, high], ref.continuous_response(design, omega), rtol=1e-10, atol=1e-14)
        assert_allclose(low + high, 1, rtol=1e-12)


@pytest.mark.parametrize("design", SPLITS.values(), ids=SPLITS.keys())
def test_steady_error_of_a_biased_derivative(design):
    """It is a_1/a_0 for split 1, and none otherwise."""
    _, B, _ = ref.matrices(design)
    error = np.linalg.solve(-ref.closed_loop(design), B)[0]
    expected = design.ascending[1] / design.ascending[0] if design.degree == 1 else 0.0
    assert_allclose(error, expected, atol=1e-12)


# ------------------------------------------------------------------------------------------------------- discrete gains


@steps
@pytest.mark.parametrize("tau", [0.01, 0.5, 40.0])
def test_step_response_of_the_first_order(tau, dt):
    count = 60
    x = ref.run(ref.first_order(tau), np.ones(count), np.zeros(count), dt)[0]
    assert_allclose(x, 1 - (tau / (tau + dt)) ** np.arange(1, count + 1), rtol=1e-9)
    x = ref.run(ref.first_order(tau), np.ones(count), np.zeros(count), dt, rule="matched")[0]
    assert_allclose(x, -np.expm1(-np.arange(1, count + 1) * dt / tau), rtol=1e-9)


@steps
@all_designs
def test_poles_by_backward_euler(design, dt):
    """Exactly 1/(1 - T p)."""
    phi = ref.transition(design, dt, "backward_euler")[0]
    got = np.poly(error_transition(ref.step_gain(design, dt), phi))
    assert_allclose(got, np.poly(1 / (1 - design.poles * dt)).real, atol=1e-10)


@steps
@designs
def test_poles_matched(design, dt):
    """Exactly e^(pT)."""
    phi = ref.transition(design, dt, "matched")[0]
    got = np.poly(error_transition(ref.step_gain(design, dt, "matched"), phi))
    assert_allclose(got, np.poly(np.exp(design.poles * dt)).real, atol=1e-10)


def spec_backward_euler(design, dt):
    """g_N = T k_N, g_i = T (k_i + g_(i+1)), L_i = g_i/(1 + g_1)."""
    g = 0.0
    gains = []
    for k in reversed(design.coefficients):
        g = dt * (k + g)
        gains.append(g)
    return np.array(gains[::-1]) / (1 + g)


@steps
@designs
def test_spec_gains_by_backward_euler(design, dt):
    assert_allclose(ref.step_gain(design, dt), spec_backward_euler(design, dt), rtol=1e-10)


@steps
@designs
def test_spec_prediction_by_backward_euler(design, dt):
    """From the top level down: x_i + T (x_(i+1) + [i = M-1] u)."""
    x = np.random.default_rng(3).normal(size=design.order)
    phi, (_, column), _ = ref.transition(design, dt, "backward_euler")
    expected = np.append(x, 0.0)
    for i in reversed(range(design.order)):
        u = 0.7 if i == design.derivative_order - 1 else 0.0
        expected[i] = x[i] + dt * (expected[i + 1] + u)
    assert_allclose(phi @ x + column * 0.7, expected[:-1], rtol=1e-12, atol=1e-14)


@steps
def test_spec_gains_of_pi(dt):
    kp, ki = 2.0, 1.5
    bottom = 1 + dt * kp + dt**2 * ki
    expected = [(dt * kp + dt**2 * ki) / bottom, dt * ki / bottom]
    assert_allclose(ref.step_gain(ref.pi_form(kp, ki), dt), expected, rtol=1e-12)


@steps
def test_spec_gains_matched(dt):
    one = ref.first_order(0.7)
    assert_allclose(ref.step_gain(one, dt, "matched"), [1 - math.exp(-dt / 0.7)], rtol=1e-12)
    for two in (ref.pi_form(2.0, 1.5), ref.second_order_inertial(0.6), ref.butterworth(3.0)):
        z1, z2 = np.exp(two.poles * dt)
        expected = [1 - (z1 * z2).real, ((1 - z1) * (1 - z2)).real / dt]
        assert_allclose(ref.step_gain(two, dt, "matched"), expected, rtol=1e-10)
    for three in (ref.butterworth(3.0, 3), ref.third_order(0.6)):
        z = np.exp(three.poles * dt)
        e1, e2, e3 = np.poly(z).real[1:] * [-1, 1, -1]
        expected = [1 - e3, (3 - e1 - e2 + 3 * e3) / (2 * dt), np.prod(1 - z).real / dt**2]
        assert_allclose(ref.step_gain(three, dt, "matched"), expected, rtol=1e-6, atol=1e-13 / dt**2)


@steps
@pytest.mark.parametrize("derivative_order", [1, 2, 3])
def test_spec_inputs_matched(dt, derivative_order):
    """T^j/j! for a constant input, and T^j/(j+1)! for a ramp's rise, with j = M - i."""
    design = ref.chain((6.0, 13.0, 12.0, 4.0), derivative_order)
    _, (_, hold), (before, now) = ref.transition(design, dt, "matched")
    expected, rise = np.zeros(4), np.zeros(4)
    for i in range(derivative_order):
        j = derivative_order - i
        expected[i] = dt**j / math.factorial(j)
        rise[i] = dt**j / math.factorial(j + 1)
    assert_allclose(hold, expected, rtol=1e-12, atol=1e-15)
    assert_allclose(now, rise, rtol=1e-9, atol=1e-15)
    assert_allclose(before + now, hold, rtol=1e-12, atol=1e-15)


@steps
def test_spec_split_of_order_two(dt):
    """z- = z/(1 + a1 T), x- = x + T (u + z-), G = T a0/(1 + a1 T), r = e/(1 + T G), x = x- + T G r, z = z- + G r."""
    design = ref.butterworth(3.0, 2, split=1)
    a1, a0 = design.coefficients
    y, u, _ = signals(50)
    x = z = 0.0
    expected = []
    for yn, un in zip(y, u, strict=True):
        z_minus = z / (1 + a1 * dt)
        x_minus = x + dt * (un + z_minus)
        G = dt * a0 / (1 + a1 * dt)
        r = (yn - x_minus) / (1 + dt * G)
        x, z = x_minus + dt * G * r, z_minus + G * r
        expected.append((x, z))
    assert_allclose(ref.run(design, y, u, dt), np.array(expected).T, rtol=1e-10, atol=1e-12)


@all_designs
def test_one_step_equals_predict_and_correct(design):
    """The closed loop solved at once is x- + L e."""
    y, u, dt = signals(40)
    state = np.zeros(design.order)
    got = ref.run(design, y, u, dt)
    for n in range(len(y)):
        phi, (_, column), _ = ref.transition(design, dt[n], "backward_euler")
        state = phi @ state + column * u[n]
        state = state + ref.step_gain(design, dt[n]) * (y[n] - state[0])
        assert_allclose(got[:, n], state, rtol=1e-8, atol=1e-9)


# ---------------------------------------------------------------------------------------------------------------- gaps


@pytest.mark.parametrize("design", [d for d in DESIGNS.values() if d.order <= 4])
def test_gap_gain_places_the_poles(design):
    phi, tau_g = np.eye(design.order), 0.0
    for dt in (0.1, 0.03, 0.2, 0.01):
        phi = ref.transition(design, dt, "backward_euler")[0] @ phi
        tau_g += dt
    for cap in (math.inf, 0.12):
        gain = ref.gap_gain(design, phi, tau_g, gap_cap=cap)
        expected = np.poly(1 / (1 - design.poles * min(tau_g, cap))).real
        assert_allclose(np.poly(error_transition(gain, phi)), expected, atol=1e-11)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(1e-3, 0.5), min_size=1, max_size=30))
def test_spec_gap_of_order_three(gaps):
    """The gains for tau_g, and L_2 += L_3 (tau_g^2 - h)/tau_g."""
    for design in (ref.third_order(0.6), ref.butterworth(3.0, 3)):
        phi, tau_g, h = np.eye(3), 0.0, 0.0
        for dt in gaps:
            phi = ref.transition(design, dt, "backward_euler")[0] @ phi
            tau_g += dt
            h += dt * tau_g
        expected = spec_backward_euler(design, tau_g)
        expected[1] += expected[2] * (tau_g**2 - h) / tau_g
        assert_allclose(ref.gap_gain(design, phi, tau_g), expected, rtol=1e-9, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(1e-3, 0.5), min_size=1, max_size=30))
def test_spec_gap_of_lower_orders(gaps):
    """The gains of one step of tau_g."""
    for design in (ref.first_order(0.6), ref.pi_form(2.0, 1.5), ref.second_order_inertial(0.3)):
        phi = np.eye(design.order)
        for dt in gaps:
            phi = ref.transition(design, dt, "backward_euler")[0] @ phi
        expected = spec_backward_euler(design, sum(gaps))
        assert_allclose(ref.gap_gain(design, phi, sum(gaps)), expected, rtol=1e-9, atol=1e-12)


@designs
def test_matched_gap_is_one_step(design):
    """Exact prediction: several steps with the same u and one correction equal one long step."""
    y = np.full(12, np.nan)
    y[[3, 11]] = 0.5, 0.7
    u = np.full(12, 0.3)
    short = ref.run(design, y, u, 0.05, rule="matched")
    long = ref.run(design, y[[3, 11]], u[[3, 11]], [0.2, 0.4], rule="matched")
    assert_allclose(short[:, [3, 11]], long, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize(("order", "limit"), [(4, 4.5), (5, 1.1), (6, 0.53)])
def test_gains_of_one_step_are_unstable_after_long_gaps(order, limit):
    """From order 4 on the gains for tau_g do not fit a prediction in small steps."""
    design = ref.butterworth(1.0, order)
    for tau_g, stable in ((0.95 * limit, True), (1.05 * limit, False)):
        phi = np.linalg.matrix_power(ref.transition(design, tau_g / 2000, "backward_euler")[0], 2000)
        naive = np.abs(np.linalg.eigvals(error_transition(ref.step_gain(design, tau_g), phi))).max()
        placed = np.abs(np.linalg.eigvals(error_transition(ref.gap_gain(design, phi, tau_g), phi))).max()
        assert (naive < 1) == stable
        assert placed < 1


@pytest.mark.parametrize("omega_tau", [0.1, 1.0, 5.0])
def test_placing_poles_after_a_gap_harms_a_split(omega_tau):
    """A split's inner level decays during a gap; poles slower than that ask for a gain below zero. Hence the long step."""
    design = ref.butterworth(1.0, 2, split=1)
    phi = np.linalg.matrix_power(ref.transition(design, omega_tau / 100, "backward_euler")[0], 100)
    assert ref.gap_gain(design, phi, omega_tau)[0] < 0
    gain = ref.step_gain(design, omega_tau)
    assert 0 < gain[0] < 1
    assert np.abs(np.linalg.eigvals(error_transition(gain, phi))).max() < 1


split_designs = pytest.mark.parametrize("design", SPLITS.values(), ids=SPLITS.keys())


def long_steps(design, y, u, dt):
    """The same gap by hand: corrected samples only, each the end of one long step with the mean input."""
    state, start, count = np.zeros(design.order), 0, len(y)
    corrected = {}
    for n in range(count):
        if np.isnan(y[n]):
            continue
        span = slice(start, n + 1)
        tau_g = dt[span].sum()
        mean = (dt[span] * u[span]).sum() / tau_g
        state = ref.run(design, [y[n]], [mean], tau_g, initial=state)[:, 0]
        corrected[n], start = state, n + 1
    return corrected


@split_designs
def test_gap_in_a_split_is_one_long_step(design):
    """With the input's mean the gap is an ordinary sample of a longer period."""
    y, u, dt = signals(60)
    y[[3, 7, 8, 9, *range(20, 34), 40, 41]] = np.nan
    got = ref.run(design, y, u, dt)
    for n, expected in long_steps(design, y, u, dt).items():
        assert_allclose(got[:, n], expected, rtol=1e-7, atol=1e-9)


@split_designs
def test_output_within_a_gap_in_a_split_is_the_long_step_so_far(design):
    """Cutting the gap short changes nothing before the cut, and the inner levels decay as one step of tau_g."""
    _, u, dt = signals(12)
    y = np.array([0.5, *[np.nan] * 11])
    got = ref.run(design, y, u, dt)
    for n in range(1, 12):
        phi = ref.transition(design, dt[1 : n + 1].sum(), "backward_euler")[0]
        expected = phi @ got[:, 0]
        expected[0] += (dt[1 : n + 1] * u[1 : n + 1]).sum()
        assert_allclose(got[:, n], expected, rtol=1e-12, atol=1e-14)


@split_designs
def test_capped_gap_in_a_split_corrects_with_the_gains_of_the_cap(design):
    _, u, dt = signals(6)
    y = np.array([0.5, *[np.nan] * 4, 0.7])
    for cap in (0.01, 0.05):
        predicted = ref.run(design, [*y[:-1], np.nan], u, dt, gap_cap=cap)[:, -1]
        got = ref.run(design, y, u, dt, gap_cap=cap)[:, -1]
        expected = predicted + ref.step_gain(design, cap) * (0.7 - predicted[0])
        assert_allclose(got, expected, rtol=1e-9, atol=1e-11)


@split_designs
@pytest.mark.parametrize("omega_tau", [0.1, 1.0, 10.0, 100.0])
def test_long_steps_of_a_split_are_stable(design, omega_tau):
    """The poles after a gap of any length are those of one step."""
    gain = ref.step_gain(design, omega_tau / 3.0)
    phi = ref.transition(design, omega_tau / 3.0, "backward_euler")[0]
    assert np.abs(np.linalg.eigvals(error_transition(gain, phi))).max() < 1


# --------------------------------------------------------------------------------------------- complementarity in time


def difference_signals(order, dt, seed=2):
    """A random y, its M-th backward difference over the steps, and the start (differences 0 ... M-1)."""
    rng = np.random.default_rng(seed)
    start = rng.normal(size=order)
    u = rng.normal(size=len(dt))
    levels, y = start.copy(), []
    for un, step in zip(u, dt, strict=True):
        above = un
        for i in reversed(range(order)):
            levels[i] += step * above
            above = levels[i]
        y.append(levels[0])
    return np.array(y), u, start


@all_designs
def test_consistent_input_is_reproduced_by_backward_euler(design):
    dt = np.random.default_rng(4).uniform(0.001, 0.1, 80)
    y, u, start = difference_signals(design.derivative_order, dt)
    given_y = y.copy()
    given_y[[5, 6, 7, 20]] = np.nan
    initial = np.zeros(design.order)
    initial[: len(start)] = start
    got = ref.run(design, given_y, u, dt, initial=initial)
    assert_allclose(got[0], y, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("design", [d for d in DESIGNS.values() if d.order <= 4])
@pytest.mark.parametrize("input_", ["sample", "trapezoid"])
def test_consistent_input_is_reproduced_matched(design, input_):
    """u constant between samples, or linear: the exact integral is y. Higher orders are not safe under varying steps."""
    order = design.derivative_order
    rng = np.random.default_rng(6)
    dt, u = rng.uniform(0.001, 0.1, 60), rng.normal(size=60)
    levels = rng.normal(size=order)
    initial = np.zeros(design.order)
    initial[:order] = levels
    y = []
    for n in range(60):
        before = u[max(n - 1, 0)] if input_ == "trapezoid" else u[n]
        slope = (u[n] - before) / dt[n]
        moved = np.zeros(order)
        for i in range(order):
            j = order - i
            moved[i] = sum(levels[i + p] * dt[n] ** p / math.factorial(p) for p in range(j))
            moved[i] += before * dt[n] ** j / math.factorial(j)
            moved[i] += slope * dt[n] ** (j + 1) / math.factorial(j + 1)
        levels = moved
        y.append(levels[0])
    got = ref.run(design, y, u, dt, initial=initial, rule="matched", input_=input_)
    assert_allclose(got[0], y, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize(
    ("design", "rule"),
    [(d, "backward_euler") for d in ALL.values()] + [(d, "matched") for d in DESIGNS.values()],
)
@pytest.mark.parametrize("input_", ["sample", "trapezoid"])
def test_discrete_low_and_high_add_to_one(design, rule, input_):
    low, high = ref.discrete_response(design, np.array([0.3, 2.0, 20.0]), 0.05, rule=rule, input_=input_)
    if rule == "backward_euler":
        continuous = ref.transfer_polynomials(design)[0]
        s = (1 - np.exp(-1j * np.array([0.3, 2.0, 20.0]) * 0.05)) / 0.05
        assert_allclose(low, np.polyval(continuous, s) / np.polyval(design.polynomial, s), rtol=1e-9)
    assert_allclose(low + high, 1, rtol=1e-9)


@designs
def test_discrete_response_tends_to_the_continuous_one(design):
    omega = np.array([0.5, 3.0])
    got = ref.discrete_response(design, omega, 1e-4)
    assert_allclose(got, ref.continuous_response(design, omega), atol=1e-2)


# ------------------------------------------------------------------------------------------- period, delay, rate, start


def test_period_wraps_the_innovation():
    design, dt = ref.pi_form(2.0, 1.5), 0.02
    t = dt * np.arange(1, 500)
    y, u = 2.0 * t, np.full(len(t), 2.0)
    wrapped = np.remainder(y + math.pi, 2 * math.pi) - math.pi
    assert_allclose(ref.run(design, wrapped, u, dt, period=2 * math.pi)[0], y, rtol=1e-9)


def test_delay_of_whole_samples_shifts_the_compared_estimate():
    tau, dt, lag = 0.5, 0.01, 3
    y, u, _ = signals(60)
    x = [0.0]
    for n in range(60):
        predicted = x[-1] + dt * u[n]
        compared = x[max(n + 1 - lag, 0)]
        x.append(predicted + dt / (tau + dt) * (y[n] - compared))
    got = ref.run(ref.first_order(tau), y, u, dt, delay=lag * dt)[0]
    assert_allclose(got, x[1:], rtol=1e-9, atol=1e-12)


def test_no_delay_is_the_ordinary_filter():
    y, u, dt = signals(60)
    design = ref.pi_form(2.0, 1.5)
    assert_allclose(ref.run(design, y, u, dt, delay=1e-14), ref.run(design, y, u, dt), atol=1e-9)


def test_rate_filter_is_a_first_order_filter():
    """S0 (30) is the chain of order 1 with y = the integral and T u = the gyro's increment."""
    tau, dt = 0.4, 0.01
    gyro, acceleration, _ = signals(80)
    integral = 0.2 + dt * np.cumsum(acceleration)
    rate = np.diff(gyro, prepend=gyro[0]) / dt
    expected = ref.run(ref.first_order(tau), integral, rate, dt, initial=0.2)[0]
    assert_allclose(ref.rate_filter(tau, gyro, acceleration, dt, initial=0.2), expected, rtol=1e-10)


def test_start_from_the_first_finite_measurement():
    y = np.array([np.nan, np.nan, 2.0, 2.0])
    got = ref.run(ref.pi_form(2.0, 1.5), y, np.zeros(4), 0.1, initial=None)
    assert_allclose(got[0], y)
    assert_allclose(got[1, 2:], 0.0, atol=1e-15)


# ---------------------------------------------------------------------------------------------------------------- tilt


def random_angles(axes, rng):
    wide, narrow = rng.uniform(-3.1, 3.1), rng.uniform(-1.4, 1.4)
    return np.array([narrow, wide] if axes == "cube" else [wide, narrow])


@pytest.mark.parametrize("axes", ref.AXES)
def test_tilt_undoes_the_specific_force(axes):
    rng = np.random.default_rng(7)
    for _ in range(200):
        angles = random_angles(axes, rng)
        assert_allclose(ref.tilt(ref.specific_force(angles, axes), axes), angles, atol=1e-13)


def test_spec_tilt():
    rng = np.random.default_rng(8)
    for _ in range(200):
        f = rng.normal(size=3)
        length = np.linalg.norm(f)
        flu = [math.atan2(f[1], f[2]), math.atan2(-f[0], math.hypot(f[1], f[2]))]
        frd = [math.atan2(-f[1], -f[2]), math.atan2(f[0], math.hypot(f[1], f[2]))]
        cube = [-math.asin(f[2] / length), math.atan2(f[1], -f[0])]
        for axes, expected in (("flu", flu), ("frd", frd), ("cube", cube)):
            assert_allclose(ref.tilt(f, axes), expected, atol=1e-13)
        a, b = cube
        shape = [-math.cos(a) * math.cos(b), math.cos(a) * math.sin(b), -math.sin(a)]
        assert_allclose(ref.specific_force(cube, "cube", g=length), length * np.array(shape), atol=1e-13)


def test_level_at_rest():
    assert_allclose(ref.specific_force((0.0, 0.0), "flu"), [0, 0, 9.81])
    assert_allclose(ref.specific_force((0.0, 0.0), "frd"), [0, 0, -9.81])
    # Right side down is a positive roll in both; nose down is a positive pitch in flu and a negative one in frd.
    assert ref.specific_force((0.1, 0.0), "flu")[1] > 0
    assert ref.specific_force((0.1, 0.0), "frd")[1] < 0
    assert ref.specific_force((0.0, 0.1), "flu")[0] < 0
    assert ref.specific_force((0.0, 0.1), "frd")[0] > 0


@pytest.mark.parametrize("axes", ref.AXES)
def test_angle_rates_are_the_angles_derivative(axes):
    rng = np.random.default_rng(9)
    for _ in range(50):
        angles, rates = random_angles(axes, rng) * 0.8, rng.normal(size=3)
        expected = ref.angle_rates_by_difference(angles, rates, axes)
        assert_allclose(ref.angle_rates(angles, rates, axes), expected, rtol=1e-8, atol=1e-9)


def test_spec_angle_rates():
    rng = np.random.default_rng(10)
    for _ in range(100):
        p, q, r = rng.normal(size=3)
        roll, pitch = random_angles("flu", rng)
        across = q * math.sin(roll) + r * math.cos(roll)
        expected = [p + math.tan(pitch) * across, q * math.cos(roll) - r * math.sin(roll)]
        for axes in ("flu", "frd"):
            assert_allclose(ref.angle_rates((roll, pitch), (p, q, r), axes), expected, rtol=1e-9, atol=1e-12)
        phi2, phi3 = random_angles("cube", rng)
        s2, c2, s3, c3 = math.sin(phi2), math.cos(phi2), math.sin(phi3), math.cos(phi3)
        expected = [s3 * p + c3 * q, r + s2 * s3 / c2 * q - s2 * c3 / c2 * p]
        assert_allclose(ref.angle_rates((phi2, phi3), (p, q, r), "cube"), expected, rtol=1e-9, atol=1e-12)


def test_tilt_filter_follows_a_steady_turn():
    """60 degrees/s about the vertical at 40 degrees of pitch; without the conversion the error is tau psi' sin(pitch)."""
    dt, heading_rate, tau = 0.01, math.radians(60), 0.01 * 0.98 / 0.02
    angles = np.array([0.0, math.radians(40)])
    gyro = np.tile(ref.rate_matrix(angles, "flu") @ (heading_rate, 0, 0), (500, 1))
    acc = np.tile(ref.specific_force(angles, "flu"), (500, 1))
    got = ref.tilt_filter(ref.first_order(tau), gyro, acc, dt, initial=angles)
    assert_allclose(got, np.tile(angles, (500, 1)), atol=1e-12)
    unconverted = ref.run(ref.first_order(tau), np.zeros(500), gyro[:, 0], dt)[0, -1]
    assert_allclose(abs(math.degrees(unconverted)), 18.9, atol=0.05)
