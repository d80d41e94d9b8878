"""One log: read, filtered and written at the same time, with checkpoints, and a report."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa

from compfilt.logs.draft import Draft, open_draft
from compfilt.logs.encoders import ROWS_PER_GROUP, LogWriter
from compfilt.logs.errors import LogError, RowError, TruncatedLog, UsageError
from compfilt.logs.identity import describe
from compfilt.logs.outcome import Job, Outcome, Summary
from compfilt.logs.overlap import ahead, behind
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.quality import make_report, read_report, report_path, write_report
from compfilt.logs.readers import LogReader, is_text, open_log
from compfilt.logs.recipe import Recipe
from compfilt.logs.writers import check_ending

__all__ = ["Advance", "run_job", "run_log"]

ROWS_PER_CHECKPOINT = 1 << 22
"""After how many rows there is a checkpoint: fixed, since the pieces of a result end there, whenever a run was stopped."""

Advance = Callable[[int, int], object]
"""Called now and then with the bytes that were read and the rows that were filtered since the last call."""


def run_job(
    recipe: Recipe,
    job: Job,
    *,
    force: bool = False,
    resume: bool = False,
    advance: Advance | None = None,
    run: Callable[..., Summary] | None = None,
) -> Outcome:
    """Do one job; what is wrong with the log stands in what is returned.

    All that goes in and out can be pickled: this is what a worker does.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    job
        The log and where its result goes, in a folder that is there.
    force
        Replace a result that is there; otherwise such a job fails.
    resume
        Leave a result that is there if it was made from the same log with the same recipe, and go on with what a run that was
        stopped has left.
    advance
        Takes the progress.
    run
        Filters the log instead of :func:`run_log`, which it is called like.
    """
    try:
        if job.out.exists() and not force:
            return _found(recipe, job, resume=resume)
        summary = (run or run_log)(recipe, job.log, job.out, resume=resume, advance=advance)
    except (LogError, UsageError) as error:
        return Outcome(job, "failed", str(error))
    except Exception as error:  # whatever it is, it is this log's
        if os.environ.get("COMPFILT_TRACEBACK") == "1":
            raise
        text = f"unexpected {type(error).__name__}: {error} (COMPFILT_TRACEBACK=1 shows where)"
        return Outcome(job, "failed", " ".join(text.split()))
    message = f"{summary} -> {job.out}"
    if summary.truncated:
        message = f"{summary.truncated}; {message}"
    status = "truncated" if summary.truncated else "done"
    return Outcome(job, status, message, summary.rows, summary.report)


def _found(recipe: Recipe, job: Job, *, resume: bool) -> Outcome:
    """Say whether a result that is there is the one that is asked for."""
    if not resume:
        return Outcome(job, "failed", f"{job.out}: is already there; --force replaces it")
    report = read_report(job.out)
    with open_log(job.log, recipe.columns):
        same = report is not None and report.get("made_from") == describe(recipe, job.log)
    if report is None or not same:
        why = "is there, but not made by this release from this log with this recipe; --force replaces it"
        return Outcome(job, "failed", f"{job.out}: {why}")
    truncated = report.get("truncated")
    message = f"{report['rows']} samples, already done -> {job.out}"
    if truncated:
        return Outcome(job, "truncated", f"{truncated}; {message}", report["rows"], report)
    return Outcome(job, "already done", message, report["rows"], report)


def run_log(
    recipe: Recipe,
    log: str | Path,
    out: str | Path,
    *,
    resume: bool = False,
    advance: Advance | None = None,
    batch_bytes: int = 1 << 20,
    batch_rows: int = ROWS_PER_GROUP,
) -> Summary:
    """Filter one log into one file, in bounded memory, and write a report on its quality beside it.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    log
        A log of any format that can be read.
    out
        The result, CSV, Parquet or Arrow by its ending. It is replaced if it is there, and only once it is complete. The report
        has its name with ".quality.json" behind it.
    resume
        Go on with what a run that was stopped has left. The result has the bytes of a run that was not.
    advance
        Called now and then with the number of bytes read, and of rows filtered, since the last call.
    batch_bytes, batch_rows
        How much is read at a time; the result does not depend on it. Batches of the size of a result's row groups are
        written without a copy.

    Returns
    -------
    Summary
        What happened. If the log could not be read to its end, ``truncated`` says why, and the result has what could be read.

    Raises
    ------
    LogError
        The log cannot be read or filtered, or the result cannot be written; nothing is left behind but what ``resume`` takes up.
    UsageError
        The recipe asks for what the filter does not have, or the result's ending is not known.

    Examples
    --------
    >>> run_log(load_recipe("seat.toml"), "drive.csv", "drive.roll.csv")  # doctest: +SKIP
    Summary(rows=14000, gaps=0, counts={'missing': 0, 'held': 0})
    """
    log, out = Path(log), Path(out)
    check_ending(out)
    with open_log(log, recipe.columns, batch_bytes=batch_bytes, batch_rows=batch_rows) as reader:
        pipeline = Pipeline(recipe, reader.schema)
        identity = describe(recipe, log)
        # A log that was touched may have changed behind its beginning.
        with open_draft(out, {**identity, "modified": log.stat().st_mtime_ns}, resume=resume) as draft:
            pipeline = _taken_up(pipeline, draft, reader.schema)
            note = f"resumed at row {pipeline.rows + 1}" if draft.state is not None else ""
            if draft.leftover:
                note = (
                    "what an earlier run left was of no use"
                    if resume
                    else "what an earlier run left was dropped"
                )
            progress = _Progress(reader, advance, pipeline.rows)
            truncated = _filter(reader, pipeline, draft, progress, text=is_text(log))
            report = make_report(log, out, identity, pipeline, truncated)
            # Never a report beside a result that it is not of: a result without one is not taken for complete.
            report_path(out).unlink(missing_ok=True)
        write_report(report, out)
    counts = pipeline.counts
    return Summary(pipeline.rows, pipeline.gaps, counts, report["faults"], truncated, note, report)


def _taken_up(pipeline: Pipeline, draft: Draft, schema: pa.Schema) -> Pipeline:
    """Bring the pipeline to where the draft ends."""
    if draft.state is None:
        return pipeline
    try:
        pipeline.state = draft.state
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError):
        # Somebody wrote into the checkpoint.
        draft.forget()
        return Pipeline(pipeline.recipe, schema)
    return pipeline


class _Progress:
    """Tell how far a log has been read and filtered, a few times a second."""

    def __init__(self, reader: LogReader, advance: Advance | None, rows: int) -> None:
        self._reader = reader
        self._advance = advance
        self._bytes, self._rows = 0, rows

    def __call__(self, rows: int) -> None:
        if self._advance is not None:
            position = self._reader.position()
            self._advance(position - self._bytes, rows - self._rows)
            self._bytes, self._rows = position, rows


def _filter(reader: LogReader, pipeline: Pipeline, draft: Draft, progress: _Progress, *, text: bool) -> str:
    """Filter what the pipeline has not seen yet; return why the log could not be read to its end, if so."""
    truncated = ""
    with (
        draft.writer(pipeline.schema(reader.schema)) as writer,
        ahead(_from_row(reader, pipeline.rows)) as batches,
        behind(_Sink(draft, writer)) as write,
    ):
        try:
            for batch in batches:
                for piece in _cut(batch, pipeline.rows):
                    write(pipeline.process(piece))
                    if draft.resumable and pipeline.rows % ROWS_PER_CHECKPOINT == 0:
                        write(pipeline.state)
                progress(pipeline.rows)
        except TruncatedLog as error:
            if not pipeline.rows:
                raise
            truncated = str(error)
        except RowError as error:
            raise (error.in_text() if text else error) from None
    return truncated


def _from_row(reader: LogReader, start: int) -> Iterator[pa.RecordBatch]:
    """Read the log from a row on, counted from 0."""
    row = 0
    for batch in reader.batches():
        row += batch.num_rows
        if row > start:
            yield batch.slice(max(0, batch.num_rows - (row - start)))


def _cut(batch: pa.RecordBatch, row: int) -> Iterator[pa.RecordBatch]:
    """Cut a batch that begins at a row where a checkpoint is due."""
    start = 0
    while start < batch.num_rows:
        length = min(batch.num_rows - start, ROWS_PER_CHECKPOINT - (row + start) % ROWS_PER_CHECKPOINT)
        yield batch.slice(start, length)
        start += length


class _Sink:
    """Write rows, and make a checkpoint of each state."""

    def __init__(self, draft: Draft, writer: LogWriter) -> None:
        self._draft = draft
        self._writer = writer

    def __call__(self, item: pa.RecordBatch | dict[str, Any]) -> None:
        if isinstance(item, dict):
            self._draft.mark(self._writer, item)
        else:
            self._writer.write(item)
