"""Pictures: what is drawn is what the result holds, and what fails is one line."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

import compfilt as cf
from compfilt import plot
from compfilt.angles import quaternion_to_angles
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.results import GROUPS
from compfilt.plot import panels
from compfilt.plot.bins import BINS

plt.switch_backend("agg")


@pytest.fixture(autouse=True)
def closed():
    """Leave no figure open."""
    yield
    plt.close("all")


def estimate(n=500):
    """A body that rests, then turns about its own x."""
    moving = (np.arange(n) >= n // 2)[:, None]
    gyr = np.array([0.01, 0.0, -0.005]) + moving * [0.5, 0.0, 0.0]
    return cf.GravityFilter().estimate(gyr, np.tile([0.0, 0.0, 9.81], (n, 1)), fs=100.0)


def result(**changes):
    """A result as ``compfilt run`` writes it."""
    n = 300
    t = 0.01 * np.arange(n) + 5.0
    columns = {
        "t": (t, "s"),
        "true_roll": (np.ones(n), None),
        "roll": (20.0 * np.sin(t), "deg"),
        "pitch": (np.where(t < 5.1, np.nan, np.cos(t)), "deg"),
        "gyro_bias_x": (0.1 * t, "deg/s"),
        "qw": (np.cos(t), "1"),
        "at_rest": (((t > 6.0) & (t < 7.0)).astype(np.uint8), None),
        "flags": (np.where(np.arange(n) % 100 == 7, 9, 0).astype(np.uint8), None),
    } | changes
    columns = {name: column for name, column in columns.items() if column is not None}
    fields = [
        pa.field(name, pa.from_numpy_dtype(values.dtype), metadata=unit and {"unit": unit})
        for name, (values, unit) in columns.items()
    ]
    return pa.Table.from_arrays(
        [pa.array(values) for values, _ in columns.values()], schema=pa.schema(fields)
    )


def written(folder, table, ending="parquet"):
    path = folder / f"result.{ending}"
    {"csv": pyarrow.csv.write_csv, "parquet": pq.write_table}[ending](table, path)
    return path


def lines(axes):
    return {line.get_label(): line.get_xydata() for line in axes.lines}


def shaded(axes, label=panels.REST):
    """From where to where an axes is shaded."""
    paths = [path for each in axes.collections if each.get_label() == label for path in each.get_paths()]
    return [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in paths]


# ------------------------------------------------------------------------------------------------------------ results


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_lines_are_the_columns(tmp_path, ending):
    table = result()
    figure = plot.result(written(tmp_path, table, ending))
    angle, bias, quaternion, flags = figure.axes
    t = table.column("t").to_numpy()
    assert shaded(angle, panels.MISSING) == [(5.0, 5.1)]
    for axes, names in ((angle, ["roll", "pitch"]), (bias, ["gyro_bias_x"]), (quaternion, ["qw"])):
        assert list(lines(axes)) == names
        for name in names:
            expected = np.column_stack([t, table.column(name).to_numpy()])
            np.testing.assert_array_equal(lines(axes)[name], expected)
    labels = [axes.get_ylabel() for axes in figure.axes]
    if ending == "parquet":
        assert labels == ["angle / deg", "bias / (deg/s)", "quaternion", "flags"]
        assert flags.get_xlabel() == "t / s"
    else:
        assert labels == ["angle", "bias", "quaternion", "flags"]
        assert flags.get_xlabel() == "t"


def test_rest_is_shaded_on_every_panel_and_named_once(tmp_path):
    figure = plot.result(written(tmp_path, result()))
    for axes in figure.axes:
        (span,) = shaded(axes)
        np.testing.assert_allclose(span, (6.01, 7.0), atol=1e-9)  # the last sample lasts until the next one
    texts = [[text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes[:3]]
    assert texts == [["roll", "pitch", "no value", "at rest"], ["gyro_bias_x"], ["qw"]]
    assert figure.axes[3].get_legend() is None


def test_shaded_rest_does_not_change_the_scale(tmp_path):
    high = result(roll=(np.linspace(1000.0, 1001.0, 300), "deg"), pitch=None)
    assert plot.result(written(tmp_path, high)).axes[0].get_ylim()[0] > 999.0


def test_flags_are_a_rug(tmp_path):
    figure = plot.result(written(tmp_path, result()))
    rug = figure.axes[-1]
    assert [tick.get_text() for tick in rug.get_yticklabels()] == ["measurement missing", "not started"]
    times = result().column("t").to_numpy()[[7, 107, 207]]
    for row, line in enumerate(rug.lines):
        np.testing.assert_array_equal(line.get_xydata(), np.column_stack([times, [row] * 3]))
    none = plot.result(written(tmp_path, result(flags=(np.zeros(300, np.uint8), None)))).axes[-1]
    assert [tick.get_text() for tick in none.get_yticklabels()] == ["none"]
    assert not none.lines


def test_without_a_time_rows_are_counted(tmp_path):
    figure = plot.result(written(tmp_path, result(t=None)))
    assert figure.axes[-1].get_xlabel() == "row"
    np.testing.assert_array_equal(lines(figure.axes[0])["roll"][:, 0], np.arange(300))
    text = result(t=None).append_column("t", pa.array(["noon"] * 300))
    assert plot.result(written(tmp_path, text)).axes[-1].get_xlabel() == "row"
    named = result(t=None, time=(np.arange(300) * 10, "ms"))
    assert plot.result(written(tmp_path, named)).axes[-1].get_xlabel() == "time / ms"


@pytest.mark.parametrize("name", ["flags", "at_rest"])
def test_marks_alone_can_be_drawn(tmp_path, name):
    table = result().select(["t", name])
    (axes,) = plot.result(written(tmp_path, table)).axes
    assert axes.lines if name == "flags" else shaded(axes)


def test_columns_of_different_units_do_not_share_a_panel(tmp_path):
    table = pa.table({"level0": [1.0, 2.0], "level1": [3.0, 4.0], "estimate": [1.0, 2.0]})
    table = table.cast(
        pa.schema([
            pa.field(name, pa.float64(), metadata={"unit": unit})
            for name, unit in (("level0", "m"), ("level1", "m/s"), ("estimate", "m"))
        ])
    )  # fmt: skip
    figure = plot.result(written(tmp_path, table))
    assert [axes.get_ylabel() for axes in figure.axes] == ["estimate / m", "level / m", "level / (m/s)"]


RECIPE = """
version = 1
[log]
rate = 100.0
{log}
[filter]
{filter}
[output]
columns = {columns}
unit = "{unit}"
"""
INERTIAL = """
gyro = { columns = ["gx", "gy", "gz"], unit = "rad/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
axes = "flu"
"""
TWO = """
measurement = {{ column = "ax", unit = "{}" }}
derivative = {{ column = "gx", unit = "{}" }}
"""
KINDS = [
    (INERTIAL, 'kind = "tilt"\ndesign = { kind = "pi", kp = 1, ki = 1 }', ["roll", "pitch", "bias"], "deg"),
    (
        INERTIAL,
        'kind = "attitude"',
        ["roll", "pitch", "yaw", "quaternion", "up", "gyro_bias", "at_rest"],
        "deg",
    ),
    (TWO.format("rad", "rad/s"), 'kind = "pi"\nkp = 1\nki = 1', ["estimate", "level0", "level1"], "rad"),
    (
        TWO.format("m", "m/s^2"),
        'kind = "third_order"\ntau = 1',
        ["position", "velocity", "bias", "level2"],
        "m",
    ),
]


@pytest.mark.parametrize(("log", "filter_", "columns", "unit"), KINDS)
def test_every_column_that_a_recipe_gives_is_known(log, filter_, columns, unit):
    """Those of the kinds cube and array are checked by their names."""
    recipe = RECIPE.format(log=log, filter=filter_, columns=columns, unit=unit).replace("'", '"')
    known = {name for names in GROUPS.values() for name in names} | {"at_rest", "flags"}
    made = {channel.name for channel in Pipeline(parse_recipe(recipe))._channels}
    assert made <= known
    for name in ("body_rate", "wheel_rate", "gravity", "angular_acceleration"):
        assert {f"{name}_{axis}" for axis in "xyz"} <= known


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (pa.table({"a": [1.0], "t": [0.0]}), "^there is no column of a result, such as roll, yaw, estimate"),
        (pa.table({"roll": ["left"]}), "^there is no column of a result"),
        (pa.table({"roll": pa.array([], pa.float64())}), "^the file holds no rows$"),
    ],
)
def test_files_with_nothing_to_draw(tmp_path, table, message):
    with pytest.raises(LogError, match=message):
        plot.result(written(tmp_path, table))


def test_files_that_are_no_results(tmp_path):
    with pytest.raises(LogError, match=r"^cannot be read: No such file or directory$"):
        plot.result(tmp_path / "result.csv")
    (tmp_path / "result.txt").write_text("roll\n1\n", encoding="utf-8")
    with pytest.raises(LogError, match=r'^the ending "\.txt" is not known'):
        plot.result(tmp_path / "result.txt")
    (tmp_path / "result.parquet").write_text("roll\n1\n", encoding="utf-8")
    with pytest.raises(LogError, match=r"^the file is damaged or of another kind") as error:
        plot.result(tmp_path / "result.parquet")
    assert "\n" not in str(error.value)


def test_one_sample_in_a_million_is_seen(tmp_path):
    n = 1_000_000
    roll = np.sin(np.arange(n) * 1e-4)
    roll[654_321], roll[654_999] = 50.0, -70.0
    roll[200_000:300_000] = np.nan
    table = pa.table({"t": np.arange(n) * 0.01, "roll": roll, "flags": (np.arange(n) == 777_777) * 16})
    figure = plot.result(written(tmp_path, table))
    drawn = lines(figure.axes[0])["roll"]
    assert len(drawn) <= 2 * BINS + 2
    for row in (654_321, 654_999):
        assert [row * 0.01, roll[row]] in drawn.tolist()
    assert np.isnan(drawn[:, 1]).sum() > 190  # a hole stays a hole
    ((flagged, _),) = figure.axes[-1].lines[0].get_xydata()
    assert 0.0 <= 7777.77 - flagged < 10_000.0 / (BINS / 2)


# ----------------------------------------------------------------------------------------------------------- estimates


@pytest.mark.parametrize(
    ("clock", "label", "last"),
    [({"fs": 100.0}, "time / s", 4.99), ({"t": np.arange(500) * 0.1}, "time / s", 49.9), ({}, "sample", 499)],
)
def test_an_estimate(clock, label, last):
    made = estimate()
    figure = plot.attitude(made, **clock)
    assert isinstance(figure, Figure)
    angle, bias = figure.axes
    assert (angle.get_ylabel(), bias.get_ylabel()) == ("angle / deg", "gyro bias / (deg/s)")
    assert bias.get_xlabel() == label
    angles = np.degrees(quaternion_to_angles(made.quaternion))
    for i, name in enumerate(("roll", "pitch", "yaw")):
        np.testing.assert_array_equal(lines(angle)[name][:, 1], angles[:, i])
    for i, name in enumerate("xyz"):
        np.testing.assert_array_equal(lines(bias)[name][:, 1], np.degrees(made.gyro_bias[:, i]))
    assert lines(angle)["roll"][-1, 0] == pytest.approx(last)
    (span,) = shaded(angle)
    first = np.flatnonzero(made.at_rest)[0]
    assert span[0] == pytest.approx(first * last / 499)


def test_an_estimate_on_given_axes():
    figure, both = plt.subplots(2)
    assert plot.attitude(estimate(), fs=100.0, ax=both) is figure
    assert [len(axes.lines) for axes in both] == [3, 3]
    figure, one = plt.subplots()
    assert plot.attitude(estimate(), fs=100.0, ax=one) is figure
    assert list(lines(one)) == ["roll", "pitch", "yaw"]
    assert one.get_xlabel() == "time / s"
    nested = plt.figure().subfigures(1, 2)[0]
    assert plot.attitude(estimate(), ax=nested.subplots(2)) is nested.figure


def test_float32_and_filters_without_rest():
    acc = np.tile(np.float32([0.0, 0.0, 9.81]), (100, 1))
    single = cf.Mahony(kp=1.0).estimate(np.zeros((100, 3), np.float32), acc, fs=100.0)
    figure = plot.attitude(single)
    assert not shaded(figure.axes[0])
    assert (
        not plot.attitude(cf.Mahony(kp=1.0).estimate(np.zeros((0, 3)), np.zeros((0, 3)), fs=1.0))
        .axes[0]
        .collections
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fs": 1.0, "t": np.arange(500)}, "give fs in Hz or t in seconds, not both"),
        ({"t": np.arange(499)}, r"t must have the shape \(500,\), got \(499,\)"),
        ({"ax": [None] * 3}, "ax must be one or two axes, got 3"),
        ({"ax": []}, "ax must be one or two axes, got 0"),
    ],
)
def test_estimates_that_cannot_be_drawn(options, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        plot.attitude(estimate(), **options)


# --------------------------------------------------------------------------------------------------------------- files

SIGNATURES = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.mark.parametrize("ending", plot.ENDINGS)
def test_pictures_are_files(tmp_path, ending):
    out = plot.save(written(tmp_path, result()), tmp_path / f"out{ending}")
    assert out.read_bytes().startswith(SIGNATURES[ending])
    assert sorted(entry.name for entry in tmp_path.iterdir()) == [f"out{ending}", "result.parquet"]


def test_what_is_there_is_not_replaced(tmp_path):
    path = written(tmp_path, result())
    out = plot.save(path)
    assert out == tmp_path / "result.png"
    before = out.read_bytes()
    out.write_bytes(b"old")
    with pytest.raises(UsageError, match=r"result\.png: is already there; --force replaces it"):
        plot.save(path)
    assert out.read_bytes() == b"old"
    plot.save(path, force=True)
    assert out.read_bytes() == before  # the same picture every time


def test_a_picture_that_fails_leaves_nothing(tmp_path, monkeypatch):
    path = written(tmp_path, result())
    (tmp_path / "result.png").write_bytes(b"old")

    def fail(*_arguments, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(Figure, "savefig", fail)
    with pytest.raises(KeyboardInterrupt):
        plot.save(path, force=True)
    assert (tmp_path / "result.png").read_bytes() == b"old"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["result.parquet", "result.png"]


# -------------------------------------------------------------------------------------------------------- command line


def compfilt(*arguments, cwd, code="from compfilt.__main__ import main; import sys; sys.exit(main())"):
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, "MPLBACKEND": "agg"},
    )


def one_line(process, status, line):
    assert (process.returncode, process.stdout, process.stderr) == (status, "", f"compfilt: {line}\n")


def test_from_the_log_to_the_picture(tmp_path):
    for line in (
        ("simulate", "child-seat", "-o", "seat.csv", "--duration", 20),
        ("run", "seat.toml", "seat.csv", "-o", "seat.parquet"),
    ):
        (tmp_path / "seat.toml").write_text(SEAT, encoding="utf-8")
        assert compfilt(*line, cwd=tmp_path).returncode == 0
    one_line(compfilt("plot", "seat.parquet", cwd=tmp_path), 0, "seat.parquet -> seat.png")
    assert (tmp_path / "seat.png").read_bytes().startswith(SIGNATURES[".png"])
    one_line(
        compfilt("plot", "seat.parquet", cwd=tmp_path),
        2,
        "seat.png: is already there; --force replaces it",
    )
    one_line(compfilt("plot", "seat.parquet", "--force", cwd=tmp_path), 0, "seat.parquet -> seat.png")
    one_line(
        compfilt("plot", "seat.csv", "-o", "log.png", cwd=tmp_path),
        1,
        "seat.csv: there is no column of a result, such as roll, yaw, estimate, bias or flags",
    )
    assert not (tmp_path / "log.png").exists()


SEAT = """
version = 1
[log]
time = { column = "t", unit = "s" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "attitude"
[output]
columns = ["roll", "pitch", "yaw", "gyro_bias", "at_rest", "flags"]
unit = "deg"
keep = ["t"]
"""


@pytest.mark.parametrize(
    ("arguments", "status", "line"),
    [
        (["nowhere.csv"], 1, "nowhere.csv: cannot be read: No such file or directory"),
        (
            ["result.parquet", "-o", "out.jpg"],
            2,
            'out.jpg: cannot write a file that ends in ".jpg"; use .png or .pdf or .svg',
        ),
        (["result.parquet", "-o", "no/out.png"], 2, "no: there is no such folder"),
        (["result.parquet", "--fs", "9"], 2, "--fs goes with a recipe: a result has its own times"),
        (["none.toml"], 2, "none.toml: the recipe cannot be read: No such file or directory"),
        (["result.parquet", "-o", "."], 2, ".: this is a folder, not a file"),
    ],
)
def test_the_command_refuses(tmp_path, arguments, status, line):
    written(tmp_path, result())
    one_line(compfilt("plot", *arguments, cwd=tmp_path), status, line)
    assert [entry.name for entry in tmp_path.iterdir()] == ["result.parquet"]


# ------------------------------------------------------------------------------------------------------------- recipes

RECIPES = Path(__file__).resolve().parent.parent / "examples/recipes"

PI = """
version = 1
[log]
rate = 100.0
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
rule = "matched"
[output]
columns = ["estimate"]
unit = "deg"
"""


def test_a_recipe_is_drawn_at_its_rate_and_by_its_rule(tmp_path, monkeypatch):
    path = tmp_path / "angle.toml"
    path.write_text(PI)
    titles = []
    monkeypatch.setattr(Figure, "suptitle", lambda _, title: titles.append(title))
    assert plot.save_design(path) == tmp_path / "angle.png"
    plot.save_design(path, fs=50.0, force=True)
    path.write_text(PI.replace("rate = 100.0", 'time = { column = "t", unit = "s" }'))
    plot.save_design(path, force=True)
    pi = "PiForm(kp=2.0, ki=1.0)"
    assert titles == [f"{pi}, 100 Hz, matched poles", f"{pi}, 50 Hz, matched poles", f"{pi}, continuous"]


@pytest.mark.parametrize("name", ["angle", "height", "cube"])
def test_the_examples_recipes_are_drawn(tmp_path, name):
    out = plot.save_design(RECIPES / f"{name}.toml", tmp_path / "out.svg")
    assert out.read_bytes().startswith(SIGNATURES[".svg"])


def test_the_command_draws_a_recipe(tmp_path):
    (tmp_path / "angle.toml").write_text(PI)
    one_line(compfilt("plot", "angle.toml", cwd=tmp_path), 0, "angle.toml -> angle.png")
    assert (tmp_path / "angle.png").read_bytes().startswith(SIGNATURES[".png"])
    refused = "angle.png: is already there; --force replaces it"
    one_line(compfilt("plot", "angle.toml", cwd=tmp_path), 2, refused)
    again = ("plot", "angle.toml", "--fs", 20, "--force")
    one_line(compfilt(*again, cwd=tmp_path), 0, "angle.toml -> angle.png")


@pytest.mark.parametrize(
    ("changes", "arguments", "line"),
    [
        ({}, ["--fs", 0], "angle.toml: fs must be positive and finite, not 0"),
        (
            {},
            ["--fs", 1e9],
            "angle.toml: fs * duration must be at most 1e+07 samples, got 8e+09: choose a lower fs",
        ),
        ({"kp = 2.0": "kp = -2.0"}, [], "angle.toml: [filter] kp must be positive and finite"),
        ({}, ["-o", "out.jpg"], 'out.jpg: cannot write a file that ends in ".jpg"; use .png or .pdf or .svg'),
    ],
)
def test_designs_that_cannot_be_drawn(tmp_path, changes, arguments, line):
    text = PI
    for old, new in changes.items():
        text = text.replace(old, new)
    (tmp_path / "angle.toml").write_text(text)
    one_line(compfilt("plot", "angle.toml", *arguments, cwd=tmp_path), 2, line)
    assert [entry.name for entry in tmp_path.iterdir()] == ["angle.toml"]


@pytest.mark.parametrize(
    ("gains", "shown"),
    [
        ("kp = 2.0", "FirstOrder(tau=0.5)"),
        ("kp = 2.0\nki = 1.0", "PiForm(kp=2.0, ki=1.0)"),
        ('design = { kind = "butterworth", omega0 = 1.0 }', "Butterworth(omega0=1.0, order=2, q=1.0)"),
    ],
)
def test_the_design_of_a_mahony_recipe_is_drawn(tmp_path, monkeypatch, gains, shown):
    text = (RECIPES / "attitude.toml").read_text()
    start, end = text.index("method ="), text.index("[policy]")
    path = tmp_path / "mahony.toml"
    path.write_text(f'{text[:start]}method = "mahony"\n{gains}\n{text[end:]}'.replace('"at_rest", ', ""))
    titles = []
    monkeypatch.setattr(Figure, "suptitle", lambda _, title: titles.append(title))
    assert plot.save_design(path).is_file()
    assert titles == [f"{shown}, continuous"]
    path.write_text(path.read_text().replace(gains, "kp = 0.0"))
    with pytest.raises(UsageError, match=r"mahony\.toml: \[filter\] kp must be positive and finite$"):
        plot.save_design(path, force=True)


@pytest.mark.parametrize("kind", ["attitude", "array"])
def test_kinds_without_a_design_say_so(tmp_path, kind):
    reason = "has no linear design to draw; plot the result of compfilt run"
    method = ' and method = "gravity"' if kind == "attitude" else ""
    with pytest.raises(UsageError, match=f'a filter of kind = "{kind}"{method} {reason}$'):
        plot.save_design(RECIPES / f"{kind}.toml", tmp_path / "out.png")
    assert not list(tmp_path.iterdir())


WITHOUT = """
import sys
sys.modules["matplotlib"] = None
from compfilt.__main__ import main
sys.exit(main())
"""


def test_without_the_extra_one_line_names_it(tmp_path):
    written(tmp_path, result())
    one_line(
        compfilt("plot", "result.parquet", cwd=tmp_path, code=WITHOUT),
        2,
        "a picture needs the extra \"plot\": pip install 'compfilt[plot]'",
    )
    # The other commands do not need it.
    made = compfilt("simulate", "child-seat", "-o", "seat.csv", "--duration", 5, cwd=tmp_path, code=WITHOUT)
    assert made.returncode == 0, made.stderr
    code = 'import sys; sys.modules["matplotlib"] = None; import compfilt.plot'
    process = compfilt(cwd=tmp_path, code=code)
    assert process.stderr.endswith("compfilt.plot needs the extra \"plot\": pip install 'compfilt[plot]'\n")


def test_the_picture_of_an_estimate_needs_no_arrow(tmp_path):
    code = """
import sys
sys.modules["pyarrow"] = None
import numpy as np, compfilt as cf
from compfilt import plot
estimate = cf.Mahony(kp=1.0).estimate(np.zeros((9, 3)), np.ones((9, 3)), fs=1.0)
plot.attitude(estimate).savefig("out.png")
"""
    process = compfilt(cwd=tmp_path, code=code)
    assert process.returncode == 0, process.stderr
