"""One log in parts: what each part does to the filter's state, and each part filtered from its own start.

Over a stretch of samples a linear filter maps its levels by an affine map. The maps of all parts can be found at once; their
chain gives the levels before every part, and the parts can then be filtered at once.
"""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

import compfilt
from compfilt.logs.affine import AffineMap
from compfilt.logs.kinds.linear import Linear
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import Recipe
from compfilt.logs.rows import RowReader, open_rows
from compfilt.logs.seams import Seam, find_seam
from compfilt.logs.starting import start_stream

__all__ = ["Part", "PartPipeline", "PartitionedLog", "open_in_parts", "why_not_in_parts"]

Array = npt.NDArray[np.float64]

BATCH_ROWS = 1 << 16
"""How many rows are read at a time."""

SEAM_ROWS = 1 << 12
"""How many rows are looked at at a time for a seam: mostly there is one right away."""

TAIL_ROWS = 1 << 14
"""How much of a part's end is looked at first for what it does to the state: most filters forget sooner."""


def why_not_in_parts(recipe: Recipe) -> str | None:
    """Say why a recipe's filter cannot go through one log in parts; ``None`` if it can."""
    filter_ = recipe.filter
    if not isinstance(filter_, Linear):
        return f'the filter "{filter_.kind}" is not linear in its state'
    if filter_.kind == "rate":
        return 'the filter "rate" carries more state than its levels'
    if "period" in filter_.stream:
        return "with a period a filter is not linear in its state"
    if filter_.stream.get("delay", 0.0) > 0.0:
        return "with a delay past estimates belong to the state"
    return _looking_back(recipe)


def _looking_back(recipe: Recipe) -> str | None:
    """Name a policy that judges a row by more than the samples and the time just before it."""
    policy = recipe.policy
    own = [policy.of(signal.name) for signal in recipe.filter.signals]
    found = {
        "stuck": any(signal.stuck for signal in own),
        "clipped": any(signal.clipped for signal in own),
        "duplicate": policy.duplicate not in {"keep", "fail"},
        "backwards": policy.backwards != "fail",
        "gap": policy.gap is not None and policy.gap.do == "hold",
    }
    name = next((name for name, looks_back in found.items() if looks_back), None)
    return name and f'the policy "{name}" depends on rows further back'


class Part(NamedTuple):
    """The rows of a log from a seam up to a row, which is the next part's seam or the log's end."""

    seam: Seam
    stop: int


class PartPipeline(Pipeline):
    """A pipeline that begins at a seam.

    Attributes
    ----------
    levels : ndarray, shape (order, channels)
        The filter's levels. Unless the log begins here they are to be set; before that they are those of a filter that
        starts with the last measurement.
    """

    def __init__(self, log: "PartitionedLog", seam: Seam) -> None:
        super().__init__(log.recipe, log.schema)
        self._begin(log, seam)

    def _begin(self, log: "PartitionedLog", seam: Seam) -> None:
        """Get to know all but the levels."""
        if seam.lead is None:
            return
        unused = self.state
        timeline = unused["timeline"]
        if timeline is not None:
            timeline["origin"] = log.origin
        self.state = {**unused, "rows": seam.row - seam.lead.num_rows}
        self.process(seam.lead)
        # What was found on the way belongs to the report on the part before; the filter's own state does not.
        state = self.state
        if timeline is not None:
            timeline |= {key: state["timeline"][key] for key in ("before", "last")}
        self.state = {
            **unused,
            "rows": seam.row,
            "stream": state["stream"],
            "signals": [
                {**fresh, **{key: judged[key] for key in ("good", "resetting")}}
                for fresh, judged in zip(unused["signals"], state["signals"], strict=True)
            ],
        }

    @property
    def levels(self) -> Array:
        """The filter's levels."""
        return np.asarray(self._stream.state.levels)

    @levels.setter
    def levels(self, levels: Array) -> None:
        # In each channel of a state the levels come first.
        order, dtype, time, kind, numbers = self.state["stream"]
        changed = [[*new, *old[order:]] for new, old in zip(levels.T.tolist(), numbers, strict=True)]
        self._stream.state = compfilt.State(order, dtype, time, kind, changed)


class _StateOnly(PartPipeline):
    """A pipeline whose results are of no interest, so that the columns to carry along need not be read."""

    def _collect(self, batch: pa.RecordBatch, _estimates: Any, _faults: Any) -> pa.RecordBatch:  # noqa: ANN401
        return batch


class _Probe(_StateOnly):
    """A pipeline with a channel more for each level: the same filter without signals, from a one in that level.

    Where the log has no number these channels have none either, so that they go through the same gaps.
    """

    def __init__(self, log: "PartitionedLog", seam: Seam) -> None:
        Pipeline.__init__(self, log.recipe, log.schema)
        self._order = len(self.levels)
        self._stream = start_stream(_without_initial(log.recipe), self._dtype, channels=1 + self._order)
        self._begin(log, seam)
        self.guess = self.levels[:, 0]
        self.levels = np.column_stack([self.guess, np.eye(self._order)])

    def _filter(self, judged: Any, seconds: Array | None, rows: int) -> list[Any]:  # noqa: ANN401 - see Pipeline
        wide = [np.column_stack([values, *[values * 0.0] * self._order]) for values in judged.values]
        return super()._filter(judged._replace(values=wide), seconds, rows)


