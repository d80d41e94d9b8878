"""The report of a sensor at rest: densities and doubts, what motors add, the command."""

import json
import sys

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import noises
from compfilt import noise, plot, simulate
from compfilt.__main__ import main
from compfilt.logs import parse_recipe
from compfilt.logs.errors import LogError, UsageError
from compfilt.noise.log import analyse_log
from compfilt.noise.recording import read_recording
from handled import handled

FS = 100.0
COLUMNS = ("gx", "gy", "gz", "ax", "ay", "az")
RECIPE = """
version = 1
[log]
time = { column = "clock", unit = "ms" }
gyro = { columns = ["p", "q", "r"], unit = "deg/s", scale = [1, 1, 0.5] }
accelerometer = { columns = ["u", "v", "w"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "first_order", tau = 0.5 }
[output]
columns = ["roll"]
unit = "deg"
"""


@pytest.fixture(scope="module")
def still():
    return noises.still(20_000, FS, np.random.default_rng(1))


@pytest.fixture(scope="module")
def report(still):
    return noise.analyse(*still, fs=FS)


def table(gyro, acc, **more):
    columns = dict(zip(COLUMNS, (*np.degrees(gyro).T, *(acc / 9.80665).T), strict=True))
    return {"t": np.arange(len(gyro)) / FS} | columns | more


