"""A log with truth in it, through a recipe, as a recording that gains are chosen on. Needs the extra ``logs`` as well."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt._core import LinearFilter
from compfilt.design.recording import from_recordings, squared
from compfilt.design.result import Designed
from compfilt.logs.errors import LogError, UsageError, quoted
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers import open_log
from compfilt.logs.recipe import Recipe
from compfilt.logs.signals import to_numpy
from compfilt.logs.units import ANGLE

__all__ = ["LogRecording", "from_logs"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class _Given:
    """A design in the place of the one that a recipe names."""

    design: LinearFilter

    @property
    def kind(self) -> str:
        return type(self.design).__name__

    @property
    def derivative_order(self) -> int:
        return self.design.derivative_order

    def build(self) -> LinearFilter:
        return self.design


@dataclass(frozen=True)
class LogRecording:
    """A log and the recipe that filters it, with every policy of the recipe; in memory.

    Attributes
    ----------
    recipe : Recipe
        Its design is replaced by those that are tried.
    table : pyarrow.Table
        The recipe's inputs and the columns of the truth.
    truth : mapping of str to str
        For each output that counts, the column that has its true values, in the output's unit. A missing value does not
        count.
    name : str
        What it is called in messages.
    """

    recipe: Recipe
    table: pa.Table
    truth: Mapping[str, str]
    name: str = "the log"

    @cached_property
    def fs(self) -> float:
        """Sample rate in Hz: the recipe's, or that of the usual step."""
        if self.recipe.clock.rate is not None:
            return self.recipe.clock.rate
        pipeline, _ = self._run(self.recipe.filter.design.build())  # type: ignore[attr-defined]
        step = pipeline.timeline.steps.quantile(0.5) if pipeline.timeline is not None else None
        if not step:
            raise LogError(f"{self.name}: the times must go on")
        return 1.0 / step

    @property
    def _period(self) -> float | None:
        unit = self.recipe.output.unit
        return 2.0 * np.pi / unit.factor if unit.dimension == ANGLE else None

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared error at every row, (n,), the mean over the outputs, in the output's unit."""
        _, result = self._run(design)
        errors = [
            to_numpy(result.column(output).combine_chunks()) - _numbers(result, column)
            for output, column in self.truth.items()
        ]
        return squared(np.column_stack(errors), self._period)

    def _run(self, design: LinearFilter) -> tuple[Pipeline, Any]:
        output = replace(
            self.recipe.output, columns=tuple(self.truth), keep=tuple(dict.fromkeys(self.truth.values()))
        )
        filter_ = replace(self.recipe.filter, design=_Given(design))  # type: ignore[call-arg]
        pipeline = Pipeline(replace(self.recipe, filter=filter_, output=output), self.table.schema)
        try:
            return pipeline, pipeline.filter(self.table)
        except LogError as error:
            raise LogError(f"{self.name}: {error}") from None


def from_logs(
    logs: Sequence[str | Path],
    recipe: Recipe,
    truth: Mapping[str, str],
    *,
    kind: str | None = None,
    order: int | None = None,
    split: int | None = None,
    derivative_order: int | None = None,
    folds: int = 5,
) -> Designed:
    """Return the gains with the least root mean square error of a recipe's outputs on logs with truth.

    What ``compfilt design --recording`` does; see `compfilt.design.from_recordings`.

    Parameters
    ----------
    logs
        Logs of any format, with the recipe's inputs and columns of truth. They are held in memory.
    recipe
        How they are filtered. Its design is replaced by those that are tried.
    truth
        For each output that counts, the column with its true values, in the output's unit.
    kind, order, split, derivative_order
        As in `compfilt.design.from_spectra`; by default those of the recipe.
    folds
        As in `compfilt.design.from_recordings`.

    Raises
    ------
    LogError
        A log cannot be read or filtered; the message names it.
    UsageError
        The recipe's filter has no linear design.
    ValueError
        Kind, order and split do not go together, or a fold has no truth.
    """
    named = getattr(recipe.filter, "design", None)
    if named is None or named.kind == "rate":
        raise UsageError(
            f'{recipe.source}: [filter] kind = "{recipe.filter.kind}" has no design to choose gains for'
        )
    if kind is None:
        kind = named.kind
        if kind in {"butterworth", "chain"}:
            order, split = order or named.build().order, split or named.build().split
        if kind == "chain":
            derivative_order = derivative_order or named.derivative_order
    recordings = [_read(log, recipe, truth) for log in logs]
    return from_recordings(
        recordings, kind=kind, order=order, split=split, derivative_order=derivative_order, folds=folds
    )


def _read(path: str | Path, recipe: Recipe, truth: Mapping[str, str]) -> LogRecording:
    columns = recipe.columns._replace(keep=tuple(dict.fromkeys(truth.values())))
    try:
        with open_log(path, columns) as reader:
            batches = list(reader.batches())
        # A format may order its columns differently than asked.
        table = pa.Table.from_batches(batches) if batches else reader.schema.empty_table()
        for column in truth.values():
            _numbers(table, column)
    except LogError as error:
        raise LogError(f"{path}: {error}") from None
    return LogRecording(recipe, table, dict(truth), str(path))


def _numbers(table: Any, column: str) -> Array:  # noqa: ANN401 - a table of Arrow
    try:
        return to_numpy(table.column(column).combine_chunks()).astype(np.float64)
    except (TypeError, ValueError, BufferError):
        raise LogError(f"the column {quoted(column)} must hold numbers") from None
