"""What is said about a log before anyone filters it: faults put in on purpose are found, and none is invented."""

import json
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import check
from compfilt import simulate
from compfilt.__main__ import main
from compfilt.logs import load_recipe, parse_recipe, run_log
from compfilt.logs.check import check_log
from compfilt.logs.check import segments as segments_module
from compfilt.logs.check import source as source_module
from compfilt.logs.check.channels import Channels
from compfilt.logs.check.claims import by_names
from compfilt.logs.check.fit import fit
from compfilt.logs.check.lines import mended, toml_text, turned_columns
from compfilt.logs.check.mounting import decide
from compfilt.logs.check.segments import Slicer
from compfilt.logs.check.source import Column, number_columns
from compfilt.logs.check.times import Times, likely_unit
from compfilt.logs.check.turning import MOUNTINGS, try_mountings
from compfilt.logs.errors import LogError
from handled import FORCE, GYRO, MAG, handled, save

# Which way is up shows only where the body stands upright most of the time: see the test of the drive.
SI = check.RECIPE.format(clock=check.TIME, magnetometer="")
FAULTS = {fault.name: fault for fault in check.faults() if fault.name not in {"clean", "acc. xyz negated"}}


@pytest.fixture(scope="module")
def log():
    return handled(seconds=150.0, rate=100.0, seed=3)


@pytest.fixture(scope="module")
def extract(log):
    """The pieces of the log, its columns gyro, accelerometer, magnetometer."""
    return sliced(np.column_stack([log[name] for name in (*GYRO, *FORCE, *MAG)]), 0.01)


def sliced(values, period, sizes=(10**9,)):
    slicer = Slicer(values.shape[1], period)
    steps = np.full(len(values), period)
    start, turn = 0, 0
    while start < len(values):
        end = start + sizes[turn % len(sizes)]
        slicer.follow(values[start:end], steps[start:end])
        start, turn = end, turn + 1
    return slicer.finish()


# ------------------------------------------------------------------------------------------------------------ whole logs


def test_nothing_is_invented(log):
    clean = check.Fault("clean", dict, ())
    for with_field in (True, False):
        report = check.check(log, clean, magnetometer=with_field)
        assert report.wrong == ()
        assert report.about("gyro unit")[0].what == "rad/s"
        assert {finding.level for finding in report.about("axes")} == {"note"}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found(log, name):
    fault = FAULTS[name]
    if fault.clock.startswith("rate"):
        rate = 200.0 if "twice" in name else 50.0
        fault = check.Fault(name, fault.spoil, fault.topics, f"rate = {rate}")
    report = check.check(log, fault)
    assert check.verdict(report, fault).startswith("found"), str(report)
    if fault.clock.startswith("rate"):
        fix = report.about("rate")[0].fix
        assert float(fix.removeprefix("rate = ")) == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize(
    "name", ["gyro in deg/s", "gyro x and y swapped", "gyro z negated", "acc. y and z swapped"]
)
def test_without_a_magnetometer(log, name):
    """Gravity alone shows the axes too; whose they are may have two answers."""
    fault = FAULTS[name]
    assert check.verdict(check.check(log, fault, magnetometer=False), fault).startswith("found")


@pytest.mark.parametrize(
    "name",
    [
        "accelerometer in g",
        "gyro in deg/s",
        "time in ms",
        "gyro x and z swapped",
        "gyro yz negated",
        "acc. x negated",
    ],
)
def test_the_fix_mends_the_log(log, tmp_path, name):
    """The lines that are proposed replace those of the recipe, and then nothing is wrong."""
    fault = FAULTS[name]
    report = check.check(log, fault)
    text = check.RECIPE.format(
        clock=check.TIME, magnetometer='magnetometer = { columns = ["mx", "my", "mz"], unit = "uT" }'
    )
    for finding in report.wrong:
        key = finding.fix.split(" = ")[0]
        text = "\n".join(finding.fix if line.startswith(key + " =") else line for line in text.splitlines())
    path = save(fault.spoil(log), tmp_path / "log.parquet")
    assert check_log(path, parse_recipe(text)).wrong == ()


