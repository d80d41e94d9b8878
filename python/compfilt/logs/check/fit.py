"""The gyro's matrix as a free linear fit, with standard errors: what its scale is."""

from dataclasses import dataclass

import numpy as np

from compfilt.logs.check.frame import liveliest, means
from compfilt.logs.check.segments import Segments
from compfilt.logs.check.source import Array

__all__ = ["Fit", "fit"]

SPAN = 2.0
"""Seconds over which means are taken."""


@dataclass(frozen=True)
class Fit:
    """A free linear fit: the true rate is `matrix` times (reading - `bias`); standard errors beside them."""

    matrix: Array
    matrix_error: Array
    scale: float
    scale_error: float


def fit(segments: Segments, rates: slice, vector: slice, bias: Array, start: Array) -> Fit:
    """Refine a matrix by robust Gauss-Newton steps: nine parts of the matrix and three of the bias."""
    chosen = liveliest(segments, rates, bias)
    durations = segments.durations[chosen][..., None]
    readings, seen = segments.values[chosen][..., rates] - bias, segments.values[chosen][..., vector]
    matrix, offset = start.copy(), np.zeros(3)
    size = float(np.abs(start).max())
    step = 1e-3 * size
    for _ in range(8):
        nudges = np.concatenate((np.zeros((1, 3, 3)), step * np.eye(9).reshape(9, 3, 3)))
        turns = (readings - offset) * durations
        before, after = means(turns, seen, matrix + nudges, SPAN)
        gaps = (after - before) / np.linalg.norm(before[:1], axis=-1, keepdims=True)
        slope = np.moveaxis((gaps[1:] - gaps[0]) / step, 0, -1)
        slopes = [slope]
        for axis in range(3):
            tilt = 1e-3 * np.eye(3)[axis] / size
            before, after = means((readings - offset - tilt) * durations, seen, matrix[None], SPAN)
            moved = (after - before)[0] / np.linalg.norm(before[0], axis=-1, keepdims=True)
            slopes.append(((moved - gaps[0]) * size / 1e-3)[..., None])
        change, covariance = _robust(np.concatenate(slopes, axis=-1), gaps[0])
        matrix, offset = matrix + change[:9].reshape(3, 3), offset + change[9:]
        if np.abs(change[:9]).max() < 2e-3 * size:
            break
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
