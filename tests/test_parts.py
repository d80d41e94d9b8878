"""One log in parts: the result, the flags and the report of the log in order, wherever it is cut."""

import itertools
import json

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compfilt.logs import parts as parts_module
from compfilt.logs import run_log, run_logs
from compfilt.logs.affine import AffineMap
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.partition import PartitionedLog, open_in_parts
from compfilt.logs.parts import run_in_parts, why_in_order
from compfilt.logs.parts_folder import folder_beside
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.run import Job, plan
from test_rows import declare_more

RECIPE = """
version = 1
[log]
{clock}
measurement = {{ column = "y", unit = "{unit}" }}
derivative = {{ column = "u", unit = "{derivative}" }}
[filter]
{filter}
[policy]
{policy}
[output]
columns = [{levels}, "flags", "faults"]
keep = ["t", "note"]
"""

FILTERS = {
    "first order": (1, 'kind = "first_order"\ntau = 0.5'),
    "first order, slow": (1, 'kind = "first_order"\ntau = 20000.0'),
    "PI": (2, 'kind = "pi"\nkp = 2.0\nki = 1.0'),
    "PI, slow": (2, 'kind = "pi"\nkp = 2e-4\nki = 1e-8\ninitial = [3.0, 0.1]'),
    "Butterworth 4": (4, 'kind = "butterworth"\nomega0 = 0.5\norder = 4\ninput = "trapezoid"'),
    "matched": (1, 'kind = "first_order"\ntau = 5.0\nrule = "matched"'),
    "third order": (3, 'kind = "third_order"\ntau = 2.0'),
    "second order inertial": (2, 'kind = "second_order_inertial"\ntau = 50.0'),
}
POLICIES = {
    "coast": "",
    "reset at gaps": 'gap = { longer_than = "1 s", do = "reset" }',
    "hold": 'missing = "hold"\nhold = "30 ms"',
    "reset": 'missing = "reset"',
}
TIME = 'time = { column = "t", unit = "ms" }'
ROWS = 12000


DEFAULTS = run_in_parts.__kwdefaults__


def recipe(filter_="PI", policy="", clock=TIME):
    order, text = FILTERS[filter_]
    second = "third" in filter_ or "inertial" in filter_
    levels = ", ".join(f'"level{level}"' for level in range(order))
    units = ("m", "m/s^2") if second else ("rad", "rad/s")
    return parse_recipe(
        RECIPE.format(
            clock=clock, unit=units[0], derivative=units[1], filter=text, policy=policy, levels=levels
        )
    )


