"""Pipelines with several sensors do what the library does, however the log is cut."""

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

import compfilt as cf
from compfilt.logs.errors import LogError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import load_recipe, parse_recipe
from sensor_recipes import (
    ARRAY,
    CUBE,
    DEGREE,
    GAP,
    PLATE,
    TIMED,
    WITHOUT_GYROS,
    G,
    array,
    complete,
    log,
    signals,
)

EXAMPLES = Path(__file__).parents[1] / "examples" / "recipes"


def cut(batch, at):
    bounds = sorted({0, batch.num_rows, *at})
    return [batch.slice(i, j - i) for i, j in itertools.pairwise(bounds)]


def run(recipe, pieces, schema=None):
    pipeline = Pipeline(parse_recipe(recipe, "cube.toml"), schema)
    return pa.Table.from_batches([pipeline.process(piece) for piece in pieces]), pipeline


def bits(table):
    return {name: table.column(name).to_numpy().tobytes() for name in table.column_names}


def columns(table, name, axes="xyz"):
    return np.column_stack([table.column(f"{name}_{axis}").to_numpy() for axis in axes])


def same(table, expected):
    """Check columns against what the library says, in the output's units."""
    for name, values in expected.items():
        np.testing.assert_array_equal(table.column(name).to_numpy(), values, err_msg=name)


@pytest.mark.parametrize("gyro", ["unknown", "known"])
def test_the_cube_is_that_of_the_library(gyro):
    head = log().slice(0, 150)  # before the gap
    out, pipeline = run(CUBE.replace('kind = "cube"', f'kind = "cube"\ngyro = "{gyro}"'), [head])
    cube = cf.Cube(array(), cf.PiForm(kp=2.0, ki=0.5), gyro=gyro)
    expected = cube.stream().estimate(*signals(head), t=head.column("t").to_numpy() * 1e-3)
    same(
        out,
        {
            "phi2": expected.phi2 / DEGREE,
            "phi3": expected.phi3 / DEGREE,
            "phi2_bias": expected.bias[:, 0] / DEGREE,
            "phi3_bias": expected.bias[:, 1] / DEGREE,
            "flags": expected.flags,
        }
        | {f"body_rate_{axis}": expected.body_rate[:, i] / DEGREE for i, axis in enumerate("xyz")}
        | {f"wheel_rate_{axis}": expected.wheel_rate[:, i] / DEGREE for i, axis in enumerate("xyz")}
        | {f"gravity_{axis}": expected.gravity[:, i] for i, axis in enumerate("xyz")},
    )
    assert pipeline.counts == expected.counts
    assert (
        min(pipeline.counts[name] for name in ("sensor_missing", "measurement_missing", "derivative_held"))
        > 0
    )


def test_options_of_the_cube_arrive():
    head = complete()
    options = 'rates = "frozen"\nat = ["45 deg", -0.6]\ninitial = ["40 deg", -0.5]\nrule = "matched"'
    recipe = CUBE.replace('kind = "cube"', f'kind = "cube"\n{options}').replace(
        "[policy]", "[policy]\nhold = 0.02"
    )
    out, _ = run(recipe, [head])
    cube = cf.Cube(array(), cf.PiForm(kp=2.0, ki=0.5), rates="frozen", at=(45 * DEGREE, -0.6))
    stream = cube.stream(initial=(40 * DEGREE, -0.5), rule="matched", hold=0.02)
    expected = stream.estimate(*signals(head), t=head.column("t").to_numpy() * 1e-3)
    same(out, {"phi2": expected.phi2 / DEGREE, "phi3": expected.phi3 / DEGREE})
    rate, _ = run(CUBE.replace('time = { column = "t", unit = "ms" }', "rate = 100").replace(GAP, ""), [head])
    expected = cf.Cube(array(), cf.PiForm(kp=2.0, ki=0.5)).stream(fs=100.0).estimate(*signals(head))
    same(rate, {"phi2": expected.phi2 / DEGREE})


@pytest.mark.parametrize("recipe", [CUBE, TIMED], ids=["cube", "array"])
@settings(max_examples=20, deadline=None)
@given(at=st.lists(st.integers(0, 300), max_size=6))
def test_pieces_give_the_bits_of_the_whole(recipe, at):
    whole, straight = run(recipe, [log()])
    pieces, pipeline = run(recipe, cut(log(), at))
    assert bits(pieces) == bits(whole)
    assert (pipeline.rows, pipeline.gaps, pipeline.counts) == (straight.rows, straight.gaps, straight.counts)


@pytest.mark.parametrize("recipe", [CUBE, TIMED], ids=["cube", "array"])
@pytest.mark.parametrize("at", [1, 149, 150, 151, 299])
def test_pickled_in_the_middle(recipe, at):
    whole, straight = run(recipe, [log()])
    pipeline = Pipeline(parse_recipe(recipe))
    first, second = cut(log(), [at])
    head = pipeline.process(first)
    resumed = pickle.loads(pickle.dumps(pipeline))
    assert bits(pa.Table.from_batches([head, resumed.process(second)])) == bits(whole)
    assert resumed.counts == straight.counts


