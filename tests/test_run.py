"""Files through a recipe: what is read and written, what is refused, and that nothing half done is left."""

import errno
import gc
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

from compfilt.logs import encoders, job, readers, run_log, run_logs, writers
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.quality import report_path
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.run import Job, Summary, plan
from compfilt.logs.watch import Watch

RECIPE = """
version = 1
[log]
time = { column = "t", unit = "s" }
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[output]
columns = ["estimate", "bias", "flags"]
keep = ["t", "note"]
"""


@pytest.fixture
def recipe():
    return parse_recipe(RECIPE, "recipe.toml")


def table(n=3000):
    rng = np.random.default_rng(5)
    t = np.round(0.01 * np.arange(n), 6)
    angle = np.round(rng.normal(0.0, 10.0, n), 3)
    angle[rng.integers(1, n, n // 20)] = np.nan
    rate = np.round(rng.normal(0.0, 10.0, n), 3)
    rate[rng.integers(1, n, n // 50)] = np.nan
    notes = [f"row {i}" for i in range(n)]
    unused = [object().__class__.__name__] * n
    return pa.table({"t": t, "unused": unused, "rate": rate, "note": notes, "angle": angle})


@pytest.fixture
def csv(tmp_path):
    """A log in CSV; missing numbers are empty fields."""
    path = tmp_path / "log.csv"
    data = table()
    lines = [
        ",".join("" if value != value else str(value) for value in row.values()) for row in data.to_pylist()
    ]
    path.write_text(",".join(data.column_names) + "\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def parquet(tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(table(), path, row_group_size=700)
    return path


def edited(csv, old, new):
    text = csv.read_text(encoding="utf-8")
    assert old in text
    csv.write_text(text.replace(old, new, 1), encoding="utf-8")
    return csv


def columns(path):
    data = pq.read_table(path)
    return {name: data.column(name).to_numpy() for name in data.column_names}


def nothing_but(folder, *names):
    assert sorted(entry.name for entry in folder.iterdir()) == sorted(names)


def test_the_size_of_the_batches_does_not_show(recipe, csv, parquet, tmp_path):
    direct = Pipeline(recipe).process(table().combine_chunks().to_batches()[0])
    results = {}
    for name, log, size in [
        ("small", csv, {"batch_bytes": 500}),
        ("large", csv, {"batch_bytes": 1 << 24}),
        ("few", parquet, {"batch_rows": 13}),
        ("many", parquet, {"batch_rows": 100_000}),
    ]:
        out = tmp_path / f"{name}.parquet"
        summary = run_log(recipe, log, out, **size)
        assert summary.rows == 3000
        results[name] = columns(out)
    for result in results.values():
        assert list(result) == ["t", "note", "estimate", "bias", "flags"]
        for name in result:
            expected = direct.column(name).to_numpy(zero_copy_only=False)
            np.testing.assert_array_equal(result[name], expected)


def test_csv_out_holds_the_same_numbers(recipe, parquet, tmp_path):
    run_log(recipe, parquet, tmp_path / "out.csv")
    run_log(recipe, parquet, tmp_path / "out.parquet")
    text = pyarrow.csv.read_csv(tmp_path / "out.csv")
    binary = columns(tmp_path / "out.parquet")
    for name in ("t", "estimate", "bias", "flags", "note"):
        np.testing.assert_array_equal(text.column(name).to_numpy(), binary[name])


def test_what_is_not_a_number_yet_is_an_empty_field(recipe, csv, tmp_path):
    lines = csv.read_text(encoding="utf-8").splitlines()
    first = lines[1].split(",")
    first[-1] = ""  # no measurement yet
    lines[1] = ",".join(first)
    csv.write_text("\n".join(lines), encoding="utf-8")
    run_log(recipe, csv, tmp_path / "out.csv")
    rows = (tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()
    assert rows[1].split(",")[2:4] == ["", ""]
    assert all(float(field) is not None for field in rows[2].split(",")[2:4])


def test_only_the_columns_of_the_recipe_are_read(csv, parquet):
    wanted = readers.Columns(("angle", "rate"), ("t",), ("note",))
    for path in (csv, parquet):
        with readers.open_log(path, wanted) as reader:
            assert reader.schema.names == ["t", "angle", "rate", "note"]
            assert next(reader.batches()).num_columns == 4


def test_the_position_ends_at_the_files_size(csv, parquet):
    for path in (csv, parquet):
        with readers.open_log(path, readers.Columns(("angle",)), batch_bytes=1000, batch_rows=100) as reader:
            positions = [reader.position() for _ in reader.batches()]
        assert positions == sorted(positions)
        assert len(positions) > 20
        assert positions[-1] == path.stat().st_size


def test_kept_columns_of_a_csv_keep_what_they_hold(tmp_path):
    path = tmp_path / "log.csv"
    rows = [f"{i},{i},{2**60 + i},," for i in range(500)] + ["500,0.5,1152921504606847476,late,2"]
    path.write_text("t,whole,large,empty,angle\n" + "\n".join(rows), encoding="utf-8")
    wanted = readers.Columns(("angle",), ("t",), ("whole", "large", "empty"))
    with readers.open_log(path, wanted, batch_bytes=1000) as reader:
        data = pa.Table.from_batches(list(reader.batches()))
    assert data.column("whole")[500].as_py() == 0.5  # it began with whole numbers
    assert data.column("large")[499].as_py() == 2**60 + 499  # float64 would round it
    assert data.column("empty")[500].as_py() == "late"
    assert data.column("angle")[0].as_py() is None
    assert data.column("angle")[500].as_py() == 2.0


FAULTS = [
    ("rate,note", "rates,note", r'there is no column "rate" \(is it "rates"\?\)'),
    ("t,unused,rate,note,angle", "a,b,c,d,e", r'there is no column "t"; there are a, b, c, d, e'),
    ("t,unused,rate", "t,rate,rate", r'there are 2 columns "rate"'),
    ("row 1700,", "row 1700,fast", r'line 1702: column "angle" holds "fast.*", not a number'),
    ("row 1700,", "row 1700,1,2", r"line 1702 has [67] fields, not 5"),
    ("row 1700,", "", r"line 1702 has 4 fields, not 5"),
]


@pytest.mark.parametrize(("old", "new", "message"), FAULTS)
@pytest.mark.parametrize("batch_bytes", [2000, 1 << 20])
def test_faults_of_a_csv_are_named(recipe, csv, tmp_path, old, new, message, batch_bytes):
    edited(csv, old, new)
    with pytest.raises(LogError, match=message) as error:
        run_log(recipe, csv, tmp_path / "out.parquet", batch_bytes=batch_bytes)
    assert "\n" not in str(error.value)
    nothing_but(tmp_path, "log.csv")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("log.csv", b"", "the file is empty"),
        ("log.parquet", b"", "the file is empty"),
        ("log.csv", b"t,angle,rate,note\n", "the file holds no rows"),
        ("log.csv", b"\x89PNG\xff\xfe\x00\n", "this is not a text in UTF-8"),
        ("log.parquet", b"t,angle,rate,note\n1,2,3,x\n", "the file is damaged or of another kind"),
        ("log.xlsx", b"PK", r'the ending "\.xlsx" is not known; logs end in \.csv, .*\.parquet, '),
        ("log", b"t", r'the ending "" is not known'),
    ],
)
def test_files_that_are_no_logs(recipe, tmp_path, name, content, message):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=message) as error:
        run_log(recipe, tmp_path / name, tmp_path / "out.csv")
    assert "\n" not in str(error.value)
    nothing_but(tmp_path, name)


def test_files_that_are_not_there(recipe, tmp_path):
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(LogError, match="cannot be read: No such file or directory"):
        run_log(recipe, tmp_path / "log.csv", tmp_path / "out.csv")
    with pytest.raises(LogError, match="this is a folder, not a file"):
        run_log(recipe, tmp_path / "folder.csv", tmp_path / "out.csv")


def test_files_that_are_not_readable(recipe, csv, tmp_path, monkeypatch):
    # Not by the file's mode, since root may read everything.
    def refuse(*_arguments, **_options):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr("pathlib.Path.open", refuse)
    with pytest.raises(LogError, match="cannot be read: Permission denied"):
        run_log(recipe, csv, tmp_path / "out.csv")


def test_a_parquet_column_that_holds_no_numbers(recipe, tmp_path):
    data = table()
    path = tmp_path / "log.parquet"
    pq.write_table(data.set_column(4, "angle", data.column("note")), path)
    with pytest.raises(LogError, match=r'^column "angle" holds string, not numbers$'):
        run_log(recipe, path, tmp_path / "out.csv")
    pq.write_table(data.slice(0, 0), path)
    with pytest.raises(LogError, match="the file holds no rows"):
        run_log(recipe, path, tmp_path / "out.csv")


def test_a_parquet_column_whose_name_is_no_text(recipe, tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(table(), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"unused", b"un\xff\xfeed"))
    with pytest.raises(LogError, match=r"^the name of a column is not a text in UTF-8$"):
        run_log(recipe, path, tmp_path / "out.csv")


def test_a_truncated_parquet_file(recipe, parquet, tmp_path):
    content = parquet.read_bytes()
    parquet.write_bytes(content[: len(content) // 2])
    with pytest.raises(LogError, match="the file is damaged or of another kind"):
        run_log(recipe, parquet, tmp_path / "out.csv")
    nothing_but(tmp_path, "log.parquet")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("stop", [KeyboardInterrupt, SystemExit, RuntimeError])
def test_a_run_that_is_stopped_leaves_nothing(recipe, csv, tmp_path, ending, stop):
    seen = []

    def advance(_size, _rows):
        # The temporary file is there while the log runs, and its name is not the final one.
        seen.append([entry.name for entry in tmp_path.iterdir() if entry.name != "log.csv"])
        if len(seen) == 3:
            raise stop

    with pytest.raises(stop):
        run_log(recipe, csv, tmp_path / f"out.{ending}", advance=advance, batch_bytes=1000)
    assert seen[0] == [f".out.{ending}.part"]
    nothing_but(tmp_path, "log.csv")


def test_a_failing_run_leaves_the_old_result(recipe, csv, tmp_path):
    out = tmp_path / "out.csv"
    out.write_text("old", encoding="utf-8")
    edited(csv, "row 1700,", "row 1700,x")
    with pytest.raises(LogError):
        run_log(recipe, csv, out)
    assert out.read_text(encoding="utf-8") == "old"
    nothing_but(tmp_path, "log.csv", "out.csv")


def test_a_result_follows_the_umask(recipe, csv, tmp_path):
    before = os.umask(0o027)
    try:
        run_log(recipe, csv, tmp_path / "out.csv")
    finally:
        os.umask(before)
    assert (tmp_path / "out.csv").stat().st_mode & 0o777 == 0o640


def test_results_that_cannot_be_written(recipe, csv, tmp_path):
    with pytest.raises(LogError, match=r"nowhere/out\.csv cannot be written: No such file or directory"):
        run_log(recipe, csv, tmp_path / "nowhere" / "out.csv")
    with pytest.raises(
        UsageError, match=r'cannot write a file that ends in "\.xls"; use \.csv or \.parquet or'
    ):
        run_log(recipe, csv, tmp_path / "out.xls")


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_full_disk(recipe, csv, tmp_path, ending):
    """A limit on the size of files stands for a full disk: the system refuses to write in the same way."""
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
    try:
        with pytest.raises(LogError, match=rf"out{ending} cannot be written: File too large$") as error:
            run_log(recipe, csv, tmp_path / f"out{ending}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert "\n" not in str(error.value)
    nothing_but(tmp_path, "log.csv")
    gc.collect()  # a destructor that complains would be a warning, and so an error


def test_row_groups_have_one_size(tmp_path, monkeypatch):
    monkeypatch.setattr(encoders, "ROWS_PER_GROUP", 100)
    batch = pa.RecordBatch.from_pydict({"a": np.arange(30.0)})
    with writers.create_log(tmp_path / "out.parquet", batch.schema) as writer:
        for _ in range(10):
            writer.write(batch)
    file = pq.ParquetFile(tmp_path / "out.parquet")
    assert [file.metadata.row_group(i).num_rows for i in range(file.num_row_groups)] == [100, 100, 100]


def test_plan_names_results_after_logs(tmp_path):
    logs = [tmp_path / "a.csv", tmp_path / "b.parquet"]
    out = tmp_path / "results"
    assert plan(logs, str(out)) == [Job(logs[0], out / "a.csv"), Job(logs[1], out / "b.parquet")]
    assert not out.exists()  # nothing is made yet
    out.mkdir()
    assert plan(logs[:1], str(out)) == [Job(logs[0], out / "a.csv")]  # the folder exists
    assert plan(logs[:1], str(tmp_path / "new") + "/") == [Job(logs[0], tmp_path / "new" / "a.csv")]
    assert plan(logs[:1], str(tmp_path / "file.csv")) == [Job(logs[0], tmp_path / "file.csv")]
    assert not (tmp_path / "file.csv").exists()


def test_plan_refuses_what_would_overwrite(tmp_path):
    log, out = tmp_path / "a.csv", tmp_path / "out.csv"
    for path in (log, out):
        path.touch()
    with pytest.raises(UsageError, match=r"out\.csv: is already there; --force replaces it"):
        plan([log], str(out))
    assert plan([log], str(out), force=True) == [Job(log, out)]
    for target in (str(log), str(tmp_path), str(tmp_path / "." / "a.csv")):
        with pytest.raises(UsageError, match="the result would replace a log"):
            plan([log], target, force=True)
    (tmp_path / "link.csv").symlink_to(log)
    with pytest.raises(UsageError, match="the result would replace a log"):
        plan([log], str(tmp_path / "link.csv"), force=True)
    with pytest.raises(UsageError, match=r"would both go to"):
        plan([tmp_path / "x" / "a.csv", tmp_path / "y" / "a.csv"], str(tmp_path / "results"))
    assert not (tmp_path / "results").exists()


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="such a link is found when it is opened")
def test_plan_refuses_a_link_to_itself(tmp_path):
    log = tmp_path / "a.csv"
    log.symlink_to(log)
    with pytest.raises(UsageError, match=r"a\.csv: this link leads to itself"):
        plan([log], str(tmp_path / "out.csv"))
    with pytest.raises(UsageError, match=r"a\.csv: this link leads to itself"):
        plan([tmp_path / "b.csv"], str(log))


def test_plan_refuses_what_cannot_be_written(tmp_path):
    log = tmp_path / "a.csv"
    (tmp_path / "plain").touch()
    (tmp_path / "taken" / "a.csv").mkdir(parents=True)
    with pytest.raises(UsageError, match=r'cannot write a file that ends in "\.txt"'):
        plan([log], str(tmp_path / "out.txt"))
    with pytest.raises(UsageError, match="there is no such folder"):
        plan([log], str(tmp_path / "nowhere" / "out.csv"))
    with pytest.raises(UsageError, match="this is a file; the results of several logs go into a folder"):
        plan([log, tmp_path / "b.csv"], str(tmp_path / "plain"))
    with pytest.raises(UsageError, match="this is a folder, not a file"):
        plan([log], str(tmp_path / "taken"), force=True)


def test_a_folder_that_cannot_be_made(recipe, csv, tmp_path):
    (tmp_path / "plain").touch()
    with pytest.raises(UsageError, match=r"plain/sub: the folder cannot be made: Not a directory"):
        run_logs(recipe, plan([csv], str(tmp_path / "plain" / "sub") + "/"))


def test_a_bad_recipe_makes_no_folder(csv, tmp_path):
    recipe = parse_recipe(RECIPE.replace('"bias"', '"velocity"'))
    with pytest.raises(UsageError, match='no "velocity"'):
        run_logs(recipe, plan([csv], str(tmp_path / "results") + "/"))
    nothing_but(tmp_path, "log.csv")


def test_one_bad_log_does_not_stop_the_others(recipe, csv, parquet, tmp_path):
    out = tmp_path / "results"
    missing = tmp_path / "missing.csv"
    outcomes = run_logs(recipe, plan([csv, missing, parquet], str(out)))
    nothing_but(
        out, *(f"log.{ending}{more}" for ending in ("csv", "parquet") for more in ("", ".quality.json"))
    )
    assert [outcome.status for outcome in outcomes] == ["done", "failed", "done"]
    assert outcomes[0].message.startswith("3000 samples, ")
    assert outcomes[0].message.endswith(f" -> {out / 'log.csv'}")
    assert outcomes[1].message == "cannot be read: No such file or directory"


PEAK = """
import sys
from compfilt.logs import parse_recipe, run_log
run_log(parse_recipe(sys.argv[1]), sys.argv[2], sys.argv[3])
(peak,) = (line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(int(peak) // 1024)
"""


def test_an_unforeseen_error_does_not_stop_the_others(recipe, csv, parquet, tmp_path, monkeypatch):
    opened = readers.open_log

    def broken(log, *args, **options):
        if log == csv:
            raise ZeroDivisionError("two\nlines")
        return opened(log, *args, **options)

    monkeypatch.setattr(job, "open_log", broken)
    outcomes = run_logs(recipe, plan([csv, parquet], f"{tmp_path}/results/"))
    assert [outcome.status for outcome in outcomes] == ["failed", "done"]
    assert outcomes[0].message.startswith("unexpected ZeroDivisionError: two lines")
    monkeypatch.setenv("COMPFILT_TRACEBACK", "1")
    with pytest.raises(ZeroDivisionError):
        run_logs(recipe, plan([csv, parquet], f"{tmp_path}/again/"))


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".feather"])
def test_a_log_whose_name_is_no_text(recipe, csv, tmp_path, ending):
    """Such names come from file systems of other systems and times; JSON can tell them."""
    if os.fsencode(os.fsdecode(b"\xff")) != b"\xff":
        pytest.skip("the system's names are text")
    log = csv.rename(tmp_path / os.fsdecode(b"dr\xffve.csv"))
    out = log.with_name(f"out-{log.stem}{ending}")
    assert run_log(recipe, log, out).rows == 3000
    report = json.loads(report_path(out).read_text(encoding="utf-8"))
    assert (report["log"], report["result"]) == (log.name, out.name)


def test_results_that_are_there_stay(recipe, csv, parquet, tmp_path):
    """Unless they are to be replaced, whether the run is to be taken up or not."""
    jobs = plan([csv, parquet], f"{tmp_path}/results/")
    run_logs(recipe, jobs[:1])
    before = jobs[0].out.stat().st_mtime_ns
    assert [outcome.status for outcome in run_logs(recipe, jobs[:1])] == ["failed"]
    outcomes = run_logs(recipe, jobs, resume=True)
    assert [outcome.status for outcome in outcomes] == ["already done", "done"]
    assert jobs[0].out.stat().st_mtime_ns == before
    assert [outcome.status for outcome in run_logs(recipe, jobs, force=True)] == ["done", "done"]
    assert jobs[0].out.stat().st_mtime_ns > before


def test_memory_does_not_grow_with_the_log(tmp_path):
    if not Path("/proc/self/status").exists():
        pytest.skip("only Linux tells the peak of a process's memory")
    peaks = []
    text = RECIPE.replace('"t", "note"', '"t", "x", "y", "z"')
    for rows in (500_000, 3_000_000):
        # One row group, which is the worst there is.
        columns = {
            name: np.random.default_rng(0).normal(size=rows) for name in ("angle", "rate", "x", "y", "z")
        }
        log = tmp_path / f"{rows}.parquet"
        pq.write_table(pa.table({"t": 0.01 * np.arange(rows)} | columns), log, row_group_size=rows)
        arguments = [sys.executable, "-c", PEAK, text, str(log), str(tmp_path / "out.parquet")]
        peaks.append(int(subprocess.run(arguments, check=True, capture_output=True, text=True).stdout))
    assert peaks[1] < peaks[0] + 60  # MB; the logs differ by 120


def test_progress_adds_up_to_the_files_sizes(recipe, csv, parquet, tmp_path):
    read = []
    jobs = plan([csv, parquet], str(tmp_path / "results"))
    watch = Watch()
    watch.advanced = lambda *done: read.append(done)
    run_logs(recipe, jobs, watch=watch)
    assert sum(rows for _, _, rows in read) == 6000
    assert sum(size for _, size, _ in read) == csv.stat().st_size + parquet.stat().st_size


def test_summary_in_words():
    assert str(Summary(10, 0, {"missing": 0})) == "10 samples"
    assert (
        str(Summary(10, 2, {"missing": 3, "not_started": 1}))
        == "10 samples, 2 gaps, 3 missing, 1 not started"
    )
