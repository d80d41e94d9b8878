"""Poles and frequency responses against scipy, the reference, and the filters' own answers."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.polynomial import polypow
from scipy import signal

import compfilt as cf
import reference as ref
from designs import all_cases, all_linear_cases, all_matched, all_plain

OMEGA = np.logspace(-2, 3, 60)
FS = 20.0
BELOW_NYQUIST = OMEGA[math.pi * FS > OMEGA]


def check_close(got, expected, tolerance):
    np.testing.assert_allclose(got, expected, rtol=0, atol=tolerance)


# --------------------------------------------------------------------------------------------------------------- poles


@all_plain
@settings(max_examples=10)
@given(exponent=st.floats(-2, 2))
def test_poles_are_the_roots_of_the_coefficients(case, exponent):
    """As polynomials, since multiple roots are ill-conditioned: they have half the digits."""
    design = case.make(10**exponent)
    poles = design.poles
    assert poles.shape == (design.order,)
    assert poles.dtype == complex
    np.testing.assert_allclose(np.poly(poles), [1.0, *design.coefficients], rtol=1e-6, atol=0)


@pytest.mark.parametrize("order", range(1, 7))
def test_poles_of_butterworth_are_numpys_roots(order):
    design = cf.Butterworth(3.0, order)
    got, expected = np.sort_complex(design.poles), np.sort_complex(np.roots([1.0, *design.coefficients]))
    np.testing.assert_allclose(got.round(9), expected.round(9), atol=1e-8)
    np.testing.assert_allclose(np.abs(design.poles), 3.0, rtol=1e-12)


@all_plain
def test_poles_are_stable_and_come_in_exact_pairs(case):
    poles = case.design.poles
    assert (poles.real < 0).all()
    complex_poles = poles[poles.imag != 0]
    assert set(complex_poles.conj()) == set(complex_poles)


@pytest.mark.parametrize("poles", [[-1.0, -2.0], [-0.1, -5.0, -40.0], [-1.0, -3.0, -9.0, -27.0]])
def test_slowest_pole_comes_first(poles):
    np.testing.assert_allclose(cf.Chain(np.poly(poles)[1:]).poles, poles, rtol=1e-9)


@all_plain
def test_coefficients_are_the_references(case):
    for speed in (0.01, 3.0, 100.0):
        np.testing.assert_allclose(
            case.make(speed).coefficients, case.reference(speed).coefficients, rtol=1e-13
        )


# ------------------------------------------------------------------------------------------------------ continuous pair


@all_plain
@pytest.mark.parametrize("speed", [0.1, 3.0, 50.0])
def test_continuous_response_is_the_references(case, speed):
    low, high = case.make(speed).frequency_response(OMEGA)
    expected_low, expected_high = ref.continuous_response(case.reference(speed), OMEGA)
    check_close(low, expected_low, 1e-12)
    check_close(high, expected_high, 1e-12)


@all_plain
def test_continuous_response_is_scipys(case):
    design = case.design
    polynomial = np.array([1.0, *design.coefficients])
    above = np.arange(design.order, -1, -1) >= design.split
    low, high = design.frequency_response(OMEGA)
    check_close(low, signal.freqs(np.where(above, 0.0, polynomial), polynomial, OMEGA)[1], 1e-12)
    check_close(high, signal.freqs(np.where(above, polynomial, 0.0), polynomial, OMEGA)[1], 1e-12)


@pytest.mark.parametrize("order", range(1, 7))
def test_split_of_one_is_scipys_butterworth_low_pass_and_split_of_order_its_high_pass(order):
    low, _ = cf.Butterworth(3.0, order, split=1).frequency_response(OMEGA)
    check_close(low, signal.freqs(*signal.butter(order, 3.0, analog=True), OMEGA)[1], 1e-12)
    _, high = cf.Butterworth(3.0, order).frequency_response(OMEGA)
    check_close(high, signal.freqs(*signal.butter(order, 3.0, "high", analog=True), OMEGA)[1], 1e-12)


@all_plain
def test_ends_of_the_frequency_axis(case):
    low, high = case.design.frequency_response([0.0, 1e9])
    check_close(low, [1, 0], 1e-7)
    check_close(high, [0, 1], 1e-7)


def test_half_at_the_corner_of_the_first_order():
    low, high = cf.FirstOrder(0.5).frequency_response(2.0)
    assert low == 0.5 - 0.5j
    assert high == 0.5 + 0.5j


# -------------------------------------------------------------------------------------------------------- discrete pair


@all_cases
@settings(max_examples=5)
@given(speed=st.floats(0.1, 20.0), samples=st.floats(2.0, 100.0))
def test_discrete_response_is_the_references(case, speed, samples):
    """Multiple poles cost the reference half its digits in the matched rule; at the Nyquist frequency the integral is zero."""
    fs = speed * samples
    omega = np.geomspace(0.01 * speed, 0.8 * math.pi * fs, 25)
    low, high = case.make(speed).frequency_response(omega, fs=fs, rule=case.rule)
    expected_low, expected_high = ref.discrete_response(case.reference(speed), omega, 1 / fs, rule=case.rule)
    check_close(low, expected_low, 1e-6)
    check_close(high, expected_high, 1e-6)
    check_close(low + high, 1, 1e-7)


def in_delays(polynomial, step):
    """T^N p((1 - q)/T) as a polynomial in q = 1/z, lowest power first; p highest power first."""
    order = len(polynomial) - 1
    total = np.zeros(order + 1)
    for power, coefficient in enumerate(polynomial[::-1]):
        total[: power + 1] += coefficient * step ** (order - power) * polypow([1.0, -1.0], power)
    return total


@all_plain
def test_backward_euler_response_is_scipys(case):
    design = case.design
    polynomial = np.array([1.0, *design.coefficients])
    above = np.arange(design.order, -1, -1) >= design.split
    bottom = in_delays(polynomial, 1 / FS)
    low, high = design.frequency_response(BELOW_NYQUIST, fs=FS)
    for got, kept in ((low, ~above), (high, above)):
        top = in_delays(np.where(kept, polynomial, 0.0), 1 / FS)
        _, expected = signal.freqz(top, bottom, BELOW_NYQUIST, fs=2 * math.pi * FS)
        check_close(got, expected, 1e-8)


def transform(impulse_response, omega):
    """The discrete-time Fourier transform at omega."""
    return np.exp(-1j * np.outer(omega, np.arange(len(impulse_response))) / FS) @ impulse_response


@all_linear_cases
def test_response_is_what_the_filter_does(case):
    """The impulse response from y is the low-pass; from u it is the high-pass of the open loop's."""
    design, count = case.make(3.0), 6000
    omega = np.linspace(0.2, 60.0, 12)
    impulse, nothing = np.zeros(count), np.zeros(count)
    impulse[0] = 1.0
    keywords = {"fs": FS, "rule": case.rule, "initial": 0.0}
    low, high = design.frequency_response(omega, fs=FS, rule=case.rule)
    check_close(transform(design.filter(impulse, nothing, **keywords), omega), low, 1e-9)
    order = design.derivative_order
    back = np.exp(-1j * omega / FS)
    # M integrations of u: by sums, or exactly for a constant input between samples (Eulerian polynomials).
    numerator = {1: [1], 2: [1, 1], 3: [1, 4, 1], 4: [1, 11, 11, 1]}[order] if case.rule == "matched" else [1]
    gain = np.polyval(numerator[::-1], back) / (math.factorial(order) if case.rule == "matched" else 1)
    open_loop = gain / ((1 - back) * FS) ** order
    check_close(transform(design.filter(nothing, impulse, **keywords), omega) / open_loop, high, 1e-8)