def write_log(path, *, rows=ROWS, seed=0, group=1700, late=0, dtype=np.float64, whole=False):
    """A log with gaps, missing samples for short and for long, and times in whole milliseconds from an epoch."""
    rng = np.random.default_rng(seed)
    steps = rng.integers(5, 16, rows)
    y, u = np.cumsum(rng.normal(0.0, 0.1, rows)), rng.normal(0.3, 1.0, rows)
    if not whole:
        steps[rng.integers(1, rows, 4)] += 3000
        for signal, longest in ((y, 400), (u, 60)):
            for at in rng.integers(1, rows, 30):
                signal[at : at + rng.integers(1, longest)] = np.nan
        # One rate in a stretch: a measurement in every tenth row, a derivative in every row but these.
        slow = np.arange(rows // 2, rows // 2 + rows // 10)
        y[slow[slow % 10 > 0]] = np.nan
        u[slow[slow % 10 == 0]] = np.nan
    y[:late] = np.nan
    columns = {"u": u.astype(dtype), "y": y.astype(dtype), "note": [f"row {i % 7}" for i in range(rows)]}
    pq.write_table(
        pa.table({"t": 1_700_000_000_000 + np.cumsum(steps), **columns}), path, row_group_size=group
    )
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_log(tmp_path_factory.mktemp("log") / "log.parquet")


def report_of(out):
    report = json.loads(out.with_name(f"{out.name}.quality.json").read_text(encoding="utf-8"))
    del report["result"]
    return report


def assert_alike(whole, parts, tolerance=1e-12):
    """Levels to so much of their range, all else and the reports exactly."""
    expected, found = pq.read_table(whole), pq.read_table(parts)
    assert found.schema.equals(expected.schema, check_metadata=True)
    for name in expected.column_names:
        a, b = expected[name], found[name]
        if not name.startswith("level"):
            assert b.to_pylist() == a.to_pylist(), name
            continue
        a, b = a.to_numpy(), b.to_numpy()
        span = np.abs(a[np.isfinite(a)]).max()
        np.testing.assert_allclose(b, a, rtol=0.0, atol=tolerance * span, err_msg=name)
    assert report_of(parts) == report_of(whole)


@pytest.fixture
def both(tmp_path):
    """Filter a log in order and in parts, and compare."""

    def compare(recipe, log, *, part_rows=1000, tolerance=1e-12):
        whole, parts = tmp_path / "whole.parquet", tmp_path / "parts.parquet"
        expected = run_log(recipe, log, whole)
        found = run_in_parts(recipe, log, parts, part_rows=part_rows)
        assert str(found).partition(", in order, since the filter started anew")[0] == str(expected)
        assert (found.faults, found.truncated) == (expected.faults, "")
        assert_alike(whole, parts, tolerance)
        names = {"whole.parquet", "parts.parquet"}
        assert {path.name for path in tmp_path.iterdir()} == names | {f"{n}.quality.json" for n in names}

    return compare


@pytest.fixture
def only_parts(monkeypatch):
    """Whatever cannot be done in parts fails, instead of being done in order."""

    def refuse(*_args, **_options):
        raise AssertionError("the log went in order")

    monkeypatch.setattr(parts_module, "run_log", refuse)


@pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)
@pytest.mark.parametrize("filter_", FILTERS)
@pytest.mark.usefixtures("only_parts")
def test_parts_are_the_whole(filter_, policy, log, both):
    both(recipe(filter_, policy), log)


@pytest.mark.parametrize("late", [1, 999, 1000, 3500, ROWS - 1])
def test_a_log_that_starts_late(late, tmp_path_factory, both):
    log = write_log(tmp_path_factory.mktemp("late") / "log.parquet", late=late)
    both(recipe("PI, slow"), log)


@pytest.mark.parametrize("group", [100, 977, ROWS])
@pytest.mark.parametrize("part_rows", [300, 1000, 4096, ROWS])
def test_any_cut(group, part_rows, tmp_path_factory, both):
    log = write_log(tmp_path_factory.mktemp("cut") / "log.parquet", group=group)
    both(recipe("Butterworth 4"), log, part_rows=part_rows)


@pytest.mark.usefixtures("only_parts")
@pytest.mark.parametrize("name", ["log.feather", "log.arrow"])
def test_other_formats(name, log, tmp_path_factory, both):
    table = pq.read_table(log)
    path = tmp_path_factory.mktemp("format") / name
    compression = "lz4" if name == "log.feather" else "uncompressed"
    pa.feather.write_feather(table, path, compression, chunksize=1300)
    both(recipe("Butterworth 4"), path)


def test_a_folder_of_parts(log, tmp_path):
    """It holds the same rows, and others read it as one table."""
    one, folder = tmp_path / "one.parquet", tmp_path / "folder.parquet"
    run_in_parts(recipe(), log, one, part_rows=1000)
    folder.write_bytes(b"to be replaced")
    summary = run_in_parts(recipe(), log, folder, part_rows=1000, as_folder=True)
    assert summary.note == ""
    assert {path.name for path in tmp_path.iterdir() if path.name.startswith(".")} == set()
    assert sorted(path.name for path in folder.iterdir())[:2] == [
        "part-000000.parquet",
        "part-000001.parquet",
    ]
    assert pq.read_table(folder).equals(pq.read_table(one))
    assert report_of(folder) == report_of(one)


def test_a_folder_holds_parquet_only(log, tmp_path):
    with pytest.raises(UsageError, match=r"use \.parquet"):
        run_in_parts(recipe(), log, tmp_path / "out.csv", as_folder=True)


@pytest.mark.usefixtures("only_parts")
def test_a_constant_rate(log, both):
    both(recipe("third order", clock="rate = 100.0"), log)


