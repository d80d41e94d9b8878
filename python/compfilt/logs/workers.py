"""Several logs at a time on one machine, each in a worker process: one that dies fails its own log only."""

import collections
import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, NoReturn

import pyarrow as pa

from compfilt.logs.job import run_job
from compfilt.logs.outcome import Job, Outcome
from compfilt.logs.recipe import Recipe
from compfilt.logs.watch import Watch

__all__ = ["run_in_workers"]

PATIENCE = 10.0
"""Seconds in which a worker that is told to stop cleans up."""


def run_in_workers(
    recipe: Recipe, jobs: Sequence[Job], workers: int, watch: Watch, *, force: bool, resume: bool
) -> list[Outcome]:
    """Do every job in one of several processes; the results are those of one after the other.

    Parameters
    ----------
    recipe, jobs, force, resume
        As for :func:`compfilt.logs.run_logs`.
    workers
        How many processes.
    watch
        Is told what happens.

    Returns
    -------
    list of Outcome
        In the order of the jobs.
    """
    waiting = collections.deque(enumerate(jobs))
    outcomes: dict[int, Outcome] = {}
    # What Arrow does with several threads is shared among the workers.
    threads = max(1, (os.cpu_count() or 1) // workers)
    settings = (recipe, force, resume, threads)
    team = [_Worker(settings) for _ in range(min(workers, len(jobs)))]
    try:
        while len(outcomes) < len(jobs):
            for worker in team:
                if worker.task is None and waiting:
                    worker.give(*waiting.popleft(), watch)
            busy = {worker.pipe: worker for worker in team if worker.task is not None}
            for pipe in wait(list(busy)):
                worker = busy[pipe]  # type: ignore[index]
                ended = worker.hear(watch)
                if ended is not None:
                    outcomes[ended[0]] = ended[1]
                    watch.ended(ended[1])
                if not worker.alive:
                    team.remove(worker)
                    if waiting:
                        team.append(_Worker(settings))
    finally:
        for worker in team:
            worker.dismiss()
        for worker in team:
            worker.wait()
    return [outcomes[number] for number in range(len(jobs))]


class _Worker:
    """A process, and what it is doing: the number of a job, and the job."""

    def __init__(self, settings: tuple[Any, ...]) -> None:
        # Not forked: Arrow's threads do not survive that.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.task: tuple[int, Job] | None = None
        self.alive = True
        self._process = context.Process(target=_work, args=(theirs, *settings), daemon=True)
        with _deaf_to_ctrl_c():
            self._process.start()
        # Only the worker holds its end now: when it dies, this end says so.
        theirs.close()

    def give(self, number: int, job: Job, watch: Watch) -> None:
        """Let the worker do a job."""
        self.task = (number, job)
        watch.began(job)
        with contextlib.suppress(OSError):  # one that is dead will be noticed when it is heard
            self.pipe.send(job)

    def hear(self, watch: Watch) -> tuple[int, Outcome] | None:
        """Take one message; return how the job ended, if it has."""
        assert self.task is not None
        number, job = self.task
        try:
            message = self.pipe.recv()
        except (EOFError, OSError):
            self.alive = False
            self._process.join()
            return number, Outcome(
                job, "failed", f"the worker process died ({_cause(self._process.exitcode)})"
            )
        if isinstance(message, Outcome):
            self.task = None
            return number, message
        watch.advanced(job, *message)
        return None

    def dismiss(self) -> None:
        """Tell the process to end: to stop what it does, or that there is no more to do."""
        if self.task is not None:
            self._process.terminate()
        self.pipe.close()

    def wait(self) -> None:
        """Wait until the process has ended."""
        self._process.join(PATIENCE)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


@contextlib.contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """Let a process that begins be deaf to Ctrl-C from its first moment; here it is heard a moment later."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    # It makes its own process deaf as well, and hears again at its end: so it comes first.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _cause(code: int | None) -> str:
    """Say how a process ended."""
    if code is not None and code < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name
    return f"exit status {code}"


def _work(pipe: "Connection[Any, Any]", recipe: Recipe, force: bool, resume: bool, threads: int) -> None:
    """Do jobs as they come, until there are no more: the worker's process."""
    # Ctrl-C reaches every process of a terminal. The parent hears it, and tells the workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _stop)
    pa.set_cpu_count(threads)

    def advance(size: int, rows: int) -> None:
        pipe.send((size, rows))

    with contextlib.suppress(EOFError, OSError):
        while True:
            job = pipe.recv()
            pipe.send(run_job(recipe, job, force=force, resume=resume, advance=advance))


def _stop(_signal: int, _frame: object) -> NoReturn:
    """Leave by way of every `finally`."""
    sys.exit(128 + signal.SIGTERM)
