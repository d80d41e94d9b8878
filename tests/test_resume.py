"""A run that was killed, or that ran out of disk, is taken up: the result has the bytes of one that was not."""

import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from compfilt.logs import draft, encoders, job, run_log
from compfilt.logs.errors import LogError
from compfilt.logs.job import run_job
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.run import Job

RECIPE = """
version = 1
[log]
time = { column = "t", unit = "s" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "FILTER"
[policy]
gap = { longer_than = "1 s", do = "reset" }
stuck = { longer_than = "20 ms", do = "coast" }
clipped = { samples = 2, do = "hold" }
[output]
columns = ["roll", "pitch", "flags", "faults"]
unit = "deg"
keep = ["t", "note"]
"""
FILTERS = {
    "tilt": 'kind = "tilt"\ndesign = { kind = "pi", kp = 2.0, ki = 0.5 }',
    "attitude": 'kind = "attitude"\nmethod = "self_calibrating"\ntau = 3.0',
}
ROWS = 6000


def recipe_text(kind="tilt"):
    return RECIPE.replace('kind = "FILTER"', FILTERS[kind])


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log with whatever can be wrong, in row groups that fit nothing."""
    path = tmp_path_factory.mktemp("log") / "log.parquet"
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.005, 0.015, ROWS))
    t[2500:] += 7.0
    columns = {name: np.round(rng.normal(0.0, 20.0, ROWS)) for name in ("gx", "gy", "gz")}
    columns |= {name: rng.normal(mean, 0.1, ROWS) for name, mean in (("ax", 0.1), ("ay", 0.2), ("az", 1.0))}
    columns["ay"][1490:1530] = np.nan
    columns["az"][2990:3020] = 1.0
    columns["gz"][3990:4010] = 100.0
    notes = [f"row {i % 40}" for i in range(ROWS)]
    pq.write_table(pa.table({"t": t, "note": notes, **columns}), path, row_group_size=777)
    return path


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Row groups of 250 rows, a checkpoint after every 1000."""
    monkeypatch.setattr(encoders, "ROWS_PER_GROUP", 250)
    monkeypatch.setattr(job, "ROWS_PER_CHECKPOINT", 1000)


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


# Kills the process when it has filtered some rows and written what it does then.
KILLED = """
import json, os, signal, sys, time
from compfilt.logs import draft, encoders, job, pipeline, readers
encoders.ROWS_PER_GROUP, job.ROWS_PER_CHECKPOINT = 250, 1000
at, where = int(os.environ["AT"]), os.environ["WHERE"]
opened = readers.open_log
job.open_log = lambda *a, **k: opened(*a, **{**k, "batch_rows": 333})
def die():
    os.kill(os.getpid(), signal.SIGKILL)
def saved_rows():
    try:
        return json.load(open(f".{sys.argv[-1]}.part.json"))["state"]["rows"]
    except FileNotFoundError:
        return 0
if where == "filter":
    process = pipeline.Pipeline.process
    def stop(self, batch):
        if self.rows >= at:
            while self.rows >= 1000 and saved_rows() < self.rows // 1000 * 1000:
                time.sleep(0.01)  # the writer catches up
            die()
        return process(self, batch)
    pipeline.Pipeline.process = stop
else:
    marks = []
    mark, replace = draft.Draft.mark, draft.Path.replace
    def counted(self, writer, state):
        marks.append(state["rows"])
        if where == "settled" and state["rows"] >= at:
            writer.settle()
            die()
        mark(self, writer, state)
    def named(self, target):
        if marks and marks[-1] >= at and str(self).endswith(".new"):
            die()
        return replace(self, target)
    draft.Draft.mark, draft.Path.replace = counted, named
from compfilt.__main__ import main
sys.exit(main())
"""


