"""Recipes: what they say arrives, and what is wrong with them is said in one line that names file and key."""

import math
import pickle
from pathlib import Path

import pytest

from compfilt.logs.errors import RecipeError
from compfilt.logs.recipe import load_recipe, parse_recipe

EXAMPLES = Path(__file__).parents[1] / "examples"

TILT = """
version = 1
[log]
time = { column = "t", unit = "ms" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s", scale = [1, -1, 2.0] }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "pi", kp = 20.0, ki = 10 }
[policy]
gap = { longer_than = "1 s", do = "reset" }
missing = "coast"
hold = "50 ms"
[output]
columns = ["roll", "pitch", "bias", "flags"]
unit = "deg"
keep = ["t"]
"""

TWO = """
version = 1
[log]
rate = 100.0
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "first_order"
tau = 0.5
[output]
columns = ["estimate"]
"""

POSITION = """
version = 1
[log]
time = { column = "t", unit = "s" }
measurement = { column = "height", unit = "m" }
derivative = { column = "acceleration", unit = "m/s^2", scale = -1 }
[filter]
kind = "third_order"
tau = "1500 ms"
delay = "100 ms"
[output]
columns = ["position", "velocity", "bias"]
unit = "cm"
"""


def test_tilt_recipe():
    recipe = parse_recipe(TILT, "seat.toml")
    assert recipe.clock.column == "t"
    assert recipe.clock.unit.factor == 1e-3
    assert recipe.filter.accelerometer.columns == ("ax", "ay", "az")
    assert recipe.filter.accelerometer.unit.name == "g"
    assert recipe.filter.gyro.columns == ("gx", "gy", "gz")
    assert recipe.filter.gyro.scale == (1.0, -1.0, 2.0)
    assert recipe.filter.kind == "tilt"
    assert recipe.filter.design.parameters == {"kp": 20.0, "ki": 10.0}
    assert recipe.filter.structure == {"axes": "flu"}
    assert recipe.policy.general.missing == "coast"
    assert recipe.policy.hold == pytest.approx(0.05)
    assert (recipe.policy.gap.longer_than, recipe.policy.gap.do) == (1.0, "reset")
    assert recipe.output.columns == ("roll", "pitch", "bias", "flags")
    assert recipe.output.keep == ("t",)
    assert recipe.inputs == ("t", "ax", "ay", "az", "gx", "gy", "gz")


def test_two_signals_and_a_rate():
    recipe = parse_recipe(TWO)
    assert recipe.clock.rate == 100.0
    assert recipe.filter.design.parameters == {"tau": 0.5}
    assert recipe.output.unit.name == "deg"  # that of the measurement
    assert recipe.policy == type(recipe.policy)()


def test_position_from_acceleration():
    recipe = parse_recipe(POSITION)
    assert recipe.filter.design.derivative_order == 2
    assert recipe.filter.design.parameters["tau"] == pytest.approx(1.5)
    assert recipe.filter.stream["delay"] == pytest.approx(0.1)
    assert recipe.filter.derivative.scale == (-1.0,)


@pytest.mark.parametrize(
    ("given", "constructor", "parameters"),
    [
        ('kind = "pi"\nkp = 2\nki = 1', "PiForm", {"kp": 2.0, "ki": 1.0}),
        ('kind = "butterworth"\nomega0 = 1\norder = 3', "Butterworth", {"omega0": 1.0, "order": 3}),
        (
            'kind = "butterworth"\nomega0 = "57.29577951308232 deg/s"\nq = 0.5',
            "Butterworth",
            {"omega0": 1.0, "q": 0.5},
        ),
        ('kind = "butterworth"\nomega0 = 1\nsplit = 1', "Butterworth", {"omega0": 1.0, "split": 1}),
        (
            'kind = "chain"\ncoefficients = [3, 2]\nsplit = 2',
            "Chain",
            {"coefficients": [3.0, 2.0], "split": 2},
        ),
        ('kind = "rate"\ntau = 0.1', "RateFilter", {"tau": 0.1}),
    ],
)
def test_designs(given, constructor, parameters):
    design = parse_recipe(TWO.replace('kind = "first_order"\ntau = 0.5', given)).filter.design
    assert design.constructor == constructor
    assert design.parameters == parameters


