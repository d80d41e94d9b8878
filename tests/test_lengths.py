"""A unit that is grossly wrong is said after a run, from the mean length of what the sensors read; the result stays as it is."""

import json
import pickle

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compfilt.__main__ import main
from compfilt.logs import Pipeline, parse_recipe
from compfilt.logs.merge import merge_states
from handled import FORCE, GYRO, handled, save

RECIPE = """
version = 1
[log]
time = {{ column = "t", unit = "s" }}
gyro = {{ columns = ["gx", "gy", "gz"], unit = "{gyro}" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "{force}" }}
axes = "flu"
[filter]
{filter}
[output]
columns = ["roll", "pitch"]
unit = "deg"
"""
FILTERS = ('kind = "attitude"', 'kind = "tilt"\ndesign = { kind = "first_order", tau = 0.5 }')


@pytest.fixture(scope="module")
def log():
    return handled(seconds=60.0, rate=100.0, seed=5)


def recipe(force="m/s^2", gyro="rad/s", kind=FILTERS[0]):
    return RECIPE.format(force=force, gyro=gyro, filter=kind)


def warnings(log, text):
    pipeline = Pipeline(parse_recipe(text))
    pipeline.filter(pa.table(log))
    return [length.doubt for length in pipeline.lengths.values() if length.doubt]


@pytest.mark.parametrize("kind", FILTERS)
def test_right_units_are_not_doubted(log, kind):
    assert warnings(log, recipe(kind=kind)) == []


@pytest.mark.parametrize(
    ("factor", "claimed", "words"),
    [
        (1 / 9.80665, "m/s^2", ("mean length is 1", "m/s^2, not 9.8: is its unit g?")),
        (1.0, "g", ("is its unit m/s^2?",)),
        (1000 / 9.80665, "g", ("is its unit mg?",)),
        (0.05, "m/s^2", ("is its unit right?",)),
        (0.0, "m/s^2", ("mean length is 0 m/s^2",)),
    ],
)
def test_an_accelerometer_in_another_unit(log, factor, claimed, words):
    spoilt = log | {name: factor * log[name] for name in FORCE}
    (found,) = warnings(spoilt, recipe(force=claimed))
    assert found.startswith("the accelerometer's mean length is ")
    assert found.endswith('"compfilt check LOG --recipe RECIPE" tells')
    for part in words:
        assert part in found


def test_a_gyro_in_degrees(log):
    """And one that turns nearly a turn in a second, in right units, is not doubted."""
    spoilt = log | {name: np.degrees(log[name]) for name in GYRO}
    (found,) = warnings(spoilt, recipe())
    assert "the gyro says " in found
    assert "is its unit deg/s?" in found
    mean = np.linalg.norm([log[name] for name in GYRO], axis=0).mean()
    assert warnings(log | {name: 0.9 * 2 * np.pi / mean * log[name] for name in GYRO}, recipe()) == []


def test_samples_that_are_no_numbers_do_not_count(log):
    """And a few wild ones, which spoil the mean, do not make a doubt."""
    spoilt = {name: values.copy() for name, values in log.items()}
    spoilt["az"][::32] = np.nan
    spoilt["ay"][16::96] = np.inf
    spoilt["ax"][48] = 1e300
    pipeline = Pipeline(parse_recipe(recipe()))
    pipeline.filter(pa.table(spoilt))
    assert pipeline.lengths["accelerometer"].count == 375 - 188 - 63
    assert pipeline.lengths["accelerometer"].doubt == ""
    assert warnings(log | {name: np.full_like(log[name], np.nan) for name in FORCE}, recipe()) == []


@given(st.lists(st.integers(1, 700), min_size=1, max_size=6))
def test_the_sums_do_not_depend_on_the_batches(log, sizes):
    """Nor on a pause between them, nor on the log being filtered in parts."""
    table = pa.table(log).combine_chunks()
    whole = Pipeline(parse_recipe(recipe()))
    whole.filter(table)
    cut = Pipeline(parse_recipe(recipe()))
    start = 0
    for size in [*sizes, table.num_rows]:
        cut.filter(table.slice(start, size))
        start += size
        cut = pickle.loads(pickle.dumps(cut))
    sums = {name: length.state for name, length in whole.lengths.items()}
    assert sums == {name: length.state for name, length in cut.lengths.items()}
    state = whole.state
    assert merge_states(state, state)["lengths"] == {
        name: [2 * part for part in sum_] for name, sum_ in sums.items()
    }


@pytest.mark.parametrize("more", [(), ("--json",)])
def test_the_command_says_it(log, tmp_path, capsys, monkeypatch, more):
    """On stderr, in the report and in the JSON; the exit status is 0."""
    monkeypatch.chdir(tmp_path)
    save(log | {name: log[name] / 9.80665 for name in FORCE}, tmp_path / "log.parquet")
    (tmp_path / "recipe.toml").write_text(recipe(), encoding="utf-8")
    monkeypatch.setattr(
        "sys.argv", ["compfilt", "run", "recipe.toml", "log.parquet", "-o", "out.parquet", *more]
    )
    with pytest.raises(SystemExit) as leaving:
        main()
    assert leaving.value.code == 0
    told = capsys.readouterr()
    report = json.loads((tmp_path / "out.parquet.quality.json").read_text(encoding="utf-8"))
    (warning,) = report["warnings"]
    assert told.err.count("warning") == 1
    assert f"compfilt: log.parquet: warning: {warning}\n" in told.err
    if more:
        assert json.loads(told.out)["quality"]["warnings"] == [warning]
    assert pq.read_table("out.parquet").num_rows == len(log["t"])