def test_the_proposed_recipe_runs(log, tmp_path):
    """From units and axes that nobody names to angles that are right."""
    spoilt = check.scaled(GYRO, 180 / np.pi)(check.scaled(FORCE, 1 / 9.81)(check.scaled(("t",), 1e6)(log)))
    spoilt = check.mounted(GYRO, (1, 0, 2), (1.0, -1.0, 1.0))(spoilt)
    path = save(spoilt, tmp_path / "log.parquet")
    report = check_log(path)
    assert [finding.topic for finding in report.wrong] == ["axes"]
    recipe = parse_recipe(report.recipe)
    run_log(recipe, path, tmp_path / "out.parquet")
    right = save(log, tmp_path / "right.parquet")
    run_log(parse_recipe(check_log(right).recipe), right, tmp_path / "right_out.parquet")
    roll, true = (read(tmp_path / name, "roll") for name in ("out.parquet", "right_out.parquet"))
    apart = (roll - true + 180.0) % 360.0 - 180.0
    assert np.median(np.abs(apart)) < 0.1


def read(path, name):
    return pq.read_table(path)[name].to_numpy()


TOLD = [
    (pa.timestamp("us"), 1e6),
    (pa.timestamp("ns", "UTC"), 1e9),
    (pa.duration("ms"), 1e3),
    (pa.uint64(), 1e6),
]


@pytest.mark.parametrize(("kind", "ticks"), TOLD, ids=[str(kind) for kind, _ in TOLD])
def test_the_log_tells_the_unit_of_its_times(log, tmp_path, kind, ticks):
    """By their type or the metadata; whatever the column is called, and even if its first row is empty."""
    unit = {1e3: "ms", 1e6: "us", 1e9: "ns"}[ticks]
    counted = np.round(ticks * (log["t"] + (1.7e9 if ticks < 1e9 else 1.7e8))).astype(np.int64)
    times = pa.array(counted.tolist()[:1000]).cast(kind)
    times = pa.concat_arrays([pa.nulls(1, kind), times.slice(1)])
    fields = [pa.field("when", kind, metadata={"unit": unit} if kind == pa.uint64() else None)]
    fields += [pa.field(name, pa.float64()) for name in (*GYRO, *FORCE)]
    table = pa.table([times, *(log[name][:1000] for name in (*GYRO, *FORCE))], schema=pa.schema(fields))
    pq.write_table(table, tmp_path / "log.parquet")
    clock = 'time = {{ column = "when"{unit} }}'
    for claimed, topics in (("", ["time"]), (', unit = "s"', ["time unit", "time"])):
        recipe = check.RECIPE.format(clock=clock.format(unit=claimed), magnetometer="")
        report = check_log(tmp_path / "log.parquet", parse_recipe(recipe))
        assert [finding.topic for finding in report.wrong] == topics
        assert report.about("time")[0].what == "1 row has no time"
    (finding,) = report.about("time unit")
    assert finding.what == f"the times are in {unit}, not in s"
    assert "the log tells its unit itself" in finding.evidence
    assert parse_recipe(recipe.replace(clock.format(unit=claimed), finding.fix)).clock.unit.name == unit
    if kind != pa.uint64():
        guessed = check_log(tmp_path / "log.parquet")
        assert guessed.about("rate")[0].what == f"100 Hz, time in {unit}"


def test_times_of_a_type_that_cannot_be(log, tmp_path):
    """Milliseconds that were written down as nanoseconds: no recipe may say so, the column must be written anew."""
    times = pa.array(np.round(1e3 * log["t"]).astype(np.int64)).cast(pa.timestamp("ns"))
    pq.write_table(
        pa.table({"t": times, **{name: log[name] for name in (*GYRO, *FORCE)}}), tmp_path / "log.parquet"
    )
    (finding,) = check_log(tmp_path / "log.parquet").wrong
    assert (finding.what, finding.fix) == ("the times are in ms, not in ns", "")
    assert "no recipe may say another" in finding.evidence


def test_unsigned_times_may_go_back_before_the_first(log, tmp_path):
    ticks = np.round(1e6 * log["t"]).astype(np.uint64) + np.uint64(2**63)
    ticks[500:600] -= np.uint64(10**7)
    columns = {"t": pa.array(ticks), **{name: log[name] for name in (*GYRO, *FORCE)}}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    report = check_log(tmp_path / "log.parquet")
    assert report.about("backwards time")[0].what == 'column "t" runs backwards once, by up to 9.99e+06 us'