@pytest.mark.parametrize(
    ("given", "constructor"),
    [
        ("tau = 1.0", "ThirdOrder"),
        ("k1 = 3.0\nk2 = 3.0\nk3 = 1.0", "ThirdOrder.from_gains"),
        ("omega0 = 1.0", "ThirdOrder.butterworth"),
    ],
)
def test_a_design_can_be_given_in_several_ways(given, constructor):
    recipe = parse_recipe(POSITION.replace('tau = "1500 ms"', given))
    assert recipe.filter.design.constructor == constructor


def test_angles_in_options_take_units():
    recipe = parse_recipe(
        TILT.replace(
            'kind = "tilt"', 'kind = "tilt"\nrates = "frozen"\nat = ["90 deg", 0]\ninitial = [0.1, "180 deg"]'
        )
    )
    assert recipe.filter.structure["at"] == pytest.approx((math.pi / 2, 0.0))
    assert recipe.filter.stream["initial"] == pytest.approx((0.1, math.pi))
    wrapped = parse_recipe(TWO.replace("tau = 0.5", 'tau = 0.5\nperiod = "360 deg"\ninitial = "90 deg"'))
    assert wrapped.filter.stream == pytest.approx({"period": 2 * math.pi, "initial": math.pi / 2})


@pytest.mark.parametrize(
    "path",
    sorted(path for path in EXAMPLES.rglob("*.toml") if path.name != "Cargo.toml"),
    ids=lambda path: path.name,
)
def test_the_examples_are_right(path):
    assert load_recipe(path).source == str(path)


def test_recipes_pickle():
    recipe = parse_recipe(TILT)
    assert pickle.loads(pickle.dumps(recipe)) == recipe


