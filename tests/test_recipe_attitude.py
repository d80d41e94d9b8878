"""Recipes of attitude filters: what they say arrives, and what is wrong with them is said in one line."""

import inspect
import pickle

import pytest

import compfilt as cf
from attitude_recipes import ATTITUDE, DEGREE, INERTIAL, MAHONY, SELF_CALIBRATING
from compfilt.logs.errors import RecipeError
from compfilt.logs.kinds.attitude_methods import _METHODS
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import parse_recipe

DESIGN = MAHONY.replace("kp = 1.0\nki = 0.1", 'design = { kind = "pi", kp = 2.0, ki = 0.5 }')
GAINS = "kp = 1.0\nki = 0.1"


def test_what_the_recipe_says_arrives():
    recipe = parse_recipe(ATTITUDE)
    assert recipe.inputs == ("t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz")
    assert recipe.filter.magnetometer.unit.factor == 1e-6
    assert recipe.filter.method.build() == cf.GravityFilter()
    assert parse_recipe(SELF_CALIBRATING).filter.method.build() == cf.GravityFilter(self_calibrating=True)
    assert parse_recipe(MAHONY).filter.method.build() == cf.Mahony(kp=1.0, ki=0.1)
    assert parse_recipe(DESIGN).filter.method.build() == cf.Mahony(kp=2.0, ki=0.5)
    assert parse_recipe(INERTIAL).filter.magnetometer is None
    given = parse_recipe(ATTITUDE.replace('"attitude"', '"attitude"\ntau = 2\nrest_rate = "1 deg/s"'))
    assert given.filter.method.parameters == {"tau": 2.0, "rest_rate": DEGREE}


def test_every_parameter_of_the_library_can_be_given():
    gravity = set(inspect.signature(cf.GravityFilter).parameters) - {"self_calibrating"}
    assert set(_METHODS["gravity"]) == gravity - {"calibration"}
    assert set(_METHODS["self_calibrating"]) == gravity - {"calibration", "order", "split"}  # and calibration
    assert set(_METHODS["mahony"]) == set(inspect.signature(cf.Mahony).parameters)


@pytest.mark.parametrize("text", [ATTITUDE, INERTIAL, MAHONY, DESIGN, SELF_CALIBRATING])
def test_recipes_pickle(text):
    recipe = parse_recipe(text)
    assert pickle.loads(pickle.dumps(recipe)) == recipe


@pytest.mark.parametrize("unit", ["T", "mT", "uT", "µT", "nT", "gauss", "mgauss"])
def test_units_of_the_magnetic_field(unit):
    assert parse_recipe(ATTITUDE.replace('"uT"', f'"{unit}"')).filter.magnetometer is not None


KIND = 'kind = "attitude"'


def added(line):
    """Return what stands for the line that names the kind, with another one below it."""
    return f"{KIND}\n{line}"


