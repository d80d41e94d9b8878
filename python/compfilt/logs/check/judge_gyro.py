"""Findings from holding the gyro against gravity and the magnetic field: its unit, the rate, everybody's axes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compfilt.logs.check.carry import Carried, carry_between_rests
from compfilt.logs.check.fit import Fit, fit
from compfilt.logs.check.lines import mended
from compfilt.logs.check.mounting import Mounting, decide
from compfilt.logs.check.report import Finding, Level
from compfilt.logs.check.rests import Rest
from compfilt.logs.check.scale import GyroScale, read_scale
from compfilt.logs.check.source import Array
from compfilt.logs.check.survey import Survey
from compfilt.logs.check.turning import SURE, Trial, try_mountings

__all__ = ["Comparison", "compare", "judge_gyro"]

WHO = {"accelerometer": "gravity", "magnetometer": "the magnetic field"}
DISTURBED = 5.0
"""Degrees by which the earth's field alone hardly misses itself: a gyro drifts by less in some seconds."""


@dataclass(frozen=True)
class Comparison:
    """The gyro held against each other sensor, and what follows.

    Attributes
    ----------
    trials
        What came of it, by the other sensor's name.
    scale, mounting, carried
        What follows from the trials.
    bias
        (3,) what the gyro reads at rest, in the claimed unit and axes; 0 where there is no rest.
    """

    trials: dict[str, tuple[Trial, Fit]]
    scale: GyroScale
    mounting: Mounting
    carried: Carried | None
    bias: Array

    @property
    def trusted(self) -> bool:
        """Whether the gyro's scale is known."""
        return self.scale.known


def compare(survey: Survey, rests: list[Rest]) -> Comparison:
    """Hold the gyro against the accelerometer and, where there is one, the magnetometer."""
    rates = survey.columns_of("gyro")
    bias = _typical([rest.mean[rates] for rest in rests])
    trials: dict[str, tuple[Trial, Fit]] = {}
    scale: float | None = None
    # The field first: it knows no accelerations. A scale that it is sure of need not be found again.
    for sensor in ("magnetometer", "accelerometer"):
        if (
            sensor not in survey.claims.triads
            or not _is_alive(survey, sensor)
            or not _is_alive(survey, "gyro")
        ):
            continue
        vector = survey.columns_of(sensor)
        trial = try_mountings(survey.segments, rates, vector, bias, scale)
        if trial is None:
            continue
        start = trial.scale * trial.mounting
        trials[sensor] = trial, fit(survey.segments, rates, vector, bias, start)
        if trial.sure and trial.unturned_margin > SURE:
            scale = trial.scale
    gravity, field = (
        trials[name][0] if name in trials else None for name in ("accelerometer", "magnetometer")
    )
    mounting = decide(gravity, field)
    carried = None
    if gravity is not None:
        # What turns the claimed rate into the accelerometer's own axes: see `mounting`.
        force = mounting.accelerometer
        matrix = gravity.scale * float(np.linalg.det(force)) * force.T @ mounting.gyro
        carried = carry_between_rests(survey, rests, bias, matrix)
    found = read_scale(survey, list(trials.values()), carried.scale if carried is not None else None)
    return Comparison(trials, found, mounting, carried, bias)


def _typical(means: list[np.ndarray]) -> np.ndarray:
    return np.median(means, axis=0) if means else np.zeros(3)


def _is_alive(survey: Survey, sensor: str) -> bool:
    """Whether the three columns vary at all: one that is stuck turns gravity about the wrong axis."""
    values = survey.segments.values[..., survey.columns_of(sensor)]
    return bool(len(values) and (np.ptp(values.reshape(-1, 3), axis=0) > 0.0).all())


def judge_gyro(survey: Survey, seen: Comparison) -> Iterator[Finding]:
    """Yield what follows for the gyro's unit and everybody's axes."""
    if not seen.trials:
        why = f"it takes {8:g} s without a gap in which every column varies"
        yield Finding("gyro unit", "unknown", "gyro and accelerometer cannot be compared", why)
        yield Finding("axes", "unknown", "gyro and accelerometer cannot be compared", why)
        return
    yield from _scale(survey, seen)
    yield from _axes(survey, seen)


