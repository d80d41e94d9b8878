"""Findings about single columns: missing numbers, stuck, cut off."""

from collections.abc import Iterator

from compfilt.logs.check.lines import IN_FILTER
from compfilt.logs.check.report import Finding, Level
from compfilt.logs.check.survey import Survey
from compfilt.logs.errors import place_of, quoted

__all__ = ["judge_channels"]

STUCK = 0.25
"""Seconds for which one column may hold one value while the others change."""
LIVELY = 0.5
"""The part of the rows in which a column changes, from which on it counts as one that should."""


def judge_channels(survey: Survey) -> Iterator[Finding]:
    """Yield what the columns say one by one."""
    for place, name in enumerate(survey.claims.columns):
        yield from _missing(survey, place, name)
        yield from _stuck(survey, place, name)
    for sensor in ("gyro", "accelerometer"):
        if sensor in survey.claims.triads:
            yield from _clipped(survey, sensor)


def _missing(survey: Survey, place: int, name: str) -> Iterator[Finding]:
    count = int(survey.channels.missing[place])
    if count:
        field = survey.claims.triads.get("magnetometer")
        part = 100.0 * count / survey.rows
        level: Level = "wrong" if part > 50.0 and (field is None or name not in field.columns) else "note"
        yield Finding(
            "missing",
            level,
            f"column {quoted(name)} has no number in {count} rows, {part:.3g} %",
            "",
            'missing = "coast"',
        )


def _stuck(survey: Survey, place: int, name: str) -> Iterator[Finding]:
    channels = survey.channels
    changes, longest = int(channels.changes[place]), int(channels.longest[place])
    if channels.missing[place] >= survey.rows:
        return
    if changes <= 1 and survey.rows > 1:
        yield Finding(
            "stuck",
            "wrong",
            f"column {quoted(name)} is {channels.stuck_value[place]:g} in every row",
            "a sensor's noise never rests",
        )
        return
    others = changes / max(survey.rows - longest, 1)
    seconds = longest * survey.period
    # With what it does elsewhere, how likely is it that it holds so long by chance?
    if seconds >= STUCK and longest >= 20 and others > LIVELY and not _at_end(survey, place):
        yield Finding(
            "stuck",
            "wrong",
            f"column {quoted(name)} holds {channels.stuck_value[place]:g} for {seconds:.3g} s while the others change",
            f"until {place_of(int(channels.longest_end[place]), text=survey.text)}; elsewhere it changes in {100.0 * others:.0f} % of the rows",
        )


def _at_end(survey: Survey, place: int) -> bool:
    """Whether the value that it holds is an end of its range: then it is cut off, not stuck."""
    held = survey.channels.stuck_value[place]
    return any(limit.value == held and limit.places > 1 for limit in survey.channels.limits(place))


def _clipped(survey: Survey, sensor: str) -> Iterator[Finding]:
    triad = survey.claims.triads[sensor]
    start = survey.columns_of(sensor).start
    found = [
        (name, limit)
        for offset, name in enumerate(triad.columns)
        for limit in survey.channels.limits(start + offset)
    ]
    if not found:
        return
    samples = sum(limit.samples for _, limit in found)
    where = ", ".join(
        f"{quoted(name)} at {limit.value:.6g} in {limit.samples} rows and {limit.places} place{'s' if limit.places > 1 else ''}"
        for name, limit in found
    )
    lowest = min(abs(limit.value * triad.factors[triad.columns.index(name)]) for name, limit in found)
    yield Finding(
        "clipping",
        "wrong",
        f"the {sensor} is cut off at the end of its range in {samples}{' or more' if samples >= 512 else ''} samples",
        f"{where}: its very largest value comes oftener than those just below, which no motion does",
        f'acc_range = "{0.999 * lowest:.4g} m/s^2"  {IN_FILTER}: such samples count as missing'
        if sensor == "accelerometer" and triad.unit is not None
        else "",
    )