def test_columns_without_names_are_found_by_what_they_do(log, tmp_path):
    names = {name: f"c{place}" for place, name in enumerate(("t", *FORCE, *GYRO))}
    path = save({names[name]: log[name] for name in names}, tmp_path / "log.parquet")
    report = check_log(path)
    assert report.wrong == ()
    assert 'time = { column = "c0", unit = "s" }' in report.recipe
    assert 'gyro = { columns = ["c4", "c5", "c6"], unit = "rad/s" }' in report.recipe
    assert 'accelerometer = { columns = ["c1", "c2", "c3"], unit = "m/s^2" }' in report.recipe


def test_what_cannot_be_told_is_said(tmp_path):
    """A sensor that lies still shows units of acceleration, but not which way its axes go."""
    rng = np.random.default_rng(1)
    count = 6000
    log = {"t": np.arange(count) / 100.0}
    log |= {name: rng.normal(0, 0.002, count) for name in GYRO}
    log |= {name: rng.normal(9.81 * (name == "az"), 0.02, count) for name in FORCE}
    report = check_log(
        save(log, tmp_path / "still.parquet"),
        parse_recipe(check.RECIPE.format(clock=check.TIME, magnetometer="")),
    )
    assert report.wrong == ()
    unknown = {finding.topic for finding in report.findings if finding.level == "unknown"}
    assert {"gyro unit", "axes", "accelerometer offset"} <= unknown


def test_a_turn_about_the_vertical_says_nothing_of_the_axes(tmp_path):
    log = handled(seconds=60.0, seed=4)
    log |= dict.fromkeys(
        ("gx", "gy"), 0.0 * log["t"] + np.random.default_rng(0).normal(0, 0.002, log["t"].size)
    )
    rng = np.random.default_rng(2)
    log |= {name: rng.normal(9.81 * (name == "az"), 0.02, log["t"].size) for name in FORCE}
    report = check_log(
        save(log, tmp_path / "yaw.parquet"),
        parse_recipe(check.RECIPE.format(clock=check.TIME, magnetometer="")),
    )
    assert [f.topic for f in report.wrong] == []
    assert report.about("axes")[0].level == "unknown"


@pytest.mark.parametrize("seed", range(3))
def test_a_simulated_drive_is_clean(tmp_path, seed):
    simulate.write(simulate.child_seat(seed=seed), tmp_path / "seat.parquet")
    report = check_log(tmp_path / "seat.parquet")
    assert report.wrong == ()
    assert report.about("gyro unit")[0].what == "deg/s"


def test_an_acceleration_in_place_of_a_specific_force(tmp_path):
    """All three negated turns just as gravity does: only where it points gives it away."""
    recipe = (
        check.RECIPE.replace('"rad/s"', '"deg/s"')
        .replace('"m/s^2"', '"g"')
        .format(clock=check.TIME, magnetometer="")
    )
    log = simulate.child_seat(duration=60.0)
    for sign, topics in ((1.0, []), (-1.0, ["direction of gravity"])):
        simulate.write(check.scaled(FORCE, sign)(log), tmp_path / "seat.parquet")
        report = check_log(tmp_path / "seat.parquet", parse_recipe(recipe))
        assert [finding.topic for finding in report.wrong] == topics


def test_a_unit_that_the_file_names_wrongly(tmp_path):
    """What is simulated writes its units into a Parquet file."""
    log = simulate.child_seat(seed=1)
    log |= {name: np.radians(log[name]) for name in GYRO}
    simulate.write(log, tmp_path / "seat.parquet")
    report = check_log(tmp_path / "seat.parquet")
    assert [finding.what for finding in report.wrong] == ["the gyro is in rad/s, not in deg/s"]


def test_raw_counts(log, tmp_path):
    """16384 counts a g, 16.4 counts a deg/s: no unit, but a scale."""
    spoilt = check.scaled(FORCE, 16384 / 9.81)(check.scaled(GYRO, 16.4 * 180 / np.pi)(log))
    report = check_log(save(spoilt, tmp_path / "raw.parquet"))
    recipe = parse_recipe(report.recipe)
    assert recipe.filter.accelerometer.scale[0] * 16384 / 9.81 == pytest.approx(1.0, rel=0.02)
    gyro = recipe.filter.gyro
    assert gyro.unit.factor * gyro.scale[0] * 16.4 * 180 / np.pi == pytest.approx(1.0, rel=0.05)


