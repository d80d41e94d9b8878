"""How a gyro turns a vector that another sensor sees: which axes, signs and scale of the gyro explain it.

Gravity, and the earth's magnetic field, stand still in the world. Over a few seconds the mean of the accelerometer is gravity: what
the body's own motion adds averages out. So if the readings are turned by the gyro into one frame, their means before and after a
moment point in one direction, and where they do not, the gyro's axes, signs or scale are not those of the other sensor.
Nothing else is assumed, so this tells more than a comparison by eye: a column of the gyro that is negated, swapped or in other
units turns the vector where it does not go.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from compfilt.logs.check.frame import liveliest, misses
from compfilt.logs.check.segments import LENGTH, Segments
from compfilt.logs.check.source import Array

__all__ = ["IDENTITY", "MOUNTINGS", "SCALES", "SURE", "WILD", "Trial", "try_mountings"]

MOUNTINGS: Array = np.array(
    [
        np.diag(signs) @ np.eye(3)[list(order)]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
)
"""(48, 3, 3): every way to name and sign three axes, left-handed ones included; the first is no change."""
IDENTITY = 0
SCALES = (1.0, 180.0 / np.pi, np.pi / 180.0, 2.0, 0.5)
"""Scales of the gyro that are tried first: none, degrees for radians, radians for degrees, and a rate that is out by two."""
EXPLAINED = 0.25
"""A scale that leaves less than this part of the turn unexplained is looked for no further."""
WILD = 20.0
"""Degrees by which gravity misses itself where a gyro turns it wildly."""
SURE = 3.5
"""So many standard errors are beyond doubt."""
LIKELY = 3.0
"""So many let the others be left out of account."""
SPANS = (2.0, 8.0 / 3.0, 4.0)
"""Seconds over which means are taken, before and after a moment: long enough for a hand's movements to average out."""
SHORT = 1.0
"""The same for the search for a scale: short, so that a scale need not be met closely."""


@dataclass(frozen=True)
class Trial:
    """What came of trying all mountings against one vector.

    Attributes
    ----------
    mounting
        (3, 3) signed permutation M, and `scale` s: the true rate in the other sensor's axes is s M times the reading.
    scale
        See `mounting`.
    angle
        Mean angle in degrees by which the vector misses itself.
    claimed_angle
        The same for the rate as it is claimed.
    identity_angle
        The same for the axes as claimed, with the best scale.
    claimed_margin
        By how many standard errors the claim is worse than the best; 0 where it is the best.
    identity_margin
        By how many standard errors the axes as claimed are worse, with the best scale.
    unturned_margin
        The same for no turning at all: how much the gyro explains.
    margin
        By how many standard errors the next best is worse.
    open
        (k, 3, 3) the mountings that are not worse by `LIKELY` standard errors, the best first.
    moments
        How many moments were compared.
    span
        Seconds of the means.
    """

    mounting: Array
    scale: float
    angle: float
    claimed_angle: float
    identity_angle: float
    claimed_margin: float
    identity_margin: float
    unturned_margin: float
    margin: float
    open: Array
    moments: int
    span: float

    @property
    def sure(self) -> bool:
        """Whether one mounting is left."""
        return len(self.open) == 1

    @property
    def accepts_axes(self) -> bool:
        """Whether the axes as claimed are not ruled out."""
        return self.identity_margin < SURE

    def leaves_open(self, mounting: Array) -> bool:
        """Whether a mounting is among those that are not ruled out."""
        return any(np.array_equal(mounting, other) for other in self.open)


def try_mountings(
    segments: Segments, rates: slice, vector: slice, bias: Array, scale: float | None = None
) -> Trial | None:
    """Hold the gyro against a vector in every mounting and in several scales; None if the log is too short.

    Parameters
    ----------
    segments
        The log.
    rates, vector
        The columns of the gyro in rad/s, as far as that is known, and of the other sensor.
    bias
        (3,) what the gyro reads at rest, in the same units.
    scale
        The scale, where it is known already.
    """
    if not len(segments):
        return None
    chosen = liveliest(segments, rates, bias)
    turns = (segments.values[chosen][..., rates] - bias) * segments.durations[chosen][..., None]
    seen = segments.values[chosen][..., vector]
    if scale is None:
        scale = _find_scale(turns, seen)
    # The claim itself stays among the candidates, so that it is judged on the same moments.
    candidates = np.concatenate((scale * MOUNTINGS, MOUNTINGS[:1], np.zeros((1, 3, 3))))
    # Short means are full of the body's accelerations, long ones are few and add up the gyro's errors.
    trials = []
    for span in SPANS:
        trials.append(_judge(misses(turns, seen, candidates, span), scale, span))
        if trials[-1].margin > SURE:
            break
    return max(trials, key=lambda trial: trial.margin)


