"""Systems of SciPy and python-control: the filter's output from their own simulations, and the way back."""

import math
import sys

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

import compfilt as cf
import reference as ref
from compfilt.interop import from_scipy, of_design, recognise
from designs import MATCHED, PLAIN, all_cases, random_signals

LINEAR = [case for case in PLAIN + MATCHED if not case.is_rate]
CASES = st.sampled_from(LINEAR)
SPEEDS = st.floats(-3.0, 3.0).map(lambda exponent: 10.0**exponent)
SHARES = st.floats(-3.0, -0.5).map(lambda exponent: 10.0**exponent)


def input_of(design, rows=400):
    """Signals of sizes that suit the design: the derivative is in units per s^M."""
    measurement, derivative = random_signals(rows)
    speed = design.coefficients[-1] ** (1 / design.order)
    return measurement, derivative * speed**design.derivative_order


def start_of(design):
    """An initial state as the filter takes it and as the system does."""
    if isinstance(design, cf.RateFilter):
        return 0.7, [0.0, 0.7]
    speed = design.coefficients[-1] ** (1 / design.order)
    levels = [(-1.3) ** (i + 1) * speed**i for i in range(design.order)]
    return levels, levels


# ------------------------------------------------------------------------------------------------------- to a library


@all_cases
@pytest.mark.parametrize("share", [0.003, 0.3])
def test_simulated_by_scipy(case, share):
    """The discrete system gives the filter's output to rounding, from any start."""
    design = case.make(3.0)
    fs = 3.0 / share
    measurement, derivative = input_of(design)
    initial, state = start_of(design)
    system = design.to_scipy(fs=fs, rule=case.rule)
    assert isinstance(system, signal.dlti)
    assert system.dt == 1.0 / fs
    _, output, _ = signal.dlsim(system, np.column_stack((measurement, derivative)), x0=state)
    expected = design.filter(measurement, derivative, fs=fs, rule=case.rule, initial=initial)
    np.testing.assert_allclose(output[:, 0], expected, atol=1e-13 * np.abs(expected).max())


@all_cases
def test_simulated_by_control(case):
    """All levels, with their names."""
    design = case.design
    measurement, derivative = input_of(design)
    initial, state = start_of(design)
    system = design.to_control(fs=50.0, rule=case.rule, all_levels=True)
    assert tuple(system.output_labels) == design.level_names
    assert system.input_labels == ["measurement", "derivative"]
    response = control.forced_response(
        system, inputs=np.vstack((measurement, derivative)), initial_state=state
    )
    levels = design.estimate(measurement, derivative, fs=50.0, rule=case.rule, initial=initial).levels
    for got, expected in zip(response.outputs, levels, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-12 * np.abs(expected).max())


@all_cases
def test_continuous_matrices_are_the_references(case):
    design = case.design
    system = design.to_scipy(all_levels=True)
    assert isinstance(system, signal.lti)
    if case.is_rate:
        return
    _, inputs, gains = ref.matrices(case.reference(3.0))
    np.testing.assert_allclose(system.A, ref.closed_loop(case.reference(3.0)), rtol=1e-12)
    np.testing.assert_allclose(system.B, np.column_stack((gains, inputs)), rtol=1e-12)
    np.testing.assert_array_equal(system.C, np.eye(design.order))
    assert not system.D.any()


@all_cases
def test_continuous_response(case):
    """From each input, through python-control: the pair of `frequency_response`."""
    design = case.design
    omega = np.geomspace(0.3, 30.0, 30)
    response = design.to_control().frequency_response(omega).complex[0]
    low, high = design.frequency_response(omega)
    integrated = response[1] * (1j * omega) ** design.derivative_order
    # The rate filter's high-pass takes its measurement.
    got = (integrated, response[0]) if case.is_rate else (response[0], integrated)
    np.testing.assert_allclose(got[0], low, rtol=1e-9)
    np.testing.assert_allclose(got[1], high, rtol=1e-9)


@pytest.mark.parametrize("case", [case for case in PLAIN if not case.is_rate], ids=lambda case: case.name)
def test_backward_euler_is_scipys(case):
    """SciPy's own backward difference of the continuous system has the same responses."""
    design = case.design
    omega = np.geomspace(0.3, 30.0, 30)
    ours = design.to_control(fs=50.0).frequency_response(omega).complex
    system = design.to_scipy().to_discrete(0.02, method="backward_diff")
    theirs = control.ss(system.A, system.B, system.C, system.D, 0.02).frequency_response(omega).complex
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


def test_poles_and_order_of_the_states():
    design = cf.ThirdOrder.butterworth(2.0)
    system = design.to_control()
    assert tuple(system.state_labels) == design.level_names
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.sort_complex(design.poles), rtol=1e-9)