def _scale(survey: Survey, seen: Comparison) -> Iterator[Finding]:
    claims, scale = survey.claims, seen.scale
    triad = claims.triads["gyro"]
    if not scale.known:
        named = f"; {triad.unit.name} was not contradicted" if triad.unit is not None else ""
        yield Finding(
            "gyro unit", "unknown", "too little turns away from the vertical to tell" + named, _numbers(seen)
        )
        return
    evidence = f"what the other sensors see turns {scale.factor:.4g} +- {scale.error:.2g} times as far as the gyro says; {_numbers(seen)}"
    if scale.claimed:
        unit = scale.unit.name if scale.unit is not None else "rad/s"
        fix = "" if triad.unit is not None else f"gyro = {mended(triad, seen.mounting.gyro, unit)}"
        yield Finding("gyro unit", "note", unit, evidence, fix)
    elif scale.unit is not None:
        fix = f"gyro = {mended(triad, seen.mounting.gyro, scale.unit.name)}"
        level: Level = "wrong" if triad.unit is not None else "note"
        what = f"the gyro is in {scale.unit.name}" + (
            f", not in {triad.unit.name}" if triad.unit is not None else ""
        )
        yield Finding("gyro unit", level, what, evidence, fix)
    elif claims.rate is not None:
        yield Finding(
            "rate",
            "wrong",
            f"the rate is {claims.rate / scale.factor:.4g} Hz and not {claims.rate:g} Hz, or the gyro's unit is of no known kind",
            evidence,
            f"rate = {claims.rate / scale.factor:.4g}",
        )
    else:
        unit = triad.unit.name if triad.unit is not None else "rad/s"
        yield Finding(
            "gyro scale",
            "wrong",
            f"the gyro's readings must be multiplied by {scale.factor:.4g}, or the times divided by it",
            evidence + "; no unit explains it: raw counts, another range, or a wrong clock?",
            f"gyro = {mended(triad, seen.mounting.gyro, unit, scale.factor)}",
        )


def _axes(survey: Survey, seen: Comparison) -> Iterator[Finding]:
    mounting = seen.mounting
    for sensor in mounting.wrong:
        triad = survey.claims.triads[sensor]
        matrix = getattr(mounting, sensor)
        unit = (
            triad.unit.name
            if triad.unit is not None
            else {"gyro": "rad/s", "accelerometer": "m/s^2"}.get(sensor, "uT")
        )
        if sensor == "gyro" and not seen.scale.claimed and seen.scale.unit is not None:
            unit = seen.scale.unit.name
        hand = "are left-handed" if np.linalg.det(matrix) < 0.0 else "are not those that the columns say"
        yield Finding(
            "axes",
            "wrong",
            f"the {sensor}'s axes {hand}: {describe(matrix)}",
            f"{_numbers(seen)}; {mounting.reason}",
            f"{sensor} = {mended(triad, matrix, unit)}",
        )
    if mounting.wrong:
        return
    gravity = seen.trials.get("accelerometer")
    for sensor, (trial, _) in seen.trials.items():
        if trial.sure and trial.identity_margin == 0.0:
            yield Finding(
                "axes",
                "note",
                f"gyro and {sensor} agree",
                f"{_number(sensor, trial)}; every other of 48 ways is worse",
            )
        else:
            why = _number(sensor, trial)
            if sensor == "magnetometer" and trial.angle > DISTURBED:
                why += "; a field that misses itself by so much is not the earth's alone: iron or a magnet near the sensor?"
            yield Finding("axes", "unknown", f"gyro and {sensor}: {_left_open(trial)}", why)
    if gravity is None:
        yield Finding("axes", "unknown", "the accelerometer cannot be compared with the gyro")


def _left_open(trial: Trial) -> str:
    """Say what the log does not tell."""
    if not trial.accepts_axes:
        return "they do not fit as claimed, and no other way is beyond doubt"
    if trial.identity_margin > 0.0:
        return "another way fits better than the claimed one, but not beyond doubt"
    return f"as claimed fits, but so do {len(trial.open) - 1} of the 47 other ways: there is too little turning to tell"


def describe(matrix: np.ndarray) -> str:
    """Say where each axis is found, ``x = y, y = -x, z = z``."""
    places = np.argmax(np.abs(matrix), axis=1)
    return ", ".join(
        f"{'xyz'[row]} = {'-' if matrix[row, place] < 0 else ''}{'xyz'[place]}"
        for row, place in enumerate(places)
    )


def _numbers(seen: Comparison) -> str:
    parts = [_number(sensor, trial) for sensor, (trial, _) in seen.trials.items()]
    if seen.carried is not None:
        parts.append(str(seen.carried))
    return "; ".join(parts)


def _number(sensor: str, trial: Trial) -> str:
    """Say how well the gyro turns what another sensor sees."""
    text = f"turned by the gyro, {WHO[sensor]} misses itself by {trial.angle:.2g} deg over {2 * trial.span:.2g} s"
    if trial.claimed_margin > 0.0:
        text += f", as claimed by {trial.claimed_angle:.2g} deg ({trial.claimed_margin:.1f} standard errors worse)"
    return (
        text
        + f"; the next best of 48 ways is {trial.margin:.1f} standard errors worse ({trial.moments} moments)"
    )
