"""A recipe that fits what was found, to be run as it stands."""

from collections.abc import Sequence

from compfilt.logs.check.direction import gravity_axes
from compfilt.logs.check.gravity import Length
from compfilt.logs.check.judge_gyro import Comparison
from compfilt.logs.check.lines import IN_FILTER, clock, mended, toml_text
from compfilt.logs.check.report import Finding
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey

__all__ = ["propose"]


def propose(
    survey: Survey, seen: Comparison, length: Length, direction: Array, findings: Sequence[Finding]
) -> str:
    """Write the recipe: an attitude from all sensors that are there, with what the findings want of the filter."""
    claims = survey.claims
    lines = ["version = 1", "", "[log]", _clock(survey, seen)]
    if claims.separator is not None:
        lines.append(f"separator = {toml_text(claims.separator)}")
    lines.append(f"gyro = {_gyro(survey, seen)}")
    triad = claims.triads["accelerometer"]
    change = seen.mounting.accelerometer
    if length.unit is not None:
        lines.append(f"accelerometer = {mended(triad, change, length.unit.name)}")
    else:
        unit = triad.unit.name if triad.unit is not None else "m/s^2"
        lines.append(f"accelerometer = {mended(triad, change, unit, length.factor)}")
    if (
        "magnetometer" in claims.triads
        and "magnetometer" in seen.trials
        and seen.trials["magnetometer"][0].sure
    ):
        field = claims.triads["magnetometer"]
        unit = field.unit.name if field.unit is not None else "uT"
        lines.append(f"magnetometer = {mended(field, seen.mounting.magnetometer, unit)}")
    axes = claims.axes if claims.axes is not None else gravity_axes(direction)
    lines += [f'axes = "{axes}"', "", "[filter]", 'kind = "attitude"', 'method = "gravity"']
    lines += [finding.fix.split("  #")[0] for finding in findings if IN_FILTER in finding.fix]
    if survey.times is not None:
        lines += ["", "[policy]", 'gap = { longer_than = "500 ms", do = "reset" }']
        if survey.times.back.count:
            lines.append('backwards = "coast"')
    lines += [
        "",
        "[output]",
        'columns = ["roll", "pitch", "yaw", "gyro_bias", "at_rest", "flags"]',
        'unit = "deg"',
    ]
    if claims.time is not None:
        lines.append(f"keep = [{toml_text(claims.time)}]")
    return "\n".join(lines) + "\n"


def _clock(survey: Survey, seen: Comparison) -> str:
    claims = survey.claims
    if claims.time is not None and survey.time_unit is not None:
        return clock(claims.time, survey.time_unit)
    rate = 1.0 / survey.period
    if not seen.scale.claimed and seen.scale.unit is None:
        rate /= seen.scale.factor
    return f"rate = {rate:.6g}" + (
        "" if claims.rate is not None else "  # a guess, if the gyro's unit is right"
    )


def _gyro(survey: Survey, seen: Comparison) -> str:
    triad, scale = survey.claims.triads["gyro"], seen.scale
    unit = (
        scale.unit.name if scale.unit is not None else triad.unit.name if triad.unit is not None else "rad/s"
    )
    by_rate = survey.times is None
    factor = scale.factor if scale.unit is None and scale.known and not scale.claimed and not by_rate else 1.0
    return mended(triad, seen.mounting.gyro, unit, factor)
