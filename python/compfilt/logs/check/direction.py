"""Where gravity points: with the axes that a recipe names, a level accelerometer at rest reads +g along up."""

from collections.abc import Iterator

import numpy as np

from compfilt.logs.check.judge_gyro import Comparison
from compfilt.logs.check.lines import mended
from compfilt.logs.check.report import Finding
from compfilt.logs.check.rests import Rest
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey

__all__ = ["gravity_axes", "judge_direction"]

CLEAR = 0.7
"""The part of gravity that must lie along z for its sign to count: less than 45 degrees of tilt."""
OTHER = {
    "flu": '"frd"  # instead, if z points down, as in north-east-down',
    "frd": '"flu"  # instead, if z points up, as in east-north-up',
}
"""What the axes may be instead."""


def usual_direction(survey: Survey, rests: list[Rest], change: Array) -> Array:
    """Return the mean direction of the specific force at rest, or over the log without any, in the axes as mended."""
    force = survey.columns_of("accelerometer")
    if rests:
        mean = sum(rest.seconds * rest.mean[force] for rest in rests)
    else:
        means = survey.segments.values[..., force].reshape(-1, 3)
        mean = means.mean(axis=0) if len(means) else np.zeros(3)
    mean = change @ mean
    return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-30))


def gravity_axes(direction: Array) -> str:
    """Guess the axes where nobody names them."""
    return "frd" if direction[2] < -CLEAR else "flu"


def judge_direction(survey: Survey, rests: list[Rest], seen: Comparison) -> Iterator[Finding]:
    """Yield whether gravity points where the axes say."""
    claims = survey.claims
    direction = usual_direction(survey, rests, seen.mounting.accelerometer)
    shown = ", ".join(f"{value:.2f}" for value in direction)
    when = "at rest" if rests else "on average"
    evidence = f"{when} the accelerometer's direction is ({shown})"
    axes = claims.axes if claims.axes is not None else gravity_axes(direction)
    up = direction[2] if axes == "flu" else -direction[2]
    if not rests and not survey.segments.values.size:
        yield Finding("direction of gravity", "unknown", "the log is too short")
        return
    # Written so that a direction of no number is not clear either.
    if not abs(up) >= CLEAR:
        yield Finding(
            "direction of gravity",
            "unknown",
            f"the body leans too much {when} to tell up from down",
            evidence,
        )
        return
    dip = _dip(survey, seen)
    if claims.axes is None:
        down = ": z points down, as in north-east-down" if axes == "frd" else ""
        what = f'axes = "{axes}", if the body stands upright{down}'
        yield Finding("direction of gravity", "note", what, evidence + dip, f'axes = "{axes}"')
    elif up > 0.0:
        yield Finding("direction of gravity", "note", f"as the axes {axes} have it", evidence + dip)
    else:
        triad = claims.triads["accelerometer"]
        unit = triad.unit.name if triad.unit is not None else "m/s^2"
        negated = mended(triad, -seen.mounting.accelerometer, unit)
        yield Finding(
            "direction of gravity",
            "wrong",
            f"gravity points the wrong way for the axes {axes}: a level body at rest reads {'+' if axes == 'flu' else '-'}g along z",
            f"{evidence}{dip}; either the log has acceleration and not specific force, all three negated, or the axes are "
            f"{'frd' if axes == 'flu' else 'flu'}, or the body was upside down: gyro and accelerometer cannot tell these apart",
            f"accelerometer = {negated}\naxes = {OTHER[axes]}",
        )


def _dip(survey: Survey, seen: Comparison) -> str:
    """Say how the magnetic field dips, which tells a negated accelerometer where the hemisphere is known."""
    found = seen.trials.get("magnetometer")
    if found is None or not found[0].sure or "magnetometer" in seen.mounting.wrong:
        return ""
    values = survey.segments.values
    force = values[..., survey.columns_of("accelerometer")] @ seen.mounting.accelerometer.T
    field = values[..., survey.columns_of("magnetometer")]
    lengths = np.linalg.norm(force, axis=-1) * np.linalg.norm(field, axis=-1)
    down = float(np.degrees(np.arcsin(-np.median((force * field).sum(axis=-1) / np.maximum(lengths, 1e-30)))))
    half = "northern" if down > 0.0 else "southern"
    return (
        f"; the magnetic field dips {down:.0f} deg below the horizontal, as in the {half} half of the world"
    )
