"""Logs through a recipe: what is read, where the result goes, and what is said when something fails."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers import Columns, open_log
from compfilt.logs.recipe import Recipe
from compfilt.logs.writers import check_ending, check_target, create_log

__all__ = ["Job", "Summary", "plan", "prepare", "run_log", "run_logs"]


class Job(NamedTuple):
    """One log and where its result goes."""

    log: Path
    out: Path


@dataclass(frozen=True)
class Summary:
    """What happened to one log.

    Attributes
    ----------
    rows
        How many samples there were.
    gaps
        How many gaps there were in time.
    counts
        How many samples each of the filter's flags was set on.

    Examples
    --------
    >>> str(Summary(1000, 1, {"missing": 3, "held": 0}))
    '1000 samples, 1 gap, 3 missing'
    """

    rows: int
    gaps: int
    counts: dict[str, int]

    def __str__(self) -> str:
        parts = [f"{self.rows} samples"]
        if self.gaps:
            parts.append(f"{self.gaps} gap{'s' if self.gaps > 1 else ''}")
        parts += [f"{count} {name.replace('_', ' ')}" for name, count in self.counts.items() if count]
        return ", ".join(parts)


def run_log(
    recipe: Recipe,
    log: str | Path,
    out: str | Path,
    *,
    advance: Callable[[int], object] | None = None,
    batch_bytes: int = 1 << 20,
    batch_rows: int = 1 << 16,
) -> Summary:
    """Filter one log into one file, in bounded memory.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    log
        A CSV or Parquet file.
    out
        The result, CSV or Parquet by its ending. It is replaced if it is there, and only once it is complete.
    advance
        Called now and then with the number of bytes read since the last call.
    batch_bytes, batch_rows
        How much is read at a time; the result does not depend on it.

    Raises
    ------
    LogError
        The log cannot be read or filtered, or the result cannot be written; nothing is left behind.
    UsageError
        The recipe asks for what the filter does not have, or the result's ending is not known.

    Examples
    --------
    >>> run_log(load_recipe("seat.toml"), "drive.csv", "drive.roll.csv")  # doctest: +SKIP
    Summary(rows=14000, gaps=0, counts={'missing': 0, 'held': 0})
    """
    out = Path(out)
    check_ending(out)
    time = () if recipe.clock.column is None else (recipe.clock.column,)
    columns = Columns(recipe.signal_columns, time, recipe.output.keep)
    with open_log(log, columns, batch_bytes=batch_bytes, batch_rows=batch_rows) as reader:
        pipeline = Pipeline(recipe, reader.schema)
        with create_log(out, pipeline.schema(reader.schema)) as writer:
            read = 0
            for batch in reader.batches():
                writer.write(pipeline.process(batch))
                if advance is not None:
                    advance(reader.position() - read)
                    read = reader.position()
    return Summary(pipeline.rows, pipeline.gaps, pipeline.counts)


def plan(logs: Sequence[Path], out: str, *, force: bool = False) -> list[Job]:
    """Decide where each result goes, and refuse what would overwrite something, before any work.

    Parameters
    ----------
    logs
        The logs.
    out
        A file if there is one log; a folder, existing or ending in "/", or whenever there are several logs. In a
        folder a result has the name of its log.
    force
        Replace results that are already there.

    Raises
    ------
    UsageError
        Two logs have the same name, a result is there already or is one of the logs, its ending is unknown, or
        there is no folder for it.
    """
    folder = len(logs) > 1 or out.endswith(("/", os.sep)) or Path(out).is_dir()
    jobs = [Job(log, Path(out) / log.name if folder else Path(out)) for log in logs]
    taken: dict[Path, Path] = {}
    inputs = {log.resolve() for log in logs}
    for log, target in jobs:
        if target.resolve() in inputs:
            raise UsageError(f"{target}: the result would replace a log; choose another place with -o")
        if target in taken:
            raise UsageError(f"{taken[target]} and {log} would both go to {target}")
        taken[target] = log
        check_target(target, force=force)
        if not folder:
            check_ending(target)
    if folder and Path(out).exists() and not Path(out).is_dir():
        raise UsageError(f"{out}: this is a file; the results of several logs go into a folder")
    if not folder and not Path(out).parent.is_dir():
        raise UsageError(f"{Path(out).parent}: there is no such folder")
    return jobs


def run_logs(
    recipe: Recipe,
    jobs: Sequence[Job],
    *,
    advance: Callable[[int], object] | None = None,
    report: Callable[[str], object] = print,
) -> int:
    """Filter several logs, one after the other; one that fails does not stop the others.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    jobs
        The logs and where their results go.
    advance
        Called now and then with the number of bytes read since the last call.
    report
        Takes one line for each log.

    Returns
    -------
    int
        How many logs failed.

    Raises
    ------
    UsageError
        The filter cannot be built or does not have an output that the recipe asks for, or a folder cannot be made;
        no log was opened.
    """
    prepare(recipe, jobs)
    return sum(not _run_job(recipe, job, advance, report) for job in jobs)


def prepare(recipe: Recipe, jobs: Sequence[Job]) -> None:
    """Make the folders of the results, once it is clear that the filter can be built.

    Raises
    ------
    UsageError
        As :func:`run_logs`.
    """
    Pipeline(recipe)  # what is wrong with the recipe is said once
    for folder in dict.fromkeys(job.out.parent for job in jobs):
        _make(folder)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: the folder cannot be made: {error.strerror}") from None


def _run_job(
    recipe: Recipe, job: Job, advance: Callable[[int], object] | None, report: Callable[[str], object]
) -> bool:
    """Filter one log and report on it; return whether it went well."""
    try:
        summary = run_log(recipe, job.log, job.out, advance=advance)
    except (LogError, UsageError) as error:
        report(f"{job.log}: {error}")
        return False
    report(f"{job.log}: {summary} -> {job.out}")
    return True