@pytest.mark.usefixtures("only_parts")
def test_float32(tmp_path_factory, both):
    log = write_log(tmp_path_factory.mktemp("single") / "log.parquet", dtype=np.float32)
    both(recipe("PI"), log, tolerance=1e-5)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), data=st.data())
def test_maps_of_pieces_compose_to_the_map_of_the_whole(seed, data, tmp_path_factory):
    log = write_log(tmp_path_factory.mktemp("maps") / "log.parquet", rows=1500, seed=seed)
    whole = open_in_parts(recipe(data.draw(st.sampled_from(list(FILTERS)))), log)
    pieces = whole.cut(data.draw(st.integers(100, 700)))
    start = whole.summarise(pieces[0]).end
    for piece in pieces[1:-1]:
        end = whole.summarise(piece)(start)
        pipeline = whole.pipeline(piece, start)
        assert sum(batch.num_rows for batch in whole.filtered(pipeline, piece)) == piece.stop - piece.seam.row
        np.testing.assert_allclose(end, pipeline.levels[:, 0], rtol=1e-11, atol=1e-11 * np.abs(end).max())
        start = end


@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_composition_is_associative(order, seed):
    rng = np.random.default_rng(seed)
    a, b, c = (
        AffineMap(rng.normal(size=order), rng.normal(size=order), rng.normal(size=(order, order)))
        for _ in range(3)
    )
    x = rng.normal(size=order)
    one, other = a.then(b).then(c)(x), a.then(b.then(c))(x)
    np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(one, c(b(a(x))), rtol=1e-10, atol=1e-10)


def test_a_fast_filter_hardly_reads_what_it_summarises(tmp_path, monkeypatch):
    """That is why finding the levels costs next to nothing."""
    log = write_log(tmp_path / "log.parquet", rows=200_000, group=5000, whole=True)
    whole = open_in_parts(recipe("first order"), log)
    part = whole.cut(90_000)[1]
    read = []
    summarise = PartitionedLog._summarise

    def counted(self, reader, piece):
        read.append(piece.stop - piece.seam.row)
        return summarise(self, reader, piece)

    monkeypatch.setattr(PartitionedLog, "_summarise", counted)
    assert whole.summarise(part).forgets
    assert sum(read) < 20_000


def test_the_cut_does_not_depend_on_the_workers(log, tmp_path):
    outs = [tmp_path / f"{workers}.parquet" for workers in (1, 2, 5)]
    for workers, out in zip((1, 2, 5), outs, strict=True):
        run_in_parts(recipe(), log, out, workers=workers, part_rows=1000)
    assert len({out.read_bytes() for out in outs}) == 1


def test_a_filter_that_starts_anew_goes_in_order(tmp_path_factory, both, monkeypatch):
    """An overflow is no affine map: the part does not end where the map said."""
    log = write_log(tmp_path_factory.mktemp("huge") / "log.parquet", whole=True)
    table = pq.read_table(log)
    u = table["u"].to_numpy().copy()
    u[3000:3400] = 1.5e308
    pq.write_table(table.set_column(1, "u", pa.array(u)), log, row_group_size=1000)
    went = []
    run = parts_module.run_log
    monkeypatch.setattr(
        parts_module, "run_log", lambda *args, **options: went.append(1) or run(*args, **options)
    )
    both(recipe("PI, slow"), log)
    assert went


@pytest.mark.parametrize(
    ("policy", "column", "row"),
    [
        ('missing = "fail"', "y", 7000),
        ('gap = { longer_than = "1 s", do = "fail" }', "t", 7000),
        ("", "backwards", 7000),
    ],
)
def test_the_first_bad_row_is_named(policy, column, row, tmp_path):
    log = write_log(tmp_path / "log.parquet", whole=True)
    table = pq.read_table(log)
    columns = {name: table[name].to_numpy(zero_copy_only=False).copy() for name in table.column_names}
    for at in (row, row + 3000):
        match column:
            case "y":
                columns["y"][at] = np.nan
            case "t":
                columns["t"][at:] += 5000
            case "backwards":
                columns["t"][at:] -= 5000
    pq.write_table(pa.table(columns), log, row_group_size=500)
    with pytest.raises(LogError, match=rf"row {row + 1}\b"):
        run_in_parts(recipe("PI", policy), log, tmp_path / "out.parquet", part_rows=1000)
    assert [path.name for path in tmp_path.iterdir()] == ["log.parquet"]


