"""Motion in a recording that should be at rest."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats  # type: ignore[import-untyped]

from compfilt.checks import positive
from compfilt.noise.curves import Array
from compfilt.noise.signals import channels
from compfilt.noise.steps import find_step

__all__ = ["NotAtRest", "Span", "find_motion", "longest_rest"]

WINDOW, FEWEST = 0.5, 32
"""A window lasts half a second, but has at least so many samples."""
QUIETEST = 10.0
"""Percent of the windows that tell how quiet this sensor is."""
LOUD = 2.0
"""A window that varies so many times as much as the quietest is not at rest..."""
SCATTER, MOST_SCATTER = 6.0, 0.35
"""...if that is also so many standard deviations above their median, of the logarithm, which is at most so much at rest: behind a slow
low-pass half a second holds few independent samples, and its noise is not measured well."""
JUMP = 8.0
"""Nor is a window at rest whose mean changes by so many standard deviations of the change from window to window, or in which the gyro's
differs by as many from what is usual."""
SHAKE, SWAY, TURN = 0.03, np.radians(3.0), np.radians(2.0)
"""A body is not at rest, however restless the recording, if its accelerometer varies by more than this part of its length, its gyro by
more than this many rad/s, or if the vertical turns by more than this angle between the beginning and the end of a rest."""
PAUSE = 1.0
"""Seconds: a shorter rest between two motions is none."""


SHOWN = 5
"""So many motions a message names."""


class Span(NamedTuple):
    """From where to where something lasts, in s from the beginning of the recording."""

    start: float
    end: float

    def __str__(self) -> str:
        return f"{self.start:.1f} s to {self.end:.1f} s"


class NotAtRest(ValueError):  # noqa: N818 - it says what the recording is
    """A recording that should be at rest holds motion.

    Attributes
    ----------
    motion : tuple of Span
        Where.
    """

    def __init__(self, motion: Sequence[Span]) -> None:
        shown = ", ".join(str(span) for span in motion[:SHOWN])
        more = f" and {len(motion) - SHOWN} times more" if len(motion) > SHOWN else ""
        super().__init__(f"not at rest from {shown}{more}")
        self.motion = tuple(motion)

    def __reduce__(self) -> tuple[type["NotAtRest"], tuple[tuple[Span, ...]]]:
        return NotAtRest, (self.motion,)


def find_motion(gyro: npt.ArrayLike, acc: npt.ArrayLike, *, fs: float) -> tuple[Span, ...]:
    """Find where a body that should be at rest moves.

    The recording is its own measure: in windows of half a second the gyro and the accelerometer may vary by no more than twice what
    they do in the quietest tenth of it, and their means may not jump. A recording that never rests is motion from its beginning to
    its end, and so is one in which the vertical turns slowly. A steady turn about the vertical looks like a gyro's bias; no
    recording tells them apart.

    Parameters
    ----------
    gyro : array_like, shape (n, 3)
        Rates in rad/s.
    acc : array_like, shape (n, 3)
        Specific force in m/s².
    fs : float
        The sample rate in Hz.

    Returns
    -------
    tuple of Span
        Where the body moves, in order; empty if it rests all the time. Good to a window.

    Raises
    ------
    ValueError
        The signals are too short, of other shapes, or not finite; or fs is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt import noise
    >>> rng = np.random.default_rng(1)
    >>> gyro = rng.normal(0.0, 0.001, (6000, 3))
    >>> acc = rng.normal([0.0, 0.0, 9.81], 0.02, (6000, 3))
    >>> gyro[2000:2400, 0] += 0.02
    >>> [str(span) for span in noise.find_motion(gyro, acc, fs=100.0)]
    ['19.5 s to 24.5 s']
    """
    rates, force = channels("gyro", gyro, width=3), channels("acc", acc, width=3)
    if len(rates) != len(force):
        raise ValueError(f"gyro and acc must be equally long, not {len(rates)} and {len(force)}")
    rate = positive("fs", fs)
    size = min(max(round(WINDOW * rate), FEWEST), len(rates))
    moving = np.zeros(len(rates) // size, np.bool_)
    length = float(np.median(np.linalg.norm(force, axis=1)))
    moving |= _restless(rates, size, SWAY, level=True)
    # The accelerometer's mean is another in every rest.
    moving |= _restless(force, size, SHAKE * length, level=False)
    spans = _spans(moving, size / rate, len(rates) / rate)
    rest = longest_rest(spans, len(rates) / rate)
    if rest is None or _turn(force, rest, rate) > TURN:
        return (Span(0.0, len(rates) / rate),)
    return spans


def longest_rest(motion: Sequence[Span], duration: float) -> Span | None:
    """Return the longest part of a recording between motions; None if there is none.

    Examples
    --------
    >>> from compfilt import noise
    >>> noise.longest_rest([noise.Span(10.0, 12.0)], 60.0)
    Span(start=12.0, end=60.0)
    """
    starts = [0.0, *(span.end for span in motion)]
    ends = [*(span.start for span in motion), duration]
    rests = [Span(start, end) for start, end in zip(starts, ends, strict=True) if end > start]
    return max(rests, key=lambda rest: rest.end - rest.start, default=None)


def _restless(values: Array, size: int, most: float, *, level: bool) -> npt.NDArray[np.bool_]:
    """Find the windows in which a sensor varies too much, its mean jumps, or, with `level`, is not the usual one."""
    count = len(values) // size
    windows = values[: count * size].reshape(count, size, 3)
    steps = [find_step(values[:, axis]) or 0.0 for axis in range(3)]
    # Of coarse steps a quiet window may show none at all.
    noise = np.maximum(windows.std(axis=1), np.array(steps) / 2.0)
    floor = np.percentile(noise, QUIETEST, axis=0)
    restless = (noise > _loudness(noise) * floor).any(axis=1) | (np.linalg.norm(noise, axis=1) > most)
    loud: npt.NDArray[np.bool_] = np.asarray(restless)
    means = windows.mean(axis=1)
    changes = np.diff(means, axis=0)
    settled = ~(loud[1:] | loud[:-1])
    if not settled.any():
        return loud
    least = np.maximum(floor, np.array(steps)) / np.sqrt(size)
    jumps = (np.abs(changes) > JUMP * np.maximum(_spread(changes[settled]), least)).any(axis=1)
    if level:
        settled_means = means[1:][settled]
        apart = np.abs(means - np.median(settled_means, axis=0))
        spread = _spread(settled_means - np.median(settled_means, axis=0))
        loud |= (apart > JUMP * np.maximum(spread, least)).any(axis=1)
    # Which of the two windows moves a jump does not say: both do.
    loud[1:] |= jumps
    loud[:-1] |= jumps
    return loud


def _spread(values: Array) -> Array:
    """Return the standard deviation about 0, from the median, which few large values do not move."""
    return np.asarray(np.median(np.abs(values), axis=0) / 0.6745)


def _loudness(noise: Array) -> Array:
    """Return how many times the quiet percentile a window may have, by the scatter of the quietest windows."""
    quietest, quiet = np.percentile(noise, [QUIETEST / 5.0, QUIETEST], axis=0)
    normal = stats.norm.ppf([QUIETEST / 500.0, QUIETEST / 100.0])
    ratio = np.where(quietest > 0.0, quiet / np.maximum(quietest, np.finfo(float).tiny), 1.0)
    scatter = np.minimum(np.log(ratio) / (normal[1] - normal[0]), MOST_SCATTER)
    return np.asarray(np.maximum(LOUD, np.exp((SCATTER - normal[1]) * scatter)))


def _spans(moving: npt.NDArray[np.bool_], window: float, duration: float) -> tuple[Span, ...]:
    """Join the windows that move, and short pauses between them."""
    edges = np.flatnonzero(np.diff(moving, prepend=False, append=False))
    spans: list[Span] = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        end = duration if last == len(moving) else last * window
        start = first * window
        if spans and start - spans[-1].end < PAUSE:
            start = spans.pop().start
        spans.append(Span(0.0 if start < PAUSE else float(start), float(end)))
    return tuple(spans)


def _turn(force: Array, rest: Span, rate: float) -> float:
    """Return by which angle the vertical turns from the beginning to the end of a rest."""
    part = force[round(rest.start * rate) : round(rest.end * rate)]
    tenth = max(len(part) // 10, 1)
    first, last = part[:tenth].mean(axis=0), part[-tenth:].mean(axis=0)
    return float(np.arctan2(np.linalg.norm(np.cross(first, last)), first @ last))