def _find_scale(turns: Array, seen: Array) -> float:
    """Choose the scale in which some mounting explains the vector; 1 where the log does not tell."""
    unturned = misses(turns, seen, np.zeros((1, 3, 3)), SPANS[0])[0]
    claimed = misses(turns, seen, MOUNTINGS, SPANS[0])
    best = _least(claimed)
    if best.mean() < EXPLAINED * unturned.mean() and _singles_out(claimed, best):
        return 1.0
    usual = [misses(turns, seen, scale * MOUNTINGS, SPANS[0]) for scale in SCALES]
    place = min(range(len(SCALES)), key=lambda place: float(usual[place].mean(axis=1).min()))
    scale, best = SCALES[place], _least(usual[place])
    if not _singles_out(usual[place], best):
        # A scale that fits singles out one mounting: this one may be a chance.
        found = _search_scale(turns, seen)
        other = _least(misses(turns, seen, found * MOUNTINGS, SPANS[0]))
        if _clearly_less(other, best):
            scale, best = found, other
    if _clearly_less(best, unturned) and _clearly_less(best, claimed[IDENTITY]):
        return scale
    # A gyro that turns wildly where gravity hardly moves is in degrees, even if what it turns is too little to show more.
    degrees = usual[SCALES.index(np.pi / 180.0)][IDENTITY]
    least = _least(claimed)
    wild = least.mean() > WILD and degrees.mean() < 0.2 * least.mean()
    return np.pi / 180.0 if wild and _clearly_less(degrees, least) else 1.0


def _singles_out(missed: Array, best: Array) -> bool:
    """Whether all mountings but one are left out of account."""
    return int(np.sum(_margins(missed, best) < LIKELY)) == 1


def _least(missed: Array) -> Array:
    """Return the row with the least mean."""
    return np.asarray(missed[int(missed.mean(axis=1).argmin())])


def _judge(missed: Array, scale: float, span: float) -> Trial:
    """Compare candidates, (50, moments): 48 mountings in one scale, then the claim, then no turning at all."""
    best = int(missed[:-2].mean(axis=1).argmin())
    margins = _margins(missed, missed[best])
    margins[best] = 0.0
    mountings = margins[:-2]
    left = np.flatnonzero(mountings < LIKELY)
    left = left[np.argsort(mountings[left], kind="stable")]
    rivals = np.delete(mountings, best)
    return Trial(
        MOUNTINGS[best],
        scale,
        float(missed[best].mean()),
        float(missed[-2].mean()),
        float(missed[IDENTITY].mean()),
        float(margins[-2]),
        float(margins[IDENTITY]),
        float(margins[-1]),
        float(rivals.min()),
        MOUNTINGS[left],
        missed.shape[1],
        span,
    )


def _margins(missed: Array, best: Array) -> Array:
    """Return by how many standard errors missed, (h, moments), are worse than the best ones, (moments,).

    Moments are compared by the logarithm of their missed, so that a few wild ones do not decide, and those in which nothing turns
    say nothing. The sum over its own root of squares is about normal where neither is better.
    """
    floor = np.radians(0.5) + np.radians(np.median(best))
    worse = np.log(floor**2 + np.radians(missed) ** 2) - np.log(floor**2 + np.radians(best) ** 2)
    return np.asarray(worse.sum(axis=-1) / (np.sqrt(np.sum(worse**2, axis=-1)) + 1e-12))


def _clearly_less(missed: Array, others: Array) -> bool:
    """Whether some missed are less than others, moment by moment, beyond doubt."""
    return bool(_margins(others, missed) > SURE)


def _search_scale(turns: Array, seen: Array) -> float:
    """Find a scale that is none of the usual ones, from those in which a body would turn at a credible rate."""
    few = np.linspace(0, len(turns) - 1, min(16, len(turns))).astype(int)
    turns, seen = turns[few], seen[few]
    per_second = np.sqrt(np.mean(turns**2)) * turns.shape[1] / LENGTH
    scales = np.geomspace(0.05, 12.0, 44) / max(per_second, 1e-12)
    matrices = np.concatenate([scale * MOUNTINGS for scale in scales])
    missed = misses(turns, seen, matrices, SHORT).mean(axis=1)
    return float(scales[int(missed.argmin()) // len(MOUNTINGS)])
