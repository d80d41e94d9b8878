"""The command line as a user meets it: statuses, one line for one thing, no traceback, nothing half done."""

import contextlib
import os
import signal
import struct
import subprocess
import sys

import pyarrow.csv
import pyarrow.parquet as pq
import pytest

from compfilt.__main__ import main

RECIPE = """
version = 1
[log]
time = { column = "t", unit = "s" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "first_order", tau = 0.5 }
[output]
columns = ["roll", "pitch", "flags"]
unit = "deg"
keep = ["t", "true_roll"]
"""


def compfilt(*arguments, cwd, **options):
    """Run the command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "compfilt", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        **options,
    )


def python(code, *arguments, cwd, **environment):
    """Run the command inside a process that was tampered with first."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """A folder with a log and a recipe, made once."""
    folder = tmp_path_factory.mktemp("shared")
    made = compfilt("simulate", "child-seat", "-o", "seat.csv", "--duration", 20, "--seed", 1, cwd=folder)
    assert made.returncode == 0, made.stderr
    assert made.stderr.startswith("compfilt: 2000 samples -> ")
    (folder / "seat.toml").write_text(RECIPE, encoding="utf-8")
    return folder


@pytest.fixture
def folder(shared, tmp_path):
    """A folder of the test's own with both."""
    for name in ("seat.csv", "seat.toml"):
        (tmp_path / name).write_bytes((shared / name).read_bytes())
    return tmp_path


@pytest.fixture
def inside(folder, monkeypatch, capsys):
    """Run the command inside this process, which is faster."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["compfilt", *arguments])
        before = signal.getsignal(signal.SIGTERM)
        try:
            status = main()
        except SystemExit as leaving:
            status = leaving.code
        finally:
            signal.signal(signal.SIGTERM, before)
        return subprocess.CompletedProcess(arguments, status, *capsys.readouterr())

    return run


def one_line(process, status, *parts):
    """Check the status and the only line on stderr."""
    assert process.returncode == status, process.stderr
    assert process.stdout == ""
    assert process.stderr.startswith("compfilt: ")
    assert process.stderr.count("\n") == 1, process.stderr
    for part in parts:
        assert part in process.stderr


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_a_log_is_filtered(folder):
    one_line(
        compfilt("run", "seat.toml", "seat.csv", "-o", "out.parquet", cwd=folder),
        0,
        "2000 samples",
        "out.parquet",
    )
    out = pq.read_table(folder / "out.parquet")
    assert out.column_names == ["t", "true_roll", "roll", "pitch", "flags"]
    error = out.column("roll").to_numpy() - out.column("true_roll").to_numpy()
    assert abs(error[320:350]).max() < 2.0  # held at one side
    assert names(folder) == ["out.parquet", "out.parquet.quality.json", "seat.csv", "seat.toml"]


def test_several_logs_go_into_a_folder_and_one_fails(folder):
    (folder / "bad.csv").write_text("t,ax\n1,2\n", encoding="utf-8")
    process = compfilt("run", "seat.toml", "bad.csv", "seat.csv", "-o", "results", cwd=folder)
    assert process.returncode == 1
    lines = process.stderr.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith('compfilt: bad.csv: there is no column "a')
    assert lines[1].startswith("compfilt: seat.csv: 2000 samples")
    assert names(folder / "results") == ["seat.csv", "seat.csv.quality.json"]


def test_force(folder):
    (folder / "out.csv").write_text("old", encoding="utf-8")
    one_line(
        compfilt("run", "seat.toml", "seat.csv", "-o", "out.csv", cwd=folder),
        2,
        "out.csv: is already there; --force",
    )
    assert (folder / "out.csv").read_text(encoding="utf-8") == "old"
    one_line(compfilt("run", "seat.toml", "seat.csv", "-o", "out.csv", "--force", cwd=folder), 0)
    assert pyarrow.csv.read_csv(folder / "out.csv").num_rows == 2000


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (
            ["nowhere.toml", "seat.csv", "-o", "out.csv"],
            ["nowhere.toml: the recipe cannot be read: No such file"],
        ),
        (["wrong.toml", "seat.csv", "-o", "out.csv"], ["wrong.toml: [filter.design]", "tau"]),
        (["core.toml", "seat.csv", "-o", "out.csv"], ["core.toml: [filter] ", "tau"]),
        (["seat.toml", "seat.csv", "-o", "seat.csv", "--force"], ["the result would replace a log"]),
        (["seat.toml", "seat.csv", "x/seat.csv", "-o", "out"], ["would both go to"]),
        (["seat.toml", "seat.csv", "-o", "out.txt"], ["out.txt: cannot write"]),
    ],
)
def test_usage_errors_are_one_line_and_nothing_is_done(folder, inside, arguments, parts):
    (folder / "wrong.toml").write_text(RECIPE.replace("tau", "tua"), encoding="utf-8")
    (folder / "core.toml").write_text(RECIPE.replace("0.5", "-0.5"), encoding="utf-8")
    before = names(folder)
    one_line(inside("run", *arguments), 2, *parts)
    assert names(folder) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "seat.toml", "seat.csv"],
        ["run", "seat.toml", "seat.csv", "-o", "o.csv", "--fast"],
        ["walk"],
        ["run"],
    ],
)
def test_the_command_lines_own_errors(inside, arguments):
    process = inside(*arguments)
    assert process.returncode == 2
    assert "Usage: compfilt" in process.stderr
    assert "Traceback" not in process.stderr


def test_help_names_the_commands(inside):
    process = inside("--help")
    assert process.returncode == 0
    for command in ("run", "simulate"):
        assert command in process.stdout
    process = inside("run", "--help")
    assert "RECIPE" in process.stdout
    assert "--force" in process.stdout


# Sends the process a signal in the middle of a log, after which it must not leave anything behind.
STOPPED = """
import os, signal, sys
from compfilt.logs import job, pipeline, readers
opened = readers.open_log
job.open_log = lambda *a, **k: opened(*a, **{**k, "batch_bytes": 2000})
process, seen = pipeline.Pipeline.process, []
def stop(self, batch):
    seen.append(1)
    if len(seen) == 5:
        assert [name for name in os.listdir() if name.endswith(".part")]
        os.kill(os.getpid(), signal.{signal})
    return process(self, batch)