WRONG = [
    # the log
    (ATTITUDE, 'axes = "flu"\n', "", "[log] axes is missing"),
    (ATTITUDE, '"flu"', '"cube"', '[log] axes has no choice "cube"; there are "flu", "frd"'),
    (ATTITUDE, "magnetometer", "magnetomter", '[log] has no key "magnetomter" (did you mean "magnetometer"?)'),
    (ATTITUDE, '"uT"', '"g"', '[log.magnetometer] unit is wrong: "g" is an acceleration, but a magnetic field'),
    (ATTITUDE, '"uT"', '"UT"', 'there is no unit "UT" (did you mean "uT"?); a magnetic field is expected here'),
    (ATTITUDE, '"mx", "my", "mz"', '"mx", "my"', "[log.magnetometer] columns must name 3 columns, not 2"),
    (ATTITUDE, '"mx", "my"', '"mx", "ay"', '[log] has the column "ay" in two places: accelerometer, magnetometer'),
    (ATTITUDE, '"deg/s"', '"g"', "[log.gyro] unit is wrong"),
    (ATTITUDE, "gyro = {", "gyr = {", '[log] gyro is missing (is it the key "gyr"?)'),
    # the method and its parameters
    (ATTITUDE, KIND, added('method = "madgwick"'), '[filter] method has no choice "madgwick"; there are "gravity"'),
    (ATTITUDE, KIND, added("kp = 1"), '[filter] has no key "kp"; there are acc_range'),
    (ATTITUDE, KIND, added("taus = 1"), '[filter] has no key "taus" (did you mean "tau"?)'),
    (ATTITUDE, KIND, added('rule = "matched"'), '[filter] has no key "rule"'),
    (ATTITUDE, KIND, added("calibration = 1"), '[filter] has no key "calibration"'),
    (ATTITUDE, KIND, added('tau = "3 m"'), '[filter] tau is wrong: "m" is a length, but a time'),
    (ATTITUDE, KIND, added('acc_range = "16 m"'), "[filter] acc_range is wrong"),
    (ATTITUDE, KIND, added('rest_rate = "1 deg"'), "[filter] rest_rate is wrong"),
    (ATTITUDE, KIND, added("order = 2.0"), "[filter] order must be a whole number, not a number"),
    (ATTITUDE, KIND, added('zeta = "1"'), '[filter] zeta must be a number, not the text "1"'),
    (INERTIAL, KIND, added("heading_tau = 5"), "[filter] heading_tau needs [log] magnetometer"),
    (SELF_CALIBRATING, KIND, added("order = 2"), '[filter] has no key "order"'),
    (SELF_CALIBRATING, KIND, added("calibration = [1, 2]"), "[filter] calibration must be a list, not a whole number"),
    (SELF_CALIBRATING, KIND, added("calibration = [[1]]"), "[filter] calibration must hold 3 rows of 3 numbers"),
    (MAHONY, GAINS, "", '[filter] method = "mahony" takes either kp, with ki or without it, or design'),
    (MAHONY, GAINS, 'kp = 1\ndesign = { kind = "pi" }', '"mahony" takes either kp'),
    (MAHONY, GAINS, "ki = 1.0", "[filter] kp is missing"),
    (MAHONY, GAINS, GAINS + "\ntau = 3", '[filter] has no key "tau"'),
    (MAHONY, GAINS, GAINS + '\nform = "pasive"', '[filter] form has no choice "pasive" (did you mean "passive"?)'),
    (DESIGN, 'kind = "pi", kp = 2.0, ki = 0.5', 'kind = "pi"', "[filter.design] kp is missing"),
    (
        DESIGN,
        '"pi", kp = 2.0, ki = 0.5',
        '"third_order", tau = 1',
        "[filter.design] kind is for accelerations; attitude takes one whose derivative is a rate",
    ),
    # the start
    (ATTITUDE, KIND, added("initial = 1"), "[filter] initial must be a list, not a whole number"),
    (ATTITUDE, KIND, added("initial = [1, 2]"), "[filter] initial must hold roll, pitch and yaw, or the four parts"),
    (ATTITUDE, KIND, added("initial = [1, 2, 3, 4, 5]"), "[filter] initial has 5 values, but the filter has 3"),
    (ATTITUDE, KIND, added('initial = [0, "1 m", 0]'), '[filter] initial is wrong: "m" is a length'),
    (ATTITUDE, KIND, added('initial = [0, "1 deg", 0, 0]'), "[filter] initial must be a number, not the text"),
    # the output
    (ATTITUDE, 'unit = "deg"\n', "", "[output] unit is missing"),
    (ATTITUDE, 'unit = "deg"\n', 'unit = "m"\n', "[output] unit is wrong"),
    (ATTITUDE, 'keep = ["t"]', 'keep = ["up_x"]', '[output] "up_x" stands in both columns and keep'),
    (ATTITUDE, '"yaw"', '"heading"', 'this filter has no "heading"; it has roll, pitch, yaw, quaternion'),
    (ATTITUDE, '"yaw"', '"bias"', 'this filter has no "bias": it is the gyro\'s, and called "gyro_bias"'),
    (MAHONY, '"flags"', '"at_rest"', 'no "at_rest": Mahony\'s filter does not look for rest'),
    (MAHONY, "ki = 0.1", "", 'no "gyro_bias": Mahony\'s filter estimates it where ki is positive'),
    # what only the library knows
    (ATTITUDE, KIND, added("tau = -1"), "[filter] tau must be positive and finite"),
    (ATTITUDE, KIND, added("rest_force = 0"), "[filter] rest_force must be"),
    (ATTITUDE, KIND, added("order = 3\nzeta = 1"), "[filter] zeta goes with order=2"),
    (ATTITUDE, KIND, added("order = 7"), "[filter] order must lie between 1 and 6"),
    (ATTITUDE, KIND, added("initial = [0, 0, 0, 0]"), "[filter] initial must be a quaternion"),
    (MAHONY, "kp = 1.0", "kp = 0", "[filter] kp must be positive"),
    (DESIGN, '"pi", kp = 2.0, ki = 0.5', '"rate", tau = 1', "[filter] design must be a chain of order 1 or 2"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_named(text, right, wrong, message):
    assert right in text
    Pipeline(parse_recipe(text))
    with pytest.raises(RecipeError) as error:
        Pipeline(parse_recipe(text.replace(right, wrong, 1), "drone.toml"))
    assert str(error.value).startswith("drone.toml: ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)