def test_an_offset_shows_over_many_orientations(log, tmp_path):
    spoilt = log | {"ax": log["ax"] + 1.5}
    report = check_log(save(spoilt, tmp_path / "offset.parquet"))
    (finding,) = report.about("accelerometer offset")
    assert finding.level == "wrong"
    assert finding.what.startswith("(1.5, ")


def test_a_delay_is_found(log, tmp_path):
    late = {name: np.concatenate((np.repeat(log[name][0], 8), log[name][:-8])) for name in FORCE}
    report = check_log(save(log | late, tmp_path / "late.parquet"))
    (finding,) = report.about("gyro delay")
    assert finding.level == "wrong"
    assert "the accelerometer is" in finding.what
    # What is to be said of the filter is in the recipe, and it is read.
    line = finding.fix.split("  #")[0]
    assert line.startswith("gyro_delay = ")
    assert f'method = "gravity"\n{line}\n' in report.recipe
    assert parse_recipe(report.recipe)


def test_what_is_wrong_comes_first(log, tmp_path):
    """Then what cannot be told, then the rest; on paper as in the report."""
    spoilt = {name: values[:1500] for name, values in check.scaled(("t",), 1e3)(log).items()}
    report = check_log(save(spoilt, tmp_path / "log.parquet"), parse_recipe(SI))
    levels = [finding.level for finding in report.findings]
    assert levels == sorted(levels, key=("wrong", "unknown", "note").index)
    assert set(levels) == {"wrong", "unknown", "note"}
    marks = [line.split(":")[0] for line in str(report).splitlines()[1:] if not line.startswith(" ")]
    assert list(dict.fromkeys(marks)) == ["WRONG", "cannot be told", "ok"]


@pytest.mark.parametrize(("name", "word"), [("log.csv", "line 502"), ("log.parquet", "row 501")])
def test_a_way_back_is_named_with_what_accepts_it(log, tmp_path, name, word):
    """In a text by the line, of which the header is the first."""
    spoilt = {name: values[:1500].copy() for name, values in log.items()}
    spoilt["t"][500:] -= 1.0
    simulate.write(spoilt, tmp_path / name)
    report = check_log(tmp_path / name, parse_recipe(SI))
    (finding,) = report.about("backwards time")
    assert finding.level == "wrong"
    assert finding.evidence.startswith(f"{word};")
    line = finding.fix.split("  #")[0]
    with pytest.raises(LogError, match=rf"^{word}: time runs backwards by 0.99 s; {line} in \[policy\]"):
        run_log(parse_recipe(SI), tmp_path / name, tmp_path / "out.csv")
    accepting = parse_recipe(f"{SI}\n[policy]\n{line}\n")
    assert run_log(accepting, tmp_path / name, tmp_path / "out.csv").rows == 1500
    assert check_log(tmp_path / name, accepting).about("backwards time")[0].level == "note"
    proposed = parse_recipe(check_log(tmp_path / name).recipe)
    assert run_log(proposed, tmp_path / name, tmp_path / "out.csv").rows == 1500


def test_a_bias_is_found_where_the_unit_cannot_be_told(tmp_path):
    """The body only rests: whether the claimed unit is right or not, a filter with that claim would be wrong."""
    rng = np.random.default_rng(2)
    log = {"t": np.arange(9000) / 100}
    log |= {name: np.radians(3.0) + rng.normal(0.0, 0.002, 9000) for name in GYRO}
    log |= {name: 9.81 * (name == "az") + rng.normal(0.0, 0.02, 9000) for name in FORCE}
    path = save(log, tmp_path / "log.parquet")
    report = check_log(path, parse_recipe(SI))
    assert report.about("gyro unit")[0].level == "unknown"
    (finding,) = report.wrong
    assert finding.topic == "gyro bias"
    assert "more than the filters learn" in finding.what
    assert "the log does not tell whether the gyro is in rad/s" in finding.evidence
    small = log | {name: log[name] - np.radians(2.0) for name in GYRO}
    assert check_log(save(small, tmp_path / "small.parquet"), parse_recipe(SI)).wrong == ()
    # Where nobody claims a unit there is no such conclusion, and no number in deg/s either.
    (finding,) = check_log(path).about("gyro bias")
    assert finding.level == "unknown"
    assert finding.what == "the gyro reads (0.0524, 0.0524, 0.0524) at rest, and its unit cannot be told"
    assert "deg/s" not in finding.evidence