@pytest.mark.parametrize(
    ("filter_", "policy", "word"),
    [
        ('kind = "rate"\ntau = 1.0', "", "more state"),
        ('kind = "first_order"\ntau = 1.0\nperiod = 6.28', "", "period"),
        ('kind = "first_order"\ntau = 1.0\ndelay = 0.1', "", "delay"),
        ('kind = "first_order"\ntau = 1.0', 'stuck = { longer_than = "1 s", do = "coast" }', '"stuck"'),
        ('kind = "first_order"\ntau = 1.0', 'backwards = "coast"', '"backwards"'),
        ('kind = "first_order"\ntau = 1.0', 'gap = { longer_than = "1 s", do = "hold" }', '"gap"'),
    ],
)
def test_what_cannot_go_in_parts(filter_, policy, word, log, tmp_path):
    level = "estimate" if "rate" in filter_ else "level0"
    text = RECIPE.format(
        clock=TIME, unit="rad", derivative="rad/s", filter=filter_, policy=policy, levels=f'"{level}"'
    )
    if 'kind = "rate"' in filter_:
        text = text.replace('unit = "rad/s" }', 'unit = "rad/s^2" }').replace(
            'unit = "rad" }', 'unit = "rad/s" }'
        )
    summary = run_in_parts(parse_recipe(text), log, tmp_path / "out.parquet", part_rows=1000)
    assert f"in order, since {'with a ' if word in ('period', 'delay') else 'the '}" in summary.note
    assert word in summary.note


def test_a_csv_and_a_tilt_cannot(tmp_path):
    assert "only be read in order" in why_in_order(recipe(), tmp_path / "log.csv")
    tilt = parse_recipe(
        'version = 1\n[log]\nrate = 100.0\ngyro = { columns = ["a", "b", "c"], unit = "rad/s" }\n'
        'accelerometer = { columns = ["d", "e", "f"], unit = "g" }\naxes = "flu"\n[filter]\nkind = "tilt"\n'
        'design = { kind = "first_order", tau = 0.5 }\n[output]\ncolumns = ["roll"]\nunit = "deg"\n'
    )
    assert "not linear" in why_in_order(tilt, "log.parquet")


