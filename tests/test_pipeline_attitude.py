"""Pipelines of attitude filters do what the library does, however the log is cut."""

import itertools
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import compfilt as cf
from attitude_recipes import (
    ALL,
    ATTITUDE,
    DEGREE,
    FLIP,
    FRD,
    INERTIAL,
    MAHONY,
    ROWS,
    SELF_CALIBRATING,
    G,
    log,
    signals,
    taken,
)
from compfilt.angles import quaternion_to_angles
from compfilt.logs.errors import LogError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import load_recipe, parse_recipe

EXAMPLES = Path(__file__).parents[1] / "examples" / "recipes"
LEARNT = [[0.01, 0.002, -0.003], [0.004, -0.02, 0.001], [0.0, 0.005, 0.03]]


def cut(batch, at):
    bounds = sorted({0, batch.num_rows, *at})
    return [batch.slice(i, j - i) for i, j in itertools.pairwise(bounds)]


def run(recipe, pieces, schema=None):
    pipeline = Pipeline(parse_recipe(recipe, "drone.toml"), schema)
    return pa.Table.from_batches([pipeline.process(piece) for piece in pieces]), pipeline


def with_filter(recipe, lines):
    return recipe.replace('kind = "attitude"', f'kind = "attitude"\n{lines}')


def bits(table):
    return {name: table.column(name).to_numpy().tobytes() for name in table.column_names}


def columns(table, *names):
    return np.column_stack([table.column(name).to_numpy() for name in names])


def vector(table, name):
    return columns(table, *(f"{name}_{axis}" for axis in "xyz"))


def quaternion(table):
    return columns(table, "qw", "qx", "qy", "qz")