def test_a_gap_starts_the_cube_anew():
    out, pipeline = run(CUBE, [log()])
    assert (pipeline.gaps, pipeline.counts["restarted"]) == (1, 1)
    assert np.flatnonzero(out.column("flags").to_numpy() & cf.Flags.RESTARTED).tolist() == [150]
    alone, _ = run(CUBE, [log().slice(150)])
    np.testing.assert_array_equal(out.column("phi2").to_numpy()[150:], alone.column("phi2").to_numpy())
    with pytest.raises(LogError, match=r"^row 151 comes .* s after the one before: a gap$"):
        run(TIMED.replace("reset", "fail"), cut(log(), [70]))


@pytest.mark.parametrize("gyro", ["unknown", "known"])
def test_the_array_is_that_of_the_library(gyro):
    whole = log()
    out, pipeline = run(ARRAY.replace('"array"', f'"array"\ngyro = "{gyro}"'), [whole])
    gyr, acc, _ = signals(whole)
    rate = array().body_rate(gyr)
    known = rate if gyro == "known" else None
    gravity = array().gravity(acc, known)
    np.testing.assert_array_equal(columns(out, "gravity"), gravity)
    np.testing.assert_array_equal(columns(out, "body_rate"), rate)
    turn = columns(out, "angular_acceleration")
    np.testing.assert_array_equal(turn, array().angular_acceleration(acc, known))
    flags = out.column("flags").to_numpy()
    missing = np.isnan(gravity).any(axis=1) | np.isnan(turn).any(axis=1)
    np.testing.assert_array_equal(flags & cf.Flags.MEASUREMENT_MISSING != 0, missing)
    np.testing.assert_array_equal(flags & cf.Flags.SENSOR_MISSING != 0, np.isnan(gyr).any(axis=(1, 2)))
    assert 0 < np.isnan(gravity).any(axis=1).sum() < 300
    assert pipeline.counts["measurement_missing"] == missing.sum()


def test_a_gyro_of_the_body_is_used():
    head = complete()
    recipe = WITHOUT_GYROS.replace("[log]", '[log]\ngyro = { columns = ["w1", "w2", "w3"], unit = "rpm" }')
    _, acc, rate = signals(head)
    out, _ = run(recipe.replace('"flags"', '"body_rate_z", "flags"'), [head])
    np.testing.assert_array_equal(columns(out, "gravity"), array().gravity(acc, rate))
    np.testing.assert_array_equal(out.column("body_rate_z").to_numpy(), rate[:, 2])
    out, _ = run(recipe.replace('"array"', '"array"\ngyro = "unknown"'), [head])
    np.testing.assert_array_equal(columns(out, "gravity"), array().gravity(acc))
    infinite = head.set_column(head.schema.get_field_index("w1"), "w1", pa.array(np.full(50, np.inf)))
    out, pipeline = run(recipe.replace('"flags"', '"body_rate"'), [infinite])
    assert np.isnan(columns(out, "body_rate")).all()
    assert pipeline.counts["measurement_missing"] == 50


def test_only_what_the_geometry_gives_is_there():
    # Three sensors above the pivot: without a gyro they do not even give gravity.
    head = complete()
    out, _ = run(PLATE, [head])
    assert out.column_names == ["angular_acceleration_z", "flags"]
    assert out.schema.field("angular_acceleration_z").metadata == {b"unit": b"deg/s^2"}
    plate = cf.AccelerometerArray([[0.12, 0, 0.03], [-0.06, 0.1, 0.03], [-0.06, -0.1, 0.03]])
    acc = np.stack([[head.column(f"a{i}{axis}").to_numpy() * G for axis in "xyz"] for i in (2, 3, 4)])
    expected = plate.angular_acceleration(np.moveaxis(acc, 2, 0), axes="z")[:, 0]
    same(out, {"angular_acceleration_z": expected / DEGREE})


def test_units_of_the_columns():
    out, _ = run(CUBE.replace('unit = "deg"\n', 'unit = "mrad"\ngravity_unit = "g"\n'), [complete()])
    plain, _ = run(CUBE, [complete()])
    units = {name: (out.schema.field(name).metadata or {}).get(b"unit") for name in out.column_names}
    assert {units[name] for name in ("phi2", "phi3")} == {b"mrad"}
    assert {units[f"{name}_{axis}"] for name in ("body_rate", "wheel_rate") for axis in "xyz"} == {b"mrad/s"}
    assert {units[name] for name in ("phi2_bias", "phi3_bias")} == {b"mrad/s"}
    assert {units[f"gravity_{axis}"] for axis in "xyz"} == {b"g"}
    assert units["flags"] is None
    np.testing.assert_array_equal(columns(out, "gravity"), columns(plain, "gravity") / G)
    default, _ = run(ARRAY, [complete()])
    units = {name: (default.schema.field(name).metadata or {}).get(b"unit") for name in default.column_names}
    assert units["gravity_x"] == b"m/s^2"
    assert units["angular_acceleration_x"] == b"rad/s^2"
    assert units["body_rate_x"] == b"rad/s"


