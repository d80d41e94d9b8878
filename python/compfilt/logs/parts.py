"""One long log on several workers: cut, summarised, filtered in parts, and put together in order."""

import contextlib
import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.partition import Part, PartitionedLog, open_in_parts, why_not_in_parts
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import Recipe
from compfilt.logs.rows import can_read_rows
from compfilt.logs.run import Summary, run_log
from compfilt.logs.writers import LogWriter, check_ending, create_log

__all__ = ["PART_ROWS", "Future", "Submit", "run_in_parts", "why_in_order"]

PART_ROWS = 1 << 21
"""Rows of a part. It is fixed, so that the result does not depend on how many workers there are."""

Levels = npt.NDArray[np.float64]


class Future(Protocol):
    """Work that somebody else does."""

    def result(self) -> Any:  # noqa: ANN401 - whatever the work returns
        """Wait for it."""

    def cancel(self) -> Any:  # noqa: ANN401
        """Let it be if it has not begun."""


Submit = Callable[..., Future]
"""Gives a function and its arguments to a worker."""


class _NotAffineError(Exception):
    """A part did not end where its map said: the filter started anew, after an overflow."""


class _Filtered(NamedTuple):
    """What became of a part: its rows are in a file, and the filter stands at `levels`."""

    summary: Summary
    levels: Levels


def why_in_order(recipe: Recipe, log: str | Path) -> str | None:
    """Say why a log cannot be filtered in parts; ``None`` if it can."""
    if not can_read_rows(log):
        return f'a log that ends in "{Path(log).suffix}" can only be read in order'
    return why_not_in_parts(recipe)


def run_in_parts(
    recipe: Recipe,
    log: str | Path,
    out: str | Path,
    *,
    workers: int = 2,
    submit: Submit | None = None,
    part_rows: int = PART_ROWS,
    advance: Callable[[int], object] | None = None,
) -> Summary:
    """Filter one long log into one file, several parts of it at once.

    The result is that of :func:`run_log` to rounding: every sample goes through the same steps, and only the levels from
    which a part starts are rounded otherwise. It depends on `part_rows`, and not on who filters the parts. A log that is
    shorter than one and a half parts goes the ordinary way, and so does one that fails.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    log
        A file whose rows can be reached in any order, such as Parquet.
    out
        The result. It is replaced if it is there, and only once it is complete. While the parts are filtered they lie in a
        hidden folder beside it, as large as the uncompressed result.
    workers
        How many threads do the work.
    submit
        Gives work to somebody else instead: called with a function and its arguments, all of which pickle, it returns a
        future. Whoever does it must see the same files under the same names.
    part_rows
        About how many rows a part has.
    advance
        Called now and then with the number of bytes done since the last call.

    Raises
    ------
    LogError
        As :func:`run_log`.
    UsageError
        As :func:`run_log`; and if the log cannot be filtered in parts: see :func:`why_in_order`.

    Examples
    --------
    >>> run_in_parts(recipe, "drive.parquet", "drive.roll.parquet", workers=8)  # doctest: +SKIP
    Summary(rows=140000000, gaps=0, counts={'missing': 0, 'held': 0})
    """
    log, out = Path(log), Path(out)
    check_ending(out)
    if why := why_in_order(recipe, log):
        raise UsageError(f"{log}: cannot be filtered in parts: {why}")
    whole = open_in_parts(recipe, log)
    parts = whole.cut(part_rows)
    if len(parts) > 1:
        with contextlib.ExitStack() as stack:
            if submit is None:
                submit = stack.enter_context(ThreadPoolExecutor(workers)).submit
            try:
                return _run(whole, parts, out, submit, advance)
            except (LogError, _NotAffineError):
                # In order it is found which row is the first to fail; nothing is assumed about the filter there.
                pass
    return run_log(recipe, log, out, advance=advance)


