"""What numbers that come in must be, and that the shared constants are those of the core."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import compfilt as cf
from compfilt import simulate
from compfilt.checks import positive, sample_rate
from compfilt.constants import HIGHEST_ORDER


@given(st.floats())
def test_only_positive_and_finite_numbers_pass(number):
    if math.isfinite(number) and number > 0.0:
        assert positive("x", number) == number
    else:
        with pytest.raises(ValueError, match=r"^x must be positive and finite, not "):
            positive("x", number)


def test_zero_passes_where_it_may():
    assert positive("x", 0, zero=True) == 0.0
    with pytest.raises(ValueError, match=r"^x must be finite and not negative, not -1$"):
        positive("x", -1.0, zero=True)


@pytest.mark.parametrize("value", [True, "1", None, [1.0]])
def test_what_is_no_number_is_named(value):
    with pytest.raises(TypeError, match=r"^x must be a number, not "):
        positive("x", value)


@pytest.mark.parametrize("rate", [1e300, 1e13, 1e-13, 1e-300])
@pytest.mark.parametrize(
    "use",
    [
        lambda rate: sample_rate("rate", rate),
        lambda rate: simulate.child_seat(duration=100.0 / rate, rate=rate),
        lambda rate: simulate.imu_log(duration=100.0 / rate, rate=rate),
    ],
    ids=["alone", "child_seat", "imu_log"],
)
def test_a_rate_that_no_sensor_has_is_refused(use, rate):
    with pytest.raises(ValueError, match=r"^rate must lie between 1e-12 and 1e\+12 Hz, not "):
        use(rate)


def test_the_highest_order_is_the_core_s():
    assert cf.Butterworth(1.0, HIGHEST_ORDER).order == HIGHEST_ORDER
    with pytest.raises(ValueError, match=f"between 1 and {HIGHEST_ORDER}"):
        cf.Butterworth(1.0, HIGHEST_ORDER + 1)
    with pytest.raises(ValueError, match=f"must be 1 to {HIGHEST_ORDER} numbers"):
        cf.Chain([1.0] * (HIGHEST_ORDER + 1))
