"""The time between the gyro's samples and the accelerometer's."""

from collections.abc import Iterator

import compfilt
from compfilt.logs.check.judge_gyro import Comparison
from compfilt.logs.check.lines import IN_FILTER
from compfilt.logs.check.report import Finding
from compfilt.logs.check.survey import Survey

__all__ = ["judge_delay"]

LARGE = 0.02
"""Seconds from which on the delay harms: 1 degree at 50 degrees per second."""
SHORTEST = 60.0
"""Seconds of log that the search needs."""


def judge_delay(survey: Survey, seen: Comparison, force_factor: float) -> Iterator[Finding]:
    """Yield the delay, from the log's beginning as far as it has no gap, with everything else mended."""
    head, period = survey.segments.head, survey.period
    scale = 1.0 if seen.scale.claimed else seen.scale.factor
    if survey.times is None and seen.scale.unit is None:
        # Nothing but another rate explains the scale.
        scale, period = 1.0, scale * period
    if not seen.scale.known or len(head) * period < SHORTEST:
        why = (
            "the gyro's scale is not known"
            if not seen.scale.known
            else f"it takes {SHORTEST:g} s without a gap from the start"
        )
        yield Finding("gyro delay", "unknown", "not looked for", why)
        return
    gyro = scale * (head[:, survey.columns_of("gyro")] - seen.bias) @ seen.mounting.gyro.T
    force = force_factor * head[:, survey.columns_of("accelerometer")] @ seen.mounting.accelerometer.T
    try:
        delay = compfilt.find_gyro_delay(gyro, force, fs=1.0 / period)
    except ValueError as error:
        yield Finding("gyro delay", "unknown", "not found", str(error))
        return
    late = "accelerometer" if delay > 0.0 else "gyro"
    yield Finding(
        "gyro delay",
        "wrong" if abs(delay) > LARGE else "note",
        f"the {late} is {1000.0 * abs(delay):.2g} ms late",
        f"found over the first {len(head) * period:.0f} s; less than a sample ({1000.0 * period:.2g} ms) does little harm"
        if abs(delay) < period
        else f"found over the first {len(head) * period:.0f} s; a sample is {1000.0 * period:.2g} ms",
        f'gyro_delay = "{1000.0 * delay:.2g} ms"  {IN_FILTER}' if abs(delay) > 5e-4 else "",
    )
