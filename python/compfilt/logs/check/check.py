"""The whole check of one log."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from compfilt.logs.check.claims import Claims, by_names, by_recipe
from compfilt.logs.check.delay import judge_delay
from compfilt.logs.check.direction import judge_direction, usual_direction
from compfilt.logs.check.gravity import judge_bias, judge_length, judge_offset, judge_rests, length_of_gravity
from compfilt.logs.check.judge_channels import judge_channels
from compfilt.logs.check.judge_gyro import compare, judge_gyro
from compfilt.logs.check.judge_time import judge_time
from compfilt.logs.check.layout import Layout, find_layout
from compfilt.logs.check.propose import propose
from compfilt.logs.check.report import Finding, Report
from compfilt.logs.check.rests import find_rests
from compfilt.logs.check.roles import by_behaviour
from compfilt.logs.check.source import number_columns
from compfilt.logs.check.survey import Survey, survey
from compfilt.logs.errors import quoted
from compfilt.logs.readers import read_schema
from compfilt.logs.recipe import Recipe

__all__ = ["check_log"]

ORDER = ("wrong", "unknown", "note")
SHOWN = 20
"""Names of columns that are listed."""
UNITS = {"gyro": "deg/s", "accelerometer": "g"}
"""What is there in a recipe that is yet to be written."""


def check_log(path: str | Path, recipe: Recipe | None = None) -> Report:
    """Say what a log seems to be, and what in it, or in its recipe, would make a filter wrong.

    Parameters
    ----------
    path
        A log in any format that recipes can read.
    recipe
        What is claimed about it. Without one the columns are found by their names or by what they do, units that the file or the
        names give are taken as claims, and the others are found; then only damage and what contradicts a name counts as wrong.

    Returns
    -------
    Report
        The findings, and a recipe that fits them.

    Raises
    ------
    LogError
        The log cannot be read, or lacks a column of the recipe.

    Notes
    -----
    Time, missing and stuck values, and clipping are looked at for every recipe; units, axes, bias and delay where the recipe has one
    ``gyro`` and one ``accelerometer``. A claim counts as wrong only where the log rules it out by 3.5 standard errors.

    Examples
    --------
    >>> import tempfile
    >>> from compfilt import simulate
    >>> log = simulate.child_seat(duration=60.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     simulate.write(log, f"{folder}/seat.parquet")
    ...     report = check_log(f"{folder}/seat.parquet")
    >>> report.wrong, report.about("accelerometer unit")[0].what
    ((), 'g')
    """
    layout = find_layout(path) if recipe is None else Layout()
    if not layout.readable:
        return Report(str(path), 0, layout.findings)
    claims = by_recipe(recipe) if recipe is not None else _guess(path, layout.separator)
    seen = survey(path, claims)
    findings = [*layout.findings, *judge_time(seen), *judge_channels(seen)]
    proposal = None
    if claims.has_both:
        proposal = _motion(seen, findings)
    else:
        findings += _nothing_to_compare(path, claims)
    if recipe is not None and recipe.filter.kind not in {"attitude", "tilt"}:
        proposal = None
    findings.sort(key=lambda finding: ORDER.index(finding.level))
    return Report(str(path), seen.rows, tuple(findings), proposal if recipe is None else None)


def _guess(path: str | Path, separator: str | None) -> Claims:
    columns = number_columns(path, separator)
    named = replace(by_names(columns), separator=separator)
    return named if named.has_both and named.time is not None else by_behaviour(path, columns, named)


def _motion(seen: Survey, found: list[Finding]) -> str:
    """Add what gyro and accelerometer say together to what was found; return a recipe that fits all of it."""
    rests = find_rests(seen.segments, seen.columns_of("gyro"), seen.columns_of("accelerometer"))
    length = length_of_gravity(seen, rests)
    compared = compare(seen, rests)
    scale = 1.0 if compared.scale.claimed else compared.scale.factor
    factor = length.factor if np.isfinite(length.factor) else 1.0

    def findings() -> Iterator[Finding]:
        yield from judge_length(length, seen.claims.triads["accelerometer"])
        yield from judge_gyro(seen, compared)
        yield from judge_direction(seen, rests, compared)
        yield from judge_rests(rests)
        yield from judge_bias(seen, rests, scale, trusted=compared.trusted)
        yield from judge_offset(seen, rests, factor)
        yield from judge_delay(seen, compared, factor)

    direction = usual_direction(seen, rests, compared.mounting.accelerometer)
    found += findings()
    return propose(seen, compared, length, direction, found)


def _nothing_to_compare(path: str | Path, claims: Claims) -> Iterator[Finding]:
    """Yield why units and axes are not looked at."""
    if claims.recipe is not None:
        what = "units and axes are looked at where a recipe has one gyro and one accelerometer"
        yield Finding("axes", "unknown", what)
        return
    lacking = [sensor for sensor in UNITS if sensor not in claims.triads]
    names = read_schema(path, claims.separator).names
    shown = ", ".join(map(quoted, names[:SHOWN])) + (", ..." if len(names) > SHOWN else "")
    yield Finding(
        "axes",
        "wrong",
        f"no {' and '.join(lacking)} {'was' if len(lacking) == 1 else 'were'} found, neither by name nor by what the columns do",
        f"there are the columns {shown}: name three of them for each sensor in a recipe, and give it with --recipe",
        "\n".join(
            f'{sensor} = {{ columns = ["X", "Y", "Z"], unit = "{UNITS[sensor]}" }}  # in [log], with your names and unit'
            for sensor in lacking
        ),
    )
