"""A result that grows under a hidden name, with checkpoints from which another process can go on.

While ``out.csv`` is made there are ``.out.csv.part``, its first rows, and, once there was a checkpoint, ``.out.csv.part.json``: how
many of its bytes are sure, and the filter's state behind them. The state is JSON, numbers and names only: to load what somebody
else left in a folder must not run it, as a pickle would.
"""

import contextlib
import json
import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import pyarrow as pa

from compfilt.logs.encoders import FORMATS, RESUMABLE, LogWriter
from compfilt.logs.errors import LogError
from compfilt.logs.writers import abandoned_on_failure

try:
    import fcntl
except ModuleNotFoundError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

__all__ = ["Draft", "open_draft"]

State = dict[str, Any]


class Draft:
    """A result that is being made.

    Parameters
    ----------
    out
        Its name when it is complete.
    identity
        What it is made from: a draft is continued only if it was made from the same.

    Attributes
    ----------
    state : dict or None
        Where to go on; ``None`` is the beginning.
    leftover : bool
        Whether there was a draft already that is not continued.
    """

    def __init__(self, out: Path, identity: Mapping[str, Any]) -> None:
        self.out = out
        self.state: State | None = None
        self.leftover = False
        self._identity = dict(identity)
        self._part = out.with_name(f".{out.name}.part")
        self._checkpoint = out.with_name(f".{out.name}.part.json")
        self._next_checkpoint = out.with_name(f".{out.name}.part.json.new")
        self._file: IO[bytes] | None = None
        self._sure = 0
        self._format = out.suffix.lower()

    def open(self, *, resume: bool) -> None:
        """Take hold of the file, and find where to go on."""
        # Not opened for appending: a file of another run must not change before it is known that the run is over.
        self._file = open(self._part, "r+b", opener=_create)  # noqa: SIM115 - Path.open has no opener
        self._lock()
        self._next_checkpoint.unlink(missing_ok=True)
        self.leftover = os.fstat(self._file.fileno()).st_size > 0
        if resume:
            self._load()
        self.leftover &= self.state is None
        if self.state is None:
            self._checkpoint.unlink(missing_ok=True)
        self._cut()

    def _lock(self) -> None:
        """Make sure that no other run writes the same result."""
        assert self._file is not None
        busy = LogError(f"{self.out} is being written by another run")
        if fcntl is None:
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._release()
            raise busy from None
        except OSError:
            return  # a file system without locks
        # The other run may have given the file its name between the opening and the lock.
        if not self._part.exists() or not os.path.samestat(self._part.stat(), os.fstat(self._file.fileno())):
            self._release()
            raise busy

    def _load(self) -> None:
        """Find the last checkpoint, if it belongs to the same work and all of its rows are there."""
        assert self._file is not None
        with contextlib.suppress(OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError):
            saved = json.loads(self._checkpoint.read_text(encoding="utf-8"))
            size = int(saved["bytes"])
            if saved["identity"] == self._identity and 0 < size <= os.fstat(self._file.fileno()).st_size:
                self._sure, self.state = size, dict(saved["state"])

    def _cut(self) -> None:
        """Cut off what is behind the last checkpoint."""
        assert self._file is not None
        # Not by way of the buffer, which may hold what a full disk did not take.
        os.ftruncate(self._file.fileno(), self._sure)
        self._file.seek(self._sure)

    def forget(self) -> None:
        """Begin at the beginning after all: the state is not one of this filter."""
        self.state, self._sure, self.leftover = None, 0, True
        self._checkpoint.unlink(missing_ok=True)
        self._cut()

    @contextlib.contextmanager
    def writer(self, schema: pa.Schema) -> Iterator[LogWriter]:
        """Write rows, behind those that are there."""
        assert self._file is not None
        if self._format in RESUMABLE:
            writer: LogWriter = RESUMABLE[self._format](self._file, schema, append=self.state is not None)
        else:
            writer = FORMATS[self._format](self._file, schema)
        with abandoned_on_failure(writer):
            yield writer
            writer.close()

    @property
    def resumable(self) -> bool:
        """Whether results of this format can be continued."""
        return self._format in RESUMABLE

    def mark(self, writer: Any, state: State) -> None:  # noqa: ANN401 - a ResumableWriter
        """Make a checkpoint behind the rows that were written so far.

        The rows are on the disk before the checkpoint is, and the checkpoint is before it gets its name: whenever the power
        fails, the checkpoint that is found has all of its rows.
        """
        assert self._file is not None
        writer.settle()
        self._file.flush()
        os.fsync(self._file.fileno())
        size = os.fstat(self._file.fileno()).st_size
        with _own_file(self._next_checkpoint) as file:
            json.dump({"identity": self._identity, "bytes": size, "state": state}, file)
            file.flush()
            os.fsync(file.fileno())
        self._next_checkpoint.replace(self._checkpoint)
        _sync_folder(self.out.parent)
        self._sure = size
        self.state = state

    def complete(self) -> None:
        """Give the result its name."""
        assert self._file is not None
        self._file.flush()
        os.fsync(self._file.fileno())
        if fcntl is None:
            self._release()  # Windows gives no other name to what is open
        self._part.replace(self.out)
        _sync_folder(self.out.parent)
        self._checkpoint.unlink(missing_ok=True)
        self._release()

    def stop(self) -> None:
        """Keep what is sure for a later run; without a checkpoint there is nothing to keep."""
        if self._file is None:
            return
        if self._sure:
            self._next_checkpoint.unlink(missing_ok=True)
            # What waits to be written would otherwise come behind the cut when the file is closed.
            for step in (self._file.flush, self._cut):
                with contextlib.suppress(OSError, ValueError):
                    step()
            self._release()
        else:
            self.discard()

    def discard(self) -> None:
        """Remove everything."""
        if self._file is not None:
            self._next_checkpoint.unlink(missing_ok=True)
            self._checkpoint.unlink(missing_ok=True)
            self._part.unlink(missing_ok=True)
            self._release()

    def _release(self) -> None:
        if self._file is not None:
            with contextlib.suppress(OSError):
                self._file.close()
            self._file = None


