"""Gains from recordings whose truth is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
import numpy.typing as npt

import compfilt
from compfilt._core import LinearFilter
from compfilt.checks import sample_rate
from compfilt.design.family import Family, family
from compfilt.design.least import least
from compfilt.design.result import Designed
from compfilt.design.running import Rule
from compfilt.design.sensitivity import sensitivity

__all__ = [
    "AttitudeRecording",
    "LinearRecording",
    "Recording",
    "TiltRecording",
    "from_recordings",
    "squared",
    "squared_angle",
]

Array = npt.NDArray[np.float64]

MEASURED_STEP = 0.02
"""Of the logarithm of a gain: a measured error is smooth enough over two percent."""


class Recording(Protocol):
    """A recording that can say how far a filter is off on it."""

    @property
    def fs(self) -> float:
        """Sample rate in Hz."""

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared error at every sample, (n,); NaN where the truth is not known."""


@dataclass(frozen=True)
class LinearRecording:
    """A measurement, its derivative and the truth.

    Attributes
    ----------
    measurement, derivative, truth : ndarray, shape (n,) or (n, channels)
        In one unit and that unit per second to the derivative order. NaN in the truth: not known there.
    fs : float
        Sample rate in Hz.
    period : float, optional
        2π for an angle that wraps.
    rule : {"backward_euler", "matched"}
    """

    measurement: Array
    derivative: Array
    truth: Array
    fs: float
    period: float | None = None
    rule: Rule = "backward_euler"

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared error at every sample, (n,), the mean over the channels."""
        estimate = design.filter(
            self.measurement, self.derivative, fs=self.fs, period=self.period, rule=self.rule
        )
        return squared(np.asarray(estimate, float) - self.truth, self.period)


@dataclass(frozen=True)
class TiltRecording:
    """A gyro, an accelerometer and the true angles, for a `TiltFilter`.

    Attributes
    ----------
    gyro, acc : ndarray, shape (n, 3)
        Body axes, in rad/s and m/s².
    truth : ndarray, shape (n, 2)
        The two angles of `tilt` in rad. NaN: not known.
    fs : float
        Sample rate in Hz.
    axes : {"flu", "frd", "cube"}
    """

    gyro: Array
    acc: Array
    truth: Array
    fs: float
    axes: Literal["flu", "frd", "cube"] = "flu"

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared error at every sample, (n,), the mean over the two angles."""
        tilt = compfilt.TiltFilter(design, axes=self.axes)
        angles = tilt.estimate(self.gyro, self.acc, fs=self.fs).angles
        return squared(np.asarray(angles, float) - self.truth, 2.0 * np.pi)


@dataclass(frozen=True)
class AttitudeRecording:
    """A gyro and an accelerometer in any attitude, for `Mahony` with a design's gains; with truth or without.

    Without truth the offline estimate stands in for it: `GravityFilter.smooth` sees the whole recording, the samples to
    come as well, and is nearer to the truth than any filter that runs. On the recordings of
    ``examples/design_from_rest`` the time constant that it chooses costs at most 1 % against the best one.

    Attributes
    ----------
    gyro, acc : ndarray, shape (n, 3)
        Body axes, in rad/s and m/s². The gyro without its bias, if the kind does not estimate it.
    fs : float
        Sample rate in Hz.
    up : ndarray, shape (n, 3), optional
        The true up in body axes, a unit vector. NaN: not known.
    counts : ndarray of bool, shape (n,), optional
        The samples that count, such as those in motion. Default: all.
    """

    gyro: Array
    acc: Array
    fs: float
    up: Array | None = None
    counts: npt.NDArray[np.bool_] | None = None

    @cached_property
    def _truth(self) -> Array:
        if self.up is not None:
            return self.up
        return np.asarray(compfilt.GravityFilter().smooth(self.gyro, self.acc, fs=self.fs).up, float)

    def squared_errors(self, design: LinearFilter) -> Array:
        """Return the squared angle between estimated and true up at every sample, (n,), in rad²."""
        estimate = compfilt.Mahony.from_design(design).estimate(self.gyro, self.acc, fs=self.fs).up
        squares = squared_angle(np.asarray(estimate, float), self._truth)
        return squares if self.counts is None else np.where(self.counts, squares, np.nan)