def test_axes_that_point_down_are_named(tmp_path):
    """With the line of a recipe that says so."""
    rng = np.random.default_rng(2)
    log = {"t": np.arange(3000) / 100} | {name: rng.normal(0.0, 0.002, 3000) for name in GYRO}
    log |= {name: -9.81 * (name == "az") + rng.normal(0.0, 0.02, 3000) for name in FORCE}
    path = save(log, tmp_path / "log.parquet")
    (finding,) = check_log(path).about("direction of gravity")
    assert "north-east-down" in finding.what
    assert finding.fix == 'axes = "frd"'
    (finding,) = check_log(path, parse_recipe(SI)).about("direction of gravity")
    assert finding.level == "wrong"
    assert finding.fix.splitlines()[1] == 'axes = "frd"  # instead, if z points down, as in north-east-down'


# ------------------------------------------------------------------------------------------------------------ the command


def test_the_command(log, tmp_path, capsys):
    path = save(log, tmp_path / "log.parquet")
    assert run("check", path) == 0
    assert "A recipe that fits:" in capsys.readouterr().out
    spoilt = save(check.scaled(FORCE, 1 / 9.81)(log), tmp_path / "g.parquet")
    (tmp_path / "si.toml").write_text(
        check.RECIPE.format(clock=check.TIME, magnetometer=""), encoding="utf-8"
    )
    assert load_recipe(tmp_path / "si.toml")
    assert run("check", spoilt, "--recipe", tmp_path / "si.toml", "--json") == 1
    report = json.loads(capsys.readouterr().out)
    assert not report["clean"]
    assert report["findings"][0]["topic"] == "accelerometer unit"
    assert report["findings"][0]["fix"].endswith('unit = "g" }')


def test_failures_are_one_line(tmp_path, capsys):
    assert run("check", tmp_path / "none.csv") == 1
    assert run("check", tmp_path / "none.csv", "--recipe", tmp_path / "none.toml") == 2
    (tmp_path / "words.csv").write_text("name,place\na,b\n", encoding="utf-8")
    assert run("check", tmp_path / "words.csv") == 1
    captured = capsys.readouterr()
    assert len(captured.err.splitlines()) == 2
    assert "no gyro and accelerometer were found" in captured.out


def run(*arguments):
    """The exit status of the command in this process."""
    before = sys.argv
    sys.argv = ["compfilt", *map(str, arguments)]
    try:
        return main()
    except SystemExit as leave:
        return leave.code
    finally:
        sys.argv = before


# ------------------------------------------------------------------------------------------------------------- the parts


@pytest.mark.parametrize("number", range(0, 48, 9))
def test_every_mounting_is_found(extract, number):
    """The gyro is read through a signed permutation: its inverse explains gravity, and no other."""
    mounting = MOUNTINGS[number]
    values = extract.values.copy()
    values[..., :3] = values[..., :3] @ mounting.T
    read = segments_module.Segments(values, extract.durations, extract.numbers, extract.head)
    trial = try_mountings(read, slice(0, 3), slice(3, 6), np.zeros(3))
    assert trial.sure
    assert np.array_equal(trial.mounting, mounting.T)
    assert trial.accepts_axes == (number == 0)


@pytest.mark.parametrize("scale", [1.0, 0.3, 3.0, 57.3, 0.01])
def test_every_scale_is_found(extract, scale):
    values = extract.values.copy()
    values[..., :3] /= scale
    read = segments_module.Segments(values, extract.durations, extract.numbers, extract.head)
    trial = try_mountings(read, slice(0, 3), slice(3, 6), np.zeros(3))
    found = fit(read, slice(0, 3), slice(3, 6), np.zeros(3), trial.scale * trial.mounting)
    assert found.scale == pytest.approx(scale, rel=0.03)


