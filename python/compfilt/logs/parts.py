"""One long log on several workers: cut, summarised, filtered in parts, and put together in order."""

import contextlib
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial, reduce
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.draft import open_draft
from compfilt.logs.encoders import FORMATS, LogWriter
from compfilt.logs.errors import LogError
from compfilt.logs.identity import describe
from compfilt.logs.job import Advance, run_log
from compfilt.logs.merge import merge_states
from compfilt.logs.outcome import Summary
from compfilt.logs.partition import Part, PartitionedLog, open_in_parts, why_not_in_parts
from compfilt.logs.parts_folder import folder_beside
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.quality import make_report, report_path, write_report
from compfilt.logs.recipe import Recipe
from compfilt.logs.rows import can_read_rows
from compfilt.logs.writers import check_ending, create_log

__all__ = ["PART_ROWS", "Future", "Submit", "run_in_parts", "why_in_order"]

PART_ROWS = 1 << 21
"""Rows of a part. It is fixed, so that the result does not depend on how many workers there are."""

_Result = tuple[str, Callable[[Path], object]]
"""The name of the parts' files, with a place for the number, and what takes the files when they are done, in order."""

Levels = npt.NDArray[np.float64]


class Future(Protocol):
    """Work that somebody else does."""

    def result(self) -> Any:  # noqa: ANN401 - whatever the work returns
        """Wait for it."""

    def cancel(self) -> Any:  # noqa: ANN401
        """Let it be if it has not begun; False if it has, and has to be waited for."""


Submit = Callable[..., Future]
"""Gives a function and its arguments to a worker."""


class _NotAffineError(Exception):
    """A part did not end where its map said: the filter started anew, after an overflow."""


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
    resume: bool = False,
    advance: Advance | None = None,
    workers: int = 2,
    submit: Submit | None = None,
    part_rows: int = PART_ROWS,
    as_folder: bool = False,
) -> Summary:
    """Filter one long log, several parts of it at once.

    The result is that of :func:`run_log` to rounding: every sample goes through the same steps, and only the levels from
    which a part starts are rounded otherwise. It depends on `part_rows`, and not on who filters the parts. A log that is
    shorter than one and a half parts goes the ordinary way, in order. So does one that fails in parts, and every log if the
    filter is not linear or the file can only be read in order: then the summary's note says why.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    log
        Best a file whose rows can be reached in any order, such as Parquet.
    out
        The result. It is replaced if it is there, and only once it is complete. While the parts are filtered they lie in a
        hidden folder beside it, as large as the uncompressed result.
    as_folder
        Make `out` a folder of Parquet files, a part each, which others read as one table. Nobody has to put the parts
        together then: it is what many workers need. A log that goes in order becomes one file all the same.
    resume
        Go on with what a run in order that was stopped has left, in order. A run in parts leaves nothing: the log is filtered
        anew.
    advance
        Called now and then with the number of bytes, and of rows, done since the last call.
    workers
        How many threads do the work.
    submit
        Gives work to somebody else instead: called with a function and its arguments, all of which pickle, it returns a
        future. Whoever does it must see the same files under the same names.
    part_rows
        About how many rows a part has.

    Raises
    ------
    LogError, UsageError
        As :func:`run_log`.

    Examples
    --------
    >>> run_in_parts(recipe, "drive.parquet", "drive.roll.parquet", workers=8)  # doctest: +SKIP
    Summary(rows=140000000, gaps=0, counts={'missing': 0, 'held': 0})
    """
    log, out = Path(log), Path(out)
    check_ending(out, (".parquet",) if as_folder else FORMATS)
    if out.is_dir() and not all(file.match("part-*.parquet") for file in out.iterdir()):
        raise LogError(f"{out}: this folder holds more than the parts of a log, and is not replaced")
    summary, failed = None, False
    why = "it was begun so" if resume and _begun(out) else why_in_order(recipe, log)
    if why is None:
        try:
            whole = open_in_parts(recipe, log)
            parts = whole.cut(part_rows)
            if len(parts) > 1:
                with contextlib.ExitStack() as stack:
                    if submit is None:
                        submit = stack.enter_context(ThreadPoolExecutor(workers)).submit
                    summary = _run(whole, parts, out, submit, advance, as_folder=as_folder)
        except _NotAffineError:
            why = "the filter started anew after an overflow"
        except LogError as error:
            # In order it is found which row is the first to fail; if none does, it is said what has.
            why, failed = str(error), True
    if summary is not None:
        write_report(summary.report, out)
        return summary
    if out.is_dir() and not failed:
        raise LogError(
            f"{out}: this is a folder of parts, and the log goes in order, into a file; remove it first"
        )
    summary = run_log(recipe, log, out, resume=resume, advance=advance)
    notes = [summary.note, f"in order, since {why}" if why else ""]
    return replace(summary, note=", ".join(filter(None, notes)))


def _begun(out: Path) -> bool:
    """Tell whether a run in order has left a checkpoint of this result: see :mod:`compfilt.logs.draft`."""
    return out.with_name(f".{out.name}.part.json").exists()