def test_nothing_stays_when_it_is_interrupted(log, tmp_path, monkeypatch):
    calls = itertools.count()

    def interrupted(*_args):
        if next(calls) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(parts_module, "_append", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_in_parts(recipe(), log, tmp_path / "out.parquet", part_rows=1000)
    assert not list(tmp_path.iterdir())


def test_a_file_that_declares_more_rows_than_it_has_is_truncated(tmp_path):
    log = write_log(tmp_path / "log.parquet", rows=4000, group=1000, whole=True)
    declare_more(log, 1000, 1010)
    whole, parts = tmp_path / "whole.parquet", tmp_path / "parts.parquet"
    expected = run_log(recipe(), log, whole)
    found = run_in_parts(recipe(), log, parts, part_rows=1000)
    assert found.truncated == expected.truncated
    assert "in order, since the file declares rows that it does not have" in found.note
    assert pq.read_table(parts).equals(pq.read_table(whole))


def test_why_a_part_could_not_be_filtered_is_said(log, tmp_path, monkeypatch):
    def full(*_arguments):
        raise LogError("no room for a part")

    monkeypatch.setattr(parts_module, "_filter", full)
    assert (
        "in order, since no room"
        in run_in_parts(recipe(), log, tmp_path / "out.parquet", part_rows=1000).note
    )


@pytest.mark.parametrize("begun", [False, True])
def test_resume_goes_in_order_only_if_a_run_in_order_has_left_something(begun, log, tmp_path):
    if begun:
        (tmp_path / ".out.parquet.part.json").write_text("{}", encoding="utf-8")
    summary = run_in_parts(recipe(), log, tmp_path / "out.parquet", part_rows=1000, resume=True)
    assert ("in order, since it was begun so" in summary.note) == begun


def test_the_folder_of_a_run_that_was_killed_goes_and_that_of_one_that_works_stays(log, tmp_path):
    for name in (".out.parquet.0123abcd.parts", ".other.parquet.0123abcd.parts"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "part-000000.parquet").write_bytes(b"begun")
    with folder_beside(tmp_path / "out.parquet") as working:
        run_in_parts(recipe(), log, tmp_path / "out.parquet", part_rows=1000)
        assert {path for path in tmp_path.iterdir() if path.is_dir()} == {
            working,
            tmp_path / ".other.parquet.0123abcd.parts",
        }
    assert not working.exists()


def test_what_a_worker_left_does_not_get_into_the_folder(log, tmp_path, monkeypatch):
    filter_ = parts_module._filter

    def died_before(whole, part, start, file):
        file.with_name(f".{file.name}.0123abcd.part").write_bytes(b"begun")
        return filter_(whole, part, start, file)

    monkeypatch.setattr(parts_module, "_filter", died_before)
    run_in_parts(recipe(), log, tmp_path / "out.parquet", part_rows=1000, as_folder=True)
    assert all(path.name.startswith("part-") for path in (tmp_path / "out.parquet").iterdir())


@pytest.mark.usefixtures("only_parts")
@pytest.mark.parametrize("as_folder", [False, True])
def test_a_report_that_cannot_be_written_leaves_the_result_and_no_other_report(
    log, tmp_path, monkeypatch, as_folder
):
    out = tmp_path / "out.parquet"
    run_in_parts(recipe(), log, out, part_rows=1000)
    old = pq.read_table(out)

    def full(_report, _out):
        raise LogError("no space left")

    monkeypatch.setattr(parts_module, "write_report", full)
    with pytest.raises(LogError, match="no space left"):
        run_in_parts(recipe("PI, slow"), log, out, part_rows=1000, as_folder=as_folder)
    assert [path.name for path in tmp_path.iterdir()] == ["out.parquet"]
    assert not pq.read_table(out).equals(old)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_folder_of_parts_is_a_result_like_any_other(log, tmp_path, monkeypatch, workers):
    """It stays without --force and with --resume, and is replaced as a whole with --force."""
    monkeypatch.setattr(parts_module.run_in_parts, "__kwdefaults__", {**DEFAULTS, "part_rows": 1000})
    out = tmp_path / "out.parquet"
    options = {"workers": workers, "as_folder": True}
    jobs = plan([log], str(out), as_folder=True)
    assert jobs == [Job(log, out)]
    assert run_logs(recipe(), jobs, **options)[0].status == "done"
    old = pq.read_table(out)
    (out / "part-999999.parquet").write_bytes(b"stale")
    with pytest.raises(UsageError, match=r"out\.parquet: is already there; --force replaces it"):
        plan([log], str(out), as_folder=True)
    assert plan([log], str(out), as_folder=True, resume=True) == jobs
    assert run_logs(recipe(), jobs, **options, resume=True)[0].status == "already done"
    assert plan([log], str(out), as_folder=True, force=True) == jobs
    assert run_logs(recipe("PI, slow"), jobs, **options, force=True)[0].status == "done"
    assert not pq.read_table(out).equals(old)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.parquet", "out.parquet.quality.json"]
    (out / "notes.txt").write_text("mine")
    assert "more than the parts of a log" in run_logs(recipe(), jobs, **options, force=True)[0].message
    assert (out / "notes.txt").read_text() == "mine"
    (out / "notes.txt").unlink()
    short = tmp_path / "short.parquet"
    pq.write_table(pq.read_table(log).slice(0, 1200), short)
    outcome = run_logs(recipe(), [Job(short, out)], **options, force=True)[0]
    assert "the log goes in order, into a file; remove it first" in outcome.message
    assert report_of(out)["rows"] == ROWS


def test_parts_of_several_logs_are_refused(log, tmp_path):
    jobs = [Job(log, tmp_path / "new" / f"{name}.parquet") for name in "ab"]
    with pytest.raises(UsageError, match="is for a single log"):
        run_logs(recipe(), jobs, as_folder=True)
    assert not list(tmp_path.iterdir())
