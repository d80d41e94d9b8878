"""Recipes with several sensors: what they say arrives, and what is wrong with them is said in one line."""

import pickle

import numpy as np
import pytest

from compfilt.logs.errors import RecipeError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import parse_recipe
from sensor_recipes import ARRAY, CUBE, GAP, PLATE, SENSORS, USED, WITHOUT_GYROS, array


def test_what_the_recipe_says_arrives():
    recipe = parse_recipe(CUBE)
    sensors = recipe.filter.sensors
    assert sensors.array == array()
    np.testing.assert_array_equal(sensors.array.noise, array().noise)
    assert [gyro.columns[0] for gyro in sensors.gyros] == ["g1x", "g2x", "g3x", "g4x", "g5x"]
    assert sensors.accelerometers[0].columns == ("a1x", "a1y", None)
    assert sensors.accelerometers[1].scale == (1.0, -1.0, 1.0)
    assert recipe.filter.wheels.columns == ("w1", "w2", "w3")
    assert recipe.inputs == ("t", *sorted(USED), "w1", "w2", "w3")
    assert pickle.loads(pickle.dumps(recipe)) == recipe
    plain = "\n".join(line for line in CUBE.splitlines() if not line.startswith(("noise", "rotation")))
    assert parse_recipe(plain).filter.sensors.array == array(noise=None, rotations=None)