def head():
    """The rows before the gap."""
    return log().slice(0, ROWS // 2)


def check(table, expected):
    """Check every column against what the library says, bit for bit."""
    angles = quaternion_to_angles(expected.quaternion) / DEGREE
    dtype = expected.quaternion.dtype
    np.testing.assert_array_equal(quaternion(table), expected.quaternion)
    np.testing.assert_array_equal(columns(table, "roll", "pitch", "yaw"), angles.astype(dtype))
    np.testing.assert_array_equal(vector(table, "up"), expected.up)
    bias = (expected.gyro_bias.astype(float) / DEGREE).astype(dtype)
    np.testing.assert_array_equal(vector(table, "gyro_bias"), bias)
    if "at_rest" in table.column_names:
        np.testing.assert_array_equal(table.column("at_rest").to_numpy(), expected.at_rest)
    np.testing.assert_array_equal(table.column("flags").to_numpy(), expected.flags)


OPTIONS = {
    "tau": ("500 ms", 0.5),
    "zeta": ("0.7", 0.7),
    "gyro_delay": ("2.5 ms", 0.0025),
    "advance": ("4 ms", 0.004),
    "heading_tau": ("1 s", 1.0),
    "acc_range": ("1.1 g", 1.1 * G),
    "rest_time": ("100 ms", 0.1),
    "rest_rate": ("0.18 deg/s", 0.18 * DEGREE),
    "rest_force": ("6 mg", 0.006 * G),
    "rest_drift": ("1 mg", 0.001 * G),
    "bias_limit": ("0.585 deg/s", 0.585 * DEGREE),
}
MEMORY = {key: value for key, value in OPTIONS.items() if key != "zeta"}


def lines(options):
    quoted = {key: f'"{text}"' if " " in text else text for key, (text, _) in options.items()}
    return "\n".join(f"{key} = {text}" for key, text in quoted.items())


def values(options):
    return {key: value for key, (_, value) in options.items()}


@pytest.mark.parametrize(
    ("recipe", "given", "filter_"),
    [
        (ATTITUDE, "", cf.GravityFilter()),
        (ATTITUDE, lines(OPTIONS), cf.GravityFilter(**values(OPTIONS))),
        (
            ATTITUDE,
            'method = "gravity"\norder = 3\nsplit = 2\n' + lines(MEMORY),
            cf.GravityFilter(order=3, split=2, **values(MEMORY)),
        ),
        (SELF_CALIBRATING, "", cf.GravityFilter(self_calibrating=True)),
        (
            SELF_CALIBRATING,
            f"calibration = {LEARNT}\n" + lines(OPTIONS),
            cf.GravityFilter(self_calibrating=True, calibration=LEARNT, **values(OPTIONS)),
        ),
        (MAHONY, "", cf.Mahony(kp=1.0, ki=0.1)),
        (
            MAHONY,
            'form = "direct"\nbias_limit = "3 deg/s"\nacc_range = "1.1 g"',
            cf.Mahony(1.0, 0.1, "direct", bias_limit=3 * DEGREE, acc_range=1.1 * G),
        ),
        (
            MAHONY.replace("kp = 1.0\nki = 0.1", 'design = { kind = "pi", kp = 2.0, ki = 0.5 }'),
            'form = "passive"',
            cf.Mahony.from_design(cf.PiForm(kp=2.0, ki=0.5), "passive"),
        ),
    ],
)
def test_the_attitude_is_that_of_the_library(recipe, given, filter_):
    out, pipeline = run(with_filter(recipe, given), [head()])
    t, gyr, acc, mag = taken(head())
    expected = filter_.estimate(gyr, acc, mag=mag, t=t)
    check(out, expected)
    assert pipeline.counts == expected.counts
    for name in ("measurement_missing", "derivative_held", "derivative_missing", "magnetometer_missing"):
        assert pipeline.counts[name] > 0


def test_every_option_makes_a_difference():
    """So that the test above would notice one that does not arrive."""
    t, gyr, acc, mag = taken(head())

    def result(options):
        estimate = cf.GravityFilter(**options).estimate(gyr, acc, mag=mag, t=t)
        return estimate.quaternion.tobytes() + estimate.at_rest.tobytes() + estimate.gyro_bias.tobytes()

    whole = result(values(OPTIONS))
    for key in OPTIONS:
        assert result({name: value for name, value in values(OPTIONS).items() if name != key}) != whole, key


def test_without_a_magnetometer_and_at_a_rate():
    recipe = INERTIAL.replace('time = { column = "t", unit = "ms" }', "rate = 100.0")
    out, pipeline = run(recipe.replace('gap = { longer_than = "1 s", do = "reset" }', ""), [head()])
    _, gyr, acc, _ = taken(head())
    check(out, cf.GravityFilter().estimate(gyr, acc, fs=100.0))
    assert pipeline.counts["magnetometer_missing"] == 0


def test_the_policy_arrives():
    recipe = ATTITUDE.replace("[policy]", '[policy]\nhold = "20 ms"')
    out, _ = run(recipe, [head()])
    t, gyr, acc, mag = taken(head())
    check(out, cf.GravityFilter().stream(hold=0.02).estimate(gyr, acc, mag, t))


@pytest.mark.parametrize("recipe", ALL.values(), ids=ALL)
@settings(max_examples=15, deadline=None)
@given(at=st.lists(st.integers(0, ROWS), max_size=6))
def test_pieces_give_the_bits_of_the_whole(recipe, at):
    whole, straight = run(recipe, [log()])
    pieces, pipeline = run(recipe, cut(log(), at))
    assert bits(pieces) == bits(whole)
    assert (pipeline.rows, pipeline.gaps, pipeline.counts) == (straight.rows, straight.gaps, straight.counts)


@pytest.mark.parametrize("recipe", ALL.values(), ids=ALL)
@pytest.mark.parametrize("at", [1, ROWS // 2 - 1, ROWS // 2, ROWS // 2 + 1, ROWS - 1])
def test_pickled_in_the_middle(recipe, at):
    whole, straight = run(recipe, [log()])
    pipeline = Pipeline(parse_recipe(recipe))
    first, second = cut(log(), [at])
    part = pipeline.process(first)
    resumed = pickle.loads(pickle.dumps(pipeline))
    assert bits(pa.Table.from_batches([part, resumed.process(second)])) == bits(whole)
    assert resumed.counts == straight.counts


@pytest.mark.parametrize("recipe", ALL.values(), ids=ALL)
def test_a_gap_starts_it_anew(recipe):
    out, pipeline = run(recipe, [log()])
    assert (pipeline.gaps, pipeline.counts["restarted"]) == (1, 1)
    assert np.flatnonzero(out.column("flags").to_numpy() & cf.Flags.RESTARTED).tolist() == [ROWS // 2]
    alone, _ = run(recipe, [log().slice(ROWS // 2)])
    np.testing.assert_array_equal(quaternion(out)[ROWS // 2 :], quaternion(alone))
    assert np.isnan(quaternion(alone)[:3]).all()  # no measurement yet
    with pytest.raises(LogError, match=r"^row 301 comes .* s after the one before: a gap$"):
        run(recipe.replace("reset", "fail"), cut(log(), [70]))


def test_a_gap_can_be_coasted_through():
    coasting, pipeline = run(ATTITUDE.replace("reset", "coast"), [log()])
    t, gyr, acc, mag = taken(log())
    check(coasting, cf.GravityFilter().estimate(gyr, acc, mag=mag, t=t))
    assert pipeline.gaps == 1


def upright(axes):
    """A level body that turns to the left and then rolls to the right, in the axes of the log; without noise."""
    n = 400
    rate = np.zeros((n, 3))
    rate[100:200, 2] = np.pi / 3  # one second: 60 degrees to the left
    rate[200:300, 0] = np.pi / 6  # one second: 30 degrees to the right
    attitude = Rotation.from_matrix(np.eye(3))
    acc, mag = np.empty((n, 3)), np.empty((n, 3))
    for i in range(n):
        attitude = attitude * Rotation.from_rotvec(rate[i] * 0.01)
        acc[i] = attitude.inv().apply([0.0, 0.0, G])
        mag[i] = attitude.inv().apply([0.0, 20e-6, -40e-6])  # x east, y north, z up
    flip = FLIP if axes == "frd" else np.ones(3)
    return log(10.0 * np.arange(n), rate * flip, acc * flip, mag * flip), attitude


@pytest.mark.parametrize("recipe", [ATTITUDE, INERTIAL], ids=["magnetometer", "inertial"])
@pytest.mark.parametrize("axes", ["flu", "frd"])
def test_angles_in_both_axes(recipe, axes):
    batch, attitude = upright(axes)
    out, _ = run(recipe.replace('"flu"', f'"{axes}"'), [batch])
    sign = 1.0 if axes == "flu" else -1.0
    np.testing.assert_allclose(columns(out, "roll", "pitch", "yaw")[-1], [30.0, 0.0, sign * 60.0], atol=0.05)
    # The world's up points up in either: with frd its last component is negative.
    up = attitude.inv().apply([0.0, 0.0, 1.0]) * (FLIP if axes == "frd" else 1.0)
    np.testing.assert_allclose(vector(out, "up")[-1], up, atol=1e-3)
    # The quaternion takes body to world, in the axes that the angles belong to.
    euler = Rotation.from_quat(quaternion(out)[-1], scalar_first=True).as_euler("ZYX", degrees=True)
    np.testing.assert_allclose(euler[::-1], columns(out, "roll", "pitch", "yaw")[-1], atol=1e-9)


@pytest.mark.parametrize("method", ["gravity", "self_calibrating"])
def test_frd_is_flu_turned_about_x(method):
    """Inputs and outputs change signs and nothing else."""
    t, gyr, acc, mag = signals()
    learnt = np.array(LEARNT)
    options = {
        "flu": f'method = "{method}"\ninitial = [0.5, 0.1, -0.2, 0.3]',
        "frd": f'method = "{method}"\ninitial = [0.5, 0.1, 0.2, -0.3]',
    }
    if method == "self_calibrating":
        options["flu"] += f"\ncalibration = {LEARNT}"
        options["frd"] += f"\ncalibration = {(learnt * np.outer(FLIP, FLIP)).tolist()}"
    flu, _ = run(with_filter(ATTITUDE, options["flu"]), [log(t, gyr, acc, mag)])
    frd, _ = run(with_filter(FRD, options["frd"]), [log(t, gyr * FLIP, acc * FLIP, mag * FLIP)])
    np.testing.assert_array_equal(quaternion(frd), quaternion(flu) * [1, 1, -1, -1])
    for name in ("up", "gyro_bias"):
        np.testing.assert_array_equal(vector(frd, name), vector(flu, name) * FLIP)
    angles = columns(flu, "roll", "pitch", "yaw") * FLIP
    np.testing.assert_allclose(columns(frd, "roll", "pitch", "yaw"), angles, rtol=0, atol=1e-12)
    for name in ("at_rest", "flags"):
        np.testing.assert_array_equal(columns(frd, name), columns(flu, name))
    zeros = vector(frd, "gyro_bias")
    assert not np.signbit(zeros[zeros == 0.0]).any()


@pytest.mark.parametrize("axes", ["flu", "frd"])
@pytest.mark.parametrize("given", ['["20 deg", -0.3, "135 deg"]', "quaternion"])
def test_initial_is_in_the_axes_of_the_log(axes, given):
    angles = np.array([20 * DEGREE, -0.3, 135 * DEGREE])
    attitude = Rotation.from_euler("ZYX", angles[::-1])
    if given == "quaternion":
        given = str(attitude.as_quat(scalar_first=True).tolist())
    batch = upright(axes)[0].slice(0, 1)
    recipe = with_filter(INERTIAL.replace('"flu"', f'"{axes}"'), f"initial = {given}")
    # One sample, no time after the start: the attitude is the initial one.
    out, _ = run(recipe, [batch])
    np.testing.assert_allclose(columns(out, "roll", "pitch", "yaw")[0], angles / DEGREE, atol=1e-9)


def test_units_of_the_columns():
    out, _ = run(ATTITUDE.replace('unit = "deg"', 'unit = "mrad"'), [head()])
    units = {name: (out.schema.field(name).metadata or {}).get(b"unit") for name in out.column_names}
    assert {units[name] for name in ("roll", "pitch", "yaw")} == {b"mrad"}
    assert {units[f"gyro_bias_{axis}"] for axis in "xyz"} == {b"mrad/s"}
    assert {units[name] for name in ("qw", "qx", "up_x", "up_z")} == {b"1"}
    assert units["flags"] is units["at_rest"] is None
    assert units["t"] == b"ms"  # a column of the log, of which the recipe knows the unit
    assert {out.schema.field(name).type for name in ("at_rest", "flags")} == {pa.uint8()}
    plain, _ = run(ATTITUDE, [head()])
    np.testing.assert_allclose(
        columns(out, "yaw", "gyro_bias_x"),
        columns(plain, "yaw", "gyro_bias_x") * DEGREE * 1e3,
        rtol=1e-14,
    )


def test_single_columns_can_be_asked_for():
    asked = 'columns = ["yaw", "qz", "up_x", "gyro_bias_y"]'
    every = 'columns = ["quaternion", "roll", "pitch", "yaw", "up", "gyro_bias", "at_rest", "flags"]'
    assert every in ATTITUDE
    out, _ = run(ATTITUDE.replace(every, asked), [head()])
    assert out.column_names == ["t", "yaw", "qz", "up_x", "gyro_bias_y"]


@pytest.mark.parametrize("recipe", [ATTITUDE, FRD], ids=["flu", "frd"])
def test_float32_stays_if_all_signals_are_float32(recipe):
    single = log(dtype=np.float32).slice(0, ROWS // 2)
    out, _ = run(recipe, [single], single.schema)
    assert {out.schema.field(name).type for name in out.column_names[1:-2]} == {pa.float32()}
    t, gyr, acc, mag = taken(single, np.float32)
    if recipe == ATTITUDE:
        check(out, cf.GravityFilter().estimate(gyr, acc, mag=mag, t=t))
    flip = FLIP.astype(np.float32)
    turned = cf.GravityFilter().estimate(gyr * flip, acc * flip, mag=mag * flip, t=t)
    if recipe == FRD:
        expected = turned.quaternion * np.array([1, 1, -1, -1], np.float32)
        np.testing.assert_array_equal(quaternion(out), expected)
    wide = single.set_column(
        single.schema.get_field_index("mz"), "mz", single.column("mz").cast(pa.float64())
    )
    out, _ = run(recipe, [wide], wide.schema)
    assert out.schema.field("qw").type == pa.float64()


@pytest.mark.parametrize("pieces", [[], [12], [8, 12, 33]])
def test_missing_samples_can_be_refused(pieces):
    batch = upright("flu")[0].slice(0, 50)
    recipe = ATTITUDE.replace("[policy]", '[policy]\nmissing = "raise"')
    assert run(recipe, cut(batch, pieces))[0].num_rows == 50
    for row, name in ((30, "gx"), (12, "my")):
        numbers = batch.column(name).to_numpy().copy()
        numbers[row] = np.nan
        batch = batch.set_column(batch.schema.get_field_index(name), name, pa.array(numbers))
    with pytest.raises(LogError, match=r'^row 13 has no number in column "my" \(magnetometer\)$'):
        run(recipe, cut(batch, pieces))


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_example_through_the_command_line(tmp_path, ending):
    """A drone that turns to the left and banks to the right, z down: every column is what it must be."""
    batch, _ = upright("frd")
    micro = pa.array((batch.column("t").to_numpy() * 1e3).astype(np.int64))
    table = pa.Table.from_batches([batch]).set_column(0, "t", micro)
    write = {"csv": pyarrow.csv.write_csv, "parquet": pq.write_table}[ending]
    write(table, tmp_path / f"log.{ending}")
    recipe = EXAMPLES / "attitude.toml"
    command = [sys.executable, "-m", "compfilt", "run", recipe, f"log.{ending}", "-o", "out.parquet"]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (process.returncode, process.stderr) == (
        0,
        f"compfilt: log.{ending}: 400 samples -> out.parquet\n",
    )
    out = pq.read_table(tmp_path / "out.parquet")
    assert out.column_names == [
        *("t", "roll", "pitch", "yaw", "qw", "qx", "qy", "qz"),
        *("gyro_bias_x", "gyro_bias_y", "gyro_bias_z", "at_rest", "flags"),
    ]
    # There is no delay here, but the recipe says so: less than half a degree while it turns.
    np.testing.assert_allclose(columns(out, "roll", "pitch", "yaw")[-1], [30.0, 0.0, -60.0], atol=0.5)
    assert set(out.column("flags").to_pylist()) == {0}
    assert load_recipe(recipe).filter.axes == "frd"
