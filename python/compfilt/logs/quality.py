"""The report on a log's quality: what the log was like, and what was done about it. JSON, the same in every run."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from compfilt.logs.clock import Timeline
from compfilt.logs.faults import Faults, names_of
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import Recipe
from compfilt.logs.writers import complete_file

__all__ = ["make_report", "read_report", "report_path", "table", "write_report"]

Report = dict[str, Any]


def report_path(out: Path) -> Path:
    """Return where the report on a result stands: beside it."""
    return out.with_name(f"{out.name}.quality.json")


def make_report(
    log: Path, out: Path, identity: Mapping[str, Any], pipeline: Pipeline, truncated: str = ""
) -> Report:
    """Say what the log was like.

    Nothing in it depends on when, where or how fast the log was filtered, or on how it was cut into batches.

    Parameters
    ----------
    log, out
        The log and its result, of which the names are told.
    identity
        What the result was made from.
    pipeline
        After the last row.
    truncated
        Why the log could not be read to its end, if so.

    Returns
    -------
    dict
        ``log``, ``result``, ``made_from`` (version of the program, hash of the recipe, size and hash of the log's beginning),
        ``complete`` and ``truncated``, ``rows``, ``time``, ``units`` (of the result's columns), ``signals``, ``flags`` (what the
        filter did), ``faults`` (what was wrong with the rows), ``warnings`` (sentences on what the recipe seems to say wrongly),
        ``policy``.
    """
    recipe = pipeline.recipe
    return {
        "log": log.name,
        "result": out.name,
        "made_from": dict(identity),
        "complete": not truncated,
        "truncated": truncated or None,
        "rows": pipeline.rows,
        "time": _time(recipe, pipeline),
        "units": pipeline.units,
        "signals": {
            signal.name: {
                column: _channel(judge, place, column)
                for place, column in enumerate(signal.columns)
                if column is not None
            }
            for signal, judge in zip(recipe.filter.signals, pipeline.judges, strict=True)
        },
        "flags": pipeline.counts,
        "faults": dict(zip(names_of(Faults), pipeline.faults.values(), strict=True)),
        "warnings": [length.doubt for length in pipeline.lengths.values() if length.doubt],
        "policy": _policy(recipe),
    }


def _time(recipe: Recipe, pipeline: Pipeline) -> Report:
    """Tell the range of time, the rate and how even it is, and the gaps."""
    timeline = pipeline.timeline
    if timeline is None:
        rate = recipe.clock.rate
        return {"rate_hz": rate, "seconds": None if rate is None else pipeline.rows / rate}
    gaps = [gap._asdict() for gap in timeline.listed]
    return {
        "column": timeline.column,
        "origin": timeline.origin,
        "first": timeline.first,
        "last": timeline.last,
        "seconds": None
        if timeline.first is None or timeline.last is None
        else timeline.last - timeline.first,
        **_rate(timeline),
        "gaps": timeline.gaps,
        "gaps_listed": gaps,
    }


def _rate(timeline: Timeline) -> Report:
    """Tell the time steps, gaps left out: the jitter is half of what lies between the 1 % shortest and the 1 % longest."""
    steps = timeline.steps
    low, middle, high = (steps.quantile(part) for part in (0.01, 0.5, 0.99))
    report: Report = {
        "step_seconds": {"shortest": steps.shortest, "median": middle, "longest": steps.longest},
        "rate_hz": None,
        "jitter_seconds": None,
    }
    if low is not None and middle is not None and high is not None:
        rate = 1.0 / middle if middle else math.inf
        report["rate_hz"] = rate if math.isfinite(rate) else None
        report["jitter_seconds"] = 0.5 * (high - low)
    return report


def _channel(judge: Any, place: int, column: str) -> Report:  # noqa: ANN401 - a Judge
    ends = {"smallest": judge.smallest[place], "largest": judge.largest[place]}
    counts = {str(kind.name).lower(): count for kind, count in judge.counts[column].items()}
    return {**counts, **{key: None if math.isnan(end) else float(end) for key, end in ends.items()}}


def _policy(recipe: Recipe) -> Report:
    """Return the policy with its defaults, and that of each signal in full."""
    policy = recipe.policy
    signals = {signal.name: asdict(policy.of(signal.name)) for signal in recipe.filter.signals}
    return {
        "hold": policy.hold,
        "gap": None if policy.gap is None else asdict(policy.gap),
        "duplicate": policy.duplicate,
        "backwards": policy.backwards,
        "signals": signals,
    }


def write_report(report: Report, out: Path) -> None:
    """Write the report beside the result.

    Raises
    ------
    LogError
        It cannot be written.
    """
    text = json.dumps(report, indent=2, allow_nan=False, ensure_ascii=False)
    with complete_file(report_path(out)) as file:
        # What a file's name has that is no text becomes an escape of JSON.
        file.write(text.encode("utf-8", "backslashreplace") + b"\n")


def read_report(out: Path) -> Report | None:
    """Read the report on a result, if there is one that can be read."""
    try:
        report = json.loads(report_path(out).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return report if isinstance(report, dict) else None


def table(reports: Sequence[Report]) -> str:
    """Put the main figures of several reports side by side, one line each.

    Samples that are missing or infinite, stuck or clipped are counted channel by channel.
    """
    heads = (
        "log",
        "rows",
        "rate Hz",
        "jitter ms",
        "gaps",
        "missing",
        "stuck",
        "clipped",
        "odd times",
        "complete",
    )
    lines = [heads, *(_line(report) for report in reports)]
    widths = [max(len(line[place]) for line in lines) for place in range(len(heads))]
    return "\n".join(
        "  ".join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])]).rstrip()
        for line in lines
    )


def _line(report: Report) -> tuple[str, ...]:
    clock, faults = report["time"], report["faults"]
    channels = [channel for signal in report["signals"].values() for channel in signal.values()]

    def total(*kinds: str) -> str:
        return str(sum(channel[kind] for channel in channels for kind in kinds))

    jitter = clock.get("jitter_seconds")
    return (
        report["log"],
        str(report["rows"]),
        "-" if clock["rate_hz"] is None else f"{clock['rate_hz']:.6g}",
        "-" if jitter is None else f"{1e3 * jitter:.3g}",
        str(clock.get("gaps", 0)),
        total("missing", "infinite"),
        total("stuck"),
        total("clipped"),
        str(faults["duplicate"] + faults["backwards"]),
        "yes" if report["complete"] else "no",
    )
