"""The noise of the sensor that made a log. Needs the extra ``logs`` as well."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.recipe import Recipe
from compfilt.noise.motion import PAUSE, NotAtRest, Span, find_motion, longest_rest
from compfilt.noise.motors import add_motors
from compfilt.noise.recording import Recording, read_recording
from compfilt.noise.report import NoiseReport, analyse

__all__ = ["analyse_log"]


def analyse_log(
    path: str | Path,
    recipe: Recipe | None = None,
    *,
    motors: str | Path | None = None,
    start: float | None = None,
    end: float | None = None,
    only_longest_rest: bool = False,
    gyro_unit: str | None = None,
) -> NoiseReport:
    """Say what noise the gyro and the accelerometer of a log have; what ``compfilt noise`` does.

    The whole log is held in memory, 48 bytes a sample.

    Parameters
    ----------
    path
        A log of the sensor at rest, in any format that recipes can read.
    recipe
        Its columns and their units. Without one they are found by their names.
    motors
        A second log, with the body fixed and the motors running.
    start, end
        The part of the log that is looked at, in s from its beginning.
    only_longest_rest
        Use the longest rest of a log that holds motion, in place of refusing it.
    gyro_unit
        The gyro's unit, where neither the recipe nor the log tells it.

    Returns
    -------
    NoiseReport

    Raises
    ------
    LogError
        A log cannot be read, or the first one is not at rest: the message says when.
    UsageError
        Nothing tells the gyro's unit, or the part ends before it begins.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> import compfilt as cf
    >>> from compfilt.noise.log import analyse_log
    >>> rng = np.random.default_rng(1)
    >>> log = {"t": np.arange(6000) / 100.0}
    >>> log |= {name: rng.normal(0.0, 0.1, 6000) for name in ("gx", "gy", "gz")}
    >>> log |= {name: rng.normal(name == "az", 0.002, 6000) for name in ("ax", "ay", "az")}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     cf.simulate.write(log, f"{folder}/rest.parquet")
    ...     report = analyse_log(f"{folder}/rest.parquet")
    >>> round(float(np.degrees(report.gyro[0].density)), 2)  # (deg/s)/√Hz, two-sided: 0.1/√100
    0.01
    """
    _check_part(start, end)
    recording = read_recording(path, recipe, gyro_unit=gyro_unit, start=start, end=end)
    if only_longest_rest:
        recording = _longest_rest(recording)
    try:
        report = analyse(recording.gyro, recording.accelerometer, fs=recording.fs)
    except NotAtRest as error:
        raise LogError(_refusal(error.motion, recording)) from None
    except ValueError as error:
        raise LogError(str(error)) from None
    report = replace(report, notes=recording.notes)
    return report if motors is None else _with_motors(report, motors, recipe, gyro_unit)


def _check_part(start: float | None, end: float | None) -> None:
    for option, moment in (("--from", start), ("--until", end)):
        if moment is not None and not np.isfinite(moment):
            raise UsageError(f"{option} must be finite, not {moment:g}")
    if end is not None and end <= (start or 0.0):
        raise UsageError(f"--until must be later than --from, which is {start or 0.0:g} s, not {end:g} s")


def _longest_rest(recording: Recording) -> Recording:
    duration = len(recording.gyro) / recording.fs
    motion = find_motion(recording.gyro, recording.accelerometer, fs=recording.fs)
    rest = longest_rest(motion, duration)
    if rest is None:
        raise LogError("there is no rest in the log")
    # Motion is found to a window: its beginning and its end lie a little within the rest.
    start = rest.start + PAUSE * (rest.start > 0.0)
    end = rest.end - PAUSE * (rest.end < duration)
    part = recording.part(Span(start, max(end, start)))
    note = f"of the log its longest rest is used, {part.start:.1f} s to {recording.start + end:.1f} s"
    return replace(part, notes=(*part.notes, note)) if motion else recording


def _refusal(motion: tuple[Span, ...], recording: Recording) -> str:
    """Say when the log moves, in its own time, and what to do about it."""
    duration = len(recording.gyro) / recording.fs
    moved = [Span(span.start + recording.start, span.end + recording.start) for span in motion]
    rest = longest_rest(motion, duration)
    if rest is None:
        return (
            f"{NotAtRest(moved)}, which is all of it: put the sensor down on something solid and record again"
        )
    found = Span(rest.start + recording.start, rest.end + recording.start)
    return (
        f"{NotAtRest(moved)}: --from and --until choose a part, --longest-rest the longest rest, from {found}"
    )


def _with_motors(
    report: NoiseReport, path: str | Path, recipe: Recipe | None, gyro_unit: str | None
) -> NoiseReport:
    try:
        running = read_recording(path, recipe, gyro_unit=gyro_unit)
        found = add_motors(report, running.gyro, running.accelerometer, fs=running.fs)
    except (LogError, ValueError) as error:
        raise LogError(f"with motors, {path}: {error}") from None
    return replace(found, notes=(*found.notes, *(f"with motors: {note}" for note in running.notes)))