def test_whose_axes_they_are(extract):
    """An accelerometer that is left-handed looks like a gyro that is turned; a magnetometer tells them apart."""
    flip = np.diag([1.0, 1.0, -1.0])
    values = extract.values.copy()
    values[..., 3:6] = values[..., 3:6] @ flip
    read = segments_module.Segments(values, extract.durations, extract.numbers, extract.head)
    gravity, field = (try_mountings(read, slice(0, 3), slice(at, at + 3), np.zeros(3)) for at in (3, 6))
    with_field, alone = decide(gravity, field), decide(gravity, None)
    for mounting in (with_field, alone):
        assert mounting.wrong == ("accelerometer",)
        assert np.array_equal(mounting.accelerometer, flip)


def test_mended_columns_are_the_right_axes():
    """What the recipe line reads is the matrix times the columns as they were."""
    rng = np.random.default_rng(5)
    values = rng.normal(size=3)
    triad = by_names([Column(name, None) for name in GYRO]).triads["gyro"]
    for matrix in MOUNTINGS:
        columns, signs = turned_columns(triad, matrix)
        read = [sign * values[GYRO.index(column)] for column, sign in zip(columns, signs, strict=True)]
        np.testing.assert_array_equal(read, matrix @ values)
        assert parse_signal_text(mended(triad, matrix, "rad/s"))


def parse_signal_text(text):
    """A recipe accepts the line."""
    return parse_recipe(
        check.RECIPE.format(clock=check.TIME, magnetometer="").replace(
            'gyro = { columns = ["gx", "gy", "gz"], unit = "rad/s" }', f"gyro = {text}"
        )
    )


@pytest.mark.parametrize(
    ("names", "gyro", "accelerometer", "time"),
    [
        (("t", *GYRO, *FORCE, *MAG), "gx", "ax", "t"),
        (("timestamp_us", "gyro_x_dps", "gyro_y_dps", "gyro_z_dps", "acc_x_g", "acc_y_g", "acc_z_g"), "gyro_x_dps", "acc_x_g", "timestamp_us"),
        (("time", "AccX", "AccY", "AccZ", "GyrX", "GyrY", "GyrZ"), "GyrX", "AccX", "time"),
        (
            ("stamp", *(f"{name}.{axis}" for name in ("angular_velocity", "linear_acceleration") for axis in "xyz")),
            "angular_velocity.x", "linear_acceleration.x", "stamp",
        ),
        (
            ("timestamp", *(f"gyro_rad[{i}]" for i in range(3)), *(f"accelerometer_m_s2[{i}]" for i in range(3))),
            "gyro_rad[0]", "accelerometer_m_s2[0]", "timestamp",
        ),
    ],
)  # fmt: skip
def test_names_are_understood(names, gyro, accelerometer, time):
    claims = by_names([Column(name, None) for name in names])
    assert claims.triads["gyro"].columns[0] == gyro
    assert claims.triads["accelerometer"].columns[0] == accelerometer
    assert claims.time == time
    units = {"gyro_x_dps": "dps", "gyro_rad[0]": "rad/s"}
    unit = claims.triads["gyro"].unit
    assert (unit.name if unit else None) == units.get(gyro)


@pytest.mark.parametrize(
    ("step", "unit"), [(0.005, "s"), (10.0, "ms"), (2500.0, "us"), (1e7, "ns"), (0.1, "s")]
)
def test_a_time_unit_by_its_step(step, unit):
    assert likely_unit(step).name == unit


def test_the_extract_does_not_depend_on_the_batches(log):
    values = np.column_stack([log[name] for name in (*GYRO, *FORCE)])
    whole, parts = sliced(values, 0.005), sliced(values, 0.005, (1, 700, 13, 2048))
    np.testing.assert_array_equal(whole.values, parts.values)
    np.testing.assert_array_equal(whole.durations, parts.durations)
    np.testing.assert_array_equal(whole.head, parts.head)


def test_the_extract_is_bounded(monkeypatch):
    monkeypatch.setattr(segments_module, "KEPT", 4)
    extract = sliced(np.arange(36 * 800.0)[:, None], 0.01)
    assert len(extract) <= 4
    assert set(np.diff(extract.numbers)) == {16.0}


def test_rows_without_numbers_lend_their_time():
    values = np.ones((1600, 1))
    values[100:105] = np.nan
    extract = sliced(values, 0.01)
    assert extract.durations.sum() == pytest.approx(8.05, abs=0.02)