def command(folder, *arguments, code=None, **environment):
    start = ["-m", "compfilt"] if code is None else ["-c", code]
    return subprocess.run(
        [sys.executable, *start, *map(str, arguments)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.parametrize("ending", ["parquet", "csv"])
@pytest.mark.parametrize(
    ("where", "at", "resumed"),
    [
        ("filter", 500, 0),
        ("filter", 1000, 1000),
        ("filter", 3700, 3000),
        ("filter", 5600, 5000),
        ("settled", 2000, 1000),
        ("named", 2000, 1000),
    ],
)
def test_a_killed_run_is_taken_up(log, tmp_path, ending, where, at, resumed):
    recipe = parse_recipe(recipe_text())
    run_log(recipe, log, tmp_path / f"whole.{ending}")
    shutil.copy2(log, tmp_path / "log.parquet")
    (tmp_path / "recipe.toml").write_text(recipe_text(), encoding="utf-8")
    out = tmp_path / f"out.{ending}"
    arguments = ("run", "recipe.toml", "log.parquet", "-o", out.name)
    killed = command(tmp_path, *arguments, code=KILLED, AT=str(at), WHERE=where)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert not out.exists()
    summary = run_log(recipe, tmp_path / "log.parquet", out, resume=True)
    # Whether the first rows had reached the file when the process died is a matter of chance.
    begun = ("what an earlier run left was of no use", "")
    assert summary.note in ((f"resumed at row {resumed + 1}",) if resumed else begun)
    assert out.read_bytes() == (tmp_path / f"whole.{ending}").read_bytes()
    reports = [
        json.loads((tmp_path / f"{name}.{ending}.quality.json").read_text()) for name in ("out", "whole")
    ]
    for report in reports:
        del report["log"], report["result"]
    assert reports[0] == reports[1]
    assert not [name for name in names(tmp_path) if name.startswith(".")]


@pytest.mark.parametrize("kind", FILTERS)
def test_stopped_again_and_again(log, tmp_path, kind):
    """Every checkpoint is one from which the run goes on, whatever the filter."""
    recipe = parse_recipe(recipe_text(kind))
    whole = run_log(recipe, log, tmp_path / "whole.parquet")
    out = tmp_path / "out.parquet"
    for _ in range(5):
        stop = Stop(out, 1100)
        with pytest.raises(KeyboardInterrupt):
            run_log(recipe, log, out, resume=True, advance=stop, batch_rows=100)
        assert names(tmp_path)[:2] == [".out.parquet.part", ".out.parquet.part.json"]
    summary = run_log(recipe, log, out, resume=True)
    assert summary.note == "resumed at row 5001"
    assert out.read_bytes() == (tmp_path / "whole.parquet").read_bytes()
    assert (summary.counts, summary.faults, summary.gaps) == (whole.counts, whole.faults, 1)
    assert pq.read_table(out).num_rows == ROWS


class Stop:
    """Interrupt a run after some rows, once the writer has caught up."""

    def __init__(self, out, rows):
        self.checkpoint = out.with_name(f".{out.name}.part.json")
        self.rows = self.saved()
        self.last = self.rows + rows

    def saved(self):
        return json.loads(self.checkpoint.read_text())["state"]["rows"] if self.checkpoint.exists() else 0

    def __call__(self, _size, rows):
        self.rows += rows
        if self.rows >= self.last:
            while self.saved() < self.rows // 1000 * 1000:
                time.sleep(0.01)
            raise KeyboardInterrupt


def stopped(recipe, log, out):
    with pytest.raises(KeyboardInterrupt):
        run_log(recipe, log, out, advance=Stop(out, 2500), batch_rows=100)


def test_without_resume_a_run_begins_anew_and_says_so(log, tmp_path):
    recipe = parse_recipe(recipe_text())
    stopped(recipe, log, tmp_path / "out.csv")
    assert run_log(recipe, log, tmp_path / "out.csv").note == "what an earlier run left was dropped"
    assert names(tmp_path) == ["out.csv", "out.csv.quality.json"]


@pytest.mark.parametrize("change", ["recipe", "log", "touched", "checkpoint", "infinite", "nested", "bytes"])
def test_what_belongs_to_something_else_is_not_taken_up(log, tmp_path, change):
    recipe = parse_recipe(recipe_text())
    copy = tmp_path / "log.parquet"
    shutil.copy2(log, copy)
    out, part = tmp_path / "out.parquet", tmp_path / ".out.parquet.part"
    checkpoint = tmp_path / ".out.parquet.part.json"
    stopped(recipe, copy, out)
    if change == "recipe":
        recipe = parse_recipe(recipe_text().replace("kp = 2.0", "kp = 2.5"))
    elif change == "log":
        table = pq.read_table(copy)
        pq.write_table(table.slice(0, 5000), copy)
    elif change == "touched":
        os.utime(copy, (1.0, 1.0))
    elif change == "checkpoint":
        saved = json.loads(checkpoint.read_text())
        saved["state"]["stream"] = ["nonsense"]
        checkpoint.write_text(json.dumps(saved))
    elif change == "infinite":
        saved = json.loads(checkpoint.read_text())
        checkpoint.write_text(json.dumps({**saved, "bytes": float("inf")}).replace("Infinity", "1e999"))
    elif change == "nested":
        checkpoint.write_text("[" * 100_000)
    else:
        part.write_bytes(part.read_bytes()[:100])
    summary = run_log(recipe, copy, out, resume=True)
    assert summary.note == "what an earlier run left was of no use"
    run_log(recipe, copy, tmp_path / "whole.parquet")
    assert out.read_bytes() == (tmp_path / "whole.parquet").read_bytes()


def test_a_checkpoint_is_not_a_pickle(log, tmp_path):
    """What a stranger leaves in the folder is not run."""
    recipe = parse_recipe(recipe_text())
    stopped(recipe, log, tmp_path / "out.csv")
    (tmp_path / ".out.csv.part.json").write_bytes(pickle.dumps(Trap(tmp_path / "sprung")))
    run_log(recipe, log, tmp_path / "out.csv", resume=True)
    assert names(tmp_path) == ["out.csv", "out.csv.quality.json"]


@pytest.mark.parametrize("link", ["symlink_to", "hardlink_to"])
@pytest.mark.parametrize("name", [".out.csv.part", ".out.csv.part.json.new"])
def test_a_link_in_the_folder_does_not_lead_out_of_it(log, tmp_path, link, name):
    """Whoever may write into the folder cannot have another file of the user overwritten."""
    recipe = parse_recipe(recipe_text())
    other = tmp_path / "other"
    other.write_text("precious", encoding="utf-8")
    getattr(tmp_path / name, link)(other)

    def link_anew(_size, _rows):
        if name.endswith(".new") and not (tmp_path / name).exists():
            getattr(tmp_path / name, link)(other)

    outcome = run_job(recipe, Job(log, tmp_path / "out.csv"), advance=link_anew)
    assert outcome.status == ("failed" if name == ".out.csv.part" else "done")
    assert "cannot be written: " in outcome.message or outcome.status == "done"
    assert other.read_text(encoding="utf-8") == "precious"


class Trap:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_a_full_disk_keeps_what_is_sure(log, tmp_path):
    resource = pytest.importorskip("resource")
    recipe = parse_recipe(recipe_text())
    run_log(recipe, log, tmp_path / "whole.parquet")
    size = (tmp_path / "whole.parquet").stat().st_size
    out = tmp_path / "out.parquet"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size * 2 // 3, limits[1]))
    try:
        with pytest.raises(
            LogError, match=r"cannot be written: File too large; --resume goes on from the last"
        ):
            run_log(recipe, log, out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert run_log(recipe, log, out, resume=True).note.startswith("resumed at row ")
    assert out.read_bytes() == (tmp_path / "whole.parquet").read_bytes()


def mount(*options):
    """Call the system's mount; whether it went well."""
    program = shutil.which("mount")
    return (
        program is not None
        and subprocess.run([program, *options], check=False, capture_output=True).returncode == 0
    )


@pytest.fixture
def disk(tmp_path):
    """A disk of a size that can be set, where the system lets us have one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    if not mount("-t", "tmpfs", "-o", "size=160k", "tmpfs", str(folder)):
        pytest.skip("no disk of our own: mounting takes a superuser on Linux")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("ending", ["parquet", "csv"])
def test_a_disk_that_was_full_and_has_room_again(log, tmp_path, disk, ending):
    recipe = parse_recipe(recipe_text())
    out = disk / f"out.{ending}"
    with pytest.raises(
        LogError, match=r"cannot be written: No space left on device; --resume goes on from the"
    ):
        run_log(recipe, log, out)
    assert names(disk) == [f".out.{ending}.part", f".out.{ending}.part.json"]
    assert mount("-o", "remount,size=10m", str(disk))
    assert run_log(recipe, log, out, resume=True).note.startswith("resumed at row ")
    run_log(recipe, log, tmp_path / f"whole.{ending}")
    assert out.read_bytes() == (tmp_path / f"whole.{ending}").read_bytes()


def test_a_report_never_stands_beside_another_result(log, tmp_path, monkeypatch):
    old, new = (parse_recipe(recipe_text().replace("kp = 2.0", f"kp = {kp}")) for kp in (2.0, 2.5))
    work = Job(log, tmp_path / "out.csv")
    run_job(old, work)
    before = work.out.read_bytes()

    def die(_draft):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(draft.Draft, "complete", die)
        with pytest.raises(KeyboardInterrupt):
            run_job(new, work, force=True)
    assert work.out.read_bytes() == before
    assert run_job(new, work, resume=True).status == "failed"
    assert run_job(new, work, force=True, resume=True).status == "done"
    assert work.out.read_bytes() != before


def test_a_report_that_cannot_be_written_leaves_the_result(log, tmp_path, monkeypatch):
    recipe = parse_recipe(recipe_text())
    run_log(recipe, log, tmp_path / "whole.csv")

    def full(_report, _out):
        raise LogError("out.csv.quality.json cannot be written: No space left on device")

    monkeypatch.setattr(job, "write_report", full)
    assert run_job(recipe, Job(log, tmp_path / "out.csv")).message.endswith("No space left on device")
    assert (tmp_path / "out.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_two_runs_do_not_write_the_same_result(log, tmp_path):
    pytest.importorskip("fcntl")
    recipe = parse_recipe(recipe_text())
    outcomes = []

    def second(_size, _rows):
        if not outcomes:
            outcomes.append(run_job(recipe, Job(log, tmp_path / "out.csv")))

    run_log(recipe, log, tmp_path / "out.csv", advance=second)
    assert outcomes[0].status == "failed"
    assert outcomes[0].message == f"{tmp_path / 'out.csv'} is being written by another run"
    assert names(tmp_path) == ["out.csv", "out.csv.quality.json"]


def test_what_is_complete_is_left_alone(log, tmp_path):
    recipe = parse_recipe(recipe_text())
    work = Job(log, tmp_path / "out.parquet")
    assert run_job(recipe, work).status == "done"
    before = (tmp_path / "out.parquet").stat()
    again = run_job(recipe, work, resume=True)
    assert (again.status, again.rows, again.failed) == ("already done", ROWS, False)
    assert "already there; --force replaces it" in run_job(recipe, work).message
    other = parse_recipe(recipe_text().replace("kp = 2.0", "kp = 2.5"))
    refused = run_job(other, work, resume=True)
    assert refused.failed
    assert "not made by this release from this log with this recipe" in refused.message
    assert (tmp_path / "out.parquet").stat().st_mtime_ns == before.st_mtime_ns
    assert run_job(other, work, force=True).status == "done"


def test_the_size_of_the_batches_does_not_show_in_the_bytes(log, tmp_path):
    recipe = parse_recipe(recipe_text())
    results = []
    for rows in (97, 1000, 100_000):
        run_log(recipe, log, tmp_path / "out.parquet", batch_rows=rows)
        results.append((tmp_path / "out.parquet").read_bytes())
    assert results[0] == results[1] == results[2]
    groups = pq.ParquetFile(tmp_path / "out.parquet").metadata
    assert {groups.row_group(i).num_rows for i in range(groups.num_row_groups)} == {250}
