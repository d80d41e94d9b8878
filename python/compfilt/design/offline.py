"""A log without truth: the offline estimate stands in for it. Needs the extra ``logs`` as well."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

import compfilt
from compfilt._core import LinearFilter
from compfilt.design.log_recording import Array, LogRecording, numbers, read_log
from compfilt.design.recording import squared_angle
from compfilt.logs.clock import Timeline
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.kinds.attitude import Attitude
from compfilt.logs.kinds.tilt import Tilt, angle_names
from compfilt.logs.recipe import Recipe

__all__ = ["UpRecording", "read_offline"]

UP = ("up_x", "up_y", "up_z")


@dataclass(frozen=True, kw_only=True)
class UpRecording(LogRecording):
    """A log through a recipe of the kind ``attitude``, judged by the vertical: it has no angles that are lost on the way up.

    Attributes
    ----------
    up : ndarray, shape (n, 3)
        The true one in body axes, a unit vector. NaN: not known.
    """

    up: Array

    @property
    def _outputs(self) -> tuple[str, ...]:
        return UP

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared angle between estimated and true up at every row, (n,), in the output's unit."""
        _, result = self._run(design)
        estimate = np.column_stack([numbers(result, column) for column in UP])
        return squared_angle(estimate, self.up) / self.recipe.output.unit.factor**2


def read_offline(path: str | Path, recipe: Recipe) -> LogRecording:
    """Read a log and put the offline estimate in the place of the truth.

    Raises
    ------
    LogError
        The log cannot be read or smoothed; the message names it.
    UsageError
        The recipe's filter has no gyro and accelerometer of three axes.
    """
    filter_ = recipe.filter
    if not isinstance(filter_, (Tilt, Attitude)):
        raise UsageError(
            f'{recipe.source}: without truth [filter] kind must be "tilt" or "attitude", not "{filter_.kind}"'
        )
    recording = read_log(path, recipe, {})
    try:
        up = _smooth(recording.table, recipe, filter_)
    except (LogError, ValueError) as error:
        raise LogError(f"{path}: {error}") from None
    if isinstance(filter_, Attitude):
        return UpRecording(recipe, recording.table, {}, recording.name, recording.text, up=up)
    return _with_angles(recording, up, filter_.structure["axes"])


def _smooth(table: pa.Table, recipe: Recipe, filter_: Tilt | Attitude) -> Array:
    table, clock = table.combine_chunks(), recipe.clock
    batch = pa.RecordBatch.from_arrays(
        [column.combine_chunks() for column in table.columns], schema=table.schema
    )
    if clock.column is None:
        times: dict[str, Any] = {"fs": clock.rate}
    else:
        times = {"t": Timeline(clock.column, clock.unit, recipe.policy).take(batch)}
    gyro, acc = (signal.take(batch, np.float64) for signal in (filter_.gyro, filter_.accelerometer))
    return np.asarray(compfilt.GravityFilter().smooth(gyro, acc, **times).up, np.float64)


def _with_angles(recording: LogRecording, up: Array, axes: Any) -> LogRecording:  # noqa: ANN401 - one of three texts
    """Add the two angles of the vertical to a recording, as its truth."""
    angles = compfilt.tilt(up, axes=axes) / recording.recipe.output.unit.factor
    table, truth = recording.table, {}
    for angle, name in zip(angles.T, angle_names(axes), strict=True):
        truth[name] = f"{name} by the offline estimate"
        table = table.append_column(truth[name], pa.array(np.ascontiguousarray(angle)))
    return replace(recording, table=table, truth=truth)