def test_columns_do_not_depend_on_the_batches(log):
    values = np.column_stack([log[name] for name in (*GYRO, *FORCE)])
    values[5000:5400, 1] = values[5000, 1]
    values[:, 3] = np.clip(values[:, 3], -5.0, 5.0)
    results = []
    for sizes in ((10**9,), (1, 97, 4096)):
        channels, start, turn = Channels(6), 0, 0
        while start < len(values):
            end = start + sizes[turn % len(sizes)]
            channels.follow(values[start:end])
            start, turn = end, turn + 1
        results.append(
            (channels.longest.tolist(), channels.longest_end.tolist(), [channels.limits(i) for i in range(6)])
        )
    assert results[0] == results[1]
    longest, ends, limits = results[0]
    assert (longest[1], ends[1]) == (399, 5400)
    assert {limit.value for limit in limits[3]} == {-5.0, 5.0}
    assert not any(limits[i] for i in (0, 1, 2, 4, 5))


def test_a_smooth_peak_is_not_cut_off():
    """Nor is one in coarse steps, or a plateau in a log without noise."""
    t = np.arange(0.0, 20.0, 0.01)
    for wave in (
        np.sin(t),
        np.round(np.sin(t), 2),
        np.clip(t - 10.0, 0.0, 5.0) * (t < 14.0) + 4.0 * (t >= 14.0),
    ):
        channels = Channels(2)
        channels.follow(np.column_stack((wave, wave)))
        assert channels.limits(0) == []


def test_times():
    ticks = np.array([0, 10, 20, 30, 30, 40, 35, 50, 500, 510, np.nan, 530], float)
    whole = Times()
    whole.follow(ticks, np.arange(12) == 4)
    assert (whole.step, whole.gaps.count, whole.gaps.largest, whole.gaps.rows) == (10.0, 1, 450.0, [9])
    assert (whole.repeated.count, whole.equal.count, whole.back.rows, whole.untimed.rows) == (1, 0, [7], [11])


def test_numbers_only(tmp_path):
    (tmp_path / "log.csv").write_text("t,name,ax,flag\n0,a,1.5,true\n1,b,2.5,false\n", encoding="utf-8")
    assert [column.name for column in number_columns(tmp_path / "log.csv")] == ["t", "ax"]


def test_the_separator_of_the_recipe(log, tmp_path):
    names = ("t", *GYRO, *FORCE)
    rows = "\n".join(
        ";".join(map(repr, row)) for row in np.column_stack([log[name][:1000] for name in names]).tolist()
    )
    (tmp_path / "log.csv").write_text(";".join(names) + "\n" + rows + "\n", encoding="utf-8")
    recipe = check.RECIPE.format(clock=f'separator = ";"\n{check.TIME}', magnetometer="")
    assert check_log(tmp_path / "log.csv", parse_recipe(recipe)).rows == 1000


def test_an_accelerometer_that_reads_nothing(log, tmp_path):
    path = save(log | {name: np.zeros(len(log["t"])) for name in FORCE}, tmp_path / "zero.parquet")
    report = check_log(path)
    assert "the accelerometer reads 0" in {finding.what for finding in report.wrong}
    assert 'column "ax" is 0 in every row' in {finding.what for finding in report.wrong}


def test_a_short_log_is_said_to_be_too_short(tmp_path):
    """And not that the body leans, or is upside down."""
    path = save({name: values[100:400] for name, values in handled(6.0).items()}, tmp_path / "short.parquet")
    report = check_log(path, parse_recipe(check.RECIPE.format(clock=check.TIME, magnetometer="")))
    for topic in ("direction of gravity", "accelerometer unit"):
        assert [(found.level, found.what) for found in report.about(topic)] == [
            ("unknown", "the log is too short")
        ]


@given(st.lists(st.integers(0, 9), max_size=6), st.integers(1, 8))
def test_chunks_do_not_depend_on_the_batches(sizes, rows):
    batches, start = [], 0
    for size in sizes:
        batches.append(pa.record_batch({"x": pa.array(np.arange(start, start + size))}))
        start += size
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(source_module, "CHUNK_ROWS", rows)
        chunks = [chunk.column("x").to_pylist() for chunk in source_module._evenly(iter(batches))]
    assert chunks == [list(range(at, min(at + rows, start))) for at in range(0, start, rows)]


