"""Replays: a device's recording against the same filter, to the bit."""

import gzip

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

import compfilt as cf
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.replay import Difference, parse_names, replay_trace
from test_cli import compfilt, one_line

RECIPE = """
version = 1
[log]
rate = 100.0
measurement = { column = "y", unit = "rad" }
derivative = { column = "u", unit = "rad/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[output]
columns = ["estimate", "bias", "flags"]
unit = "deg"
"""


def bits(value):
    return f"0x{int(np.float32(value).view(np.uint32)):08x}"


def recorded(rows=500):
    """What a device records: a stream of single samples in float32, one of them missing."""
    rng = np.random.default_rng(3)
    y, u = rng.normal(size=(2, rows)).astype(np.float32)
    y[10] = np.nan
    stream = cf.PiForm(kp=2.0, ki=1.0).stream(fs=100.0, dtype=np.float32)
    angle, bias, flags = [], [], []
    for measurement, derivative in zip(y, u, strict=True):
        estimate = stream.estimate(np.array([measurement]), np.array([derivative]))
        angle.append(estimate.angle[0])
        bias.append(estimate.bias[0])
        flags.append(int(estimate.flags[0]))
    return {"y": y, "u": u, "estimate": np.array(angle), "bias": np.array(bias), "flags": np.array(flags)}


def written(path, columns, form, separator=","):
    """Write a trace as decimals, as bits, or as Parquet."""
    if form == "parquet":
        pyarrow.parquet.write_table(pa.table({**columns, "flags": columns["flags"].astype(np.uint8)}), path)
        return path
    lines = [separator.join(columns)]
    for row in zip(*columns.values(), strict=True):
        fields = [form(value) if isinstance(value, np.float32) else str(value) for value in row]
        lines.append(separator.join(fields))
    content = ("\n".join(lines) + "\n").encode()
    path.write_bytes(gzip.compress(content) if path.suffix == ".gz" else content)
    return path


@pytest.mark.parametrize(
    ("name", "form"),
    [("a.csv", str), ("b.csv", bits), ("c.parquet", "parquet")],
    ids=["decimal", "bits", "parquet"],
)
def test_the_same_bits(tmp_path, name, form):
    replay = replay_trace(parse_recipe(RECIPE), written(tmp_path / name, recorded(), form))
    assert (replay.rows, replay.columns, replay.differences) == (500, ("estimate", "bias", "flags"), ())
    assert replay.lines() == ["500 samples of estimate, bias, flags: the same bits"]


@pytest.mark.parametrize(
    ("name", "separator", "log"),
    [
        ("a.tsv", "\t", ""),
        ("a.csv.gz", ",", ""),
        ("a.TSV.gz", "\t", ""),
        ("a.csv", ";", 'separator = ";"'),
        ("a.tsv", "|", 'separator = "|"'),
    ],
)
@pytest.mark.parametrize("form", [str, bits], ids=["decimal", "bits"])
def test_a_text_is_read_as_by_runs(tmp_path, name, separator, log, form):
    columns = recorded(100)
    columns["bias"][50] = 7.0
    recipe = parse_recipe(RECIPE.replace("[log]", f"[log]\n{log}"))
    (difference,) = replay_trace(recipe, written(tmp_path / name, columns, form, separator)).differences
    assert (difference.row, difference.column, difference.found) == (51, "bias", np.float32(7.0))


def test_a_trace_that_is_cut_is_named(tmp_path):
    trace = written(tmp_path / "device.csv", recorded(100), bits)
    trace.write_bytes(trace.read_bytes()[:-30])
    with pytest.raises(LogError, match="the log cannot be read from line 101 on: its last row has"):
        replay_trace(parse_recipe(RECIPE), trace)


def test_where_they_part(tmp_path):
    columns = recorded()
    columns["bias"][300] = np.nextafter(columns["bias"][300], np.float32(9), dtype=np.float32)
    columns["estimate"][400:410] += np.float32(1)
    columns["flags"][450] = 2
    replay = replay_trace(parse_recipe(RECIPE), written(tmp_path / "device.csv", columns, bits))
    assert [(d.row, d.column, d.rows) for d in replay.differences] == [
        (301, "bias", 1),
        (401, "estimate", 10),
        (451, "flags", 1),
    ]
    assert replay.differences[0].ulps == 1
    assert replay.differences[0].found == columns["bias"][300]
    first, _, last = replay.lines()
    assert first.startswith('row 301, column "bias": expected ')
    assert first.endswith(", 1 ulp apart")
    assert last == 'row 451, column "flags": expected 0, found 2'


@given(st.floats(-(2.0**99), 2.0**99, width=32), st.integers(-19, 19))
def test_ulps_count_the_numbers_between(value, steps):
    start = np.float32(value)
    end = start
    with np.errstate(under="ignore"):
        for _ in range(abs(steps)):
            end = np.nextafter(end, np.float32(np.copysign(np.inf, steps)), dtype=np.float32)
    assert Difference(1, None, "x", start, end, 1).ulps == abs(steps)


