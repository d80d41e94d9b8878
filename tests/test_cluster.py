"""A real cluster of two worker processes: every log once, whatever dies; one long log in parts; data frames."""

import os
import signal
import subprocess
import sys
import time

import dask.dataframe as dd
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from distributed import Client, WorkerPlugin

from compfilt.logs import cluster, job, parts, run_log, run_logs
from compfilt.logs.cluster import LOCAL, connect, run_logs_on, run_long_log_on
from compfilt.logs.dask_workers import DaskWorkers
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.frames import filter_frame
from compfilt.logs.outcome import Job
from compfilt.logs.watch import Watch
from test_parts import FILTERS, assert_alike, recipe, write_log

LOGS = 200

# Dask's own loose ends.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(scope="module")
def client():
    """A cluster of two processes. A worker that dies is replaced."""
    with connect(LOCAL, workers=2) as client:
        yield client


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Small logs of different lengths."""
    folder = tmp_path_factory.mktemp("logs")
    return [
        write_log(folder / f"{number:03}.parquet", rows=500 + 10 * number, seed=number)
        for number in range(LOGS)
    ]


class Listed(Watch):
    """Keeps what it is told, and does something at some outcome."""

    def __init__(self, at=None, do=None):
        self.ends = []
        self.rows = 0
        self._at, self._do = at, do

    def advanced(self, _job, _size, rows):
        self.rows += rows

    def ended(self, outcome):
        self.ends.append(outcome.job)
        if len(self.ends) == self._at:
            self._do()


def jobs_in(folder, logs):
    folder.mkdir()
    return [Job(log, folder / log.name) for log in logs]


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def pids(client):
    return set(client.run(os.getpid).values())


def test_every_log_once_though_a_worker_is_killed(client, logs, tmp_path):
    serial = run_logs(recipe(), jobs_in(tmp_path / "serial", logs))
    before = pids(client)
    victim = min(before)
    watch = Listed(at=LOGS // 3, do=lambda: os.kill(victim, signal.SIGKILL))
    jobs = jobs_in(tmp_path / "cluster", logs)
    outcomes = run_logs_on(client, recipe(), jobs, watch=watch)
    assert [outcome.job for outcome in outcomes] == jobs
    assert {outcome.failed for outcome in outcomes} == {False}
    assert sorted(watch.ends) == jobs
    assert watch.rows == sum(outcome.rows for outcome in serial)
    # The reports name log and result, which are called the same.
    assert contents(tmp_path / "cluster") == contents(tmp_path / "serial")
    assert victim not in pids(client)


def test_a_task_that_is_repeated_finds_its_result(client, logs, tmp_path):
    """Dask repeats what was done if the worker that knows how it ended dies; the result is not an obstacle then."""
    jobs = jobs_in(tmp_path / "out", logs[:3])
    run_logs_on(client, recipe(), jobs[:1], force=False)
    done = jobs[0].out.stat().st_mtime_ns
    outcomes = run_logs_on(client, recipe(), jobs, resume=True, force=False)
    assert [outcome.status for outcome in outcomes] == ["already done", "done", "done"]
    assert jobs[0].out.stat().st_mtime_ns == done


def test_a_report_that_was_begun_goes(client, logs, tmp_path):
    """A worker that is killed while it writes a report leaves it under a hidden name."""
    jobs = jobs_in(tmp_path / "out", logs[:2])
    begun = tmp_path / "out" / f".{jobs[0].out.name}.quality.json.0123abcd.part"
    foreign = tmp_path / "out" / ".other.parquet.quality.json.0123abcd.part"
    for path in (begun, foreign):
        path.write_bytes(b"{")
    run_logs_on(client, recipe(), jobs)
    assert (begun.exists(), foreign.exists()) == (False, True)


def test_results_that_are_there_stay(client, logs, tmp_path):
    jobs = jobs_in(tmp_path / "out", logs[:2])
    jobs[0].out.write_bytes(b"precious")
    outcomes = run_logs_on(client, recipe(), jobs, force=False)
    assert [outcome.status for outcome in outcomes] == ["failed", "done"]
    assert "--force" in outcomes[0].message
    assert jobs[0].out.read_bytes() == b"precious"


def test_a_log_that_fails_does_not_stop_the_others(client, logs, tmp_path):
    bad = tmp_path / "bad.parquet"
    pq.write_table(pa.table({"t": [1, 2]}), bad)
    serial = run_logs(recipe(), jobs_in(tmp_path / "serial", [logs[0], bad, logs[1]]))
    outcomes = run_logs_on(client, recipe(), jobs_in(tmp_path / "cluster", [logs[0], bad, logs[1]]))
    assert [outcome.status for outcome in outcomes] == ["done", "failed", "done"]
    assert outcomes[1].message == serial[1].message
    assert contents(tmp_path / "cluster") == contents(tmp_path / "serial")


class Deadly(WorkerPlugin):
    """Workers that die of one log, as of one that exhausts the memory."""

    name = "deadly"

    def __init__(self, log):
        self._log = log

    def setup(self, worker):  # noqa: ARG002 - the name is part of the call
        self._run = job.run_log
        job.run_log = self._run_log

    def teardown(self, worker):  # noqa: ARG002
        job.run_log = self._run

    def _run_log(self, recipe, log, out, **options):
        if log.name == self._log:
            os.kill(os.getpid(), signal.SIGKILL)
        return self._run(recipe, log, out, **options)


def allow_failures(count, dask_scheduler):
    dask_scheduler.allowed_failures, before = count, dask_scheduler.allowed_failures
    return before


def test_a_log_that_kills_its_workers_fails(client, logs, tmp_path):
    jobs = jobs_in(tmp_path / "out", logs[:4])
    client.register_plugin(Deadly(logs[2].name))
    before = client.run_on_scheduler(allow_failures, count=0)
    try:
        outcomes = run_logs_on(client, recipe(), jobs)
    finally:
        client.run_on_scheduler(allow_failures, count=before)
        client.unregister_worker_plugin("deadly")
    assert (outcomes[2].status, outcomes[2].message) == (
        "failed",
        "the worker that filtered it died (attempts: 1)",
    )
    assert not jobs[2].out.exists()
    # Dask blames what else the worker had at hand, too; whatever failed can be done again.
    assert all(outcome.status == "done" or "died" in outcome.message for outcome in outcomes)
    again = run_logs_on(client, recipe(), jobs, force=False, resume=True)
    assert {outcome.failed for outcome in again} == {False}


@pytest.mark.parametrize(
    "policy", ["", 'gap = { longer_than = "1 s", do = "reset" }'], ids=["coast", "reset"]
)
@pytest.mark.parametrize("filter_", FILTERS)
def test_one_long_log_over_the_cluster(filter_, policy, client, tmp_path):
    log = write_log(tmp_path / "log.parquet", rows=20_000, seed=7)
    whole, parts = tmp_path / "whole.parquet", tmp_path / "parts.parquet"
    run_log(recipe(filter_, policy), log, whole)
    watch = Listed()
    outcome = run_long_log_on(client, recipe(filter_, policy), Job(log, parts), part_rows=2000, watch=watch)
    assert (outcome.status, outcome.rows, watch.rows) == ("done", 20_000, 20_000)
    assert "in order" not in outcome.message
    assert_alike(whole, parts)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_one_long_log_though_a_worker_is_killed(client, tmp_path):
    log = write_log(tmp_path / "log.parquet", rows=400_000, seed=8, group=20_000)
    whole, parts = tmp_path / "whole.parquet", tmp_path / "parts.parquet"
    run_log(recipe("PI, slow"), log, whole)
    killer = Killer(min(pids(client)), tmp_path)
    outcome = run_long_log_on(client, recipe("PI, slow"), Job(log, parts), part_rows=10_000, watch=killer)
    assert killer.done
    assert outcome.status == "done"
    assert_alike(whole, parts)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_one_long_log_that_kills_its_workers_goes_in_order(client, tmp_path):
    log = write_log(tmp_path / "log.parquet")
    killed = client.run_on_scheduler(allow_failures, count=0)
    client.register_plugin(DeadlyParts())
    try:
        outcome = run_long_log_on(client, recipe(), Job(log, tmp_path / "out.parquet"), part_rows=1000)
    finally:
        client.run_on_scheduler(allow_failures, count=killed)
        client.unregister_worker_plugin("deadly parts")
    assert outcome.status == "done"
    assert "in order, since the worker that filtered it died" in outcome.message
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


class DeadlyParts(WorkerPlugin):
    """Workers that die of the first part that they are to filter."""

    name = "deadly parts"

    def setup(self, worker):  # noqa: ARG002 - the name is part of the call
        self._filter, parts._filter = parts._filter, die

    def teardown(self, worker):  # noqa: ARG002
        parts._filter = self._filter


def die(*_arguments):
    os._exit(1)


def test_work_that_fails_otherwise_is_a_log_error(client):
    with pytest.raises(LogError, match="unexpected ZeroDivisionError on a worker"):
        DaskWorkers(client)(divmod, 1, 0).result()


def test_a_client_that_lost_its_scheduler_is_a_log_error(client):
    with Client(client.scheduler.address, set_as_default=False) as lost:
        pass
    with pytest.raises(LogError, match="the scheduler was lost"):
        DaskWorkers(lost)(divmod, 1, 1)


def test_what_a_worker_is_at_is_waited_for(client, tmp_path):
    """Otherwise it would write on when the next run does."""
    begun, done = tmp_path / "begun", tmp_path / "done"
    workers = DaskWorkers(client)
    running = workers(slow, begun, done)
    waiting = [workers(slow, tmp_path / "late", tmp_path / "late") for _ in range(5)]
    while not begun.exists():
        time.sleep(0.01)
    cancelled = [future for future in (running, *waiting) if future.cancel() is False]
    assert running in cancelled
    for future in cancelled:
        with pytest.raises(LogError):
            future.result()
    assert done.exists()


def slow(begun, done):
    begun.touch()
    time.sleep(1.0)
    done.touch()


class Killer(Watch):
    """Kills a worker when the first part is done."""

    def __init__(self, pid, _folder):
        self._pid = pid
        self.done = False

    def advanced(self, _job, _size, _rows):
        if not self.done:
            self.done = True
            os.kill(self._pid, signal.SIGKILL)


def test_the_command_line(client, logs, tmp_path):
    text = (
        'version = 1\n[log]\ntime = { column = "t", unit = "ms" }\n'
        'measurement = { column = "y", unit = "rad" }\nderivative = { column = "u", unit = "rad/s" }\n'
        '[filter]\nkind = "pi"\nkp = 2.0\nki = 1.0\n[output]\ncolumns = ["estimate"]\n'
    )
    (tmp_path / "recipe.toml").write_text(text, encoding="utf-8")
    address = client.scheduler.address
    for number, arguments in enumerate(([], ["--scheduler", address])):
        command = [*arguments, "recipe.toml", *map(str, logs[:3]), "-o", f"{number}/"]
        done = command_line("run", *command, folder=tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stderr.count("samples") == 3
    assert contents(tmp_path / "0") == contents(tmp_path / "1")


@pytest.mark.parametrize(
    ("scheduler", "words"),
    [("here", "neither"), ("tcp://127.0.0.1:1", "cannot be reached"), ("127.0.0.1:port", "neither")],
)
def test_no_scheduler(scheduler, words, monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 0.5)
    with pytest.raises(UsageError, match=f"--scheduler {scheduler}: .*{words}"), connect(scheduler):
        pass


def test_without_the_extra_one_line_names_it(tmp_path):
    code = (
        "import sys; sys.modules['distributed'] = None; from compfilt.__main__ import main; sys.exit(main())"
    )
    (tmp_path / "recipe.toml").write_text("", encoding="utf-8")
    arguments = ("run", "recipe.toml", "log.csv", "-o", "out/", "--scheduler", "local")
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "compfilt[cluster]" in done.stderr


def command_line(*arguments, folder):
    return subprocess.run(
        [sys.executable, "-m", "compfilt", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def frame_of(log):
    return pq.read_table(log).to_pandas()


def test_frames(logs, tmp_path):
    run_log(recipe(), logs[5], tmp_path / "out.parquet")
    frame = frame_of(logs[5]).set_index(pd.Index(range(100, 650)))
    found = filter_frame(frame, recipe())
    pd.testing.assert_frame_equal(found.reset_index(drop=True), frame_of(tmp_path / "out.parquet"))
    assert list(found.index) == list(range(100, 650))
    assert list(filter_frame(frame.iloc[:0], recipe()).columns) == list(found.columns)
    with pytest.raises(LogError, match='no column "u"'):
        filter_frame(frame.drop(columns="u"), recipe())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda frame: frame.assign(u="text"), 'column "u" holds'),
        (lambda frame: frame.assign(y=True), 'column "y" holds bool'),
        (lambda frame: pd.concat([frame, frame[["y"]]], axis=1), '2 columns "y"'),
        (lambda frame: frame.assign(u=[1.0, "text"] * (len(frame) // 2)), "cannot be read"),
    ],
    ids=["text", "bool", "doubled", "mixed"],
)
def test_frames_that_cannot_be_filtered(change, words, logs):
    with pytest.raises(LogError, match=words):
        filter_frame(change(frame_of(logs[5])), recipe())


def test_partitions_of_a_dask_frame(client, logs):
    """A partition is a log: the filter starts anew in each."""
    frames = dd.from_map(frame_of, logs[:4])
    found = client.compute(frames.map_partitions(filter_frame, recipe())).result()
    expected = pd.concat([filter_frame(frame_of(log), recipe()) for log in logs[:4]])
    pd.testing.assert_frame_equal(found, expected)
