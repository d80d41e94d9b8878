"""Logs on a Dask cluster: a log is a task, or one long log in parts. Needs the extra ``cluster``."""

import contextlib
import itertools
import logging
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any
from urllib.parse import urlsplit

from distributed import Client, LocalCluster, as_completed

import compfilt
from compfilt.logs.dask_workers import LOST, DaskWorkers, why_failed
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.job import run_job
from compfilt.logs.outcome import Job, Outcome
from compfilt.logs.parts import PART_ROWS, run_in_parts, why_in_order
from compfilt.logs.quality import report_path
from compfilt.logs.recipe import Recipe
from compfilt.logs.run import prepare
from compfilt.logs.watch import Watch

__all__ = ["LOCAL", "connect", "run_logs_on", "run_long_log_on", "run_scheduled"]

LOCAL = "local"
"""The scheduler's address that stands for worker processes on this machine."""

IN_FLIGHT = 1000
"""How many logs the scheduler knows of at a time: enough for every worker to have the next one at hand."""

CONNECT_TIMEOUT = 10.0
"""Seconds to wait for a scheduler."""

_BEGUN = re.compile(r"\.(.+)\.[0-9a-f]{8}\.part")
"""The name of a file that appears when it is complete, until then."""


def run_scheduled(
    scheduler: str,
    recipe: Recipe,
    jobs: Sequence[Job],
    *,
    workers: int | None = None,
    force: bool = False,
    resume: bool = False,
    as_folder: bool = False,
    watch: Watch | None = None,
) -> list[Outcome]:
    """Filter logs on the cluster of a scheduler: several by :func:`run_logs_on`, a single one in parts if that can be.

    Parameters, result and errors are those of :func:`connect`, :func:`run_logs_on` and :func:`run_long_log_on`.
    """
    prepare(recipe, jobs, as_folder=as_folder)
    with connect(scheduler, workers=workers) as client:
        if len(jobs) == 1 and why_in_order(recipe, jobs[0].log) is None:
            options: dict[str, Any] = {"force": force, "resume": resume, "as_folder": as_folder}
            return [run_long_log_on(client, recipe, jobs[0], **options, watch=watch)]
        return run_logs_on(client, recipe, jobs, force=force, resume=resume, watch=watch)


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
        address: Any = scheduler
        if scheduler == LOCAL:
            address = stack.enter_context(
                LocalCluster(  # type: ignore[no-untyped-call]
                    n_workers=workers or os.cpu_count() or 1,
                    threads_per_worker=1,
                    dashboard_address=":0",
                    silence_logs=logging.CRITICAL,
                )
            )
        else:
            _check_address(scheduler)
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
    force: bool = False,
    resume: bool = False,
    watch: Watch | None = None,
) -> list[Outcome]:
    """Filter logs, each by one worker; one that fails does not stop the others.

    The results are those of :func:`compfilt.logs.run_logs`, byte for byte. If a worker dies, others filter the logs that it
    had. A log on which workers die again and again fails, and what they had at hand beside it may fail with it: `resume` does
    that again. Logs and results must have the same absolute paths for all workers.

    Parameters
    ----------
    client
        Connected to the cluster: see :func:`connect`.
    recipe
        What to read, filter and write.
    jobs
        The logs and where their results go, in folders that are there.
    force
        Replace results that are there; otherwise such logs fail.
    resume
        Leave results that an earlier run completed, unless `force` replaces them. What it left undone is taken up in any case, as is what was left by a
        worker that died.
    watch
        Is told how each log ended, in the order in which they are done.

    Returns
    -------
    list of Outcome
        How each job ended, in the order of the jobs.

    Raises
    ------
    LogError
        The scheduler was lost.
    """
    watch = watch or Watch()
    # A result that a worker finds is of this run, or may stay: those that may not are refused here.
    refused = [] if force or resume else [job for job in jobs if job.out.exists()]
    fresh = [job for job in jobs if job not in refused] if refused else jobs
    outcomes: dict[Job, Outcome] = {}
    for outcome in itertools.chain(
        (run_job(recipe, job) for job in refused), _done(client, recipe, fresh, force=force)
    ):
        job = outcome.job
        watch.began(job)
        watch.advanced(job, job.log.stat().st_size if job.log.is_file() else 0, outcome.rows)
        watch.ended(outcome)
        outcomes[job] = outcome
    _clean(fresh)
    return [outcomes[job] for job in jobs]


def run_long_log_on(
    client: Client,
    recipe: Recipe,
    job: Job,
    *,
    force: bool = False,
    resume: bool = False,
    watch: Watch | None = None,
    part_rows: int = PART_ROWS,
    as_folder: bool = False,
) -> Outcome:
    """Filter one long log in parts on a cluster: :func:`compfilt.logs.run_in_parts` with its workers."""
    watch = watch or Watch()
    watch.began(job)
    run = partial(run_in_parts, submit=DaskWorkers(client), part_rows=part_rows, as_folder=as_folder)
    outcome = run_job(
        recipe, _absolute(job), force=force, resume=resume, advance=partial(watch.advanced, job), run=run
    )
    outcome = replace(outcome, job=job)
    watch.ended(outcome)
    return outcome


def _absolute(job: Job) -> Job:
    """Name the files so that a worker finds them, wherever it runs."""
    return Job(job.log.resolve(), job.out.resolve())


def _done(client: Client, recipe: Recipe, jobs: Sequence[Job], *, force: bool) -> Iterator[Outcome]:
    """Yield how every job ended when it has; the scheduler never has more than some of them at once."""
    waiting = iter(jobs)
    running: dict[Any, Job] = {}

    def start(job: Job) -> Any:  # noqa: ANN401 - a future
        # Dask repeats a task whose worker died, also one that was done; then the result is there, or its beginning. It may lack
        # its report: what was not there before is of this run, and may be replaced.
        mine = force or not job.out.exists()
        future = client.submit(run_job, recipe, _absolute(job), force=mine, resume=True, pure=False)
        running[future.key] = job
        return future

    first = [start(job) for job in itertools.islice(waiting, IN_FLIGHT)]
    completed: Any = as_completed(first, loop=client.loop)  # type: ignore[no-untyped-call]
    for future in completed:
        yield _outcome(running.pop(future.key), future)
        completed.update([start(job) for job in itertools.islice(waiting, 1)])


def _outcome(job: Job, future: Any) -> Outcome:  # noqa: ANN401
    """Take what a worker says, or say what became of the workers."""
    if future.cancelled():
        raise LogError(LOST)
    error = future.exception()
    if error is not None:
        return Outcome(job, "failed", why_failed(error))
    outcome: Outcome = future.result()
    return replace(outcome, job=job)


def _clean(jobs: Sequence[Job]) -> None:
    """Remove the reports that workers which died had begun; a result that was begun has been completed by another."""
    paths = {report_path(job.out) for job in jobs}
    for folder in {path.parent for path in paths}:
        for path in folder.iterdir():
            match = _BEGUN.fullmatch(path.name)
            if match and folder / match[1] in paths:
                path.unlink(missing_ok=True)


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


def _version() -> str:
    return compfilt.__version__
