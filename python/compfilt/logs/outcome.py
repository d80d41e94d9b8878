"""What is to be done with one log, and how that ended. All of it pickles."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["Job", "Outcome", "Summary"]


class Job(NamedTuple):
    """One log and where its result goes."""

    log: Path
    out: Path


@dataclass(frozen=True)
class Summary:
    """What happened to one log.

    Attributes
    ----------
    rows
        How many samples there were.
    gaps
        How many gaps there were in time.
    counts
        How many samples each of the filter's flags was set on.
    faults
        How many rows had each fault, by its name.
    truncated
        Why the log could not be read to its end, if so.
    note
        What else is worth saying, such as where an earlier run was taken up.
    report
        The report on the log's quality.

    Examples
    --------
    >>> str(Summary(1000, 1, {"missing": 3, "held": 0}))
    '1000 samples, 1 gap, 3 missing'
    """

    rows: int
    gaps: int
    counts: dict[str, int]
    faults: dict[str, int] = field(default_factory=dict)
    truncated: str = ""
    note: str = ""
    report: dict[str, Any] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        parts = [f"{self.rows} samples"]
        if self.gaps:
            parts.append(f"{self.gaps} gap{'s' if self.gaps > 1 else ''}")
        # What is missing is among the filter's counts.
        faults = {name: count for name, count in self.faults.items() if name not in ("missing", "gap")}
        parts += [
            f"{count} {name.replace('_', ' ')}" for name, count in (self.counts | faults).items() if count
        ]
        return ", ".join(parts + ([self.note] if self.note else []))


@dataclass(frozen=True)
class Outcome:
    """How one job ended.

    Attributes
    ----------
    job
        The log and its result.
    status
        "done"; "truncated", if the log could be read to some row only; "already done", if an earlier run did it; "failed".
    message
        One line for a person, without the log's name.
    rows
        How many samples there were, as far as that is known.
    report
        The report on the log's quality, where there is a result.
    """

    job: Job
    status: str
    message: str
    rows: int = 0
    report: dict[str, Any] | None = None

    @property
    def failed(self) -> bool:
        """Whether something was wrong with the log."""
        return self.status in ("failed", "truncated")

    @property
    def warnings(self) -> list[str]:
        """What the recipe seems to say wrongly about the log."""
        return [] if self.report is None else list(self.report.get("warnings", ()))

    def __str__(self) -> str:
        return f"{self.job.log}: {self.message}"