@all_matched
def test_matched_response_tends_to_the_continuous_one_faster_or_as_fast(case):
    """Both tend to it as the sample rate rises."""
    expected = case.design.frequency_response([0.5, 3.0])
    errors = []
    for fs in (100.0, 400.0):
        got = case.design.frequency_response([0.5, 3.0], fs=fs, rule=case.rule)
        errors.append(np.abs(np.subtract(got, expected)).max())
    assert errors[1] < 0.3 * errors[0] < 0.1


def test_rate_filter_responds_as_the_first_order():
    """Its high branch is the gyro's, its low branch the integral's."""
    for fs in (None, FS):
        got = cf.RateFilter(0.5).frequency_response(BELOW_NYQUIST, fs=fs)
        check_close(got, cf.FirstOrder(0.5).frequency_response(BELOW_NYQUIST, fs=fs), 1e-12)


def test_drift_free_pair_of_the_rate_filter():
    assert cf.RateFilter(0.5).drift_free == cf.FirstOrder(0.5)


# --------------------------------------------------------------------------------------------------------------- shapes


@pytest.mark.parametrize("shape", [(), (0,), (1,), (5,), (2, 3), (2, 0), (2, 3, 4)])
@pytest.mark.parametrize("fs", [None, FS])
def test_response_is_shaped_like_omega(shape, fs):
    omega = np.random.default_rng(1).uniform(0.1, 10.0, shape)
    low, high = cf.PiForm(2.0, 1.0).frequency_response(omega, fs=fs)
    for branch, index in ((low, 0), (high, 1)):
        assert branch.shape == shape
        assert branch.dtype == complex
        flat = cf.PiForm(2.0, 1.0).frequency_response(omega.ravel(), fs=fs)[index]
        np.testing.assert_array_equal(branch.ravel(), flat)


@pytest.mark.parametrize("dtype", [np.float32, np.int64, ">f8"])
def test_omega_of_other_dtypes_and_layouts(dtype):
    omega = np.arange(1, 9).astype(dtype)[::2]
    got = cf.PiForm(2.0, 1.0).frequency_response(omega)
    np.testing.assert_array_equal(got, cf.PiForm(2.0, 1.0).frequency_response([1.0, 3.0, 5.0, 7.0]))


def test_negative_frequencies_are_the_conjugate():
    low, high = cf.ThirdOrder(0.5).frequency_response([-2.0, 2.0], fs=FS)
    assert low[0] == low[1].conjugate()
    assert high[0] == high[1].conjugate()