def an_observer(**keywords):
    rng = np.random.default_rng(5)
    A = np.array([[1.0, 0.1, 0.0], [0.0, 0.9, 0.1], [0.2, 0.0, 0.7]])
    return cf.Observer(
        A, rng.normal(size=(3, 1)), rng.normal(size=(2, 3)), 0.1 * rng.normal(size=(3, 2)), **keywords
    )


@pytest.mark.parametrize("output", ["filtered", "predicted"])
def test_observer(output):
    observer = an_observer()
    rng = np.random.default_rng(6)
    y, u = rng.normal(size=(200, 2)), rng.normal(size=(200, 1))
    start = [1.0, -2.0, 0.5]
    system = observer.to_scipy(fs=20.0, output=output)
    _, got, _ = signal.dlsim(system, np.hstack((y, u)), x0=start)
    predicted, filtered = observer.run(y, u, initial=start)
    np.testing.assert_allclose(got, predicted if output == "predicted" else filtered, rtol=1e-11, atol=1e-12)
    named = observer.to_control(fs=20.0, output=output)
    assert named.input_labels == ["y0", "y1", "u0"]
    assert named.output_labels == [f"x{i}_{output}" for i in range(3)]
    np.testing.assert_array_equal(named.A, system.A)


def test_observer_without_a_sample_rate():
    assert an_observer().to_scipy().dt is True
    assert an_observer().to_control().dt is True


# ------------------------------------------------------------------------------------------------------ from a library


def assert_same_chain(chain, design, rtol=1e-7):
    np.testing.assert_allclose(chain.coefficients, design.coefficients, rtol=rtol)
    assert (chain.derivative_order, chain.split) == (design.derivative_order, design.split)


@settings(max_examples=200, deadline=None)
@given(case=CASES, speed=SPEEDS, share=st.none() | SHARES)
def test_round_trip_through_scipy(case, speed, share):
    """Continuous or discrete, of every order, split and rule."""
    design = case.make(speed)
    fs = None if share is None else speed / share
    chain = cf.Chain.from_scipy(design.to_scipy(fs=fs, rule=case.rule), rule=case.rule)
    assert_same_chain(chain, design)


@settings(max_examples=50, deadline=None)
@given(case=CASES, speed=SPEEDS, share=st.none() | SHARES)
def test_round_trip_through_control(case, speed, share):
    design = case.make(speed)
    fs = None if share is None else speed / share
    system = design.to_control(fs=fs, rule=case.rule, all_levels=True)
    assert_same_chain(cf.Chain.from_control(system, rule=case.rule), design)


@settings(max_examples=50, deadline=None)
@given(case=CASES, speed=SPEEDS, seed=st.integers(0, 1000))
def test_states_may_be_any(case, speed, seed):
    """Other coordinates of the state are the same system."""
    design = case.make(speed)
    system = design.to_scipy()
    units = speed ** np.arange(design.order)
    turn = units[:, None] * np.linalg.qr(np.random.default_rng(seed).normal(size=2 * (design.order,)))[0]
    turned = np.linalg.solve(turn, system.A @ turn), np.linalg.solve(turn, system.B), system.C @ turn
    assert_same_chain(cf.Chain.from_scipy(signal.StateSpace(*turned, system.D)), design)


@pytest.mark.parametrize("case", [case for case in PLAIN if not case.is_rate], ids=lambda case: case.name)
def test_low_pass_alone(case):
    """As a transfer function, of both libraries."""
    design = case.design
    denominator = [1.0, *design.coefficients]
    numerator = denominator[design.order + 1 - design.split :]
    for chain in (
        cf.Chain.from_scipy(
            signal.TransferFunction(numerator, denominator), derivative_order=design.derivative_order
        ),
        cf.Chain.from_control(
            control.TransferFunction(numerator, denominator), derivative_order=design.derivative_order
        ),
    ):
        assert_same_chain(chain, design)


def test_a_butterworth_of_scipy_is_the_split_1():
    chain = cf.Chain.from_scipy(signal.lti(*signal.butter(4, 2.0, analog=True)))
    assert_same_chain(chain, cf.Butterworth(2.0, order=4, split=1))


@settings(max_examples=200, deadline=None)
@given(case=CASES, entry=st.integers(0, 1), by=st.floats(1e-3, 0.5))
def test_a_little_else_is_no_chain(case, entry, by):
    """A branch that is a thousandth too strong is found."""
    system = case.design.to_scipy()
    system.B[:, entry] *= 1.0 + by
    with pytest.raises(ValueError, match=r"^system must "):
        cf.Chain.from_scipy(system)