def _create(path: str, flags: int) -> int:
    """Open a file whether it is there or not, and leave what is in it.

    A link to another file is refused: whoever may write into the folder must not have that file overwritten.
    """
    handle = os.open(path, flags | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
    held = os.fstat(handle)
    if not stat.S_ISREG(held.st_mode) or held.st_nlink > 1:
        os.close(handle)
        raise LogError(f"{path} cannot be written: it is not a file of its own")
    return handle


def _own_file(path: Path) -> IO[str]:
    """Open a new file in place of whatever has the name; a link there is removed, not followed."""
    for _ in range(100):  # somebody may make the link again between the two
        path.unlink(missing_ok=True)
        with contextlib.suppress(FileExistsError):
            return path.open("x", encoding="utf-8")
    raise LogError(f"{path} cannot be written: it is not a file of its own")


def _sync_folder(folder: Path) -> None:
    """Make a new name last through a power failure, where the system knows how."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextlib.contextmanager
def open_draft(out: Path, identity: Mapping[str, Any], *, resume: bool) -> Iterator[Draft]:
    """Make a result that appears under its name only when it is complete.

    When the block ends well the result gets its name. When the log turns out to be bad nothing is left, and whatever stood under the
    name stays. When the run is stopped, or the disk is full, the rows up to the last checkpoint are kept.

    Parameters
    ----------
    out
        The result's name.
    identity
        What it is made from.
    resume
        Go on with what an earlier run left, if it was made from the same.

    Raises
    ------
    LogError
        The folder or the file cannot be written, or another run writes it.
    """
    draft = Draft(out, identity)
    try:
        draft.open(resume=resume)
        yield draft
        draft.complete()
    except LogError:
        draft.discard()
        raise
    except (OSError, pa.ArrowException) as error:
        draft.stop()
        kept = "; --resume goes on from the last checkpoint" if draft.state is not None else ""
        raise LogError(f"{out} cannot be written: {_words(error)}{kept}") from None
    except BaseException:
        draft.stop()
        raise


def _words(error: OSError | pa.ArrowException) -> str:
    """Say it in the system's own words: Arrow wraps them in several of its own."""
    number = error.errno if isinstance(error, OSError) else None
    return os.strerror(number) if number else " ".join(str(error).split())