pipeline.Pipeline.process = stop
from compfilt.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize(
    ("name", "status", "word"), [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")]
)
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_stopped_run_leaves_nothing(folder, name, status, word, ending):
    code = STOPPED.replace("{signal}", name)
    process = python(code, "run", "seat.toml", "seat.csv", "-o", f"out.{ending}", cwd=folder)
    one_line(process, status, f"compfilt: {word}")
    assert names(folder) == ["seat.csv", "seat.toml"]


def test_ctrl_c_keeps_the_last_checkpoint_and_says_how_to_go_on(folder):
    arguments = ("run", "seat.toml", "seat.csv", "-o", "out.csv")
    code = STOPPED.replace("{signal}", "SIGINT")
    code = code.replace("opened = readers", "job.ROWS_PER_CHECKPOINT = 20\nopened = readers")
    # Not before there is a checkpoint: the writer may be behind.
    wait = "while not os.path.exists('.out.csv.part.json'): pass"
    code = code.replace("    if len(seen) == 5:\n", f"    if len(seen) == 5:\n        {wait}\n")
    process = python(code, *arguments, cwd=folder)
    one_line(process, 130, "compfilt: interrupted; the same command with --resume does the rest")
    assert names(folder)[:2] == [".out.csv.part", ".out.csv.part.json"]
    rows = len((folder / ".out.csv.part").read_text(encoding="utf-8").splitlines()) - 1
    assert rows >= 20
    one_line(compfilt(*arguments, "--resume", cwd=folder), 0, f"resumed at row {rows + 1}")
    compfilt("run", "seat.toml", "seat.csv", "-o", "whole.csv", cwd=folder)
    assert (folder / "out.csv").read_bytes() == (folder / "whole.csv").read_bytes()
    one_line(compfilt(*arguments, "--resume", cwd=folder), 0, "2000 samples, already done")
    assert not [name for name in names(folder) if name.startswith(".")]


def test_a_killed_run_leaves_nothing_under_the_final_name(folder):
    process = python(
        STOPPED.replace("{signal}", "SIGKILL"), "run", "seat.toml", "seat.csv", "-o", "out.csv", cwd=folder
    )
    assert process.returncode == -9
    assert "out.csv" not in names(folder)


BROKEN = """
import sys
from compfilt.logs import pipeline
def broken(self, batch):
    raise AssertionError("two\\nlines")
pipeline.Pipeline.process = broken
from compfilt.__main__ import main
sys.exit(main())
"""


def test_an_unexpected_error_is_one_line_unless_asked(folder):
    arguments = ("run", "seat.toml", "seat.csv", "-o", "out.parquet")
    one_line(
        python(BROKEN, *arguments, cwd=folder),
        1,
        "unexpected AssertionError: two lines",
        "COMPFILT_TRACEBACK=1",
    )
    assert names(folder) == ["seat.csv", "seat.toml"]
    process = python(BROKEN, *arguments, cwd=folder, COMPFILT_TRACEBACK="1")
    assert process.returncode == 1
    assert "Traceback (most recent call last)" in process.stderr


@pytest.mark.parametrize("package", ["typer", "tqdm"])
def test_without_the_extra_one_line_names_it(folder, package):
    code = (
        f"import sys; sys.modules['{package}'] = None; from compfilt.__main__ import main; sys.exit(main())"
    )
    process = python(code, "run", "seat.toml", "seat.csv", "-o", "out.csv", cwd=folder)
    one_line(process, 2)
    assert process.stderr == (
        "compfilt: the command line needs the extra \"logs\": pip install 'compfilt[logs]'\n"
    )


def test_without_arrow_too(folder):
    code = "import sys; sys.modules['pyarrow'] = None; from compfilt.__main__ import main; sys.exit(main())"
    process = python(code, "run", "seat.toml", "seat.csv", "-o", "out.csv", cwd=folder)
    one_line(process, 2, 'needs the extra "logs"')


def test_a_progress_bar_on_a_terminal_only(folder):
    shown = on_a_terminal(folder, "run", "seat.toml", "seat.csv", "-o", "out.csv")
    assert "%|" in shown
    assert "2000 samples" in shown
    process = compfilt("run", "seat.toml", "seat.csv", "-o", "out.csv", "--force", cwd=folder)
    assert "%|" not in process.stderr


def on_a_terminal(folder, *arguments):
    """Run the command with a terminal for stderr; return what it shows."""
    fcntl, pty, termios = (pytest.importorskip(name) for name in ("fcntl", "pty", "termios"))
    leader, follower = pty.openpty()
    fcntl.ioctl(follower, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    command = [sys.executable, "-m", "compfilt", *arguments]
    running = subprocess.Popen(command, cwd=folder, stderr=follower)
    os.close(follower)
    shown = b""
    # A terminal that nobody reads stops who writes to it; at its end Linux gives an error.
    with contextlib.suppress(OSError):
        while part := os.read(leader, 1 << 16):
            shown += part
    os.close(leader)
    assert running.wait(60) == 0
    return shown.decode()


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_table_on_a_terminal_where_there_are_several_logs(folder, workers):
    (folder / "second.csv").write_bytes((folder / "seat.csv").read_bytes())
    logs = ("seat.csv", "second.csv")
    shown = on_a_terminal(folder, "run", "seat.toml", *logs, "-o", "out", "--workers", workers)
    for part in ("all: ", "seat.csv: ", "samples/s", "jitter ms"):
        assert part in shown
    lines = [line.split() for line in shown.splitlines()]
    for log in logs:
        assert [log, "2000", "100"] in [line[:3] for line in lines]


def test_a_simulated_log_may_have_the_name_of_what_it_simulates(folder, inside):
    assert inside("simulate", "child-seat", "-o", "child-seat.csv", "--duration", "1").returncode == 0
    assert names(folder) == ["child-seat.csv", "seat.csv", "seat.toml"]


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["-o", "out.txt"], "cannot write a file that ends in"),
        (["-o", "out.csv", "--duration", "-1"], "duration must be positive and finite, not -1"),
        (["-o", "seat.csv"], "seat.csv: is already there; --force replaces it"),
        (["-o", "nowhere/out.csv"], "there is no such folder"),
    ],
)
def test_simulate_refuses(folder, inside, arguments, part):
    one_line(inside("simulate", "child-seat", *arguments), 2, part)
    assert names(folder) == ["seat.csv", "seat.toml"]