WRONG = [
    (
        CUBE,
        "position = [0.05,",
        "positoin = [0.05,",
        '[log.sensors #1] position is missing (is it the key "positoin"?)',
    ),
    (CUBE, '"150 mm"]', '"150 mm", 1]', "[log.sensors #2] position must hold 3 values, not 4"),
    (CUBE, '"150 mm"', '"150 deg"', '[log.sensors #2] position is wrong: "deg" is an angle, but a length'),
    (
        CUBE,
        "[[0, 1, 0], [1, 0, 0],",
        "[[0, 1, 0], [1, 0],",
        "[log.sensors #1] rotation must hold 3 rows of 3 numbers",
    ),
    (
        CUBE,
        "[0, 0, -1]]",
        "[0, 0, 0]]",
        "[log.sensors #1] rotation must hold the sensor's three axes in body axes",
    ),
    (
        CUBE,
        '"a2x", "a2y", "a2z"',
        '"a2x", "a2y"',
        "[log.sensors #2.accelerometer] columns must name 3 columns, not 2",
    ),
    (
        CUBE,
        '"a2x", "a2y", "a2z"',
        '"-", "-", "-"',
        "[log.sensors #2.accelerometer] columns names no column at all",
    ),
    (
        CUBE,
        '"a2x", "a2y", "a2z"',
        '"a2x", "a2x", "-"',
        "[log.sensors #2.accelerometer] columns names a column twice",
    ),
    (
        CUBE,
        '"g2x", "g2y", "g2z"',
        '"g2x", "g1y", "g2z"',
        '[log] has the column "g1y" in two places: gyro of sensor 1, ',
    ),
    (
        CUBE,
        '["w1", "w2", "w3"]',
        '["w1", "w2", "a5z"]',
        '"a5z" in two places: accelerometer of sensor 5, wheels',
    ),
    (CUBE, 'unit = "rad/s" }', 'unit = "g" }', "[log.sensors #3.gyro] unit is wrong"),
    (CUBE, 'noise = ["4 mg", 0.04,', 'noise = ["4 mg", 0.0,', "[log.sensors #2] noise must be positive"),
    (
        CUBE,
        'noise = ["4 mg", 0.04, "0.01 g"]',
        "",
        "[log.sensors #2] noise is missing, but other sensors have one",
    ),
    (
        CUBE,
        'gyro = { columns = ["g4x", "g4y", "g4z"], unit = "deg/s" }',
        "",
        "[log.sensors #4] gyro is missing",
    ),
    (
        ARRAY,
        'gyro = { columns = ["g4x", "g4y", "g4z"], unit = "deg/s" }',
        "",
        "#4] gyro is missing, but other sensors",
    ),
    (
        CUBE,
        "rotation =",
        "turned = 1\nrotation =",
        '[log.sensors #1] has no key "turned"; there are accelerometer',
    ),
    (CUBE, SENSORS, "", "[log] sensors is missing"),
    (CUBE, SENSORS, "sensors = []", "[log] sensors is empty: give at least one"),
    (CUBE, SENSORS, "sensors = [1]", "[log] sensors must be a table, not a whole number"),
    (
        CUBE,
        SENSORS,
        "[log.sensors]\nposition = [0, 0, 0]",
        "sensors must be written [[log.sensors]], one such table",
    ),
    (
        CUBE,
        '"a3x", "a3y", "a3z"',
        '"a3x", "a3y", "-"',
        "[log] sensors cannot be used: positions must give gravity along",
    ),
    (
        CUBE,
        '"a3x", "a3y", "a3z"',
        '"a3x", "a3y", "-"',
        'body rate of a gyro as well; gyro = "known" in [filter] uses it',
    ),
    (
        CUBE,
        SENSORS,
        SENSORS[: SENSORS.index("[[log.sensors]]", 5)],
        "[log] sensors cannot be used: channels must leave",
    ),
    (CUBE, "[log]", '[log]\naxes = "cube"', '[log] has no key "axes"'),
    (CUBE, '"cube"', '"cube"\ngyro = "kown"', '[filter] gyro has no choice "kown" (did you mean "known"?)'),
    (CUBE, '"cube"', '"cube"\nat = [1]', "[filter] at must hold two angles, phi2 and phi3"),
    (
        CUBE,
        '"pi", kp = 2.0, ki = 0.5',
        '"third_order", tau = 1',
        "is for accelerations; cube takes one whose derivative",
    ),
    (CUBE, 'unit = "deg"\n', "", "[output] unit is missing"),
    (CUBE, 'unit = "deg"\n', 'unit = "deg"\ngravity_unit = "deg"\n', "[output] gravity_unit is wrong"),
    (CUBE, 'time = { column = "t", unit = "ms" }', "", "[log] needs either time"),
    (ARRAY, '"array"', '"array"\ndesign = 1', '[filter] has no key "design"'),
    (ARRAY, '"array"', '"array"\n[policy]\nhold = 1', '[policy] has no key "hold"'),
    (ARRAY, '"array"', f'"array"\n[policy]\n{GAP}', "[policy] gap needs [log] time"),
    (ARRAY, "[log]", "[log]\nrate = 1\ntime = 1", "[log] needs either time"),
    (
        ARRAY,
        "[log]",
        '[log]\ngyro = { columns = ["w1", "w2", "w3"], unit = "rpm" }',
        "[log] gyro is given, but the sensors have gyros as well",
    ),
    (WITHOUT_GYROS, '"array"', '"array"\ngyro = "known"', '[filter] gyro is "known", but there is none'),
    # What only the library knows.
    (CUBE, "kp = 2.0", "kp = -2.0", "[filter] kp must be positive"),
    (
        CUBE,
        'wheels = { columns = ["w1", "w2", "w3"], unit = "rpm" }',
        "",
        'no "wheel_rate": it takes [log] wheels',
    ),
    (CUBE, '"wheel_rate"', '"wheelrate"', 'no "wheelrate" (did you mean "wheel_rate"?); it has phi2'),
    (CUBE, '"pi", kp = 2.0, ki = 0.5', '"first_order", tau = 1', 'this filter has no "bias"; it has phi2'),
    (CUBE, 'keep = ["t"]', 'keep = ["gravity_x"]', '"gravity_x" stands in both columns and keep'),
    (
        WITHOUT_GYROS,
        '"flags"',
        '"body_rate_x"',
        'no "body_rate_x": it takes [log] gyro, or a gyro in each of',
    ),
    (
        PLATE,
        '"flags"',
        '"gravity"',
        'no "gravity": positions must give gravity along x, y and z, but that takes the',
    ),
    (
        PLATE,
        '"flags"',
        '"angular_acceleration_x"',
        'no "angular_acceleration_x": positions must give the angular',
    ),
]


@pytest.mark.parametrize(("text", "right", "wrong", "message"), WRONG)
def test_what_is_wrong_is_named(text, right, wrong, message):
    assert right in text
    Pipeline(parse_recipe(text))
    with pytest.raises(RecipeError) as error:
        Pipeline(parse_recipe(text.replace(right, wrong, 1), "cube.toml"))
    assert str(error.value).startswith("cube.toml: ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)
