"""Where a log can be cut: rows after which everything about a filter is known but its levels."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from compfilt.logs.recipe import Recipe

__all__ = ["Seam", "find_seam"]


class Seam(NamedTuple):
    """A place between two rows of a log.

    Right after a measurement no time is left that it has not corrected for. If it is also known which derivative is held and
    since when, the filter's levels are all that depends on the rows further back.

    Attributes
    ----------
    row
        How many rows lie before it.
    lead
        The rows just before it: from the last derivative to the measurement. ``None`` at the log's beginning, where the
        levels are known as well.
    """

    row: int
    lead: pa.RecordBatch | None


def find_seam(recipe: Recipe, batches: Iterable[pa.RecordBatch], row: int) -> Seam | None:
    """Find the first seam in a log's rows; `row` is how many lie before the first batch.

    A derivative and a measurement that lie in different batches are passed by, so that a lead is never long.
    """
    for batch in batches:
        place = _place(recipe, batch)
        if place is not None:
            first, last = place
            # A copy: a slice would take the whole batch along to another process.
            return Seam(row + last + 1, batch.take(np.arange(first, last + 1)))
        row += batch.num_rows
    return None


def _place(recipe: Recipe, batch: pa.RecordBatch) -> tuple[int, int] | None:
    """Find the first measurement at or after a derivative, and the last derivative up to it."""
    measurement, derivative = (
        np.flatnonzero(np.isfinite(signal.take(batch, np.float64))) for signal in recipe.filter.signals
    )
    if not derivative.size:
        return None
    after = measurement[measurement >= derivative[0]]
    if not after.size:
        return None
    last = int(after[0])
    return int(derivative[derivative <= last][-1]), last
