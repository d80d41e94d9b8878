"""What a check found: findings, each with its evidence and the line of a recipe that would mend it."""

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

__all__ = ["Finding", "Level", "Report"]

Level = Literal["wrong", "unknown", "note"]
"""What a finding means: a filter would be wrong; it cannot be told; worth knowing."""

MARKS: dict[Level, str] = {"wrong": "WRONG", "unknown": "cannot be told", "note": "ok"}


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes
    ----------
    topic
        What it is about, as ``"gyro unit"``.
    level
        ``"wrong"``: a filter would be wrong; ``"unknown"``: the log does not tell; ``"note"``: worth knowing.
    what
        One sentence.
    evidence
        The numbers behind it, and how sure they make it.
    fix
        The line or lines of a recipe that would mend it; empty where there are none.
    """

    topic: str
    level: Level
    what: str
    evidence: str = ""
    fix: str = ""

    def __str__(self) -> str:
        lines = [f"{MARKS[self.level]}: {self.topic}: {self.what}"]
        if self.evidence:
            lines.append(f"    because {self.evidence}")
        lines += [f"    fix: {line}" for line in self.fix.splitlines()]
        return "\n".join(lines)


@dataclass(frozen=True)
class Report:
    """All that was found in one log.

    Attributes
    ----------
    log
        Its name.
    rows
        How many samples it has.
    findings
        What was found: first what is wrong, then what cannot be told, then the rest.
    recipe
        The text of a recipe that fits what was found; None where the log lacks what a recipe needs, or where the caller's recipe is
        of a kind for which none is proposed.
    """

    log: str
    rows: int
    findings: tuple[Finding, ...] = field(default=())
    recipe: str | None = None

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """The findings that would make a filter wrong."""
        return tuple(finding for finding in self.findings if finding.level == "wrong")

    def about(self, topic: str) -> tuple[Finding, ...]:
        """Return the findings about one topic."""
        return tuple(finding for finding in self.findings if finding.topic == topic)

    def as_json(self) -> dict[str, Any]:
        """Return what ``compfilt check --json`` prints."""
        return {
            "log": self.log,
            "rows": self.rows,
            "clean": not self.wrong,
            "findings": [asdict(finding) for finding in self.findings],
            "recipe": self.recipe,
        }

    def __str__(self) -> str:
        many = len(self.wrong)
        verdict = f"{many} thing{'s' if many != 1 else ''} wrong" if many else "nothing wrong"
        samples = f"{self.rows} samples" if self.rows else "no samples were read"
        lines = [f"{self.log}: {samples}, {verdict}", *map(str, self.findings)]
        if self.recipe is not None:
            lines += ["", "A recipe that fits:", "", self.recipe]
        return "\n".join(lines)
