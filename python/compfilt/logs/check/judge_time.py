"""Findings about time: unit, rate, gaps, order."""

from collections.abc import Iterator

from compfilt.logs.check.lines import clock
from compfilt.logs.check.report import Finding
from compfilt.logs.check.survey import Survey
from compfilt.logs.check.times import Times
from compfilt.logs.errors import quoted
from compfilt.logs.units import Unit

__all__ = ["judge_time"]


def judge_time(survey: Survey) -> Iterator[Finding]:
    """Yield what the time column says."""
    times, claims = survey.times, survey.claims
    if times is None:
        if claims.rate is None:
            yield Finding(
                "time",
                "wrong",
                "no column of times was found",
                "no name looks like one",
                "rate = 100.0  # (Hz) yours",
            )
        if 0 < survey.channels.repeated < 0.3 * survey.rows:
            yield Finding(
                "duplicates",
                "note",
                f"{_rows(survey.channels.repeated, 'repeats', 'repeat')} the row before in every signal",
                "with a constant rate it cannot be told whether they stand for lost samples or are too many",
            )
        return
    if not times.step:
        yield Finding("time", "wrong", f"column {quoted(claims.time or '')} never goes forward")
        return
    yield from _unit(survey, times)
    yield from _order(survey, times)
    yield from _gaps(survey, times)


def _unit(survey: Survey, times: Times) -> Iterator[Finding]:
    claims, unit = survey.claims, survey.time_unit
    if unit is None or claims.time is None:
        return
    rate = 1.0 / survey.period
    told = "" if survey.told is None else "; the log tells its unit itself"
    fix = clock(claims.time, unit)
    jitter = 100.0 * times.spread / times.step
    evidence = f"the usual step is {times.step:g}, 90 % of the steps lie within {jitter:.2g} % of it"
    if survey.told is not None and survey.told.factor != unit.factor:
        yield _not_in(survey.told, unit, times, f"{evidence}{told}, and no recipe may say another", "")
    elif claims.time_unit is not None and claims.time_unit.factor != unit.factor:
        yield _not_in(claims.time_unit, unit, times, evidence + told, fix)
    else:
        known = claims.time_unit is not None or survey.told is not None
        yield Finding(
            "rate", "note", f"{rate:.6g} Hz, time in {unit.name}", evidence + told, "" if known else fix
        )
    if jitter > 100.0:
        yield Finding(
            "jitter",
            "note",
            "the steps differ by more than the usual step",
            evidence + "; the filters take times as they come",
        )


def _not_in(said: Unit, unit: Unit, times: Times, evidence: str, fix: str) -> Finding:
    return Finding(
        "time unit",
        "wrong",
        f"the times are in {unit.name}, not in {said.name}",
        f"{evidence}: that is {1.0 / (times.step * said.factor):.3g} Hz in {said.name}, and "
        f"{1.0 / (times.step * unit.factor):.5g} Hz in {unit.name}",
        fix,
    )


def _order(survey: Survey, times: Times) -> Iterator[Finding]:
    name = quoted(survey.claims.time or "")
    if times.untimed.count:
        yield Finding(
            "time",
            "wrong",
            f"{_rows(times.untimed.count, 'has', 'have')} no time",
            times.untimed.where(text=survey.text),
        )
    if times.back.count:
        unit = survey.time_unit.name if survey.time_unit is not None else ""
        recipe = survey.claims.recipe
        known = recipe is not None and recipe.policy.backwards != "fail"
        yield Finding(
            "backwards time",
            "note" if known else "wrong",
            f"column {name} runs backwards {_times(times.back.count)}, by up to {times.back.largest:g} {unit}"
            + (", which the recipe's policy knows of" if known else ""),
            f"{times.back.where(text=survey.text)}; best sort the log or cut it there",
            ""
            if known
            else 'backwards = "coast"  # in [policy]: passes over such rows; "reset" starts anew there',
        )
    if times.repeated.count:
        yield Finding(
            "duplicates",
            "wrong",
            f"{_rows(times.repeated.count, 'repeats', 'repeat')} the row before, time and signals",
            f"{times.repeated.where(text=survey.text)}; a filter corrects once more at the same moment: leave them out",
        )
    if times.equal.count:
        yield Finding(
            "duplicates",
            "wrong",
            f"{_rows(times.equal.count, 'has', 'have')} the time of the row before but other signals",
            f"{times.equal.where(text=survey.text)}; the rotation of such a row lasts 0 s and is lost: the stamps are too coarse or come in bursts",
            f"rate = {survey.rows / max(_seconds(survey, times), 1e-9):.6g}  # in place of time, if the sensor's clock is even",
        )


def _gaps(survey: Survey, times: Times) -> Iterator[Finding]:
    gaps, factor = times.gaps, survey.time_unit.factor if survey.time_unit is not None else 1.0
    if not gaps.count:
        return
    recipe = survey.claims.recipe
    known = recipe is not None and recipe.policy.gap is not None
    seconds, lost = gaps.largest * factor, gaps.total * factor
    yield Finding(
        "gaps",
        "note" if known else "wrong",
        f"{gaps.count} gap{'s' if gaps.count > 1 else ''}, the longest {seconds:.3g} s"
        + (", which the recipe's policy knows of" if known else ""),
        f"{gaps.where(text=survey.text)}: {lost:.3g} s in all, while the usual step is {survey.period:.3g} s",
        ""
        if known
        else f'[policy] gap = {{ longer_than = "{max(0.9 * seconds, 3.0 * survey.period) if gaps.count == 1 else 10.0 * survey.period:.3g} s", do = "reset" }}',
    )


def _seconds(survey: Survey, times: Times) -> float:
    return float(times.last - times.first) * (
        survey.time_unit.factor if survey.time_unit is not None else 1.0
    )


def _rows(count: int, one: str, many: str) -> str:
    """Say how many rows do something; `one` and `many` are its verb."""
    return f"{count} row {one}" if count == 1 else f"{count} rows {many}"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