def run(capsys, *arguments):
    """Run the command; return its status, what it printed and what it said."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["compfilt", "noise", *map(str, arguments)])
        try:
            status = main()
        except SystemExit as stop:
            status = stop.code
    out, err = capsys.readouterr()
    return status or 0, out, err


# --------------------------------------------------------------------------------------------------------------- report


def test_densities_are_what_was_put_in(report):
    for channel, density in zip(report.channels, [1e-4] * 3 + [1e-3] * 3, strict=True):
        assert channel.fit.random_walk.low < density < channel.fit.random_walk.high
        assert channel.white == pytest.approx(density, rel=0.1)
        assert channel.lines == ()
        assert channel.notes == ()
    found = report.densities()
    assert found.derivative == pytest.approx(1e-4, rel=0.03)
    assert found.measurement == pytest.approx(1e-3 / 9.8, rel=0.03)
    assert found.walk == 0.0


def test_noise_along_gravity_does_not_tilt_it():
    rng = np.random.default_rng(2)
    gyro, acc = noises.still(10_000, FS, rng)
    acc[:, 2] += noises.white(0.02, FS, len(acc), rng)
    found = noise.analyse(gyro, acc, fs=FS)
    assert found.accelerometer[2].density == pytest.approx(0.02, rel=0.05)
    assert found.densities().measurement == pytest.approx(1e-3 / 9.8, rel=0.1)


def test_the_walk_of_the_bias_is_given(still):
    rng = np.random.default_rng(3)
    gyro = still[0] + np.column_stack([noises.walk(3e-5, FS, 20_000, rng) for _ in range(3)])
    assert noise.analyse(gyro, still[1], fs=FS).densities().walk == pytest.approx(3e-5, rel=0.5)


def test_doubts_are_said():
    """A coarse resolution, a low-pass, and a channel that is stuck."""
    rng = np.random.default_rng(4)
    gyro, acc = noises.still(20_000, FS, rng)
    gyro[:, 0] = np.round(gyro[:, 0] / 0.003) * 0.003
    gyro[:, 1] = 0.0
    smooth = np.convolve(noises.white(0.01, FS, 20_009, rng), np.full(10, 0.1), mode="valid")
    acc[:, 0] += smooth
    found = noise.analyse(gyro, acc, fs=FS)
    assert "its resolution hides the noise: a step is" in found.gyro[0].notes[0]
    assert found.gyro[0].step == pytest.approx(0.003)
    assert found.gyro[1].notes == ("always reads the same: it is stuck, or its resolution hides its noise",)
    assert "as behind a low-pass" in found.accelerometer[0].notes[0]
    assert found.accelerometer[0].density == pytest.approx(0.01, rel=0.07)
    assert found.gyro[2].notes == ()
    assert "gyro y: always reads the same" in found.table()
    json.dumps(found.as_json(), allow_nan=False)


def test_a_short_recording_has_no_fit_and_no_nan(still):
    found = noise.analyse(still[0][:200], still[1][:200], fs=FS)
    assert found.gyro[0].fit is None
    assert "no noises can be told apart" in found.gyro[0].notes[0]
    assert found.densities().derivative == pytest.approx(1e-4, rel=0.3)
    assert "nan" not in found.table()
    json.dumps(found.as_json(), allow_nan=False)


def test_data_sheets_have_their_units():
    """0.01 (deg/s)/√Hz two-sided is an angle random walk of 0.6 deg/√h."""
    rng = np.random.default_rng(5)
    gyro, acc = noises.still(20_000, FS, rng, gyro=np.radians(0.01), acc=9.80665e-4)
    channels = {channel["name"]: channel for channel in noise.analyse(gyro, acc, fs=FS).as_json()["channels"]}
    walk = channels["gyro x"]["fit"]["random_walk"]["data_sheet"]
    assert walk["unit"] == "deg/√h"
    assert walk["value"] == pytest.approx(0.6, rel=0.05)
    assert walk["low"] < 0.6 < walk["high"]
    density = channels["gyro x"]["density"]["data_sheet"]
    assert density["value"] == pytest.approx(0.01 * np.sqrt(2.0), rel=0.05)
    density = channels["accelerometer z"]["density"]["data_sheet"]
    assert density["unit"] == "µg/√Hz"
    assert density["value"] == pytest.approx(100.0 * np.sqrt(2.0), rel=0.05)
    unseen = channels["gyro x"]["fit"]["rate_random_walk"]
    assert unseen["value"] is None
    assert unseen["data_sheet"]["below"] == pytest.approx(unseen["below"] * np.degrees(1.0) * 3600.0 * 60.0)


def test_motion_is_refused(still):
    gyro = still[0].copy()
    gyro[5000:5200, 1] += 0.05
    with pytest.raises(
        noise.NotAtRest, match=r"^not at rest from 49.5 s to 52.5 s$|^not at rest from 50.0 s to 52"
    ):
        noise.analyse(gyro, still[1], fs=FS)


# --------------------------------------------------------------------------------------------------------------- motors


def test_what_motors_add(report):
    rng = np.random.default_rng(6)
    gyro, acc = noises.still(12_000, FS, rng)
    t = np.arange(12_000) / FS
    acc[:, 0] += 0.3 * np.sin(2 * np.pi * 31.4 * t) + 0.05
    gyro[:, 2] += noises.white(3e-4, FS, 12_000, rng)
    found = noise.add_motors(report, gyro, acc, fs=FS).motors
    names = [vibration.name for vibration in found]
    assert names == [channel.name for channel in report.channels]
    shaken, buzzing = found[names.index("accelerometer x")], found[names.index("gyro z")]
    assert shaken.rms == pytest.approx(0.3 / np.sqrt(2.0), rel=0.05)
    assert [vibration.name for vibration in found if vibration.rms] == ["gyro z", "accelerometer x"]
    assert shaken.bias_change == pytest.approx(0.05, abs=0.002)
    assert [round(line.frequency, 1) for line in shaken.lines] == [31.4]
    assert shaken.slow_ratio == pytest.approx(1.0, abs=0.3)
    assert buzzing.slow_density == pytest.approx(np.hypot(3e-4, 1e-4), rel=0.2)
    assert buzzing.slow_ratio == pytest.approx(np.sqrt(10.0), rel=0.25)


def test_no_ratio_to_what_the_rest_does_not_show(still):
    gyro, acc = still[0].copy(), still[1]
    gyro[:, 0] = 0.0
    stuck = noise.add_motors(noise.analyse(gyro, acc, fs=FS), *still, fs=FS)
    assert [vibration.name for vibration in stuck.motors if vibration.slow_ratio is None] == ["gyro x"]
    json.dumps(stuck.as_json(), allow_nan=False)
    short = noise.add_motors(noise.analyse(still[0][:400], acc[:400], fs=FS), *still, fs=FS)
    assert {vibration.slow_ratio for vibration in short.motors} == {None}
    (row,) = [
        line for line in short.table().splitlines() if "accelerometer" not in line and "times that" in line
    ][:1]
    assert row.split()[-3:] == ["-", "-", "-"]


@pytest.mark.parametrize("share", [0.5, 0.97, 1.03, 2.0])
def test_motors_at_another_rate_are_refused(report, still, share):
    with pytest.raises(
        ValueError, match=f"^fs must be that of the recording at rest, {FS:g} Hz, not {share * FS:g} Hz"
    ):
        noise.add_motors(report, *still, fs=share * FS)
    assert noise.add_motors(report, *still, fs=1.01 * FS).motors


def test_the_part_that_is_empty_is_named(still, tmp_path):
    simulate.write(table(*still), tmp_path / "rest.parquet")
    with pytest.raises(LogError, match=r"^there is nothing from 5 s on to 0 s: the log lasts"):
        read_recording(tmp_path / "rest.parquet", gyro_unit="deg/s", start=5.0, end=0.0)


# ------------------------------------------------------------------------------------------------------------------ log


def test_a_log_gives_what_its_arrays_give(still, report, tmp_path):
    simulate.write(table(*still), tmp_path / "rest.parquet")
    found = analyse_log(tmp_path / "rest.parquet")
    for channel, expected in zip(found.channels, report.channels, strict=True):
        assert channel.density == pytest.approx(expected.density, rel=1e-6)


def test_a_recipe_names_columns_units_and_scales(still, tmp_path):
    gyro, acc = still
    columns = table(gyro, acc)
    names = dict(zip(COLUMNS, "pqruvw", strict=True))
    renamed = {names[name]: columns[name] for name in COLUMNS} | {"clock": 1000.0 * columns["t"]}
    renamed["r"] = 2.0 * renamed["r"]
    pq.write_table(pa.table(renamed), tmp_path / "rest.parquet")
    recording = read_recording(tmp_path / "rest.parquet", parse_recipe(RECIPE))
    np.testing.assert_allclose(recording.gyro, gyro, rtol=1e-12)
    np.testing.assert_allclose(recording.accelerometer, acc, rtol=1e-12)
    assert recording.fs == pytest.approx(FS)
    assert recording.notes == ()


def test_the_longest_whole_piece_is_used(still, tmp_path):
    columns = table(*still)
    columns["gz"][3000] = np.nan
    columns["t"] = columns["t"] + 7.0 * (np.arange(20_000) >= 12_000)
    simulate.write(columns, tmp_path / "rest.parquet")
    recording = read_recording(tmp_path / "rest.parquet")
    assert len(recording.gyro) == 12_000 - 3001
    assert recording.start == pytest.approx(30.01)
    assert recording.notes == (
        "the log has 1 gaps in time and 1 rows without a value: the longest piece without is used, 30.0 s to 120.0 s",
    )


@pytest.mark.parametrize("factor", [1.0, 1e3, 9.80665], ids=["g", "mg", "m/s^2"])
def test_gravity_tells_the_unit_of_an_accelerometer(still, tmp_path, factor):
    columns = table(*still)
    columns |= {name: columns[name] * factor for name in ("ax", "ay", "az")}
    pq.write_table(pa.table(columns), tmp_path / "rest.parquet")
    recording = read_recording(tmp_path / "rest.parquet", gyro_unit="deg/s")
    np.testing.assert_allclose(recording.accelerometer, still[1], rtol=1e-12)
    with pytest.raises(
        UsageError, match=r'^nothing tells the unit of "gx", "gy", "gz", and a gyro at rest does not'
    ):
        read_recording(tmp_path / "rest.parquet")
    with pytest.raises(UsageError, match=r"^--gyro-unit: "):
        read_recording(tmp_path / "rest.parquet", gyro_unit="metre")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"az": np.full(20_000, 512.0)},
            "the accelerometer reads 512, which is one g in neither m/s², g nor mg",
        ),
        ({"ax": None}, "no accelerometer was found by name among the columns that hold numbers"),
        ({"t": None}, "no column of times was found by its name"),
        ({"t": np.zeros(20_000)}, 'the times in column "t" do not go forward'),
        ({"t": np.where(np.arange(20_000) == 5, np.nan, 1.0)}, 'row 6 has no time in column "t"'),
        ({"gx": np.full(20_000, np.nan)}, "no 64 samples in a row are whole: of 20000, 20000 lack a value"),
    ],
)
def test_logs_that_cannot_be_used(still, tmp_path, change, message):
    columns = {name: values for name, values in (table(*still) | change).items() if values is not None}
    pq.write_table(pa.table(columns), tmp_path / "rest.parquet")
    with pytest.raises(LogError) as error:
        read_recording(tmp_path / "rest.parquet", gyro_unit="deg/s")
    assert str(error.value).startswith(message)


# -------------------------------------------------------------------------------------------------------------- command


@pytest.fixture(scope="module")
def logs(still, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    gyro, acc = still
    simulate.write(table(gyro, acc), folder / "rest.parquet")
    moved = gyro.copy()
    moved[8000:8400] += 0.1
    simulate.write(table(moved, acc), folder / "moved.parquet")
    t = np.arange(20_000) / FS
    simulate.write(table(gyro, acc + np.sin(2 * np.pi * 17.0 * t)[:, None]), folder / "motors.parquet")
    return folder


def test_the_command_prints_a_table(logs, capsys):
    status, out, err = run(capsys, logs / "rest.parquet", "--motors", logs / "motors.parquet")
    assert status == 0
    assert err == ""
    assert "200 s at rest, 100 Hz" in out
    assert "angle random walk / deg/√h" in out
    assert "17 Hz" in out
    assert out.count("note: noise alone shows a line in about 1 of 100 channels") == 1
    assert "compfilt.design.from_densities(" in out
    assert max(map(len, out.splitlines())) < 125


def test_without_lines_nothing_is_said_of_them(logs, capsys):
    _, out, _ = run(capsys, logs / "rest.parquet")
    assert "lines (rms" not in out
    assert "shows a line" not in out


def test_lines_of_noise_alone_are_as_rare_as_is_said():
    """About 1 of 100 channels, counted over 600 of them."""
    rng = np.random.default_rng(8)
    found = sum(bool(noise.find_lines(rng.normal(size=4000), fs=100.0)) for _ in range(600))
    assert 1 <= found <= 18


def as_text(columns, path, separator=","):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, "%.5f", separator, header=separator.join(columns), comments="")
    return path


def test_the_gyros_unit_is_proposed_where_the_log_shows_it(still, tmp_path, capsys):
    """At rest it does not; then it is said what does."""
    path = as_text(table(*still), tmp_path / "rest.csv")
    status, out, err = run(capsys, path)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "give --gyro-unit, such as deg/s, or a recipe; compfilt check tells it from a log in which" in err
    moved = handled(seconds=90.0, seed=3)
    moved |= {name: np.degrees(moved[name]) for name in ("gx", "gy", "gz")}
    path = as_text({name: moved[name] for name in ("t", *COLUMNS)}, tmp_path / "moved.csv")
    status, out, err = run(capsys, path, "--longest-rest")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "by the log's motion it is deg/s, as compfilt check says; give --gyro-unit deg/s" in err


def test_other_separators_and_logs_without_a_header(still, tmp_path, capsys):
    path = as_text(table(*still), tmp_path / "rest.csv", ";")
    status, out, _ = run(capsys, path, "--gyro-unit", "deg/s")
    assert status == 0
    assert "200 s at rest" in out
    recipe = RECIPE.replace("[log]", '[log]\nseparator = ";"')
    names = ("clock", "p", "q", "r", "u", "v", "w")
    renamed = dict(zip(names, table(*still).values(), strict=True))
    as_text(renamed | {"clock": 1e3 * renamed["clock"]}, tmp_path / "other.csv", ";")
    assert analyse_log(tmp_path / "other.csv", parse_recipe(recipe)).fs == pytest.approx(FS)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[1:]), encoding="utf-8")
    status, _, err = run(capsys, path, "--gyro-unit", "deg/s")
    assert status == 1
    assert "the first row is numbers: is the header missing? (compfilt check tells more)" in err


def test_the_command_prints_json(logs, capsys):
    status, out, _ = run(capsys, logs / "rest.parquet", "--json", "--from", "10", "--until", "150")
    found = json.loads(out)
    assert status == 0
    assert found["duration"] == pytest.approx(140.0, abs=0.1)
    assert found["densities"]["derivative"] == pytest.approx(1e-4, rel=0.05)
    assert len(found["channels"]) == 6


def test_the_command_refuses_motion_with_its_times(logs, capsys):
    status, out, err = run(capsys, logs / "moved.parquet", "--from", "10")
    assert (status, out) == (1, "")
    assert err.startswith(f"compfilt: {logs / 'moved.parquet'}: not at rest from ")
    assert "80.0 s to 84.0 s" in err or "79.5 s to 84" in err
    assert "--longest-rest the longest rest, from 84" in err
    assert err.count("\n") == 1
    status, out, _ = run(capsys, logs / "moved.parquet", "--longest-rest")
    assert status == 0
    assert "note: of the log its longest rest is used, 85" in out


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["none.parquet"], 1, "cannot be read"),
        (["rest.parquet", "--motors", "none.parquet"], 1, "with motors, "),
        (["rest.parquet", "--from", "300"], 1, "there is nothing from 300 s on"),
        (
            ["rest.parquet", "--from", "5", "--until", "2"],
            2,
            "--until must be later than --from, which is 5 s",
        ),
        (["rest.parquet", "--until", "0"], 2, "--until must be later than --from, which is 0 s, not 0 s"),
        (["rest.parquet", "--from", "nan"], 2, "--from must be finite, not nan"),
        (["rest.parquet", "--recipe", "none.toml"], 2, "the recipe cannot be read"),
        (["rest.parquet", "--plot", "none/rest.png"], 2, "there is no such folder"),
        (["rest.parquet", "--plot", "rest.txt"], 2, "rest.txt"),
        (["rest.parquet", "--plot", "rest.parquet"], 2, "rest.parquet"),
    ],
)
def test_what_goes_wrong_is_one_line(logs, capsys, monkeypatch, arguments, status, message):
    monkeypatch.chdir(logs)
    found, out, err = run(capsys, *arguments)
    assert (found, out) == (status, "")
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.skipif(not hasattr(plot, "allan"), reason="compfilt.plot draws no Allan deviation yet")
def test_the_command_draws_a_picture(logs, capsys, tmp_path):
    picture = tmp_path / "noise.png"
    arguments = (logs / "rest.parquet", "--motors", logs / "motors.parquet", "--plot", picture)
    status, _, err = run(capsys, *arguments)
    assert status == 0
    assert err == f"compfilt: {logs / 'rest.parquet'} -> {picture}\n"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(capsys, *arguments)[0] == 2
    assert run(capsys, *arguments, "--force")[0] == 0
