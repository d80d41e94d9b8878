"""A device's recording through the filter that ran on it: the same bits, or where they part."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from compfilt.logs.clock import Timeline
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers import Columns, open_log
from compfilt.logs.recipe import Recipe

__all__ = ["Difference", "Replay", "parse_names", "replay_trace"]


@dataclass(frozen=True)
class Difference:
    """The first sample of a column where a device's output is not the filter's.

    Attributes
    ----------
    row
        Counted from 1.
    time
        The time in seconds, whole numbers counted from the first, if the recipe names a column of times.
    column
        The output.
    expected, found
        The filter's number and the device's: float32, or uint8 of flags.
    rows
        How many rows of the column differ.
    """

    row: int
    time: float | None
    column: str
    expected: np.generic
    found: np.generic
    rows: int

    @property
    def ulps(self) -> int | None:
        """How many float32 numbers they are apart; ``None`` where one is no number, and for flags."""
        pair = np.array([self.expected, self.found])
        if pair.dtype != np.float32 or not np.isfinite(pair).all():
            return None
        bits = pair.view(np.int32).astype(np.int64)
        # Numbers in order: those below zero count down.
        places = np.where(bits < 0, -(2**31) - bits, bits)
        return int(abs(places[1] - places[0]))

    def __str__(self) -> str:
        time = "" if self.time is None else f" (time {self.time:.12g})"
        apart = "" if self.ulps is None else f", {self.ulps} ulp apart"
        more = f"; {self.rows} rows differ" if self.rows > 1 else ""
        return (
            f'row {self.row}{time}, column "{self.column}": expected {_shown(self.expected)}, '
            f"found {_shown(self.found)}{apart}{more}"
        )


@dataclass(frozen=True)
class Replay:
    """What came of a replay.

    Attributes
    ----------
    rows
        How many samples there were.
    columns
        The outputs that were compared.
    differences
        The first one of each column that has any, in the order of the rows.
    """

    rows: int
    columns: tuple[str, ...]
    differences: tuple[Difference, ...]

    def lines(self) -> list[str]:
        """Say it in words."""
        if self.differences:
            return [str(difference) for difference in self.differences]
        return [f"{self.rows} samples of {', '.join(self.columns)}: the same bits"]


def parse_names(text: str) -> dict[str, str]:
    """Read "roll=est_roll,bias=b": the columns of outputs that have another name in the trace.

    Raises
    ------
    UsageError
        A part has no name, no column, or a name that stood before.

    Examples
    --------
    >>> parse_names("roll=est_roll,bias=b")
    {'roll': 'est_roll', 'bias': 'b'}
    """
    names: dict[str, str] = {}
    for part in text.split(",") if text else []:
        name, _, column = (piece.strip() for piece in part.partition("="))
        if not name or not column or name in names:
            raise UsageError(f'--out-columns: "{part}" is not NAME=COLUMN with a name of its own')
        names[name] = column
    return names


def replay_trace(recipe: Recipe, trace: str | Path, names: Mapping[str, str] | None = None) -> Replay:
    """Run the inputs that a device recorded through the same filter, and compare its outputs.

    Parameters
    ----------
    recipe
        The filter. Its inputs are read in its units; its outputs are compared in SI units, as a chip has them.
    trace
        A log with the recipe's inputs and the device's outputs, float32: decimals that are read as themselves, or bits
        such as 0x3c23d70a.
    names
        For outputs with another name in the trace, their columns.

    Returns
    -------
    Replay

    Raises
    ------
    LogError
        The trace cannot be read, lacks a column, or holds something else than numbers.
    UsageError
        The filter cannot be built, does not have an output, or computes it in float64.

    Examples
    --------
    >>> replay_trace(load_recipe("angle.toml"), "device.csv").differences  # doctest: +SKIP
    ()
    """
    recipe = _in_si(recipe)
    inputs = recipe.signal_columns
    outputs = Pipeline(recipe).schema(pa.schema([])).names
    unknown = [name for name in names or {} if name not in outputs]
    if unknown:
        raise UsageError(
            f'--out-columns: the recipe has no output "{unknown[0]}"; it has {", ".join(outputs)}'
        )
    columns = {name: (names or {}).get(name, name) for name in outputs}
    time = () if recipe.clock.column is None else (recipe.clock.column,)
    comparison = _Comparison(outputs)
    # A timeline of its own: that of the pipeline has already moved on, and may leave gaps out.
    clock = Timeline(time[0], recipe.clock.unit, recipe.policy) if time else None
    # As they are written: a text's bits in hexadecimal would be taken for whole numbers.
    written = Columns((), time, separator=recipe.separator, written=(*inputs, *columns.values()))
    with open_log(trace, written) as reader:
        pipeline = Pipeline(recipe, _in_single(reader.schema, recipe))
        for batch in reader.batches():
            filtered = _filtered(pipeline, batch, inputs)
            comparison.add(filtered, batch, columns, None if clock is None else clock.take(batch))
    if not comparison.rows:
        raise LogError("the file holds no rows")
    return Replay(comparison.rows, tuple(outputs), comparison.differences())


def _in_si(recipe: Recipe) -> Recipe:
    """Return the recipe with outputs as a chip has them."""
    chosen = recipe.output
    angles = {"roll", "pitch", "yaw"} & set(chosen.columns)
    if recipe.filter.kind == "attitude" and angles:
        raise UsageError(
            f'{recipe.source}: [output] "{min(angles)}" is computed in float64, for people: compare the quaternion'
        )
    units = (unit._replace(factor=1.0) for unit in (chosen.unit, chosen.gravity_unit))
    unit, gravity_unit = units
    return replace(recipe, output=replace(chosen, unit=unit, gravity_unit=gravity_unit, keep=()))


def _in_single(log: pa.Schema, recipe: Recipe) -> pa.Schema:
    """Return what the filter sees of a trace: the inputs in float32, and the time as it is."""
    fields = [pa.field(name, pa.float32()) for name in recipe.signal_columns]
    time = recipe.clock.column
    if time is not None:
        fields.append(log.field(time))
    return pa.schema(fields)


def _filtered(pipeline: Pipeline, batch: pa.RecordBatch, inputs: tuple[str, ...]) -> pa.RecordBatch:
    """Run the filter over a batch, in float32."""
    first_row = pipeline.rows + 1
    for name in inputs:
        values = pa.array(_single(batch.column(name), name, first_row))
        place = batch.schema.get_field_index(name)
        batch = batch.set_column(place, pa.field(name, pa.float32()), values)
    return pipeline.process(batch)


class _Comparison:
    """What differs so far, column by column."""

    def __init__(self, outputs: list[str]) -> None:
        self.rows = 0
        self._first: dict[str, Difference] = {}
        self._outputs = outputs

    def add(
        self,
        filtered: pa.RecordBatch,
        batch: pa.RecordBatch,
        columns: Mapping[str, str],
        seconds: npt.NDArray[np.float64] | None,
    ) -> None:
        """Compare the outputs of a batch."""
        for name in self._outputs:
            expected = filtered.column(name).to_numpy(zero_copy_only=False)
            found = _single(batch.column(columns[name]), columns[name], self.rows + 1)
            if expected.dtype == np.uint8:
                same = expected == found
                found = found.astype(np.int64) if np.isfinite(found).all() else found
            else:
                same = (expected.view(np.uint32) == found.view(np.uint32)) | (
                    np.isnan(expected) & np.isnan(found)
                )
            for row in np.flatnonzero(~same)[:1]:
                when = None if seconds is None else float(seconds[row])
                self._note(
                    Difference(
                        self.rows + int(row) + 1, when, name, expected[row], found[row], int((~same).sum())
                    )
                )
        self.rows += batch.num_rows

    def _note(self, difference: Difference) -> None:
        """Keep the first of a column, and count the rows."""
        before = self._first.get(difference.column)
        if before is not None:
            difference = replace(before, rows=before.rows + difference.rows)
        self._first[difference.column] = difference

    def differences(self) -> tuple[Difference, ...]:
        """Return the first of each column, the earliest of all first."""
        return tuple(sorted(self._first.values(), key=lambda difference: difference.row))


def _single(values: Any, name: str, first_row: int) -> npt.NDArray[np.float32]:  # noqa: ANN401 - an array of any type
    """Read a column as float32: numbers, or texts of decimals and of bits; an empty field is NaN.

    Raises
    ------
    LogError
        A field is none of these.
    """
    if pa.types.is_integer(values.type) or pa.types.is_floating(values.type):
        return np.asarray(values.to_numpy(zero_copy_only=False)).astype(np.float32)
    if not (pa.types.is_string(values.type) or pa.types.is_null(values.type)):
        raise LogError(f'column "{name}" holds {values.type}, not numbers')
    return np.fromiter(_read(values.to_pylist(), name, first_row), np.float32, len(values))


def _read(texts: list[str | None], name: str, first_row: int) -> Iterator[np.float32]:
    for row, text in enumerate(texts, first_row):
        text = (text or "nan").strip()  # noqa: PLW2901
        try:
            if text[:2].lower() == "0x":
                yield np.array([int(text, 16)], np.uint32).view(np.float32)[0]
            else:
                yield np.float32(text)
        except (ValueError, OverflowError):
            raise LogError(
                f'row {row}: column "{name}" holds "{text}", neither a number nor the bits of one'
            ) from None


def _shown(value: np.generic) -> str:
    """Write a number with its bits, or a set of flags."""
    if isinstance(value, np.float32):
        return f"{value} (0x{int(value.view(np.uint32)):08x})"
    return str(value)