def from_recordings(
    recordings: Sequence[Recording],
    *,
    kind: str = "first_order",
    order: int | None = None,
    split: int | None = None,
    derivative_order: int | None = None,
    folds: int = 5,
) -> Designed:
    """Return the gains with the least root mean square error on recordings with truth, and what they are worth elsewhere.

    The error that the best gains have on the recordings they were chosen on is too good. So the choice is made again for
    each fold without it, and scored on it: the root mean square of that is the cross-validated error. The folds are whole
    recordings, or blocks of time where there is only one; a filter always runs over a whole recording.

    Parameters
    ----------
    recordings : sequence of LinearRecording, TiltRecording or AttitudeRecording
        Or of anything that has `fs` and `squared_errors`.
    kind, order, split, derivative_order
        As in `from_spectra`.
    folds : int
        How many, at least 2; not more than there are recordings, if there are several. Default 5.

    Returns
    -------
    Designed
        `measured` has the error and the cross-validated one, in the truth's unit; the sensitivities are those of the
        measured error.

    Raises
    ------
    ValueError
        If there is no recording, a fold without truth, or a filter does not go with a recording.

    Examples
    --------
    >>> import numpy as np
    >>> from compfilt.design import LinearRecording, from_recordings
    >>> rng = np.random.default_rng(0)
    >>> rate = np.cos(np.arange(20_000) / 100.0)
    >>> angle = np.cumsum(rate) / 100.0
    >>> recording = LinearRecording(
    ...     measurement=angle + rng.normal(0.0, 0.1, angle.size),
    ...     derivative=rate + rng.normal(0.0, 0.1, angle.size),
    ...     truth=angle,
    ...     fs=100.0,
    ... )
    >>> chosen = from_recordings([recording])
    >>> 0.5 < chosen.design.tau < 2.0  # 1 s by the densities
    True
    """
    chosen = family(kind, order, split, derivative_order)
    scores = _Scores(recordings, folds, chosen.butterworth(1.0))
    everything = np.ones(scores.folds, bool)
    design, at_end = scores.best(chosen, everything)
    crossed = []
    for fold in range(scores.folds):
        others, _ = scores.best(chosen, np.arange(scores.folds) != fold)
        crossed.append(scores.sums(others)[fold])
    measured = (
        ("error on the recordings (RMS)", scores.error(design, everything)),
        (
            "error on recordings left out (RMS, cross-validated)",
            float(np.sqrt(np.sum(crossed) / scores.count)),
        ),
    )
    changed = sensitivity(design, lambda other: scores.error(other, everything), MEASURED_STEP)
    warning = "the best gains lie at the end of the search: one signal is nearly all error, or the recordings are short"
    return Designed(design, sensitivity=changed, measured=measured, warnings=(warning,) if at_end else ())


class _Scores:
    """The squared errors of designs, summed over each fold; each design is tried once."""

    def __init__(self, recordings: Sequence[Recording], folds: int, probe: LinearFilter) -> None:
        if not recordings:
            raise ValueError("recordings must have at least one")
        if folds < 2:
            raise ValueError(f"folds must be at least 2, not {folds}")
        self.recordings = tuple(recordings)
        self.folds = min(folds, len(recordings)) if len(recordings) > 1 else folds
        self.fastest = 0.5 * max(sample_rate("fs", each.fs) for each in recordings)
        self.counts, longest = np.zeros(self.folds), 0.0
        for which, each in enumerate(self.recordings):
            errors = each.squared_errors(probe)
            self.counts += self._by_fold(np.isfinite(errors).astype(float), which)
            longest = max(longest, errors.size / each.fs)
        if not self.counts.all():
            raise ValueError(
                "recordings must have a known truth in every fold: use fewer folds or longer recordings"
            )
        self.count = float(self.counts.sum())
        self.slowest = 0.1 / longest
        self._known: dict[LinearFilter, Array] = {}

    def sums(self, design: LinearFilter) -> Array:
        """Return the sum of the squared errors over each fold."""
        if design not in self._known:
            self._known[design] = sum(
                (
                    self._by_fold(np.nan_to_num(each.squared_errors(design)), which)
                    for which, each in enumerate(self.recordings)
                ),
                np.zeros(self.folds),
            )
        return self._known[design]

    def error(self, design: LinearFilter, chosen: npt.NDArray[np.bool_]) -> float:
        """Return the root mean square error over some folds."""
        return float(np.sqrt(self.sums(design)[chosen].sum() / self.counts[chosen].sum()))

    def best(self, kind: Family, chosen: npt.NDArray[np.bool_]) -> tuple[LinearFilter, bool]:
        """Return the design with the least error over some folds, and whether it lies at an end of the search."""
        return least(kind, lambda design: self.error(design, chosen), self.slowest, self.fastest)

    def _by_fold(self, values: Array, which: int) -> Array:
        """Add up: one of several recordings belongs to one fold, a single one is cut into blocks of time."""
        if len(self.recordings) > 1:
            return np.where(np.arange(self.folds) == which % self.folds, values.sum(), 0.0)
        return np.array([block.sum() for block in np.array_split(values, self.folds)])


def squared_angle(up: Array, truth: Array) -> Array:
    """Return the squares of the angles between unit vectors, (n, 3) each, in rad²."""
    across = np.linalg.norm(np.cross(up, truth), axis=1)
    return np.asarray(np.arctan2(across, np.sum(up * truth, axis=1)) ** 2)


def squared(error: Array, period: float | None) -> Array:
    """Return the squares of errors, (n,) or the mean over (n, channels), wrapped into a period; NaN where none is known."""
    if period is not None:
        error = np.remainder(error + period / 2.0, period) - period / 2.0
    squares = error**2
    if squares.ndim == 1:
        return squares
    known = np.isfinite(squares)
    counts = known.sum(axis=1)
    return np.where(counts > 0, np.where(known, squares, 0.0).sum(axis=1) / np.maximum(counts, 1), np.nan)
