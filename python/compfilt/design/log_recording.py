"""A log and the recipe that filters it, as a recording. Needs the extra ``logs`` as well."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt._core import LinearFilter
from compfilt.design.recording import squared
from compfilt.logs.errors import LogError, RowError, quoted
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers import is_text, open_log
from compfilt.logs.recipe import Recipe
from compfilt.logs.signals import to_numpy
from compfilt.logs.units import ANGLE

__all__ = ["LogRecording", "numbers", "read_log"]

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
    text : bool
        Whether it was read from a text, whose users count lines.
    """

    recipe: Recipe
    table: pa.Table
    truth: Mapping[str, str]
    name: str = "the log"
    text: bool = False

    @cached_property
    def fs(self) -> float:
        """Sample rate in Hz: the recipe's, or that of the usual step."""
        if self.recipe.clock.rate is not None:
            return self.recipe.clock.rate
        pipeline, _ = self._run(None)
        step = pipeline.timeline.steps.quantile(0.5) if pipeline.timeline is not None else None
        if not step:
            raise LogError(f"{self.name}: the times must go on")
        return 1.0 / step

    @property
    def _period(self) -> float | None:
        unit = self.recipe.output.unit
        return 2.0 * np.pi / unit.factor if unit.dimension == ANGLE else None

    @property
    def _outputs(self) -> tuple[str, ...]:
        """What the recipe is to give."""
        return tuple(self.truth)

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared error at every row, (n,), the mean over the outputs, in the output's unit."""
        _, result = self._run(design)
        errors = [numbers(result, output) - numbers(result, column) for output, column in self.truth.items()]
        return squared(np.column_stack(errors), self._period)

    def _run(self, design: LinearFilter | None) -> tuple[Pipeline, Any]:
        """Filter the log, with the recipe's own design where there is no other."""
        output = replace(
            self.recipe.output, columns=self._outputs, keep=tuple(dict.fromkeys(self.truth.values()))
        )
        filter_ = self.recipe.filter
        if design is not None:
            filter_ = filter_.with_design(_Given(design))  # type: ignore[arg-type]  # as good as a Design
        pipeline = Pipeline(replace(self.recipe, filter=filter_, output=output), self.table.schema)
        try:
            return pipeline, pipeline.filter(self.table)
        except RowError as error:
            raise LogError(f"{self.name}: {error.in_text() if self.text else error}") from None
        except LogError as error:
            raise LogError(f"{self.name}: {error}") from None


def read_log(path: str | Path, recipe: Recipe, truth: Mapping[str, str]) -> LogRecording:
    """Read the recipe's inputs and the truth.

    Raises
    ------
    LogError
        The log cannot be read, or one of the columns holds no number; the message names it.
    """
    columns = recipe.columns._replace(keep=tuple(dict.fromkeys(truth.values())))
    try:
        with open_log(path, columns) as reader:
            batches = list(reader.batches())
        # A format may order its columns differently than asked.
        table = pa.Table.from_batches(batches) if batches else reader.schema.empty_table()
        _check_values(table, (*recipe.signal_columns, *truth.values()))
    except LogError as error:
        raise LogError(f"{path}: {error}") from None
    return LogRecording(recipe, table, dict(truth), str(path), is_text(path))


def _check_values(table: Any, columns: Iterable[str]) -> None:  # noqa: ANN401 - a table of Arrow
    """Refuse a column without a value: the filter would coast through it, and its gains mean nothing."""
    for column in columns:
        if not np.isfinite(numbers(table, column)).any():
            raise LogError(f"the column {quoted(column)} must have values: all of them are missing")


def numbers(table: Any, column: str) -> Array:  # noqa: ANN401 - a table of Arrow
    """Return a column as float64."""
    try:
        return to_numpy(table.column(column).combine_chunks()).astype(np.float64)
    except (TypeError, ValueError, BufferError):
        raise LogError(f"the column {quoted(column)} must hold numbers") from None