@given(st.text(st.characters(exclude_categories=["Cs"]), min_size=1))
def test_names_are_escaped_in_a_recipe(name):
    assert pytest.importorskip("tomllib").loads(f"x = {toml_text(name)}") == {"x": name}


NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)


@settings(max_examples=10, phases=[Phase.explicit, Phase.generate])
@given(st.lists(NAMES, min_size=7, max_size=7, unique=True))
def test_every_proposed_line_is_toml(log, tmp_path_factory, names):
    """Whatever the columns are called, a line that is proposed is read as these names."""
    clean = {name: values[:1200] for name, values in log.items()}
    spoilt = check.scaled(("t",), 1e3)(check.scaled(FORCE, 1 / 9.81)(clean)) | {"gz": 0.0 * clean["t"]}
    columns = dict(zip(("t", *GYRO, *FORCE), names, strict=True))
    path = save(
        {columns[name]: spoilt[name] for name in columns}, tmp_path_factory.mktemp("log") / "log.parquet"
    )
    text = check.RECIPE.format(clock=check.TIME, magnetometer="")
    for name, other in columns.items():
        text = text.replace(f'"{name}"', toml_text(other))
    report = check_log(path, parse_recipe(text))
    lines = [line for finding in report.findings for line in finding.fix.splitlines() if "column" in line]
    assert {line.split(" = ")[0] for line in lines} >= {"time", "accelerometer"}
    for line in lines:
        (said,) = pytest.importorskip("tomllib").loads(line).values()
        assert set(said.get("columns", [said.get("column")])) <= set(names)
    for printed in str(report).splitlines():
        assert printed.isprintable()


def test_long_names_are_not_guessed_from():
    assert not by_names([Column("x" * 10**5, None)]).triads


def test_a_bias_changes_no_delay(log):
    """What the gyro reads at rest is no turn that the accelerometer would have to follow."""
    delays = [
        check.check(log, fault).about("gyro delay")[0].what
        for fault in (check.Fault("clean", dict, ()), FAULTS["gyro bias 3 deg/s"])
    ]
    assert delays[0] == delays[1]


def test_a_wrong_rate_changes_no_delay(log):
    """The delay is looked for at the rate that was found."""
    half = check.Fault("rate stated half", check.without_time, ("rate",), "rate = 50")
    delays = [
        check.check(log, fault).about("gyro delay")[0].what
        for fault in (check.Fault("clean", dict, ()), half)
    ]
    assert delays[0].split(" is ")[0] == delays[1].split(" is ")[0]
    ms = [float(delay.split(" is ")[1].removesuffix(" ms late")) for delay in delays]
    assert ms[1] == pytest.approx(ms[0], rel=0.1)


def test_a_magnet_that_goes_with_the_body_is_named(log):
    """Its field hides the earth's, so that the magnetometer's axes cannot be told: that is said, with the reason."""
    report = check.check(log | {"mx": log["mx"] + 100.0}, check.Fault("magnet", dict, ()))
    assert report.wrong == ()
    (finding,) = (found for found in report.about("axes") if found.level == "unknown")
    assert finding.what.startswith("gyro and magnetometer: ")
    assert finding.evidence.endswith("iron or a magnet near the sensor?")


def test_only_the_magnetometer_may_be_missing(log, tmp_path):
    spoiled = {
        {"gx": "mpu_gx", "gy": "mpu_gy", "gz": "mpu_gz"}.get(name, name): values.copy()
        for name, values in log.items()
    }
    spoiled["mpu_gx"][np.arange(len(log["t"])) % 9 != 0] = np.nan
    spoiled["mx"][np.arange(len(log["t"])) % 9 != 0] = np.nan
    recipe = parse_recipe(
        """
version = 1
[log]
time = { column = "t", unit = "s" }
gyro = { columns = ["mpu_gx", "mpu_gy", "mpu_gz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
magnetometer = { columns = ["mx", "my", "mz"], unit = "uT" }
axes = "flu"
[filter]
kind = "attitude"
[output]
columns = ["quaternion"]
unit = "rad"
"""
    )
    report = check_log(save(spoiled, tmp_path / "missing.parquet"), recipe)
    levels = {finding.what.split('"')[1]: finding.level for finding in report.about("missing")}
    assert levels == {"mpu_gx": "wrong", "mx": "note"}
