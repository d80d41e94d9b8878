"""Gains from logs with truth in them, or without, through a recipe. Needs the extra ``logs`` as well."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from compfilt.design.log_recording import LogRecording, read_log
from compfilt.design.offline import read_offline
from compfilt.design.recording import from_recordings
from compfilt.design.result import Designed
from compfilt.logs.errors import RecipeError, UsageError
from compfilt.logs.recipe import Recipe

__all__ = ["LogRecording", "from_logs"]

_INSTEAD = {
    "attitude": ": its one number is tau, and for the noise at rest that is the tau of compfilt design --noise FILE --kind "
    'first_order; method = "mahony" has gains'
}
"""What to do about a filter without a design."""

_NO_TRUTH = (
    "without a truth the errors are those against the offline estimate, which follows accelerations that last for many "
    "seconds as well: the gains are too fast for them"
)


def from_logs(
    logs: Sequence[str | Path],
    recipe: Recipe,
    truth: Mapping[str, str] | None = None,
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
        How they are filtered: one with a design, or of Mahony's filter. Its gains are replaced by those that are tried.
    truth
        For each output that counts, the column with its true values, in the output's unit. Without it the offline
        estimate, `GravityFilter.smooth`, stands in for the truth: of both angles of a tilt recipe, of the vertical of Mahony's filter.
    kind, order, split, derivative_order
        As in `compfilt.design.from_spectra`; by default those of the recipe.
    folds
        As in `compfilt.design.from_recordings`.

    Raises
    ------
    LogError
        A log cannot be read or filtered; the message names it.
    UsageError
        The recipe's filter has no linear design; or there is no truth and it is neither a tilt nor an attitude filter.
    ValueError
        Kind, order and split do not go together, or a fold has no truth.
    """
    filter_ = recipe.filter
    try:
        named = filter_.linear
    except ValueError as error:
        raise RecipeError(f"{recipe.source}: [filter] {error}") from None
    if named is None or named.kind == "rate":
        raise UsageError(
            f"{recipe.source}: a filter of {filter_.title} has no design to choose gains for{_INSTEAD.get(filter_.kind, '')}"
        )
    if kind is None:
        kind = named.kind
        if kind in {"butterworth", "chain"}:
            order, split = order or named.build().order, split or named.build().split
        if kind == "chain":
            derivative_order = derivative_order or named.derivative_order
    recordings = [
        read_offline(log, recipe) if truth is None else read_log(log, recipe, truth) for log in logs
    ]
    chosen = from_recordings(
        recordings, kind=kind, order=order, split=split, derivative_order=derivative_order, folds=folds
    )
    return chosen if truth is not None else chosen.with_warning(_NO_TRUTH)
