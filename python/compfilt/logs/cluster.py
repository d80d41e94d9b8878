"""Logs on a Dask cluster: a log is a task, or one long log in parts. Needs the extra ``cluster``."""

import contextlib
import itertools
import logging
import os
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

from distributed import Client, KilledWorker, LocalCluster, as_completed

import compfilt
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.parts import PART_ROWS, run_in_parts, why_in_order
from compfilt.logs.recipe import Recipe
from compfilt.logs.run import Job, Summary, prepare, run_log

__all__ = ["LOCAL", "connect", "run_logs_on", "run_long_log_on"]

LOCAL = "local"
"""The scheduler's address that stands for worker processes on this machine."""

IN_FLIGHT = 1000
"""How many logs the scheduler knows of at a time: enough for every worker to have the next one at hand."""

CONNECT_TIMEOUT = 10.0
"""Seconds to wait for a scheduler."""


class _Outcome(NamedTuple):
    """What became of a log: a summary, or why it failed."""

    summary: Summary | None
    failure: str = ""


@contextlib.contextmanager
def connect(scheduler: str, *, workers: int | None = None) -> Iterator[Client]:
    """Connect to a cluster whose workers have this version of compfilt.

    Parameters
    ----------
    scheduler
        Its address, such as ``"tcp://10.0.0.1:8786"``; or ``"local"`` for processes on this machine, which end with the
        block.
    workers
        How many processes ``"local"`` starts; as many as there are cores without it.

    Raises
    ------
    UsageError
        There is no scheduler at the address, it has no workers, or they have not this version.

    Examples
    --------
    >>> with connect("local", workers=2) as client:  # doctest: +SKIP
    ...     failed = run_logs_on(client, recipe, jobs)
    """
    with contextlib.ExitStack() as stack:
        if scheduler != LOCAL:
            _check_address(scheduler)
            address: Any = scheduler
        else:
            address = stack.enter_context(
                LocalCluster(  # type: ignore[no-untyped-call]
                    n_workers=workers or os.cpu_count() or 1,
                    threads_per_worker=1,
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                )
            )
        try:
            client = stack.enter_context(
                Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)  # type: ignore[no-untyped-call]
            )
        except OSError as error:
            # The first line says what, the others where it was tried.
            reason = str(error).partition("\n")[0]
            raise UsageError(f"--scheduler {scheduler}: cannot be reached: {reason}") from None
        _check_workers(client, scheduler)
        yield client


def run_logs_on(
    client: Client,
    recipe: Recipe,
    jobs: Sequence[Job],
    *,
    advance: Callable[[int], object] | None = None,
    report: Callable[[str], object] = print,
) -> int:
    """Filter logs, each by one worker; one that fails does not stop the others.

    The results are those of :func:`compfilt.logs.run_logs`, byte for byte. If a worker dies, its logs are filtered by
    others; a result appears only when it is complete, and is not read before. Logs and results must have the same
    absolute paths for all workers.

    Parameters
    ----------
    client
        Connected to the cluster: see :func:`connect`.
    recipe
        What to read, filter and write.
    jobs
        The logs and where their results go.
    advance
        Called after each log with its size in bytes.
    report
        Takes one line for each log, in the order in which they are done.

    Returns
    -------
    int
        How many logs failed.

    Raises
    ------
    UsageError
        The filter cannot be built or does not have an output that the recipe asks for, or a folder cannot be made.
    LogError
        The scheduler was lost.
    """
    prepare(recipe, jobs)
    failed = 0
    try:
        for job, outcome in _done(client, recipe, jobs):
            failed += outcome.summary is None
            report(
                f"{job.log}: {outcome.failure}"
                if outcome.summary is None
                else f"{job.log}: {outcome.summary} -> {job.out}"
            )
            if advance is not None:
                advance(job.log.stat().st_size if job.log.is_file() else 0)
    finally:
        _clean(jobs)
    return failed


def run_scheduled(
    scheduler: str,
    recipe: Recipe,
    jobs: Sequence[Job],
    *,
    workers: int | None = None,
    advance: Callable[[int], object] | None = None,
    report: Callable[[str], object] = print,
) -> int:
    """Filter logs on the cluster of a scheduler: several by :func:`run_logs_on`, a single one in parts if that can be.

    The parameters, the result and the errors are those of :func:`connect` and :func:`run_logs_on`.
    """
    prepare(recipe, jobs)
    with connect(scheduler, workers=workers) as client:
        if len(jobs) == 1:
            ((log, out),) = jobs
            why = why_in_order(recipe, log)
            if why is None:
                try:
                    summary = run_long_log_on(client, recipe, log, out, advance=advance)
                except (LogError, UsageError) as error:
                    report(f"{log}: {error}")
                    return 1
                report(f"{log}: {summary} -> {out}")
                return 0
            report(f"{log}: goes to one worker: {why}")
        return run_logs_on(client, recipe, jobs, advance=advance, report=report)