def test_times_and_other_names(tmp_path):
    columns = recorded()
    columns = {"t": np.arange(500) / 100.0, **columns}
    columns["est"] = columns.pop("estimate")
    recipe = parse_recipe(RECIPE.replace("rate = 100.0", 'time = { column = "t", unit = "s" }'))
    stream = cf.PiForm(kp=2.0, ki=1.0).estimate(columns["y"], columns["u"], t=columns["t"])
    columns |= {"est": stream.angle.copy(), "bias": stream.bias, "flags": stream.flags}
    trace = written(tmp_path / "device.csv", columns, str)
    assert not replay_trace(recipe, trace, {"estimate": "est"}).differences
    columns["est"][7] = np.float32("nan")
    (difference,) = replay_trace(recipe, written(trace, columns, str), {"estimate": "est"}).differences
    assert (difference.row, difference.time, difference.ulps) == (8, 0.07, None)
    assert "row 8 (time 0.07)" in str(difference)


@pytest.mark.parametrize("dtype", [pa.timestamp("ms"), pa.duration("ms"), pa.int64()], ids=str)
def test_the_trace_tells_the_unit_of_its_times(tmp_path, dtype):
    columns = recorded()
    ticks = 10 * np.arange(500)
    stream = cf.PiForm(kp=2.0, ki=1.0).estimate(columns["y"], columns["u"], t=ticks / 1000.0)
    columns |= {"estimate": stream.angle.copy(), "bias": stream.bias, "flags": stream.flags}
    columns["estimate"][7] = np.float32("nan")
    times = pa.array(ticks).cast(dtype)
    table = pa.table({"t": times, **columns})
    schema = table.schema.set(0, pa.field("t", dtype, metadata={"unit": "ms"}))
    pyarrow.parquet.write_table(table.cast(schema), tmp_path / "device.parquet")
    recipe = parse_recipe(RECIPE.replace("rate = 100.0", 'time = { column = "t" }'))
    (difference,) = replay_trace(recipe, tmp_path / "device.parquet").differences
    assert (difference.row, difference.time) == (8, 0.07)


def test_a_trace_without_rows_is_not_the_same(tmp_path):
    trace = tmp_path / "device.csv"
    trace.write_text("y,u,estimate,bias,flags\n", encoding="utf-8")
    with pytest.raises(LogError, match="the file holds no rows"):
        replay_trace(parse_recipe(RECIPE), trace)


def test_an_attitude_is_compared_as_a_quaternion(tmp_path):
    rng = np.random.default_rng(1)
    gyr = rng.normal(size=(200, 3)).astype(np.float32)
    acc = (rng.normal(size=(200, 3)) + np.array([0, 0, 9.8])).astype(np.float32)
    text = """
version = 1
[log]
rate = 100.0
gyro = { columns = ["gx", "gy", "gz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
axes = "flu"
[filter]
kind = "attitude"
[output]
columns = ["quaternion", "at_rest"]
unit = "rad"
"""
    estimate = cf.GravityFilter().estimate(gyr, acc, fs=100.0)
    columns = {
        name: values
        for axes, table in (("gx gy gz", gyr), ("ax ay az", acc), ("qw qx qy qz", estimate.quaternion))
        for name, values in zip(axes.split(), table.T, strict=True)
    }
    columns["at_rest"] = estimate.at_rest.astype(int)
    trace = written(tmp_path / "device.csv", columns, bits)
    assert not replay_trace(parse_recipe(text), trace).differences
    with pytest.raises(UsageError, match='"roll" is computed in float64'):
        replay_trace(parse_recipe(text.replace('"quaternion"', '"roll"')), trace)


def test_errors(tmp_path):
    recipe = parse_recipe(RECIPE)
    columns = recorded(20)
    with pytest.raises(UsageError, match='the recipe has no output "roll"; it has estimate, bias, flags'):
        replay_trace(recipe, tmp_path / "none.csv", {"roll": "x"})
    trace = written(tmp_path / "device.csv", columns, bits)
    with pytest.raises(LogError, match='no column "est"'):
        replay_trace(recipe, trace, {"estimate": "est"})
    trace.write_text(trace.read_text().replace(bits(columns["u"][4]), "0xzz"), encoding="utf-8")
    with pytest.raises(
        LogError, match='row 5: column "u" holds "0xzz", neither a number nor the bits of one'
    ):
        replay_trace(recipe, trace)
    for text in ("a", "a=", "=b", "a=b,a=c"):
        with pytest.raises(UsageError, match="--out-columns"):
            parse_names(text)


def test_the_command(tmp_path):
    (tmp_path / "pi.toml").write_text(RECIPE, encoding="utf-8")
    columns = recorded()
    written(tmp_path / "good.csv", columns, bits)
    columns["bias"][300] = 0.0
    columns["est"] = columns.pop("estimate")
    written(tmp_path / "bad.csv", columns, bits)
    one_line(compfilt("replay", "good.csv", "pi.toml", cwd=tmp_path), 0, "the same bits")
    bad = compfilt("replay", "bad.csv", "pi.toml", "--out-columns", "estimate=est", cwd=tmp_path)
    one_line(bad, 1, 'bad.csv: row 301, column "bias"')
    one_line(compfilt("replay", "bad.csv", "pi.toml", cwd=tmp_path), 1, 'no column "estimate"')
    one_line(compfilt("replay", "good.csv", "pi.toml", "--out-columns", "x", cwd=tmp_path), 2, "NAME=COLUMN")
