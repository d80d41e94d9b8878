"""A recipe bound to its filter's state: record batches in, record batches out."""

import itertools
import operator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyarrow as pa

import compfilt
from compfilt.logs.clock import Timeline, Timing, time_unit
from compfilt.logs.errors import RowError
from compfilt.logs.exchange import arrow_reader
from compfilt.logs.faults import FAULTS, Faults
from compfilt.logs.judge import Judge
from compfilt.logs.lengths import MeanLength
from compfilt.logs.outputs import Channel, choose
from compfilt.logs.readers.base import check_kinds, check_present
from compfilt.logs.recipe import Recipe
from compfilt.logs.signals import from_numpy
from compfilt.logs.starting import dtype_of, start_stream

__all__ = ["Pipeline"]

Values = npt.NDArray[np.floating]
Times = npt.NDArray[np.float64]
Rows = npt.NDArray[np.bool_]
Bits = npt.NDArray[np.uint8]


class _Judged(NamedTuple):
    """The signals of a batch as the filter takes them, what was wrong with them, and where it starts anew."""

    values: list[Values]
    faults: Bits
    restarts: npt.NDArray[np.intp]


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
    counts : dict of str to int
        What happened to the samples, by the names that the filter gives it.
    faults : dict of Faults to int
        What was wrong with the rows.
    timeline : Timeline or None
        What the times of the log were like, where it has any.
    judges : list of Judge
        What the samples were like, for each of the filter's signals.
    lengths : dict of str to MeanLength
        How long the readings of the accelerometer and of the gyro are, where the filter has one of them.

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
        self.counts: dict[str, int] = {}
        self.faults = dict.fromkeys(Faults, 0)
        self._dtype = dtype_of(recipe, schema)
        self._stream = start_stream(recipe, self._dtype)
        self.timeline = None
        if recipe.clock.column is not None:
            self.timeline = Timeline(recipe.clock.column, recipe.clock.unit, recipe.policy)
            if schema is not None:
                time_unit(schema.field(recipe.clock.column), recipe.clock.unit)
        self.judges = [
            Judge(signal, recipe.policy.of(signal.name), self._dtype) for signal in recipe.filter.signals
        ]
        self.lengths = {
            signal.name: MeanLength(signal)
            for signal in recipe.filter.signals
            if signal.name in ("accelerometer", "gyro")
        }
        # A log without rows shows what the filter has, and leaves its state as it is.
        nothing = [signal.empty(self._dtype) for signal in recipe.filter.signals]
        blank = self._stream.estimate(
            *recipe.filter.arguments(nothing), t=None if self.timeline is None else np.empty(0)
        )
        offer = recipe.filter.offer(blank, recipe.output)
        faults = Channel(FAULTS, FAULTS, slice(None), None)
        offer = offer._replace(columns={**offer.columns, FAULTS: (faults,)})
        self._channels = choose(recipe.output, offer, recipe.source)

    @property
    def gaps(self) -> int:
        """How many gaps were found in time."""
        return 0 if self.timeline is None else self.timeline.gaps

    @property
    def units(self) -> dict[str, str]:
        """The units of the columns that the filter gives, where they have one, and of the time where it is kept."""
        clock = self.recipe.clock
        kept = (
            {clock.column: clock.unit.name} if clock.column in self.recipe.output.keep and clock.unit else {}
        )
        given = {channel.name: channel.unit.name for channel in self._channels if channel.unit is not None}
        return {**{str(name): unit for name, unit in kept.items()}, **given}

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
        if field.name != clock.column:
            return field
        unit = time_unit(field, clock.unit)
        return field.with_metadata({**(field.metadata or {}), "unit": unit.name})

    def process(self, batch: pa.RecordBatch) -> pa.RecordBatch:
        """Filter the next rows of the log.

        Raises
        ------
        LogError
            There is a bad sample or an odd time, and the policy is to fail. The message names the first such row,
            counted from 1. The pipeline is of no use afterwards.
        """
        first_row = self.rows + 1
        timing = None
        if self.timeline is not None:
            timing = self.timeline.judge(self.timeline.take(batch), first_row)
        judged = self._judge(batch, timing, first_row)
        estimates = self._filter(judged, None if timing is None else timing.seconds, batch.num_rows)
        self.rows += batch.num_rows
        return self._collect(batch, estimates, judged.faults)

    def filter(self, table: Any) -> pa.Table:  # noqa: ANN401 - whatever exports itself to Arrow
        """Filter the next rows of the log, from whatever holds them.

        Parameters
        ----------
        table
            An Arrow table, batch or reader, a DataFrame of pandas (from 2.2) or polars, or anything else that offers
            itself to Arrow (``__arrow_c_stream__`` or ``__arrow_c_array__``). Its columns are not copied first. Only
            those of the recipe are looked at.

        Returns
        -------
        pyarrow.Table
            One row for each of the input, with the columns of :meth:`schema`.

        Raises
        ------
        TypeError
            It does not offer itself to Arrow.
        LogError
            A column is not there or holds no numbers; or as :meth:`process`.

        Examples
        --------
        >>> import pyarrow as pa
        >>> from compfilt.logs import Pipeline, parse_recipe
        >>> recipe = parse_recipe('''
        ... version = 1
        ... [log]
        ... rate = 10.0
        ... measurement = { column = "angle", unit = "deg" }
        ... derivative = { column = "speed", unit = "deg/s" }
        ... [filter]
        ... kind = "pi"
        ... kp = 2.0
        ... ki = 1.0
        ... [output]
        ... columns = ["estimate"]
        ... ''')
        >>> log = pa.table({"angle": [0.0, 0.5, 1.0], "speed": [5.0, 5.0, 5.0]})
        >>> Pipeline(recipe, log.schema).filter(log).column("estimate").to_numpy().round(3)
        array([0.413, 0.838, 1.273])
        """
        reader = arrow_reader(table)
        check_present(reader.schema.names, self.recipe.columns.all)
        check_kinds(reader.schema, self.recipe.columns)
        batches = [self.process(batch) for batch in reader]
        return pa.Table.from_batches(batches, self.schema(reader.schema))

    def _judge(self, batch: pa.RecordBatch, timing: Timing | None, first_row: int) -> _Judged:
        """Take every signal out of a batch, in SI, with what is bad about it dealt with."""
        rows = batch.num_rows
        seconds, coasting, holding = self._times(timing, rows)
        faults = np.zeros(rows, np.uint8) if timing is None else timing.faults
        restarts = np.zeros(rows, np.bool_) if timing is None else timing.restarts
        failures = [] if timing is None or timing.failure is None else [timing.failure]
        values = []
        for signal, judge in zip(self.recipe.filter.signals, self.judges, strict=True):
            taken = signal.take(batch, self._dtype)
            if signal.name in self.lengths:
                self.lengths[signal.name].follow(taken, first_row)
            verdict = judge.process(taken, seconds, first_row, coasting, holding)
            values.append(verdict.values)
            if verdict.faults is not None:
                faults |= verdict.faults
            if verdict.restarts is not None:
                restarts |= verdict.restarts
            if verdict.failure is not None:
                failures.append(verdict.failure)
        if failures:
            # The first row of all, so that the message does not depend on how the log is cut.
            row, why = min(failures, key=operator.itemgetter(0))
            raise RowError(first_row + row, why)
        if faults.any():
            for fault in Faults:
                self.faults[fault] += int(np.count_nonzero(faults & np.uint8(fault)))
        return _Judged(values, faults, np.flatnonzero(restarts))

    def _times(self, timing: Timing | None, rows: int) -> tuple[Times | None, Rows | None, Rows | None]:
        """Return the time of the samples, if there is one, and where it takes the signals out of use."""
        if timing is not None:
            masks = (timing.coasting, timing.holding)
            coasting, holding = (mask if mask.any() else None for mask in masks)
            return timing.seconds, coasting, holding
        rate = self.recipe.clock.rate
        if rate is None or not any(judge.needs_time for judge in self.judges):
            return None, None, None
        return np.arange(self.rows, self.rows + rows) / rate, None, None

    def _filter(self, judged: _Judged, seconds: Times | None, rows: int) -> list[Any]:
        """Run the stream over one batch, starting anew where the policy says so."""
        anew = set(judged.restarts.tolist())
        bounds = sorted({0, rows} | anew)
        arguments = self.recipe.filter.arguments(judged.values)
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

    def _collect(self, batch: pa.RecordBatch, estimates: list[Any], faults: Bits) -> pa.RecordBatch:
        """Put the kept columns and the outputs side by side."""
        schema = self.schema(batch.schema)
        arrays = [batch.column(name) for name in self.recipe.output.keep]
        for channel in self._channels:
            if channel.name == FAULTS:
                arrays.append(from_numpy(faults, pa.uint8()))
                continue
            parts = [channel.take(estimate, self._dtype) for estimate in estimates]
            dtype = schema.field(channel.name).type
            # A batch without rows has no parts.
            joined: Any = parts[0] if len(parts) == 1 else np.concatenate(parts or [np.empty(0)])
            arrays.append(from_numpy(joined, dtype))
        return pa.RecordBatch.from_arrays(arrays, schema=schema)

    @property
    def state(self) -> dict[str, Any]:
        """All that is carried from batch to batch, in plain numbers; set it to continue from there.

        It is for a pipeline of the same recipe on a log with the same columns.
        """
        stream = getattr(self._stream, "state", None)
        return {
            "rows": self.rows,
            "counts": dict(self.counts),
            "faults": [self.faults[fault] for fault in Faults],
            "timeline": None if self.timeline is None else self.timeline.state,
            "signals": [judge.state for judge in self.judges],
            "lengths": {name: length.state for name, length in self.lengths.items()},
            # A state is made of plain numbers, and this is how it pickles.
            "stream": None if stream is None else list(stream.__reduce__()[1]),
        }

    @state.setter
    def state(self, value: dict[str, Any]) -> None:
        self.rows = value["rows"]
        self.counts = dict(value["counts"])
        self.faults = dict(zip(Faults, value["faults"], strict=True))
        if self.timeline is not None:
            self.timeline.state = value["timeline"]
        for judge, state in zip(self.judges, value["signals"], strict=True):
            judge.state = state
        for name, length in self.lengths.items():
            length.state = value["lengths"][name]
        if value["stream"] is not None:
            self._stream.state = compfilt.State(*value["stream"])
