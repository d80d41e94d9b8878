"""What to do with bad samples and odd times: the table [policy] of a recipe, for all signals and for each by itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from compfilt.logs.signals import Signal
from compfilt.logs.table import Table
from compfilt.logs.units import TIME

__all__ = ["Clipped", "Gap", "Policy", "SignalPolicy", "Stuck", "parse_policy"]

BAD = ("coast", "hold", "reset", "fail")
"""What can be done with a sample that is no measurement."""

SUSPECT = (*BAD, "keep")
"""What can be done with one that may be a measurement."""


@dataclass(frozen=True)
class Gap:
    """What to do when two samples lie further apart than `longer_than` seconds."""

    longer_than: float
    do: str


@dataclass(frozen=True)
class Stuck:
    """What to do when a channel has had the same value for longer than `longer_than` seconds."""

    longer_than: float
    do: str


@dataclass(frozen=True)
class Clipped:
    """What to do with values at the end of a sensor's range.

    Such are those at `low` or `high` or beyond, in SI; and those at the largest or smallest value so far, from the
    `samples`-th in a row on.
    """

    low: float | None
    high: float | None
    samples: int | None
    do: str


@dataclass(frozen=True)
class SignalPolicy:
    """What to do with the samples of one signal, each channel by itself."""

    missing: str = "coast"
    infinite: str = "coast"
    stuck: Stuck | None = None
    clipped: Clipped | None = None


@dataclass(frozen=True)
class Policy:
    """What to do with bad samples and odd times.

    Attributes
    ----------
    general
        What is done with the samples of a signal that has no policy of its own.
    hold
        Seconds for which the last derivative stands in for a missing one; ``None`` is the filter's default.
    gap, duplicate, backwards
        What is done with time stamps that lie far apart, that are equal, and that go back.
    signals
        The policies of single signals, by their names.
    """

    general: SignalPolicy = SignalPolicy()
    hold: float | None = None
    gap: Gap | None = None
    duplicate: str = "keep"
    backwards: str = "fail"
    signals: Mapping[str, SignalPolicy] = field(default_factory=dict)

    def of(self, signal: str) -> SignalPolicy:
        """Return the policy of a signal."""
        return self.signals.get(signal, self.general)


def parse_policy(policy: Table, signals: Sequence[Signal], *, times: bool, rate: bool, holds: bool) -> Policy:
    """Read the table, and its tables for single signals.

    Parameters
    ----------
    policy
        The table [policy].
    signals
        Those of the filter.
    times, rate
        Whether the log has a column of times, or a constant rate.
    holds
        Whether the filter holds derivatives.
    """
    has_time = times or rate
    general = _samples(policy, SignalPolicy(), None, has_time=has_time)
    own: dict[str, SignalPolicy] = {}
    for signal in signals:
        if signal.name in policy:
            table = policy.table(signal.name)
            own[signal.name] = _samples(table, general, signal, has_time=has_time)
            table.close()
    for key, why in (("gap", "gaps"), ("duplicate", "equal times"), ("backwards", "way back")):
        if key in policy and not times:
            policy.fail(f"needs [log] time: a constant rate has no {why}", key)
    return Policy(
        general,
        policy.quantity("hold", TIME) if holds and "hold" in policy else None,
        _gap(policy) if "gap" in policy else None,
        policy.choice("duplicate", SUSPECT, "keep"),
        policy.choice("backwards", BAD, "fail"),
        own,
    )


def _samples(table: Table, general: SignalPolicy, signal: Signal | None, *, has_time: bool) -> SignalPolicy:
    """Read what to do with samples; what the table does not say is as in general."""
    missing = table.choice("missing", (*BAD, "raise"), general.missing)
    # "raise" is the word of the library's streams for it.
    missing = "fail" if missing == "raise" else missing
    infinite = table.choice("infinite", BAD, missing if "missing" in table else general.infinite)
    stuck, clipped = general.stuck, general.clipped
    if "stuck" in table:
        if not has_time:
            table.fail("needs [log] time or rate", "stuck")
        stuck = _stuck(table)
    if "clipped" in table:
        clipped = _clipped(table, signal)
    return SignalPolicy(missing, infinite, stuck, clipped)


def _gap(policy: Table) -> Gap:
    table = policy.table("gap")
    return Gap(*_longer_than(table, BAD))


def _stuck(parent: Table) -> Stuck:
    return Stuck(*_longer_than(parent.table("stuck"), SUSPECT))


def _longer_than(table: Table, choices: tuple[str, ...]) -> tuple[float, str]:
    """Read a time and what to do after it."""
    longer_than, do = table.quantity("longer_than", TIME), table.choice("do", choices)
    table.close()
    if longer_than <= 0.0:
        table.fail("must be positive", "longer_than")
    return longer_than, do


def _clipped(parent: Table, signal: Signal | None) -> Clipped:
    """Read a range, as one limit of both signs or as two, a number of samples, or both."""
    table = parent.table("clipped")
    low = high = None
    if "range" in table:
        if signal is None:
            table.fail("belongs to one signal: write it below [policy.SIGNAL]", "range")
        low, high = _range(table, signal)
    samples = table.get("samples", table.as_integer) if "samples" in table else None
    if samples is not None and samples < 2:
        table.fail("must be at least 2", "samples")
    if low is None and samples is None:
        table.fail('needs range = ["-16 g", "16 g"], or samples = 3, or both')
    clipped = Clipped(low, high, samples, table.choice("do", SUSPECT, "keep"))
    table.close()
    return clipped


def _range(table: Table, signal: Signal) -> tuple[float, float]:
    dimension = signal.unit.dimension
    if not table.holds_list("range"):
        limit = table.quantity("range", dimension)
        if limit <= 0.0:
            table.fail("must be positive, or two limits", "range")
        return -limit, limit
    limits = table.quantities("range", (dimension, dimension))
    if len(limits) != 2 or limits[0] >= limits[1]:
        table.fail("must hold two limits, the lower one first", "range")
    return limits[0], limits[1]