def _run(
    whole: PartitionedLog,
    parts: Sequence[Part],
    out: Path,
    submit: Submit,
    advance: Advance | None,
    *,
    as_folder: bool,
) -> Summary:
    """Find the levels before every part, then filter all parts, and put the results together as they come."""
    starts = _starts(whole, parts, submit)
    pipeline = Pipeline(whole.recipe, whole.schema)
    identity = describe(whole.recipe, whole.path)
    size = whole.path.stat().st_size
    states = []
    result = _many_files(out) if as_folder else _one_file(out, identity, pipeline.schema(whole.schema))
    with result as (name, take):
        files = [Path(name.format(number)) for number in range(len(parts))]
        with _all(
            submit, [(_filter, whole, *job) for job in zip(parts, starts, files, strict=True)]
        ) as futures:
            for future, part, file, end in zip(futures, parts, files, [*starts[1:], None], strict=True):
                states.append(future.result())
                _check(states[-1], end)
                take(file)
                if advance is not None:
                    first, last = (size * row // parts[-1].stop for row in (part.seam.row, part.stop))
                    advance(last - first, part.stop - part.seam.row)
        pipeline.state = reduce(merge_states, states)
        report = make_report(whole.path, out, identity, pipeline)
        # As in run_log: never a report beside a result that it is not of.
        report_path(out).unlink(missing_ok=True)
    return Summary(pipeline.rows, pipeline.gaps, pipeline.counts, report["faults"], report=report)


@contextlib.contextmanager
def _one_file(out: Path, identity: Mapping[str, Any], schema: pa.Schema) -> Iterator[_Result]:
    """Put the parts one behind the other."""
    with (
        open_draft(out, identity, resume=False) as draft,
        folder_beside(out) as folder,
        draft.writer(schema) as writer,
    ):
        yield f"{folder}/{{}}.arrow", partial(_append, writer)


@contextlib.contextmanager
def _many_files(out: Path) -> Iterator[_Result]:
    """Leave the parts as they are, in a folder that gets its name when all are there."""
    with folder_beside(out) as folder:
        done: set[Path] = set()
        yield f"{folder}/part-{{:06}}.parquet", done.add
        if out.is_file():
            out.unlink()
        # A worker that died has left what it had begun.
        for path in folder.iterdir():
            if path not in done:
                path.unlink()
        with _aside(out):
            folder.rename(out)


@contextlib.contextmanager
def _aside(out: Path) -> Iterator[None]:
    """Move an older folder of parts away; it comes back if the block fails, otherwise it is removed."""
    old = out.with_name(f".{out.name}.{secrets.token_hex(4)}.old")
    if out.is_dir():
        out.rename(old)
    try:
        yield
    except BaseException:
        if old.exists():
            old.rename(out)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _starts(whole: PartitionedLog, parts: Sequence[Part], submit: Submit) -> list[Levels | None]:
    """Find the levels before every part; ``None`` at the log's beginning."""
    with _all(submit, [(PartitionedLog.summarise, whole, part) for part in parts[:-1]]) as maps:
        # The first part begins where the log does: its map is constant.
        starts: list[Levels | None] = [maps[0].result().end]
        for future in maps[1:]:
            starts.append(future.result()(starts[-1]))
        return [None, *starts]


@contextlib.contextmanager
def _all(submit: Submit, work: Sequence[tuple[Any, ...]]) -> Iterator[list[Future]]:
    """Give all of some work to the workers; when the block ends what has not begun is cancelled, the rest waited for."""
    futures: list[Future] = []
    try:
        futures += [submit(*task) for task in work]
        yield futures
    finally:
        running = [future for future in futures if future.cancel() is False]
        for future in running:
            with contextlib.suppress(Exception):
                future.result()


def _filter(whole: PartitionedLog, part: Part, start: Levels | None, file: Path) -> dict[str, Any]:
    """Filter a part into a file, and return the pipeline's state. If it is done twice, a complete file appears each time."""
    pipeline = whole.pipeline(part, start)
    make = create_log if file.suffix in FORMATS else _create_arrow
    with make(file, pipeline.schema(whole.schema)) as writer:
        for batch in whole.filtered(pipeline, part):
            writer.write(batch)
    return pipeline.state


@contextlib.contextmanager
def _create_arrow(path: Path, schema: pa.Schema) -> Iterator[Any]:
    """Write a file that is read once and soon: as it lies in memory, and not forced to the disk."""
    temporary = path.with_name(f"{path.name}.{secrets.token_hex(4)}")
    try:
        with pa.ipc.new_file(str(temporary), schema) as writer:
            yield writer
        temporary.replace(path)
    except OSError as error:
        raise LogError(f"{temporary} cannot be written: {error.strerror or error}") from None


def _check(state: dict[str, Any], expected: Levels | None) -> None:
    """Raise _NotAffineError unless a part has ended where the next one has started, but for rounding."""
    if expected is None:
        return
    order, dtype, _, _, numbers = state["stream"]
    tolerance = np.sqrt(np.finfo(dtype).eps)
    atol = tolerance * np.abs(expected).max()
    if not np.allclose(numbers[0][:order], expected, rtol=tolerance, atol=atol):
        raise _NotAffineError


def _append(writer: LogWriter, file: Path) -> None:
    """Append a part to the result, and free its room."""
    with pa.memory_map(str(file)) as source, pa.ipc.open_file(source) as reader:
        for number in range(reader.num_record_batches):
            writer.write(reader.get_batch(number))
    # Where a mapped file cannot be removed it goes with its folder.
    with contextlib.suppress(OSError):
        file.unlink()
