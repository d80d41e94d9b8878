"""A recipe bound to its filter's state: record batches in, record batches out."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

import compfilt
from compfilt.logs.clock import Timeline
from compfilt.logs.errors import LogError, RecipeError
from compfilt.logs.outputs import choose
from compfilt.logs.recipe import Recipe

__all__ = ["Pipeline", "start_stream"]

Values = npt.NDArray[np.floating]


class Pipeline:
    """Filter a log batch by batch.

    The state is carried from batch to batch, so that the result does not depend on how the log is cut: a log in
    pieces gives the same bits as the whole. A pipeline pickles in the middle of a log and goes on where it was.

    Parameters
    ----------
    recipe
        What to read, filter and write.
    schema
        The log's columns. If all signals are float32, so are the arithmetic and the output; otherwise, and without
        a schema, both are float64.

    Attributes
    ----------
    rows : int
        How many rows went through.
    gaps : int
        How many gaps were found in time.
    counts : dict of str to int
        What happened to the samples, by the names that the filter gives it.

    Raises
    ------
    RecipeError
        The filter cannot be built from the recipe, or does not have an output that it asks for.

    Examples
    --------
    >>> pipeline = Pipeline(load_recipe("seat.toml"), log.schema)  # doctest: +SKIP
    >>> for batch in log.to_batches():  # doctest: +SKIP
    ...     result = pipeline.process(batch)
    """

    def __init__(self, recipe: Recipe, schema: pa.Schema | None = None) -> None:
        self.recipe = recipe
        self.rows = 0
        self.gaps = 0
        self.counts: dict[str, int] = {}
        self._dtype = _dtype(recipe, schema)
        self._stream = start_stream(recipe, self._dtype)
        self._timeline = None
        if recipe.clock.column is not None and recipe.clock.unit is not None:
            self._timeline = Timeline(recipe.clock.column, recipe.clock.unit, recipe.policy.gap)
        # A log without rows shows what the filter has, and leaves its state as it is.
        nothing = [signal.empty(self._dtype) for signal in recipe.filter.signals]
        blank = self._stream.estimate(
            *recipe.filter.arguments(nothing), t=None if self._timeline is None else np.empty(0)
        )
        self._channels = choose(recipe.output, recipe.filter.offer(blank, recipe.output), recipe.source)

    def schema(self, log: pa.Schema) -> pa.Schema:
        """Return the columns of the result, given those of the log; the unit stands in each field's metadata."""
        fields = [self._kept(log.field(name)) for name in self.recipe.output.keep]
        for channel in self._channels:
            dtype = pa.uint8() if channel.unit is None else pa.from_numpy_dtype(np.dtype(self._dtype))
            metadata = None if channel.unit is None else {"unit": channel.unit.name}
            fields.append(pa.field(channel.name, dtype, metadata=metadata))
        return pa.schema(fields)

    def _kept(self, field: Any) -> Any:  # noqa: ANN401 - a field of any type
        """Return the field of a column that is carried along: as it is, but the recipe knows the unit of the time."""
        clock = self.recipe.clock
        if clock.unit is None or field.name != clock.column:
            return field
        return field.with_metadata({**(field.metadata or {}), "unit": clock.unit.name})

    def process(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Filter the next rows of the log.

        Raises
        ------
        LogError
            A sample is missing where the policy is to raise, time runs backwards, or there is a gap where the
            policy is to fail. The message names the row, counted from 1. The pipeline is of no use afterwards.
        """
        first_row = self.rows + 1
        signals = self._signals(batch, first_row)
        seconds = None
        gaps = np.empty(0, dtype=np.intp)
        if self._timeline is not None:
            ticks = batch.column(self._timeline.column).to_numpy(zero_copy_only=False)
            seconds = self._timeline.seconds(ticks, first_row)
            gaps = self._timeline.gaps(seconds, first_row)
        self.gaps += gaps.size
        estimates = self._filter(signals, seconds, gaps, batch.num_rows)
        self.rows += batch.num_rows
        return self._collect(batch, estimates)

    def _signals(self, batch: pa.RecordBatch, first_row: int) -> list[Values]:
        """Take every signal out of a batch, in SI."""
        signals = self.recipe.filter.signals
        values = [signal.take(batch, self._dtype) for signal in signals]
        if self.recipe.policy.missing == "raise":
            places = [
                (signal.first_missing(array), signal.name)
                for signal, array in zip(signals, values, strict=True)
            ]
            found = [(*place, name) for place, name in places if place is not None]
            if found:
                # The first row of all, so that the message does not depend on how the log is cut.
                row, column, name = min(found, key=lambda place: place[0])
                raise LogError(f'row {first_row + row} has no number in column "{column}" ({name})')
        return values

    def _filter(
        self,
        signals: Sequence[Values],
        seconds: npt.NDArray[np.float64] | None,
        gaps: npt.NDArray[np.intp],
        rows: int,
    ) -> list[Any]:
        """Run the stream over one batch, starting anew at the gaps where the policy says so."""
        gap = self.recipe.policy.gap
        anew = set(gaps.tolist()) if gap is not None and gap.do == "reset" else set()
        bounds = sorted({0, rows} | anew)
        arguments = self.recipe.filter.arguments(signals)
        estimates = []
        for start, end in itertools.pairwise(bounds):
            if start in anew:
                self._stream.reset()
            part = slice(start, end)
            estimate = self._stream.estimate(
                *(argument[part] for argument in arguments), t=None if seconds is None else seconds[part]
            )
            if start in anew:
                estimate.flags[0] |= np.uint8(compfilt.Flags.RESTARTED)
            for name, count in estimate.counts.items():
                self.counts[name] = self.counts.get(name, 0) + int(count)
            estimates.append(estimate)
        return estimates

    def _collect(self, batch: pa.RecordBatch, estimates: list[Any]) -> pa.RecordBatch:
        """Put the kept columns and the outputs side by side."""
        schema = self.schema(batch.schema)
        arrays = [batch.column(name) for name in self.recipe.output.keep]
        for channel in self._channels:
            parts = [channel.take(estimate, self._dtype) for estimate in estimates]
            dtype = schema.field(channel.name).type
            arrays.append(pa.array(np.concatenate(parts) if parts else [], type=dtype))
        return pa.RecordBatch.from_arrays(arrays, schema=schema)


def _dtype(recipe: Recipe, schema: pa.Schema | None) -> type[np.floating]:
    """float32 if every signal is, otherwise float64."""
    single = schema is not None and all(
        schema.field(name).type == pa.float32() for name in recipe.signal_columns
    )
    return np.float32 if single else np.float64


def start_stream(recipe: Recipe, dtype: type[np.floating], **options: Any) -> Any:  # noqa: ANN401 - any stream
    """Make the filter and a stream of it; what the core refuses is an error of the recipe."""
    policy: dict[str, Any] = {"missing": recipe.policy.missing, **options}
    if recipe.policy.hold is not None:
        policy["hold"] = recipe.policy.hold
    try:
        return recipe.filter.start(recipe.clock.rate, dtype, **policy)
    except (ValueError, TypeError) as error:
        raise RecipeError(f"{recipe.source}: [filter] {error}") from None
