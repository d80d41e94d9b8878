"""Work given to the workers of a Dask cluster, as a log in parts needs it."""

import time
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import Any

from distributed import Client, KilledWorker
from distributed.client import ClosedClientError

from compfilt.logs.errors import LogError, UsageError

__all__ = ["LOST", "DaskFuture", "DaskWorkers", "why_failed"]

LOST = "the scheduler was lost; what is not reported may not be done"

POLL = 0.05
"""Seconds between two looks at what the workers do; what was cancelled is known to them by the first."""


def why_failed(error: BaseException) -> str:
    """Say in one line what became of the workers, or what they did not expect."""
    if isinstance(error, KilledWorker):
        return f"the worker that filtered it died (attempts: {error.allowed_failures + 1})"
    return f"unexpected {type(error).__name__} on a worker: {error}".replace("\n", " ")


class DaskWorkers:
    """Gives a function and its arguments to a worker when called.

    Parameters
    ----------
    client
        Connected to the cluster.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._busy: set[str] | None = None

    def __call__(self, function: Callable[..., Any], *arguments: Any) -> "DaskFuture":  # noqa: ANN401
        """Give it away. Dask would not do the same twice: a part that was filtered for a run that failed is gone."""
        try:
            return DaskFuture(self, self._client.submit(function, *arguments, pure=False))
        except ClosedClientError:
            raise LogError(LOST) from None

    def wait_for(self, key: str) -> None:
        """Wait until no worker is at a task that was cancelled."""
        # Nothing begins any more when all was cancelled: what is not among the busy ones stays so.
        while self._busy is None or key in self._busy:
            self._busy = self._busy or set()
            time.sleep(POLL)
            found: Any = self._client.run(_running, on_error="ignore")
            self._busy = set().union(*found.values())


class DaskFuture:
    """A future of Dask with the errors that one log may have; what was cancelled and is being done can be waited for."""

    def __init__(self, workers: DaskWorkers, future: Any) -> None:  # noqa: ANN401 - Dask's are half typed
        self._workers = workers
        self._future = future
        self._cancelled = False

    def result(self) -> Any:  # noqa: ANN401 - whatever the work returns
        """Wait for it.

        Raises
        ------
        LogError, UsageError
            As the work, or the work could not be done.
        """
        if self._cancelled:
            self._workers.wait_for(self._future.key)
        try:
            return self._future.result()
        except (LogError, UsageError):
            raise
        except CancelledError:
            raise LogError(LOST) from None
        except Exception as error:  # noqa: BLE001 - whatever the work raised
            raise LogError(why_failed(error)) from None

    def cancel(self) -> bool:
        """Let it be; False if it may have begun. Dask does not say, and does not stop what has."""
        if self._future.done():
            return True
        self._cancelled = True
        self._future.cancel()
        return False


def _running(dask_worker: Any) -> set[str]:  # noqa: ANN401 - Dask tells the worker by the argument's name
    """Return the keys of the tasks that a worker is at, cancelled or not."""
    return {str(task.key) for task in dask_worker.state.all_running_tasks}