@pytest.mark.parametrize(
    ("system", "reason"),
    [
        (signal.TransferFunction([2.0], [1.0, 1.0]), "constant measurement unchanged, its gain is 2$"),
        (signal.TransferFunction([1.0, 1.0], [1.0, 3.0, 1.0]), "last terms of its denominator"),
        (signal.TransferFunction([1.0], [1.0, -1.0]), r"stable, it has a pole at 1 rad/s$"),
        (signal.TransferFunction([1.0], [1.0, -1.0, 1.0]), r"stable, it has a pole at 0.5.0.866025j rad/s$"),
        (signal.TransferFunction([1.0], np.poly([-1.0] * 7)), "1 to 6 states, got 7"),
        (signal.StateSpace([[-1.0]], [[1.0, 0.5]], [[1.0]], [[0.0, 0.0]]), "branches must sum to 1"),
        (signal.StateSpace([[-1.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.1]]), "branches must sum to 1"),
        (signal.StateSpace([[-1.0]], [[1.0] * 3], [[1.0]], [[0.0] * 3]), "one input, .*, got 3"),
        (signal.StateSpace([[math.nan]], [[1.0]], [[1.0]], [[0.0]]), "finite"),
        (signal.StateSpace([[0.5]], [[0.5]], [[1.0]], [[0.0]], dt=True), "state its sample period"),
        (signal.StateSpace([[0.0]], [[1.0]], [[1.0]], [[0.0]], dt=0.1), "not have a pole at z = 0"),
        # A forward step: the measurement acts one sample late.
        (signal.StateSpace([[0.9]], [[0.1]], [[1.0]], [[0.0]], dt=0.1), "by the rule that is given"),
        (cf.RateFilter(1.0).to_scipy(), "stable, it has a pole at 0 rad/s"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_no_chain(system, reason):
    with pytest.raises(ValueError, match=f"^system must .*{reason}"):
        cf.Chain.from_scipy(system)


def test_the_other_rule_is_found_out():
    """Where it can be: with derivative order 1 both rules have the same responses for the same discrete poles."""
    system = cf.ThirdOrder(1.0).to_scipy(fs=5.0)
    with pytest.raises(ValueError, match="by the rule that is given"):
        cf.Chain.from_scipy(system, rule="matched")


def test_a_derivative_order_that_does_not_fit():
    system = cf.ThirdOrder(1.0).to_scipy()
    with pytest.raises(ValueError, match="must sum to 1"):
        cf.Chain.from_scipy(system, derivative_order=1)
    with pytest.raises(ValueError, match="derivative_order"):
        cf.Chain.from_scipy(system, derivative_order=4)


@pytest.mark.parametrize("method", ["from_scipy", "from_control"])
def test_other_objects(method):
    with pytest.raises(TypeError, match=r"^system must be a .*, got list$"):
        getattr(cf.Chain, method)([1.0])


def test_wrong_arguments():
    design = cf.FirstOrder(1.0)
    with pytest.raises(ValueError, match=r"^fs must be positive"):
        design.to_scipy(fs=-1.0)
    with pytest.raises(ValueError, match=r"^rule must be"):
        design.to_scipy(rule="tustin")
    with pytest.raises(ValueError, match=r"split = order|split"):
        cf.Butterworth(1.0, split=1).to_scipy(fs=10.0, rule="matched")
    with pytest.raises(ValueError, match=r"^rule must be"):
        cf.Chain.from_scipy(design.to_scipy(), rule="tustin")
    with pytest.raises(ValueError, match=r"^fs must be positive and finite, not 0$"):
        an_observer().to_scipy(fs=0.0)
    with pytest.raises(ValueError, match=r"^output must be"):
        an_observer().to_scipy(output="both")


def test_an_observer_without_filtered_estimate():
    observer = cf.Observer([[0.0, 1.0], [0.0, 0.0]], np.zeros((2, 0)), [[1.0, 0.0]], [[0.0], [0.5]])
    with pytest.raises(ValueError, match="output must be 'predicted'"):
        observer.to_scipy()
    assert observer.to_scipy(output="predicted").B.tolist() == [[0.0], [0.5]]


@pytest.mark.parametrize(
    ("library", "method", "how"),
    [("scipy", "to_scipy", r"compfilt\[design\]"), ("control", "to_control", "pip install control")],
)
def test_a_library_that_is_missing(monkeypatch, library, method, how):
    monkeypatch.setitem(sys.modules, {"scipy": "scipy.signal"}.get(library, library), None)
    with pytest.raises(ImportError, match=f"^{library} is not installed: .*{how}"):
        getattr(cf.FirstOrder(1.0), method)()


def test_recognised_without_an_object():
    """The parts that the methods are made of."""
    chain = recognise(from_scipy(cf.PiForm(2.0, 1.0).to_scipy()))
    assert_same_chain(chain, cf.PiForm(2.0, 1.0))
    assert of_design(chain).states == ("angle", "minus_bias")


def test_a_derivative_order_of_none_is_not_one():
    with pytest.raises(ValueError, match="derivative_order"):
        recognise(of_design(cf.FirstOrder(1.0)), derivative_order=0)
