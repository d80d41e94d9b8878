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

from compfilt.logs.check.segments import Segments
from compfilt.logs.check.source import Array

__all__ = ["IDENTITY", "MOUNTINGS", "SCALES", "SURE", "WILD", "Fit", "Trial", "fit", "try_mountings", "turn"]

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
SURE = 4.0
"""So many standard errors are beyond doubt."""
LIKELY = 3.0
"""So many let the others be left out of account."""
SPANS = (2.0, 8.0 / 3.0, 4.0)
"""Seconds over which means are taken, before and after a moment: long enough for a hand's movements to average out."""
SHORT = 1.0
"""The same for the search for a scale: short, so that a scale need not be met closely."""
MOST_SEGMENTS = 48
"""How many pieces of the log enter, those that turn most."""


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


@dataclass(frozen=True)
class Fit:
    """A free linear fit: the true rate is `matrix` times (reading - `bias`); standard errors beside them."""

    matrix: Array
    matrix_error: Array
    scale: float
    scale_error: float


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
    chosen = _liveliest(segments, rates, bias)
    turns = (segments.values[chosen][..., rates] - bias) * segments.durations[chosen][..., None]
    seen = segments.values[chosen][..., vector]
    if scale is None:
        scale = _find_scale(turns, seen)
    # The claim itself stays among the candidates, so that it is judged on the same moments.
    candidates = np.concatenate((scale * MOUNTINGS, MOUNTINGS[:1], np.zeros((1, 3, 3))))
    # Short means are full of the body's accelerations, long ones are few and add up the gyro's errors.
    trials = []
    for span in SPANS:
        trials.append(_judge(_misses(turns, seen, candidates, span), scale, span))
        if trials[-1].margin > SURE:
            break
    return max(trials, key=lambda trial: trial.margin)


def _find_scale(turns: Array, seen: Array) -> float:
    """Choose the scale in which some mounting explains the vector; 1 where the log does not tell."""
    unturned = _misses(turns, seen, np.zeros((1, 3, 3)), SPANS[0])[0]
    claimed = _misses(turns, seen, MOUNTINGS, SPANS[0])
    best = _least(claimed)
    if _clearly_less(best, unturned) and best.mean() < EXPLAINED * unturned.mean():
        return 1.0
    usual = _misses(turns, seen, np.concatenate([scale * MOUNTINGS for scale in SCALES]), SPANS[0])
    place = int(usual.mean(axis=1).argmin()) // len(MOUNTINGS)
    scale, best = SCALES[place], _least(usual)
    rivals = _margins(usual[len(MOUNTINGS) * place : len(MOUNTINGS) * (place + 1)], best)
    if np.sum(rivals < LIKELY) > 1:
        # A scale that fits singles out one mounting: this one may be a chance.
        found = _search_scale(turns, seen)
        other = _least(_misses(turns, seen, found * MOUNTINGS, SPANS[0]))
        if _clearly_less(other, best):
            scale, best = found, other
    if _clearly_less(best, unturned) and _clearly_less(best, claimed[IDENTITY]):
        return scale
    # A gyro that turns wildly where gravity hardly moves is in degrees, even if what it turns is too little to show more.
    degrees = usual[len(MOUNTINGS) * SCALES.index(np.pi / 180.0)]
    wild = claimed.mean(axis=1).min() > WILD and degrees.mean() < 0.2 * claimed.mean(axis=1).min()
    return np.pi / 180.0 if wild and _clearly_less(degrees, _least(claimed)) else 1.0


def _least(misses: Array) -> Array:
    """Return the row with the least mean."""
    return misses[int(misses.mean(axis=1).argmin())]


def _liveliest(segments: Segments, rates: slice, bias: Array) -> Array:
    """Choose the pieces that turn most, without one wild piece deciding."""
    turned = np.abs(segments.values[..., rates] - bias).sum(axis=(1, 2))
    return np.sort(np.argsort(-turned)[:MOST_SEGMENTS])