def run_long_log_on(
    client: Client,
    recipe: Recipe,
    log: str | Path,
    out: str | Path,
    *,
    part_rows: int = PART_ROWS,
    advance: Callable[[int], object] | None = None,
) -> Summary:
    """Filter one long log in parts on a cluster: :func:`compfilt.logs.parts.run_in_parts` with its workers."""
    submit = partial(client.submit, pure=False)
    return run_in_parts(
        recipe, Path(log).resolve(), Path(out).resolve(), submit=submit, part_rows=part_rows, advance=advance
    )


def _done(client: Client, recipe: Recipe, jobs: Sequence[Job]) -> Iterator[tuple[Job, _Outcome]]:
    """Yield every job when it is done; the scheduler never has more than some of them at once."""
    waiting = iter(jobs)
    running: dict[Any, Job] = {}

    def start(job: Job) -> Any:  # noqa: ANN401 - a future
        future = client.submit(_filter_log, recipe, Job(job.log.resolve(), job.out.resolve()), pure=False)
        running[future.key] = job
        return future

    first = [start(job) for job in itertools.islice(waiting, IN_FLIGHT)]
    completed: Any = as_completed(first, loop=client.loop)  # type: ignore[no-untyped-call]
    for future in completed:
        yield running.pop(future.key), _outcome(future)
        completed.update([start(job) for job in itertools.islice(waiting, 1)])


def _filter_log(recipe: Recipe, job: Job) -> _Outcome:
    """Filter one log, on a worker."""
    try:
        return _Outcome(run_log(recipe, job.log, job.out))
    except (LogError, UsageError) as error:
        return _Outcome(None, str(error))


def _outcome(future: Any) -> _Outcome:  # noqa: ANN401
    """Take what a worker says, or say what became of the workers."""
    if future.cancelled():
        raise LogError("the scheduler was lost; what is not reported may not be done")
    error = future.exception()
    if isinstance(error, KilledWorker):
        return _Outcome(None, f"every worker that filtered it died, {error.allowed_failures + 1} of them")
    if error is not None:
        return _Outcome(None, f"unexpected {type(error).__name__} on a worker: {error}".replace("\n", " "))
    outcome: _Outcome = future.result()
    return outcome


def _check_address(scheduler: str) -> None:
    """Raise UsageError unless this is an address; a client that cannot be made leaves a traceback behind."""
    try:
        parts = urlsplit(scheduler if "://" in scheduler else f"tcp://{scheduler}")
        complete = parts.hostname and parts.port
    except ValueError:
        complete = None
    if not complete:
        raise UsageError(
            f'--scheduler {scheduler}: is neither "{LOCAL}" nor an address such as tcp://10.0.0.1:8786'
        )


def _version() -> str:
    return compfilt.__version__


def _check_workers(client: Client, scheduler: str) -> None:
    """Raise UsageError unless there are workers, and all have this version."""
    try:
        versions = set(client.run(_version).values())
    except ModuleNotFoundError as error:
        raise UsageError(f"--scheduler {scheduler}: a worker has no {error.name}") from None
    if not versions:
        raise UsageError(f"--scheduler {scheduler}: has no workers")
    if versions != {_version()}:
        found = ", ".join(sorted(versions))
        raise UsageError(f"--scheduler {scheduler}: its workers have compfilt {found}, not {_version()}")


_TEMPORARY = re.compile(r"\.(.+)\.[0-9a-f]{8}\.part")
"""The name under which a result grows: a worker that is killed leaves it behind."""


def _clean(jobs: Sequence[Job]) -> None:
    """Remove what workers that were killed have left behind."""
    names: dict[Path, set[str]] = {}
    for job in jobs:
        names.setdefault(job.out.parent, set()).add(job.out.name)
    for folder, wanted in names.items():
        for path in folder.iterdir():
            match = _TEMPORARY.fullmatch(path.name)
            if match and match[1] in wanted:
                path.unlink(missing_ok=True)