def test_one_column_of_a_vector_can_be_asked_for():
    out, _ = run(CUBE.replace('"body_rate", "wheel_rate", "gravity"', '"gravity_z", "body_rate_x"'), [log()])
    assert out.column_names == [
        "t",
        "phi2",
        "phi3",
        "phi2_bias",
        "phi3_bias",
        "gravity_z",
        "body_rate_x",
        "flags",
    ]


def test_float32_stays_if_all_signals_are_float32():
    single = log(dtype=np.float32).slice(0, 150)
    out, _ = run(CUBE, [single], single.schema)
    assert {out.schema.field(name).type for name in out.column_names[1:-1]} == {pa.float32()}
    t = single.column("t").to_numpy() * 1e-3
    cube = cf.Cube(array(), cf.PiForm(kp=2.0, ki=0.5))
    expected = cube.stream(dtype=np.float32).estimate(*signals(single, np.float32), t=t)
    assert expected.gravity.dtype == expected.angles.dtype == np.float32
    same(out, {"phi3": (expected.phi3.astype(float) / DEGREE).astype(np.float32)})
    np.testing.assert_array_equal(columns(out, "gravity"), expected.gravity)
    plain, _ = run(ARRAY, [single], single.schema)
    assert plain.schema.field("gravity_x").type == pa.float32()
    np.testing.assert_array_equal(columns(plain, "gravity"), array().gravity(signals(single, np.float32)[1]))
    wide = single.set_column(
        single.schema.get_field_index("w3"), "w3", single.column("w3").cast(pa.float64())
    )
    out, _ = run(CUBE, [wide], wide.schema)
    assert out.schema.field("phi2").type == pa.float64()


@pytest.mark.parametrize("pieces", [[], [12], [8, 12, 33]])
def test_missing_samples_can_be_refused(pieces):
    batch = complete()
    for row, name in ((12, "g3y"), (30, "a1x")):
        values = batch.column(name).to_numpy().copy()
        values[row] = np.nan
        batch = batch.set_column(batch.schema.get_field_index(name), name, pa.array(values))
    policy = '[policy]\nmissing = "raise"\n'
    for recipe in (CUBE.replace("[policy]\n", policy), ARRAY + policy):
        # The first row, though the signal of a later one is read earlier.
        with pytest.raises(LogError, match=r'^row 13 has no number in column "g3y" \(gyro of sensor 3\)$'):
            run(recipe, cut(batch, pieces))
        assert run(recipe, [complete()])[0].num_rows == 50  # the unused channel is not missing
    with pytest.raises(
        LogError, match=r'^row 31 has no number in column "a1x" \(accelerometer of sensor 1\)$'
    ):
        run(WITHOUT_GYROS + policy, cut(batch, pieces))


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_examples_cube_through_the_command_line(tmp_path, ending):
    """A cube at rest, turned by 10°/s in its sensors' eyes: every column is what it must be."""
    recipe = load_recipe(EXAMPLES / "cube.toml")
    phi2, phi3, rate = 35.0 * DEGREE, -40.0 * DEGREE, np.array([2.0, -1.0, 0.5])
    up = np.array([-np.cos(phi2) * np.cos(phi3), np.cos(phi2) * np.sin(phi3), -np.sin(phi2)])
    data = {"t": 0.001 * np.arange(3000)}
    for i, rotation in enumerate(recipe.filter.sensors.array.rotations, 1):
        data |= {
            f"a{i}{axis}": np.full(3000, value) for axis, value in zip("xy", rotation @ up, strict=False)
        }
        data |= {
            f"g{i}{axis}": np.full(3000, value) for axis, value in zip("xyz", rotation @ rate, strict=True)
        }
    data |= {f"w{i}": np.full(3000, 100.0 * i) for i in (1, 2, 3)}
    table = pa.table(data)
    write = {"csv": pyarrow.csv.write_csv, "parquet": pq.write_table}[ending]
    write(table, tmp_path / f"log.{ending}")
    command = [
        sys.executable,
        "-m",
        "compfilt",
        "run",
        str(EXAMPLES / "cube.toml"),
        f"log.{ending}",
        "-o",
        "out.parquet",
    ]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert (process.returncode, process.stderr) == (
        0,
        f"compfilt: log.{ending}: 3000 samples -> out.parquet\n",
    )
    out = pq.read_table(tmp_path / "out.parquet")
    np.testing.assert_allclose(columns(out, "gravity"), np.tile(G * up, (3000, 1)), atol=1e-9)
    np.testing.assert_allclose(columns(out, "body_rate"), np.tile(rate, (3000, 1)), atol=1e-9)
    wheels = rate + 6.0 * 100.0 * np.array([1, 2, 3])  # 1 rpm is 6°/s
    np.testing.assert_allclose(columns(out, "wheel_rate"), np.tile(wheels, (3000, 1)), atol=1e-9)
    assert out.column("phi2").to_numpy()[0] == pytest.approx(35.0)
    assert out.column("phi3").to_numpy()[0] == pytest.approx(-40.0)
    assert set(out.column("flags").to_pylist()) == {0}