def _judge(misses: Array, scale: float, span: float) -> Trial:
    """Compare candidates, (50, moments): 48 mountings in one scale, then the claim, then no turning at all."""
    best = int(misses[:-2].mean(axis=1).argmin())
    margins = _margins(misses, misses[best])
    margins[best] = 0.0
    mountings = margins[:-2]
    left = np.flatnonzero(mountings < LIKELY)
    left = left[np.argsort(mountings[left], kind="stable")]
    rivals = np.delete(mountings, best)
    return Trial(
        MOUNTINGS[best],
        scale,
        float(misses[best].mean()),
        float(misses[-2].mean()),
        float(misses[IDENTITY].mean()),
        float(margins[-2]),
        float(margins[IDENTITY]),
        float(margins[-1]),
        float(rivals.min()),
        MOUNTINGS[left],
        misses.shape[1],
        span,
    )


def _margins(misses: Array, best: Array) -> Array:
    """Return by how many standard errors misses, (h, moments), are worse than the best ones, (moments,).

    Moments are compared by the logarithm of their misses, so that a few wild ones do not decide, and those in which nothing turns
    say nothing. The sum over its own root of squares is about normal where neither is better.
    """
    floor = np.radians(0.5) + np.radians(np.median(best))
    worse = np.log(floor**2 + np.radians(misses) ** 2) - np.log(floor**2 + np.radians(best) ** 2)
    return np.asarray(worse.sum(axis=-1) / (np.sqrt(np.sum(worse**2, axis=-1)) + 1e-12))


def _clearly_less(misses: Array, others: Array) -> bool:
    """Whether some misses are less than others, moment by moment, beyond doubt."""
    return bool(_margins(others, misses) > SURE)


def _search_scale(turns: Array, seen: Array) -> float:
    """Find a scale that is none of the usual ones, from those in which a body would turn at a credible rate."""
    few = np.linspace(0, len(turns) - 1, min(16, len(turns))).astype(int)
    turns, seen = turns[few], seen[few]
    per_second = np.sqrt(np.mean(turns**2)) * turns.shape[1] / 8.0
    scales = np.geomspace(0.05, 12.0, 44) / max(per_second, 1e-12)
    matrices = np.concatenate([scale * MOUNTINGS for scale in scales])
    misses = _misses(turns, seen, matrices, SHORT).mean(axis=1)
    return float(scales[int(misses.argmin()) // len(MOUNTINGS)])


def _misses(turns: Array, seen: Array, matrices: Array, span: float) -> Array:
    """Return (h, moments): the angle in degrees between the means before and after, for each matrix."""
    before, after = _means(turns, seen, matrices, span)
    cross = np.linalg.norm(np.cross(before, after), axis=-1)
    dot = (before * after).sum(axis=-1)
    return np.degrees(np.arctan2(cross, dot)).reshape(len(matrices), -1)


def _means(turns: Array, seen: Array, matrices: Array, span: float) -> tuple[Array, Array]:
    """Return (h, moments, 3) twice: the mean of the vector before and after each moment, in the axes of the moment."""
    pieces, cells, _ = turns.shape
    size = round(cells * span / 8.0)
    count = cells // size
    turns = turns[:, : count * size].reshape(pieces * count, size, 3)
    seen = seen[:, : count * size].reshape(pieces * count, size, 3)
    # A smooth weight: what a body's own acceleration adds up to is its change of speed, and that hides in sharp ends.
    weight = np.sin(np.pi * (np.arange(size) + 0.5) / size) ** 2
    start = np.zeros((3, len(matrices), pieces * count))
    end = np.zeros_like(start)
    for cell in range(size - 1, -1, -1):
        start += weight[cell] * seen[:, cell].T[:, None]
        start = turn(start, np.einsum("hij,mj->ihm", matrices, turns[:, cell]))
    for cell in range(size):
        end = turn(end, np.einsum("hij,mj->ihm", matrices, -turns[:, cell]))
        end += weight[cell] * seen[:, cell].T[:, None]
    shape = (len(matrices), pieces, count, 3)
    before = np.moveaxis(end, 0, -1).reshape(shape)[:, :, :-1]
    after = np.moveaxis(start, 0, -1).reshape(shape)[:, :, 1:]
    return before.reshape(len(matrices), -1, 3), after.reshape(len(matrices), -1, 3)


def turn(v: Array, r: Array) -> Array:
    """Turn vectors by rotation vectors, both (3, ...): Rodrigues' formula."""
    # No angle is zero then, and what is left out is below rounding.
    angle = np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2) + 1e-30
    across = _cross(r, v)
    twice = _cross(r, across)
    across *= np.sin(angle) / angle
    twice *= 2.0 * (np.sin(0.5 * angle) / angle) ** 2
    across += twice
    across += v
    return across


def _cross(a: Array, b: Array) -> Array:
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=out[i])
        out[i] -= a[k] * b[j]
    return out


