"""Units: factors against their definitions, dimensions, and messages that help."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compfilt.logs import units
from compfilt.logs.units import UnitError, parse_quantity, parse_unit

KNOWN = sorted(units._UNITS)


@pytest.mark.parametrize(
    ("name", "one_in_si"),
    [
        ("s", 1.0),
        ("ms", 1e-3),
        ("us", 1e-6),
        ("µs", 1e-6),
        ("ns", 1e-9),
        ("min", 60.0),
        ("deg", math.pi / 180),
        ("rad/s", 1.0),
        ("deg/s", math.pi / 180),
        ("°/s", math.pi / 180),
        ("dps", math.pi / 180),
        ("rpm", 2 * math.pi / 60),
        ("m/s^2", 1.0),
        ("m/s²", 1.0),
        ("m/s2", 1.0),
        ("g", 9.80665),
        ("mg", 9.80665e-3),
        ("mm", 1e-3),
        ("cm", 1e-2),
        ("km", 1e3),
        ("ft", 0.3048),
        ("km/h", 1000 / 3600),
        ("Hz", 1.0),
        ("deg/s^2", math.pi / 180),
        ("T", 1.0),
        ("µT", 1e-6),
        ("uT", 1e-6),
        ("nT", 1e-9),
        ("gauss", 1e-4),
        ("mgauss", 1e-7),
        ("1", 1.0),
    ],
)
def test_factor_is_the_definition(name, one_in_si):
    assert parse_unit(name).to_si(1.0) == pytest.approx(one_in_si, rel=1e-15)


@given(st.sampled_from(KNOWN), st.floats(-1e6, 1e6))
def test_there_and_back(name, value):
    unit = parse_unit(name)
    assert unit.from_si(unit.to_si(value)) == pytest.approx(value, rel=4e-16, abs=1e-300)


@given(st.sampled_from(KNOWN), st.floats(-1e6, 1e6))
def test_quantity_is_number_times_unit(name, value):
    unit = parse_unit(name)
    assert parse_quantity(f"{value!r} {name}", unit.dimension) == unit.to_si(value)


@given(st.sampled_from(KNOWN), st.sampled_from(KNOWN))
def test_a_unit_fits_its_own_dimension_only(name, other):
    expected = parse_unit(other).dimension
    if parse_unit(name).dimension == expected:
        assert parse_unit(name, expected).name == name
    else:
        with pytest.raises(UnitError, match="is expected here"):
            parse_unit(name, expected)


def test_wrong_dimension_names_what_was_expected():
    with pytest.raises(UnitError) as error:
        parse_unit("g", units.ANGULAR_RATE)
    assert '"g" is an acceleration' in str(error.value)
    assert "an angular rate is expected here: rad/s" in str(error.value)
    assert "deg/s" in str(error.value)


def test_unknown_unit_lists_those_of_the_dimension_only():
    with pytest.raises(UnitError) as error:
        parse_unit("degs", units.ANGLE)
    assert 'there is no unit "degs" (did you mean "deg"?)' in str(error.value)
    assert "rad, mrad, deg" in str(error.value)
    assert "km" not in str(error.value)


def test_unknown_unit_without_a_dimension_lists_all():
    with pytest.raises(UnitError, match="the known ones are 1, s, ms"):
        parse_unit("furlong")


@pytest.mark.parametrize("text", ["", "1", "ms", "1 2 s", "one s", "1,5 s", "nan s"])
def test_what_is_not_a_quantity(text):
    with pytest.raises(UnitError):
        parse_quantity(text, units.TIME)


@pytest.mark.parametrize(
    ("text", "seconds"), [("1 s", 1.0), ("20ms", 0.02), (" 1.5e-3  s ", 1.5e-3), ("-.5 s", -0.5)]
)
def test_quantities(text, seconds):
    assert parse_quantity(text, units.TIME) == pytest.approx(seconds, rel=1e-15)


def test_derivatives_of_a_dimension():
    assert units.ANGLE.per_second(1) == units.ANGULAR_RATE
    assert units.LENGTH.per_second(2) == units.ACCELERATION
    assert str(units.LENGTH.per_second(3)) == "a quantity in m^1 s^-3"
    assert str(units.MAGNETIC_FIELD.per_second(1)) == "a quantity in s^-1 T^1"
