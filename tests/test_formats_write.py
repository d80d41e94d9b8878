"""Results in every format that is written, and what they are called."""

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.feather
import pyarrow.parquet as pq
import pytest

from compfilt.logs import encoders, parse_recipe, run_log, run_logs, writers
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.run import Job, plan
from format_files import data, recipe, write

READ = {
    ".parquet": pq.read_table,
    ".feather": pyarrow.feather.read_table,
    ".arrow": lambda path: pa.ipc.open_file(path).read_all(),
}


def test_every_format_holds_the_same_numbers(tmp_path):
    log, names, _ = write(tmp_path, "log.parquet", data())
    text = recipe(names).replace('"flags"]', '"flags"]\nkeep = ["t"]')
    results = {}
    for ending, read in READ.items():
        run_log(parse_recipe(text), log, tmp_path / f"out{ending}", batch_rows=100)
        results[ending] = read(tmp_path / f"out{ending}")
    expected = results.pop(".parquet")
    assert expected.num_rows == 2000
    for table in results.values():
        assert table.schema.equals(expected.schema, check_metadata=True)
        for name in table.column_names:
            assert table.column(name).to_numpy().tobytes() == expected.column(name).to_numpy().tobytes()
    run_log(parse_recipe(text), log, tmp_path / "out.csv")
    text_table = pyarrow.csv.read_csv(tmp_path / "out.csv")
    for name in expected.column_names:
        np.testing.assert_array_equal(text_table.column(name).to_numpy(), expected.column(name).to_numpy())


def test_batches_of_arrow_are_gathered(tmp_path, monkeypatch):
    monkeypatch.setattr(encoders, "ROWS_PER_GROUP", 100)
    batch = pa.RecordBatch.from_pydict({"a": np.arange(30.0), "b": [f"row {i}" for i in range(30)]})
    with writers.create_log(tmp_path / "out.arrow", batch.schema) as writer:
        for _ in range(10):
            writer.write(batch)
    with pa.ipc.open_file(tmp_path / "out.arrow") as reader:
        sizes = [reader.get_batch(i).num_rows for i in range(reader.num_record_batches)]
        assert sizes == [100, 100, 100]
        assert reader.read_all().column("b").to_pylist() == 10 * batch.column("b").to_pylist()


def odd(tmp_path, notes, name="log.arrow"):
    """A log of batches that each hold some notes."""
    path = tmp_path / name
    with pa.OSFile(str(path), "wb") as file:
        writer = None
        for start, note in zip(range(0, 10_000, len(notes[0])), notes, strict=False):
            count = len(note)
            columns = {"t": np.arange(start, start + count) / 100.0, "y": np.ones(count), "u": np.ones(count)}
            batch = pa.RecordBatch.from_pydict({**columns, "note": note})
            writer = writer or pa.ipc.new_stream(file, batch.schema)
            writer.write_batch(batch)
        writer.close()
    return path


KEEPING = """
version = 1
[log]
time = { column = "t", unit = "s" }
measurement = { column = "y", unit = "deg" }
derivative = { column = "u", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[output]
columns = ["estimate"]
keep = ["note"]
"""


def test_what_a_csv_cannot_hold_is_refused(tmp_path):
    log = odd(tmp_path, [[[1.0, 2.0]] * 10])
    with pytest.raises(LogError, match=r'^a CSV file cannot hold what column "note" holds; use \.parquet$'):
        run_log(parse_recipe(KEEPING), log, tmp_path / "out.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["log.arrow"]
    run_log(parse_recipe(KEEPING), log, tmp_path / "out.parquet")


@pytest.mark.parametrize("ending", [".arrow", ".feather", ".parquet", ".csv"])
def test_a_dictionary_may_change_on_the_way(tmp_path, monkeypatch, ending):
    monkeypatch.setattr(encoders, "ROWS_PER_GROUP", 10)
    notes = [["a", "b"] * 5, ["c", None] * 5, ["b", "d"] * 5]
    log = odd(tmp_path, [pa.array(note).dictionary_encode() for note in notes])
    run_log(parse_recipe(KEEPING), log, tmp_path / f"out{ending}")
    if ending != ".csv":
        found = READ.get(ending, READ[".arrow"])(tmp_path / f"out{ending}").column("note").to_pylist()
        assert found == [note for part in notes for note in part]


def test_what_arrow_refuses_to_write_is_one_sentence(tmp_path, monkeypatch):
    def refuse(*_args):
        raise pa.ArrowInvalid("not\nthat")

    monkeypatch.setattr(encoders._Csv, "write", refuse)
    with pytest.raises(LogError, match=r"out\.csv cannot be written: not that$"):
        run_log(parse_recipe(KEEPING), odd(tmp_path, [["a"] * 10]), tmp_path / "out.csv")


@pytest.mark.parametrize("ending", [".arrow", ".parquet"])
def test_the_bytes_do_not_depend_on_the_batches(tmp_path, monkeypatch, ending):
    monkeypatch.setattr(encoders, "ROWS_PER_GROUP", 24)
    log = odd(tmp_path, [[None if i % 7 == 3 else f"row {i}" for i in range(1000)]])
    results = set()
    for rows in (7, 24, 100, 10_000):
        run_log(parse_recipe(KEEPING), log, tmp_path / f"out{ending}", batch_rows=rows)
        results.add((tmp_path / f"out{ending}").read_bytes())
    assert len(results) == 1


NAMES = {
    "a.csv": "a.csv",
    "b.parquet": "b.parquet",
    "c.feather": "c.feather",
    "d.arrow": "d.arrow",
    "e.CSV": "e.CSV",
    "f.ulg": "f.parquet",
    "g.tsv": "g.parquet",
    "h.csv.gz": "h.parquet",
    "i.2024.csv.zst": "i.2024.parquet",
    "j.2024.h5": "j.2024.parquet",
    "k.npz": "k.parquet",
    "l.mcap": "l.parquet",
    "m": "m.parquet",
}


def test_a_result_is_called_like_its_log_if_its_format_is_written(tmp_path):
    logs = [tmp_path / name for name in NAMES]
    out = tmp_path / "results"
    assert plan(logs, str(out)) == [Job(tmp_path / log, out / name) for log, name in NAMES.items()]
    (tmp_path / "drive.v1").mkdir()
    assert plan([tmp_path / "drive.v1"], f"{out}/") == [Job(tmp_path / "drive.v1", out / "drive.v1.parquet")]


def test_logs_whose_results_would_have_the_same_name_are_refused(tmp_path):
    with pytest.raises(UsageError, match=r"would both go to .*a\.parquet"):
        plan([tmp_path / "a.ulg", tmp_path / "a.parquet"], str(tmp_path / "results"))


def test_logs_of_many_formats_in_one_run(tmp_path):
    logs = [write(tmp_path, name, data(200))[0] for name in ("log.csv", "log.arrow", "log.npz")]
    out = tmp_path / "results"
    outcomes = run_logs(parse_recipe(recipe()), plan(logs, str(out)))
    assert [outcome.failed for outcome in outcomes] == [False] * 3
    results = [path.name for path in out.iterdir() if not path.name.endswith(".quality.json")]
    assert sorted(results) == ["log.arrow", "log.csv", "log.parquet"]