def _run(
    whole: PartitionedLog,
    parts: Sequence[Part],
    out: Path,
    submit: Submit,
    advance: Callable[[int], object] | None,
) -> Summary:
    """Find the levels before every part, then filter all parts, and put the results together as they come."""
    size, rows = whole.path.stat().st_size, parts[-1].stop
    schema = Pipeline(whole.recipe, whole.schema).schema(whole.schema)
    with _all(submit, [(PartitionedLog.summarise, whole, part) for part in parts[:-1]]) as maps:
        starts: list[Levels | None] = [None]
        for future in maps:
            # The first part's map is constant.
            affine = future.result()
            starts.append(affine(affine.about if starts[-1] is None else starts[-1]))
    with _folder_beside(out) as folder:
        files = [folder / f"{number}.arrow" for number in range(len(parts))]
        work = [(_filter, whole, *job) for job in zip(parts, starts, files, strict=True)]
        with _all(submit, work) as futures, create_log(out, schema) as writer:
            summaries = []
            for future, part, file, expected in zip(futures, parts, files, [*starts[1:], None], strict=True):
                done: _Filtered = future.result()
                _check(done.levels, expected, whole)
                summaries.append(done.summary)
                _append(writer, file)
                if advance is not None:
                    advance(size * part.stop // rows - size * part.seam.row // rows)
    return reduce(_together, summaries)


@contextlib.contextmanager
def _all(submit: Submit, work: Sequence[tuple[Any, ...]]) -> Iterator[list[Future]]:
    """Give all of some work to the workers; what has not begun when the block ends is cancelled."""
    futures: list[Future] = []
    try:
        futures += [submit(*task) for task in work]
        yield futures
    finally:
        for future in futures:
            future.cancel()


@contextlib.contextmanager
def _folder_beside(out: Path) -> Iterator[Path]:
    """Make a hidden folder for the parts, where there is room for the result too; it goes away with all it holds."""
    folder = out.with_name(f".{out.name}.{secrets.token_hex(4)}.parts")
    try:
        folder.mkdir()
    except OSError as error:
        raise UsageError(f"{folder}: the folder cannot be made: {error.strerror}") from None
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _filter(whole: PartitionedLog, part: Part, start: Levels | None, file: Path) -> _Filtered:
    """Filter a part into a file. If it is done twice, each time a complete file appears."""
    pipeline = whole.pipeline(part, start)
    temporary = file.with_name(f"{file.name}.{secrets.token_hex(4)}")
    try:
        with pa.ipc.new_file(str(temporary), pipeline.schema(whole.schema)) as writer:
            for batch in whole.filtered(pipeline, part):
                writer.write_batch(batch)
        temporary.replace(file)
    except OSError as error:
        raise LogError(f"{temporary} cannot be written: {error.strerror or error}") from None
    rows = part.stop - part.seam.row
    return _Filtered(Summary(rows, pipeline.gaps, pipeline.counts), pipeline.levels[:, 0])


def _check(levels: Levels, expected: Levels | None, whole: PartitionedLog) -> None:
    """Raise _NotAffineError unless a part has ended where the next one has started, but for rounding."""
    single = all(whole.schema.field(name).type == pa.float32() for name in whole.recipe.signal_columns)
    tolerance = np.sqrt(np.finfo(np.float32 if single else np.float64).eps)
    if expected is not None and not np.allclose(
        levels, expected, rtol=tolerance, atol=tolerance * np.abs(expected).max()
    ):
        raise _NotAffineError


def _append(writer: LogWriter, file: Path) -> None:
    """Append a part to the result, and free its room."""
    with pa.memory_map(str(file)) as source, pa.ipc.open_file(source) as reader:
        for number in range(reader.num_record_batches):
            writer.write(reader.get_batch(number))
    # Where a mapped file cannot be removed it goes with its folder.
    with contextlib.suppress(OSError):
        file.unlink()


def _together(first: Summary, second: Summary) -> Summary:
    """Add what happened to two parts."""
    counts = {name: first.counts.get(name, 0) + count for name, count in second.counts.items()}
    return Summary(first.rows + second.rows, first.gaps + second.gaps, first.counts | counts)
