"""Findings from rest: gravity's length and direction, the gyro's bias, the accelerometer's offset."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from compfilt.logs.check.claims import Triad
from compfilt.logs.check.lines import IN_FILTER, mended
from compfilt.logs.check.report import Finding
from compfilt.logs.check.rests import Rest
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey
from compfilt.logs.units import ACCELERATION, STANDARD_GRAVITY, Unit, parse_unit

__all__ = ["Length", "judge_bias", "judge_length", "judge_offset", "judge_rests", "length_of_gravity"]

NEAR = 0.12
"""How far gravity's length may be off, as a part: cheap accelerometers are, and so is the mean of a moving one."""
BIAS_LIMIT = np.radians(2.0)
"""rad/s: what the gravity filters learn at rest; see `bias_limit`."""


class Length(NamedTuple):
    """Gravity's length in the claimed unit, and what makes m/s² of it: a unit where one fits, and a further factor."""

    value: float
    unit: Unit | None
    factor: float
    at_rest: bool


def length_of_gravity(survey: Survey, rests: list[Rest]) -> Length:
    """Measure gravity with the accelerometer as it is claimed."""
    force = survey.columns_of("accelerometer")
    if rests:
        value = float(np.median([np.linalg.norm(rest.mean[force]) for rest in rests]))
    else:
        # Over seconds a body's own accelerations average out, as far as it does not turn.
        means = survey.segments.values[..., force]
        value = float(np.median(np.linalg.norm(means, axis=-1))) if means.size else np.nan
    claimed = survey.claims.triads["accelerometer"].unit
    raw = value / (claimed.factor if claimed is not None else 1.0)
    units = [claimed] if claimed is not None else []
    units += [parse_unit(name, ACCELERATION) for name in ("m/s^2", "g", "mg", "cm/s^2", "ft/s^2")]
    off = [abs(np.log(max(raw, 1e-30) * unit.factor / STANDARD_GRAVITY)) for unit in units]
    # The claimed one is believed if it is near; else the nearest of all.
    best = 0 if claimed is not None and off[0] < NEAR else int(np.argmin(off))
    unit = units[best] if off[best] < NEAR else None
    factor = (
        (STANDARD_GRAVITY / value if value > 0.0 else np.nan)
        if unit is None
        else unit.factor / (claimed.factor if claimed is not None else 1.0)
    )
    return Length(value, unit, factor, bool(rests))


def judge_length(length: Length, triad: Triad) -> Iterator[Finding]:
    """Yield what gravity's length says about the accelerometer's unit."""
    where = "at rest" if length.at_rest else "on average, without any rest"
    if not np.isfinite(length.value):
        yield Finding("accelerometer unit", "unknown", "the log is too short")
        return
    if length.value == 0.0:
        yield Finding(
            "accelerometer unit", "wrong", "the accelerometer reads 0", f"gravity is 0 long {where}"
        )
        return
    if length.unit is None:
        claimed = triad.unit.name if triad.unit is not None else "m/s^2"
        unknown_scale = f"accelerometer = {mended(triad, np.eye(3), claimed, length.factor)}"
        evidence = f"gravity is {length.value:.5g} long {where} in the claimed unit, which is 1 g of no unit: raw counts?"
        yield Finding("accelerometer unit", "wrong", "no unit fits gravity's length", evidence, unknown_scale)
        return
    measured = length.value * length.factor
    fix = f"accelerometer = {mended(triad, np.eye(3), length.unit.name)}"
    if triad.unit is not None and length.unit != triad.unit:
        yield Finding(
            "accelerometer unit",
            "wrong",
            f"the accelerometer is in {length.unit.name}, not in {triad.unit.name}",
            f"gravity is {length.value:.5g} m/s^2 long {where} if it were, and {measured:.5g} m/s^2 in {length.unit.name}",
            fix,
        )
    else:
        evidence = f"gravity is {measured:.5g} m/s^2 long {where}"
        yield Finding("accelerometer unit", "note", length.unit.name, evidence, "" if triad.unit else fix)


