"""Logs through a recipe: where the results go, and one log after the other or several at a time."""

import functools
import os
from collections.abc import Sequence
from pathlib import Path

from compfilt.logs.errors import UsageError
from compfilt.logs.job import run_job, run_log
from compfilt.logs.outcome import Job, Outcome, Summary
from compfilt.logs.parts import run_in_parts
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers import check_library
from compfilt.logs.recipe import Recipe
from compfilt.logs.watch import Watch
from compfilt.logs.workers import run_in_workers
from compfilt.logs.writers import check_ending, check_target, result_name

__all__ = ["Job", "Outcome", "Summary", "plan", "prepare", "run_job", "run_log", "run_logs"]


def plan(
    logs: Sequence[Path], out: str, *, force: bool = False, resume: bool = False, as_folder: bool = False
) -> list[Job]:
    """Decide where each result goes, and refuse what would overwrite something, before any work.

    Parameters
    ----------
    logs
        The logs.
    out
        A file if there is one log; a folder, existing or ending in "/", or whenever there are several logs. In a
        folder a result has the name of its log; that of a log in a format that is not written ends in ".parquet".
    force
        Replace results that are already there.
    resume
        Results may be there already: whether they are the right ones is looked at later.
    as_folder
        The result of a single log is a folder of parts: one that is there and ends in ".parquet" is such a result.

    Raises
    ------
    UsageError
        Two logs have the same name, a result is there already or is one of the logs, its ending is unknown, or
        there is no folder for it; or a library that reads one of the logs is not installed.
    """
    parts = as_folder and len(logs) == 1 and out.lower().endswith(".parquet")
    folder = len(logs) > 1 or out.endswith(("/", os.sep)) or (Path(out).is_dir() and not parts)
    jobs = [Job(log, Path(out) / result_name(log) if folder else Path(out)) for log in logs]
    taken: dict[Path, Path] = {}
    for log in logs:
        check_library(log)
    inputs = {_resolved(log) for log in logs}
    for log, target in jobs:
        if _resolved(target) in inputs:
            raise UsageError(f"{target}: the result would replace a log; choose another place with -o")
        if target in taken:
            raise UsageError(f"{taken[target]} and {log} would both go to {target}")
        taken[target] = log
        check_target(target, force=force or resume, folder=parts)
        if not folder:
            check_ending(target)
    if folder and Path(out).exists() and not Path(out).is_dir():
        raise UsageError(f"{out}: this is a file; the results of several logs go into a folder")
    if not folder and not Path(out).parent.is_dir():
        raise UsageError(f"{Path(out).parent}: there is no such folder")
    return jobs


def _resolved(path: Path) -> Path:
    """Follow links to the file itself."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):  # a RuntimeError until Python 3.12
        raise UsageError(f"{path}: this link leads to itself, or nowhere") from None


def run_logs(
    recipe: Recipe,
    jobs: Sequence[Job],
    *,
    workers: int = 1,
    force: bool = False,
    resume: bool = False,
    as_folder: bool = False,
    watch: Watch | None = None,
) -> list[Outcome]:
    """Filter several logs; one that fails does not stop the others.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    jobs
        The logs and where their results go.
    workers
        How many logs to filter at a time, each in a process of its own. The results do not depend on it. More than one
        need ``if __name__ == "__main__":`` in the script that asks for them, as all of Python's processes do. A single log
        goes in parts to so many threads, as :func:`compfilt.logs.run_in_parts` does it.
    force
        Replace results that are there; otherwise such logs fail.
    resume
        Leave results that an earlier run completed, unless `force` replaces them, and go on with what it left.
    as_folder
        Leave the parts of a single log in a folder.
    watch
        Is told what happens.

    Returns
    -------
    list of Outcome
        How each job ended, in the order of the jobs.

    Raises
    ------
    UsageError
        The filter cannot be built or does not have an output that the recipe asks for, a folder cannot be made, or the
        parts of several logs are asked for; no log was opened.
    """
    prepare(recipe, jobs, as_folder=as_folder)
    watch = watch or Watch()
    if min(workers, len(jobs)) > 1:
        return run_in_workers(recipe, jobs, workers, watch, force=force, resume=resume)
    in_parts = functools.partial(run_in_parts, workers=workers, as_folder=as_folder)
    run = in_parts if workers > 1 or as_folder else run_log
    outcomes = []
    for job in jobs:
        watch.began(job)
        advance = functools.partial(watch.advanced, job)
        outcomes.append(run_job(recipe, job, force=force, resume=resume, advance=advance, run=run))
        watch.ended(outcomes[-1])
    return outcomes


def prepare(recipe: Recipe, jobs: Sequence[Job], *, as_folder: bool = False) -> None:
    """Make the folders of the results, once it is clear that the filter can be built.

    Raises
    ------
    UsageError
        As :func:`run_logs`.
    """
    if as_folder and len(jobs) > 1:
        raise UsageError("--parts (as_folder) is for a single log")
    Pipeline(recipe)  # what is wrong with the recipe is said once
    for folder in dict.fromkeys(job.out.parent for job in jobs):
        _make(folder)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: the folder cannot be made: {error.strerror}") from None
