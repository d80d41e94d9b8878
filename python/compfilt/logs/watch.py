"""What happens while logs are filtered, as it is told to people and to machines."""

import json
import sys
from collections.abc import Sequence
from typing import IO, Any

from tqdm import tqdm  # type: ignore[import-untyped]

from compfilt.logs.outcome import Job, Outcome
from compfilt.logs.quality import table
from compfilt.logs.readers import size_of

__all__ = ["JsonLines", "Terminal", "Watch"]


class Watch:
    """Is told what happens; this one says nothing."""

    def began(self, job: Job) -> None:
        """Take that a log is being read."""

    def advanced(self, job: Job, size: int, rows: int) -> None:
        """Take how many bytes of a log were read, and how many rows were filtered, since the last time."""

    def ended(self, outcome: Outcome) -> None:
        """Take how a job ended."""

    def close(self) -> None:
        """Take that there is no more."""


class Terminal(Watch):
    """Lines on stderr, one a log; on a terminal also bars, one for each log that is read and one for all, and a table at the end.

    Parameters
    ----------
    jobs
        All that is to be done.
    lines
        Whether to write a line for each log.
    """

    def __init__(self, jobs: Sequence[Job], *, lines: bool = True) -> None:
        self._lines = lines
        self._shown = sys.stderr.isatty()
        self._sizes = {job: size_of(job.log) if job.log.exists() else 0 for job in jobs}
        self._outcomes: list[Outcome] = []
        self._rows = 0
        self._bars: dict[Job, Any] = {}
        self._all = self._bar(sum(self._sizes.values()), "all" if len(jobs) > 1 else None, 0)

    def _bar(self, size: int, name: str | None, position: int) -> Any:  # noqa: ANN401 - tqdm has no types
        return tqdm(
            total=size,
            desc=name,
            position=position,
            unit="B",
            unit_scale=True,
            disable=not self._shown,
            leave=False,
        )

    def began(self, job: Job) -> None:
        """Show a bar for the log, where there are several."""
        if len(self._sizes) > 1:
            taken = {bar.pos for bar in self._bars.values()}
            free = next(place for place in range(1, len(taken) + 2) if -place not in taken)
            self._bars[job] = self._bar(self._sizes[job], job.log.name, free)

    def advanced(self, job: Job, size: int, rows: int) -> None:
        """Move the bars."""
        if job in self._bars:
            self._bars[job].update(size)
        self._rows += rows
        elapsed = self._all.format_dict["elapsed"]
        if elapsed:
            self._all.set_postfix_str(f"{tqdm.format_sizeof(self._rows / elapsed)} samples/s", refresh=False)
        self._all.update(size)

    def ended(self, outcome: Outcome) -> None:
        """Take the log's bar away, and write its line."""
        if outcome.job in self._bars:
            self._bars.pop(outcome.job).close()
        self._outcomes.append(outcome)
        if self._lines:
            tqdm.write(f"compfilt: {outcome}", file=sys.stderr)
        # A wrong unit spoils every number of the result: nobody asks for so little that it may be kept from them.
        for warning in outcome.warnings:
            tqdm.write(f"compfilt: {outcome.job.log}: warning: {warning}", file=sys.stderr)

    def close(self) -> None:
        """Take all bars away; on a terminal write the table, if there were several logs."""
        for bar in (*self._bars.values(), self._all):
            bar.close()
        reports = [outcome.report for outcome in self._outcomes if outcome.report is not None]
        if self._shown and self._lines and len(reports) > 1:
            tqdm.write(table(reports), file=sys.stderr)


class JsonLines(Terminal):
    """One JSON object a line and log, on stdout, in the order in which they end; no lines for people but warnings."""

    def __init__(self, jobs: Sequence[Job], *, file: IO[str] | None = None) -> None:
        super().__init__(jobs, lines=False)
        self._file = file or sys.stdout

    def ended(self, outcome: Outcome) -> None:
        """Write the log's object."""
        super().ended(outcome)
        told = {
            "log": str(outcome.job.log),
            "result": str(outcome.job.out) if outcome.report is not None else None,
            "status": outcome.status,
            "message": outcome.message,
            "rows": outcome.rows,
            "quality": outcome.report,
        }
        print(json.dumps(told), file=self._file, flush=True)