def judge_rests(rests: list[Rest]) -> Iterator[Finding]:
    """Yield how much rest there is."""
    seconds = sum(rest.seconds for rest in rests)
    if rests:
        yield Finding("rest", "note", f"{len(rests)} rest{'s' if len(rests) > 1 else ''}, {seconds} s in all")
    else:
        yield Finding(
            "rest",
            "unknown",
            "no rest was found",
            "no 2 s are quiet in both sensors; bias and offset stay unknown",
        )


def judge_bias(survey: Survey, rests: list[Rest], scale: float, *, trusted: bool) -> Iterator[Finding]:
    """Yield the gyro's bias; `scale` makes rad/s of the claimed unit, where that is `trusted`: known from the log's motion."""
    if not rests:
        return
    rates, claimed = survey.columns_of("gyro"), survey.claims.triads["gyro"].unit
    means = scale * np.array([rest.mean[rates] for rest in rests])
    weights = np.array([float(rest.seconds) for rest in rests])
    bias = np.average(means, axis=0, weights=weights)
    drift = float(np.ptp(means, axis=0).max())
    largest = float(np.abs(bias).max())
    shown = ", ".join(f"{value:.3g}" for value in np.degrees(bias))
    over = f"mean over {len(rests)} rests of {int(weights.sum())} s; it differs by"
    evidence = f"{over} {np.degrees(drift):.2g} deg/s between them"
    if not trusted and claimed is None:
        yield Finding(
            "gyro bias",
            "unknown",
            f"the gyro reads ({', '.join(f'{value:.3g}' for value in bias)}) at rest, and its unit cannot be told",
            f"{over} {drift:.2g} between them",
        )
    elif largest > BIAS_LIMIT:
        if not trusted and claimed is not None:
            # Whichever it is, a filter with this claim is wrong.
            evidence += f"; the log does not tell whether the gyro is in {claimed.name}: if not, that is wrong instead"
        yield Finding(
            "gyro bias",
            "wrong",
            f"({shown}) deg/s at rest: more than the filters learn by themselves",
            evidence,
            f'bias_limit = "{max(1.5 * np.degrees(largest), 3.0):.2g} deg/s"  {IN_FILTER}',
        )
    else:
        yield Finding("gyro bias", "note", f"({shown}) deg/s at rest", evidence)


def judge_offset(survey: Survey, rests: list[Rest], factor: float) -> Iterator[Finding]:
    """Yield the accelerometer's offset, as far as the orientations at rest show it."""
    force = survey.columns_of("accelerometer")
    means = factor * np.array([rest.mean[force] for rest in rests]).reshape(-1, 3)
    spread = _turned_apart(means)
    lengths = np.linalg.norm(means, axis=1) if len(means) else np.zeros(0)
    between = f"; gravity's length is {lengths.min():.4g} to {lengths.max():.4g} m/s^2" if len(means) else ""
    if len(means) < 4 or spread < 0.3:
        yield Finding(
            "accelerometer offset",
            "unknown",
            "the rests do not show it",
            f"that takes at least four in quite different orientations, and there {'is' if len(means) == 1 else 'are'} {len(means)}"
            f" of spread {spread:.2g} (0.3 needed){between}",
        )
        return
    # |f - o|^2 = c is linear in o and c - |o|^2.
    rows = np.column_stack((2.0 * means, np.ones(len(means))))
    solved = np.linalg.lstsq(rows, np.sum(means**2, axis=1), rcond=None)[0]
    offset = solved[:3]
    left = np.linalg.norm(means - offset, axis=1)
    size = float(np.linalg.norm(offset))
    yield Finding(
        "accelerometer offset",
        "wrong" if size > 0.1 * STANDARD_GRAVITY else "note",
        f"({', '.join(f'{value:.2g}' for value in offset)}) m/s^2",
        f"{len(means)} rests: gravity's length varies by {np.ptp(lengths):.2g} m/s^2, without the offset by {np.ptp(left):.2g}",
    )


def _turned_apart(means: Array) -> float:
    """Return how widely directions are spread: the smallest standard deviation over all axes, 0.58 at best."""
    lengths = np.linalg.norm(means, axis=1, keepdims=True)
    if len(means) < 2 or not np.all(lengths > 0.0):
        return 0.0
    directions = means / lengths
    return float(np.sqrt(np.linalg.eigvalsh(np.cov(directions.T, bias=True))[0].clip(0.0)))