WRONG = [
    # unknown keys, with the nearest known one
    (TILT, 'missing = "coast"', 'mising = "coast"', '[policy] has no key "mising" (did you mean "missing"?)'),
    (TILT, "[policy]", "[polici]", 'has no key "polici" (did you mean "policy"?)'),
    (TILT, "kp = 20.0", "kp = 20.0, kd = 1", '[filter.design] has no key "kd"'),
    (TILT, 'unit = "ms"', 'unit = "ms", offset = 1', '[log.time] has no key "offset"'),
    (TILT, 'axes = "flu"', 'axes = "flu"\nmagnetometer = 1', '[log] has no key "magnetometer"'),
    (TILT, 'kind = "tilt"', 'kind = "tilt"\nperiod = 1', '[filter] has no key "period"'),
    (TILT, 'unit = "deg"\n', 'unit = "deg"\nformat = 1\n', '[output] has no key "format"'),
    (TWO, "tau = 0.5", 'tau = 0.5\naxes = "flu"', '[filter] has no key "axes"'),
    # missing keys, with what may be meant
    (TILT, "version = 1", "", "version is missing"),
    (TILT, "ki = 10", "kd = 10", "[filter.design] ki is missing"),
    (TWO, "tau = 0.5", "tua = 0.5", '[filter] tau is missing (is it the key "tua"?)'),
    (TILT, 'axes = "flu"', "", "[log] axes is missing"),
    (TILT, 'unit = "deg/s", ', "", "[log.gyro] unit is missing"),
    (TILT, 'unit = "deg"\n', "", "[output] unit is missing"),
    (TWO, "tau = 0.5", "", "[filter] tau is missing"),
    (TWO, "rate = 100.0", "", "[log] needs either time"),
    (TWO, 'measurement = { column = "angle", unit = "deg" }', "", "[log] measurement is missing"),
    (TWO, 'columns = ["estimate"]', "", "[output] columns is missing"),
    # wrong types
    (TILT, "version = 1", 'version = "1"', 'version must be a whole number, not the text "1"'),
    (TILT, "kp = 20.0", 'kp = "20"', '[filter.design] kp must be a number, not the text "20"'),
    (TILT, "kp = 20.0", "kp = true", "kp must be a number, not a true or false"),
    (TILT, "kp = 20.0", "kp = nan", "kp must be finite, not nan"),
    (TILT, 'columns = ["gx", "gy", "gz"]', 'columns = "gx"', "[log.gyro] columns must be a list"),
    (TILT, '["gx", "gy", "gz"]', '["gx", "gy", 3]', "[log.gyro] columns must be a text, not a whole number"),
    (
        TILT,
        'time = { column = "t", unit = "ms" }',
        "time = 3",
        "[log] time must be a table, not a whole number",
    ),
    (TWO, "rate = 100.0", "rate = 2024-01-01", "[log] rate must be a number, not a date or time"),
    (TWO, "tau = 0.5", "tau = [0.5]", "[filter] tau must be a number, not a list"),
    # values that cannot be
    (TILT, "version = 1", "version = 2", "version is 2, but this release reads version 1"),
    (TILT, 'kind = "tilt"', 'kind = "tlit"', '[filter] kind has no choice "tlit" (did you mean "tilt"?)'),
    (TILT, 'axes = "flu"', 'axes = "ned"', 'axes has no choice "ned"; there are "flu", "frd", "cube"'),
    (TILT, 'do = "reset"', 'do = "resets"', '[policy.gap] do has no choice "resets" (did you mean "reset"?)'),
    (TILT, '"1 s"', '"1 deg"', "[policy.gap] longer_than is wrong"),
    (TILT, '"1 s"', "0", "[policy.gap] longer_than must be positive"),
    (TILT, '["gx", "gy", "gz"]', '["gx", "gy"]', "[log.gyro] columns must name 3 columns, not 2"),
    (TILT, '["gx", "gy", "gz"]', '["gx", "gy", "gx"]', "[log.gyro] columns names a column twice"),
    (TILT, "[1, -1, 2.0]", "[1, 0, 1]", "[log.gyro] scale must hold 3 factors, none of them 0"),
    (TILT, "[1, -1, 2.0]", "[1, 1]", "[log.gyro] scale must hold 3 factors"),
    (TILT, '"pi", kp = 20.0, ki = 10', '"third_order", tau = 1', "[filter.design] kind is for accelerations"),
    (TILT, 'columns = ["roll", "pitch", "bias", "flags"]', "columns = []", "[output] columns is empty"),
    (TILT, '["roll", "pitch", "bias", "flags"]', '["roll", "roll"]', "[output] columns names a column twice"),
    (TILT, 'kind = "tilt"', 'kind = "tilt"\nat = [1]', "[filter] at must hold two angles"),
    (TILT.replace('"flu"', '"cube"'), '"tilt"', '"tilt"\nat = [1]', "must hold two angles, phi2 and phi3"),
    (
        TILT,
        'kind = "tilt"',
        'kind = "tilt"\ninitial = [1, 2, 3]',
        "[filter] initial has 3 values, but the filter has 2",
    ),
    (TWO, "rate = 100.0", "rate = 0", "[log] rate must be positive, not 0"),
    (TWO, "rate = 100.0", 'rate = 1\ntime = { column = "t", unit = "s" }', "[log] needs either time"),
    (
        TWO,
        "[output]",
        '[policy]\ngap = { longer_than = 1, do = "fail" }\n[output]',
        "[policy] gap needs [log] time",
    ),
    (
        POSITION,
        'tau = "1500 ms"',
        "tau = 1\nomega0 = 1",
        'kind = "third_order" takes either tau, or k1 and k2 and k3',
    ),
    (
        POSITION,
        'tau = "1500 ms"',
        "",
        'kind = "third_order" takes either tau, or k1 and k2 and k3, or omega0',
    ),
    # units
    (
        TILT,
        'unit = "deg/s"',
        'unit = "g"',
        '[log.gyro] unit is wrong: "g" is an acceleration, but an angular rate',
    ),
    (TILT, 'unit = "deg/s"', 'unit = "degs/s"', 'there is no unit "degs/s" (did you mean "deg/s"?)'),
    (TILT, 'unit = "ms"', 'unit = "deg"', "[log.time] unit is wrong"),
    (TILT, 'unit = "deg"\n', 'unit = "m"\n', "[output] unit is wrong"),
    (TWO, 'unit = "deg/s"', 'unit = "deg"', "an angular rate is expected here"),
    (POSITION, 'unit = "m/s^2"', 'unit = "m/s"', "an acceleration is expected here"),
    # not TOML
    (TWO, "rate = 100.0", "rate = ", "not TOML"),
]


@pytest.mark.parametrize(("text", "right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_named(text, right, wrong, message):
    assert text.count(right) >= 1
    parse_recipe(text)
    with pytest.raises(RecipeError) as error:
        parse_recipe(text.replace(right, wrong), "seat.toml")
    assert str(error.value).startswith("seat.toml: ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_files(tmp_path):
    path = tmp_path / "seat.toml"
    with pytest.raises(RecipeError, match=r"seat\.toml: the recipe cannot be read: No such file"):
        load_recipe(path)
    with pytest.raises(RecipeError, match="cannot be read: Is a directory"):
        load_recipe(tmp_path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(RecipeError, match="not a text in UTF-8"):
        load_recipe(path)
    path.write_text(TWO, encoding="utf-8")
    assert load_recipe(path) == parse_recipe(TWO, str(path))
