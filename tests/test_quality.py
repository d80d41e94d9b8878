"""The report on a log's quality: what was put into a log is found in it, and it is the same in every run."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

import compfilt as cf
from compfilt.logs import job, run_log
from compfilt.logs.errors import TruncatedLog
from compfilt.logs.job import run_job
from compfilt.logs.quality import report_path, table
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.run import Job
from compfilt.logs.steps import Steps

RECIPE = """
version = 1
[log]
time = { column = "t", unit = "ms" }
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[policy]
gap = { longer_than = "1 s", do = "reset" }
[policy.measurement]
stuck = { longer_than = "55 ms", do = "coast" }
clipped = { range = "90 deg", do = "keep" }
[output]
columns = ["estimate", "flags"]
"""
ROWS = 2000


@pytest.fixture
def recipe():
    return parse_recipe(RECIPE, "angle.toml")


@pytest.fixture
def log(tmp_path):
    """100 Hz with a jitter of 1 ms, two gaps, and a few bad samples."""
    rng = np.random.default_rng(4)
    t = 10.0 * np.arange(ROWS) + rng.uniform(-1.0, 1.0, ROWS)
    t[500:] += 2000.0
    t[1500:] += 60_000.0
    angle, rate = rng.normal(0.0, 10.0, ROWS), rng.normal(0.0, 10.0, ROWS)
    angle[100:103] = np.nan
    angle[200] = 95.0
    angle[300:310] = 1.5
    rate[700] = -np.inf
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table({"t": t, "angle": angle, "rate": rate}), path, row_group_size=333)
    return path


def report_of(recipe, log, out, **options):
    run_log(recipe, log, out, **options)
    return json.loads(report_path(out).read_text(encoding="utf-8"))


def test_what_was_put_into_the_log_is_in_the_report(recipe, log, tmp_path):
    report = report_of(recipe, log, tmp_path / "out.csv")
    t = pq.read_table(log).column("t").to_numpy() * 1e-3
    assert (report["log"], report["result"]) == ("log.parquet", "out.csv")
    assert (report["complete"], report["truncated"], report["rows"]) == (True, None, ROWS)
    assert report["made_from"]["version"] == cf.__version__
    assert report["made_from"]["recipe"] == recipe.digest
    assert report["made_from"]["log"]["bytes"] == log.stat().st_size
    time = report["time"]
    assert (time["first"], time["last"]) == (t[0], t[-1])
    assert time["rate_hz"] == pytest.approx(100.0, rel=0.02)
    assert time["jitter_seconds"] == pytest.approx(1.7e-3, rel=0.1)
    assert time["gaps"] == 2
    assert [gap["row"] for gap in time["gaps_listed"]] == [501, 1501]
    assert [gap["after"] for gap in time["gaps_listed"]] == [t[499], t[1499]]
    angle = report["signals"]["measurement"]["angle"]
    assert {kind: angle[kind] for kind in ("missing", "infinite", "stuck", "clipped")} == {
        "missing": 3,
        "infinite": 0,
        "stuck": 4,
        "clipped": 1,
    }
    assert angle["largest"] == pytest.approx(np.deg2rad(95.0), rel=1e-15)
    assert report["signals"]["derivative"]["rate"]["infinite"] == 1
    assert report["signals"]["derivative"]["rate"]["smallest"] > -1.0  # the infinite one is left out
    assert report["faults"]["gap"] == 2
    assert report["flags"]["restarted"] == 2
    assert report["flags"]["measurement_missing"] == 7
    assert report["policy"]["signals"]["measurement"]["stuck"] == {"longer_than": 0.055, "do": "coast"}
    assert report["policy"]["signals"]["derivative"]["missing"] == "coast"
    assert report["policy"]["backwards"] == "fail"


def test_the_units_of_the_columns_are_told(log, tmp_path):
    """A CSV has no other place for them; a column without a unit is not among them."""
    text = RECIPE.replace('"flags"]', '"bias", "flags"]\nunit = "mrad"\nkeep = ["t", "rate"]')
    report = report_of(parse_recipe(text), log, tmp_path / "out.csv")
    assert report["units"] == {"t": "ms", "estimate": "mrad", "bias": "mrad/s"}


def test_the_report_has_the_same_bytes_in_every_run(recipe, log, tmp_path):
    texts = set()
    for rows in (2000, 500, 37):
        run_log(recipe, log, tmp_path / "out.csv", batch_rows=rows)
        texts.add(report_path(tmp_path / "out.csv").read_bytes())
    assert len(texts) == 1


def test_the_recipes_hash_is_of_what_it_says_only(recipe):
    assert parse_recipe("# a comment\n" + RECIPE.replace("kp = 2.0", "kp   = 2.0")).digest == recipe.digest
    assert parse_recipe(RECIPE.replace("kp = 2.0", "kp = 2.5")).digest != recipe.digest


def test_a_constant_rate(log, tmp_path):
    text = RECIPE.replace('time = { column = "t", unit = "ms" }', "rate = 100.0")
    text = text.replace('gap = { longer_than = "1 s", do = "reset" }', "")
    report = report_of(parse_recipe(text), log, tmp_path / "out.csv")
    assert report["time"] == {"rate_hz": 100.0, "seconds": 20.0}


def test_a_signal_without_any_number(recipe, log, tmp_path):
    data = pq.read_table(log)
    pq.write_table(data.set_column(2, "rate", pa.array([None] * ROWS, pa.float64())), log)
    report = report_of(recipe, log, tmp_path / "out.csv")
    assert report["signals"]["derivative"]["rate"]["smallest"] is None
    assert report["signals"]["derivative"]["rate"]["missing"] == ROWS


@pytest.mark.parametrize("step", [1.0, 1e-308])
def test_most_times_may_be_equal(tmp_path, step):
    """A clock that is coarser than the sampling, or hardly moves: the median step is zero, and there is no rate to tell."""
    log = tmp_path / "log.csv"
    log.write_text("t,angle,rate\n" + "".join(f"{i // 100 * step},1.0,{i}\n" for i in range(400)))
    report = report_of(parse_recipe(RECIPE), log, tmp_path / "out.csv")
    assert report["time"]["step_seconds"]["median"] == 0.0
    assert report["time"]["rate_hz"] is None
    assert report["faults"]["duplicate"] == 396


def test_a_rate_beyond_all_numbers_is_not_told(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("t,angle,rate\n" + "".join(f"{i}e-315,1.0,{i}\n" for i in range(400)))
    report = report_of(parse_recipe(RECIPE.replace('"ms"', '"s"')), log, tmp_path / "out.csv")
    assert report["time"]["rate_hz"] is None


@given(
    st.lists(st.floats(0.0, 1e6), min_size=1, max_size=60),
    st.lists(st.integers(0, 60), max_size=4),
    st.floats(0.0, 1.0),
)
def test_quantiles_are_those_of_the_sorted_steps(steps, at, part):
    parts, whole = Steps(), Steps()
    whole.add(np.array(steps))
    for piece in np.split(np.array(steps), sorted(min(place, len(steps)) for place in at)):
        parts.state = json.loads(json.dumps(parts.state))
        parts.add(piece)
    assert parts.state == whole.state
    exact = sorted(steps)[max(0, int(np.ceil(part * len(steps))) - 1)]
    assert whole.quantile(part) == pytest.approx(exact, rel=1e-3, abs=1e-307)


class Broken:
    """A reader of a log that is damaged from some row on."""

    def __init__(self, reader, rows):
        self.reader, self.rows = reader, rows
        self.schema, self.size, self.position = reader.schema, reader.size, reader.position

    def batches(self):
        left = self.rows
        for batch in self.reader.batches():
            if left:
                yield batch.slice(0, left)
            left -= min(left, batch.num_rows)
        raise TruncatedLog(self.rows, "a block is damaged")


@pytest.fixture
def broken(monkeypatch):
    """Make logs end at some row."""
    opened = job.open_log

    class Opened:
        def __init__(self, context, rows):
            self.context, self.rows = context, rows

        def __enter__(self):
            return Broken(self.context.__enter__(), self.rows)

        def __exit__(self, *error):
            return self.context.__exit__(*error)

    def break_at(rows):
        monkeypatch.setattr(job, "open_log", lambda *a, **k: Opened(opened(*a, **k), rows))

    return break_at


def test_what_is_readable_of_a_damaged_log_is_kept_and_the_log_fails(recipe, log, tmp_path, broken):
    run_log(recipe, log, tmp_path / "whole.parquet")
    broken(1234)
    work = Job(log, tmp_path / "out.parquet")
    outcome = run_job(recipe, work)
    why = "the log cannot be read from row 1235 on: a block is damaged"
    assert (outcome.status, outcome.failed, outcome.rows) == ("truncated", True, 1234)
    assert outcome.message.startswith(f"{why}; 1234 samples, 1 gap, ")
    whole = pq.read_table(tmp_path / "whole.parquet").slice(0, 1234)
    assert pq.read_table(work.out).equals(whole)
    assert (outcome.report["complete"], outcome.report["truncated"]) == (False, why)
    again = run_job(recipe, work, resume=True)
    assert (again.status, again.rows) == ("truncated", 1234)


def test_a_log_of_which_nothing_is_readable_has_no_result(recipe, log, tmp_path, broken):
    broken(0)
    outcome = run_job(recipe, Job(log, tmp_path / "out.csv"))
    assert outcome.status == "failed"
    assert [entry.name for entry in tmp_path.iterdir()] == ["log.parquet"]


def test_the_table_has_a_line_for_each_log(recipe, log, tmp_path):
    reports = [report_of(recipe, log, tmp_path / name) for name in ("a.csv", "b.csv")]
    lines = table(reports).splitlines()
    assert len(lines) == 3
    assert " ".join(lines[0].split()) == (
        "log rows rate Hz jitter ms gaps missing stuck clipped odd times complete"
    )
    cells = lines[1].split()
    assert cells[:2] == ["log.parquet", "2000"]
    assert cells[4:] == ["2", "4", "4", "1", "0", "yes"]