def fit(segments: Segments, rates: slice, vector: slice, bias: Array, start: Array) -> Fit:
    """Refine a matrix by robust Gauss-Newton steps: nine parts of the matrix and three of the bias."""
    chosen = _liveliest(segments, rates, bias)
    durations = segments.durations[chosen][..., None]
    readings, seen = segments.values[chosen][..., rates] - bias, segments.values[chosen][..., vector]
    matrix, offset = start.copy(), np.zeros(3)
    size = float(np.abs(start).max())
    step = 1e-3 * size
    for _ in range(3):
        nudges = np.concatenate((np.zeros((1, 3, 3)), step * np.eye(9).reshape(9, 3, 3)))
        turns = (readings - offset) * durations
        before, after = _means(turns, seen, matrix + nudges, SPANS[0])
        gaps = (after - before) / np.linalg.norm(before[:1], axis=-1, keepdims=True)
        slope = np.moveaxis((gaps[1:] - gaps[0]) / step, 0, -1)
        slopes = [slope]
        for axis in range(3):
            tilt = 1e-3 * np.eye(3)[axis] / size
            before, after = _means((readings - offset - tilt) * durations, seen, matrix[None], SPANS[0])
            moved = (after - before)[0] / np.linalg.norm(before[0], axis=-1, keepdims=True)
            slopes.append(((moved - gaps[0]) * size / 1e-3)[..., None])
        change, covariance = _robust(np.concatenate(slopes, axis=-1), gaps[0])
        matrix, offset = matrix + change[:9].reshape(3, 3), offset + change[9:]
    error = np.sqrt(np.diag(covariance))[:9].reshape(3, 3)
    inside = np.abs(start) > 0.0
    parts, weights = (matrix * np.sign(start))[inside], 1.0 / np.maximum(error[inside], 1e-12) ** 2
    scale = float(np.sum(parts * weights) / np.sum(weights))
    return Fit(matrix, error, scale, float(1.0 / np.sqrt(np.sum(weights))))


def _robust(slopes: Array, gaps: Array) -> tuple[Array, Array]:
    """Solve slopes x = -gaps by iterated least squares with Cauchy's weights; return x and its covariance."""
    x = np.zeros(slopes.shape[-1])
    prior = 1e-6 * np.eye(len(x)) * np.trace(np.einsum("mij,mik->jk", slopes, slopes)) / len(x)
    weight = np.ones(len(gaps))
    for _ in range(8):
        information = np.einsum("m,mij,mik->jk", weight, slopes, slopes) + prior
        x = -np.linalg.solve(information, np.einsum("m,mij,mi->j", weight, slopes, gaps))
        left = gaps + slopes @ x
        size = np.linalg.norm(left, axis=1)
        weight = 1.0 / (1.0 + (size / (1.5 * np.median(size) + 1e-12)) ** 2)
    scores = np.einsum("m,mij,mi->mj", weight, slopes, left)
    inverse = np.linalg.inv(information)
    return x, inverse @ (scores.T @ scores) @ inverse
