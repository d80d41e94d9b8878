"""A recipe bound to its filter's state: record batches in, record batches out."""

import difflib
import itertools
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

import compfilt
from compfilt.logs.clock import Timeline
from compfilt.logs.errors import LogError, RecipeError
from compfilt.logs.outputs import Channel, linear_channels, tilt_channels
from compfilt.logs.recipe import Recipe, Signal

__all__ = ["Pipeline"]


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
        self._stream = _build(recipe, self._dtype, recipe.clock.rate)
        self._channels = _choose_channels(recipe, self._dtype)
        self._timeline = None
        if recipe.clock.column is not None and recipe.clock.unit is not None:
            self._timeline = Timeline(recipe.clock.column, recipe.clock.unit, recipe.policy.gap)

    def schema(self, log: pa.Schema) -> pa.Schema:
        """Return the columns of the result, given those of the log; the unit stands in each field's metadata."""
        fields = [log.field(name) for name in self.recipe.output.keep]
        for channel in self._channels:
            unit = channel.unit(self.recipe.output.unit.name)
            dtype = pa.uint8() if unit is None else pa.from_numpy_dtype(np.dtype(self._dtype))
            fields.append(pa.field(channel.name, dtype, metadata=None if unit is None else {"unit": unit}))
        return pa.schema(fields)

    def process(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Filter the next rows of the log.

        Raises
        ------
        LogError
            A sample is missing where the policy is to raise, time runs backwards, or there is a gap where the
            policy is to fail. The message names the row, counted from 1. The pipeline is of no use afterwards.
        """
        first_row = self.rows + 1
        measurement = self._signal(self.recipe.measurement, batch, first_row)
        derivative = self._signal(self.recipe.derivative, batch, first_row)
        seconds = None
        gaps = np.empty(0, dtype=np.intp)
        if self._timeline is not None:
            ticks = batch.column(self._timeline.column).to_numpy(zero_copy_only=False)
            seconds = self._timeline.seconds(ticks, first_row)
            gaps = self._timeline.gaps(seconds, first_row)
        self.gaps += gaps.size
        estimates = self._filter(measurement, derivative, seconds, gaps)
        self.rows += batch.num_rows
        return self._collect(batch, estimates)

    def _signal(self, signal: Signal, batch: pa.RecordBatch, first_row: int) -> npt.NDArray[np.floating]:
        """Take a signal out of a batch, in SI: (n,) of one column, (n, c) of several."""
        columns = []
        for name, scale in zip(signal.columns, signal.scale, strict=True):
            values = batch.column(name).to_numpy(zero_copy_only=False).astype(np.float64)
            # In float64, so that float32 is rounded once.
            columns.append((values * (signal.unit.factor * scale)).astype(self._dtype, copy=False))
            missing = np.flatnonzero(~np.isfinite(columns[-1]))
            if missing.size and self.recipe.policy.missing == "raise":
                raise LogError(
                    f'row {first_row + missing[0]} has no number in column "{name}" ({signal.name})'
                )
        return columns[0] if len(columns) == 1 else np.column_stack(columns)

    def _filter(
        self,
        measurement: npt.NDArray[np.floating],
        derivative: npt.NDArray[np.floating],
        seconds: npt.NDArray[np.float64] | None,
        gaps: npt.NDArray[np.intp],
    ) -> list[Any]:
        """Run the stream over one batch, starting anew at the gaps where the policy says so."""
        gap = self.recipe.policy.gap
        anew = set(gaps.tolist()) if gap is not None and gap.do == "reset" else set()
        bounds = sorted({0, len(measurement)} | anew)
        estimates = []
        for start, end in itertools.pairwise(bounds):
            if start in anew:
                self._stream.reset()
            part = slice(start, end)
            signals = (measurement[part], derivative[part])
            if self.recipe.filter.kind == "tilt":
                signals = signals[::-1]  # TiltFilter takes the gyro first
            estimate = self._stream.estimate(*signals, None if seconds is None else seconds[part])
            if start in anew:
                estimate.flags[0] |= compfilt.Flags.RESTARTED
            for name, count in estimate.counts.items():
                self.counts[name] = self.counts.get(name, 0) + int(count)
            estimates.append(estimate)
        return estimates

    def _collect(self, batch: pa.RecordBatch, estimates: list[Any]) -> pa.RecordBatch:
        """Put the kept columns and the outputs side by side."""
        schema = self.schema(batch.schema)
        arrays = [batch.column(name) for name in self.recipe.output.keep]
        factor = self.recipe.output.unit.factor
        for channel in self._channels:
            parts = [channel.take(estimate, factor, self._dtype) for estimate in estimates]
            dtype = schema.field(channel.name).type
            arrays.append(pa.array(np.concatenate(parts) if parts else [], type=dtype))
        return pa.RecordBatch.from_arrays(arrays, schema=schema)


def _dtype(recipe: Recipe, schema: pa.Schema | None) -> type[np.floating]:
    """float32 if every signal is, otherwise float64."""
    columns = recipe.measurement.columns + recipe.derivative.columns
    single = schema is not None and all(schema.field(name).type == pa.float32() for name in columns)
    return np.float32 if single else np.float64


def _build(recipe: Recipe, dtype: type[np.floating], rate: float | None) -> Any:  # noqa: ANN401 - any stream
    """Make the filter and a stream of it; what the core refuses is an error of the recipe."""
    policy, filter_ = recipe.policy, recipe.filter
    options = dict(filter_.stream) | {"missing": policy.missing}
    if policy.hold is not None:
        options["hold"] = policy.hold
    try:
        design = filter_.design.build()
        if filter_.kind == "tilt":
            design = compfilt.TiltFilter(design, **filter_.structure)
        return design.stream(fs=rate, dtype=dtype, **options)
    except (ValueError, TypeError) as error:
        raise RecipeError(f"{recipe.source}: [filter] {error}") from None


def _choose_channels(recipe: Recipe, dtype: type[np.floating]) -> tuple[Channel, ...]:
    """Find the outputs that the recipe asks for among those that the filter has."""
    # One sample through a stream of its own shows what an estimate of this filter holds.
    probe = _build(recipe, dtype, 1.0)
    if recipe.filter.kind == "tilt":
        offer = tilt_channels(probe.estimate(np.zeros((1, 3), dtype), np.ones((1, 3), dtype)))
    else:
        blank = np.zeros(1, dtype)
        offer = linear_channels(probe.estimate(blank, blank), recipe.filter.design.derivative_order)
    channels: dict[str, Channel] = {}
    for name in recipe.output.columns:
        if name not in offer:
            near = difflib.get_close_matches(name, offer, n=1)
            hint = f' (did you mean "{near[0]}"?)' if near else ""
            known = ", ".join(offer)
            raise RecipeError(
                f'{recipe.source}: [output] columns: this filter has no "{name}"{hint}; it has {known}'
            )
        channels |= {channel.name: channel for channel in offer[name]}
    clash = [name for name in recipe.output.keep if name in channels]
    if clash:
        raise RecipeError(f'{recipe.source}: [output] "{clash[0]}" stands in both columns and keep')
    return tuple(channels.values())
