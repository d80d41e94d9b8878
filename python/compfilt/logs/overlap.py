"""Reading, filtering and writing at the same time: threads with a bounded number of items between them.

Arrow and the filters let other threads run while they work.
"""

import contextlib
import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Generic, TypeVar

__all__ = ["ahead", "behind"]

Item = TypeVar("Item")

ROOM = 2
"""How many items may wait: enough to even out what takes longer now and then, and little memory."""


class _End:
    """Comes after the last item; with the error, if there was one."""

    def __init__(self, error: BaseException | None = None) -> None:
        self.error = error


@contextlib.contextmanager
def ahead(items: Iterable[Item]) -> Iterator[Iterator[Item]]:
    """Draw items in a thread of its own, a few ahead of their use.

    What drawing raises comes out behind the items before it. When the block ends the thread has ended too.
    """
    waiting: queue.Queue[Item | _End] = queue.Queue(ROOM)
    stop = threading.Event()

    def draw() -> None:
        end = _End()
        try:
            for item in items:
                waiting.put(item)
                if stop.is_set():
                    return
        except BaseException as error:  # noqa: BLE001 - it is raised again where the items are used
            end = _End(error)
        waiting.put(end)

    thread = threading.Thread(target=draw, name="compfilt-reader", daemon=True)
    thread.start()
    try:
        yield _taken(waiting)
    finally:
        stop.set()
        while thread.is_alive():
            with contextlib.suppress(queue.Empty):
                waiting.get(timeout=0.01)
        thread.join()


def _taken(waiting: "queue.Queue[Item | _End]") -> Iterator[Item]:
    while True:
        item = waiting.get()
        if isinstance(item, _End):
            if item.error is not None:
                raise item.error
            return
        yield item


@contextlib.contextmanager
def behind(use: Callable[[Item], object]) -> Iterator[Callable[[Item], None]]:
    """Use items in a thread of its own, which may be a few behind.

    When the block ends well all items have been used; when it ends with an exception those that wait are dropped. What using
    them raises comes out with the next item, or at the end of the block.
    """
    work = _Behind(use)
    try:
        yield work.put
        work.finish()
    finally:
        work.drop()


class _Behind(Generic[Item]):
    """The thread of `behind`. After an error it takes what still comes and drops it, so that nobody waits for it."""

    def __init__(self, use: Callable[[Item], object]) -> None:
        self._use = use
        self._waiting: queue.Queue[Item | _End] = queue.Queue(ROOM)
        self._error: BaseException | None = None
        self._dropping = False
        self._thread = threading.Thread(target=self._work, name="compfilt-writer", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not isinstance(item := self._waiting.get(), _End):
            if self._dropping:
                continue
            try:
                self._use(item)
            except BaseException as error:  # noqa: BLE001 - it is raised again where the items come from
                self._error, self._dropping = error, True

    def put(self, item: Item) -> None:
        self._check()
        self._waiting.put(item)

    def finish(self) -> None:
        self._waiting.put(_End())
        self._thread.join()
        self._check()

    def drop(self) -> None:
        self._dropping = True
        if self._thread.is_alive():
            self._waiting.put(_End())
            self._thread.join()

    def _check(self) -> None:
        if self._error is not None:
            raise self._error
