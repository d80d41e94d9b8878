"""Several logs at a time: the results of one after the other, whatever happens to a worker."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from compfilt.logs import workers
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.run import plan, run_logs
from compfilt.logs.watch import Watch
from compfilt.logs.workers import _deaf_to_ctrl_c

RECIPE = """
version = 1
[log]
rate = 100.0
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[output]
columns = ["estimate", "bias", "flags"]
"""


def write_log(path, rows, seed):
    rng = np.random.default_rng(seed)
    pq.write_table(pa.table({"angle": rng.normal(size=rows), "rate": rng.normal(size=rows)}), path)
    return path


@pytest.fixture
def logs(tmp_path):
    folder = tmp_path / "logs"
    folder.mkdir()
    paths = [write_log(folder / f"{i}.parquet", 1000 + i, i) for i in range(6)]
    (folder / "bad.parquet").write_bytes(b"nothing of the kind")
    return [*paths[:3], folder / "bad.parquet", *paths[3:]]


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_results_are_those_of_one_after_the_other(logs, tmp_path):
    recipe = parse_recipe(RECIPE)
    serial = run_logs(recipe, plan(logs, str(tmp_path / "serial")))
    several = run_logs(recipe, plan(logs, str(tmp_path / "several")), workers=2)
    assert contents(tmp_path / "serial") == contents(tmp_path / "several")
    assert len(contents(tmp_path / "serial")) == 12
    assert [(one.job.log, one.status, one.report) for one in several] == [
        (one.job.log, one.status, one.report) for one in serial
    ]
    assert [one.status for one in serial].index("failed") == 3


def test_a_worker_that_dies_fails_its_own_log_only(logs, tmp_path, monkeypatch):
    victims = [write_log(tmp_path / f"victim{i}.parquet", 1_000_000, i) for i in range(2)]
    at_work = {}
    give = workers._Worker.give

    def noted(self, number, job, watch):
        at_work[job.log] = self._process.pid
        give(self, number, job, watch)

    monkeypatch.setattr(workers._Worker, "give", noted)

    class Killer(Watch):
        def advanced(self, job, _size, _rows):
            if job.log in victims:
                os.kill(at_work[job.log], signal.SIGKILL)

    out = tmp_path / "out"
    jobs = plan([*victims, *logs], str(out))
    outcomes = run_logs(parse_recipe(RECIPE), jobs, workers=2, watch=Killer())
    for outcome in outcomes[:2]:
        assert outcome.message == "the worker process died (SIGKILL)"
        assert not outcome.job.out.exists()
    assert [one.status for one in outcomes[2:]] == ["done"] * 3 + ["failed"] + ["done"] * 3
    assert not set(at_work.values()) <= {at_work[victim] for victim in victims}  # others took their places
    # The next run cleans up after it.
    again = run_logs(parse_recipe(RECIPE), plan(victims, str(out)))
    assert "what an earlier run left was dropped" in again[0].message
    assert not list(out.glob(".*"))


def command(folder, *arguments):
    return [sys.executable, "-m", "compfilt", "run", "recipe.toml", *map(str, arguments)], {"cwd": folder}


@pytest.mark.parametrize("number", [1, 2])
def test_one_json_object_a_log(logs, tmp_path, number):
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    arguments, options = command(tmp_path, *logs, "-o", "out", "--json", "--workers", number)
    done = subprocess.run(arguments, **options, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    assert done.stderr == ""
    told = {line["log"]: line for line in map(json.loads, done.stdout.splitlines())}
    assert set(told) == {str(path) for path in logs}
    bad = told[str(logs[3])]
    assert (bad["status"], bad["result"], bad["quality"]) == ("failed", None, None)
    assert "the file is damaged" in bad["message"]
    good = told[str(logs[0])]
    assert (good["status"], good["rows"], good["quality"]["rows"]) == ("done", 1000, 1000)
    assert good["quality"] == json.loads((tmp_path / "out" / "0.parquet.quality.json").read_text())


def is_deaf(pipe):
    pipe.send(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))


def test_a_worker_is_deaf_to_ctrl_c_from_its_first_moment():
    """Before it has run a line of ours it would print a traceback."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=is_deaf, args=(theirs,))
    with _deaf_to_ctrl_c():
        process.start()
    assert ours.recv()
    process.join()
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_interrupted_workers_leave_nothing_and_the_run_can_go_on(logs, tmp_path):
    large = [write_log(tmp_path / f"large{i}.parquet", 3_000_000, i) for i in range(2)]
    (tmp_path / "recipe.toml").write_text(RECIPE, encoding="utf-8")
    arguments, options = command(tmp_path, logs[0], *large, "-o", "out", "--workers", 2)
    out = tmp_path / "out"
    # A group of its own, which gets the signal as a terminal would send it: every process of it.
    running = subprocess.Popen(
        arguments, **options, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    patience = time.monotonic() + 50.0
    while not (out.exists() and list(out.glob("*large*"))):
        assert running.poll() is None, running.stderr.read()
        assert time.monotonic() < patience
        time.sleep(0.01)
    os.killpg(running.pid, signal.SIGINT)
    _, said = running.communicate(timeout=50)
    assert running.returncode == 130, said
    assert said.splitlines()[-1] == "compfilt: interrupted; the same command with --resume does the rest"
    assert "Traceback" not in said
    assert not list(out.glob(".*"))
    finished = subprocess.run(
        [*arguments, "--resume"], **options, capture_output=True, text=True, check=False, timeout=60
    )
    assert finished.returncode == 0, finished.stderr
    run_logs(parse_recipe(RECIPE), plan([logs[0], *large], str(tmp_path / "serial")))
    assert contents(out) == contents(tmp_path / "serial")