def _without_initial(recipe: Recipe) -> Recipe:
    """Leave an initial state out, which is for the log's beginning alone."""
    filter_ = recipe.filter
    assert isinstance(filter_, Linear)
    stream = {key: value for key, value in filter_.stream.items() if key != "initial"}
    return replace(recipe, filter=replace(filter_, stream=stream))


@dataclass(frozen=True)
class PartitionedLog:
    """A log and what it takes to filter a part of it anywhere. It pickles, and holds no rows.

    Attributes
    ----------
    recipe
        A linear one: see :func:`why_not_in_parts`.
    path
        A file whose rows can be reached in any order.
    schema
        Its columns, as far as the recipe needs them.
    origin
        The time of its first row, from which whole numbers count; ``None`` where the times are none.

    Examples
    --------
    >>> log = open_in_parts(recipe, "drive.parquet")  # doctest: +SKIP
    >>> first, second = log.cut(rows=1_000_000)  # doctest: +SKIP
    >>> levels = log.summarise(first).end  # doctest: +SKIP
    >>> pipeline = log.pipeline(second, levels)  # doctest: +SKIP
    >>> results = list(log.filtered(pipeline, second))  # doctest: +SKIP
    """

    recipe: Recipe
    path: Path
    schema: pa.Schema
    origin: int | None

    def cut(self, rows: int) -> list[Part]:
        """Cut the log into parts of about so many rows, at seams near the beginnings of the pieces it is stored in.

        The cut depends on the log alone. Where there is no seam the part before goes on.
        """
        with open_rows(self.path, self.recipe.columns) as reader:
            seams = [Seam(0, None)]
            for row, limit in _places(reader.starts, rows):
                seam = find_seam(self.recipe, reader.read(row, limit, SEAM_ROWS), row)
                if seam is not None:
                    seams.append(seam)
            stops = [*(seam.row for seam in seams[1:]), reader.starts[-1]]
        return [Part(seam, stop) for seam, stop in zip(seams, stops, strict=True)]

    def summarise(self, part: Part) -> AffineMap:
        """Find what a part that ends at a seam does to the levels.

        It is looked at from its end backwards, in longer and longer pieces, until the filter has forgotten what was
        before. Mostly that is soon, and the part is hardly read.
        """
        stop, rows = part.stop, TAIL_ROWS
        whole: AffineMap | None = None
        with open_rows(self.path, self.recipe.columns._replace(keep=())) as reader:
            while stop > part.seam.row and not (whole and whole.forgets):
                row = stop - rows
                seam: Seam | None = part.seam
                if row > part.seam.row:
                    seam = find_seam(self.recipe, reader.read(row, stop - 1, SEAM_ROWS), row)
                if seam is not None:
                    piece = self._summarise(reader, Part(seam, stop))
                    whole = piece.then(whole) if whole else piece
                    stop = seam.row
                rows *= 2
        assert whole is not None  # no part is empty
        return whole

    def _summarise(self, reader: RowReader, part: Part) -> AffineMap:
        """Do the same for a piece, all of which is looked at."""
        batches = reader.read(part.seam.row, part.stop, BATCH_ROWS)
        if part.seam.lead is None:
            pipeline = _StateOnly(self, part.seam)
            _exhaust(pipeline, batches)
            return AffineMap.constant(pipeline.levels[:, 0])
        probe = _Probe(self, part.seam)
        _exhaust(probe, batches)
        return AffineMap(probe.guess, probe.levels[:, 0], probe.levels[:, 1:])

    def pipeline(self, part: Part, levels: Array | None) -> PartPipeline:
        """Make the pipeline for a part; `levels` are those before it, ``None`` at the log's beginning."""
        pipeline = PartPipeline(self, part.seam)
        if levels is not None:
            pipeline.levels = levels[:, np.newaxis]
        return pipeline

    def filtered(self, pipeline: PartPipeline, part: Part) -> Iterator[pa.RecordBatch]:
        """Yield a part's results.

        Raises
        ------
        LogError
            As :meth:`Pipeline.process`, and where the file is damaged.
        """
        with open_rows(self.path, self.recipe.columns) as reader:
            for batch in reader.read(part.seam.row, part.stop, BATCH_ROWS):
                yield pipeline.process(batch)


def open_in_parts(recipe: Recipe, path: str | Path) -> PartitionedLog:
    """Look at a log that is to be filtered in parts.

    Raises
    ------
    LogError
        It cannot be read, or its rows can only be read in order.
    """
    path = Path(path)
    with open_rows(path, recipe.columns) as reader:
        # A pipeline that has seen one row knows.
        pipeline = PartPipeline(PartitionedLog(recipe, path, reader.schema, None), Seam(0, None))
        _exhaust(pipeline, reader.read(0, 1, 1))
        timeline = pipeline.state["timeline"]
        return PartitionedLog(recipe, path, reader.schema, timeline and timeline["origin"])


def _exhaust(pipeline: Pipeline, batches: Iterator[pa.RecordBatch]) -> None:
    for batch in batches:
        pipeline.process(batch)


def _places(starts: Sequence[int], rows: int) -> Iterator[tuple[int, int]]:
    """Yield from where and up to where to look for each seam: every so many rows, at the start of a piece if one is near."""
    total = starts[-1]
    places = []
    for row in range(rows, total - rows // 2, rows):
        index = int(np.searchsorted(starts, row))
        near = min(starts[index - 1 : index + 1], key=lambda start: abs(start - row))
        places.append(near if abs(near - row) <= rows // 4 else row)
    # The last part is not empty.
    return itertools.pairwise([*places, total - 1])
