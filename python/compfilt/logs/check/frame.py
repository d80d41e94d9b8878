"""Vectors turned by a gyro into one frame: their means before and after a moment, and how far apart these point."""

import numpy as np

from compfilt.logs.check.segments import LENGTH, Segments
from compfilt.logs.check.source import Array

__all__ = ["liveliest", "means", "misses", "turn"]

MOST_SEGMENTS = 48
"""How many pieces of the log enter, those that turn most."""


def liveliest(segments: Segments, rates: slice, bias: Array) -> Array:
    """Choose the pieces that turn most, without one wild piece deciding."""
    turned = np.abs(segments.values[..., rates] - bias).sum(axis=(1, 2))
    return np.asarray(np.sort(np.argsort(-turned)[:MOST_SEGMENTS]))


def misses(turns: Array, seen: Array, matrices: Array, span: float) -> Array:
    """Return (h, moments): the angle in degrees between the means before and after, for each matrix."""
    before, after = means(turns, seen, matrices, span)
    cross = np.linalg.norm(np.cross(before, after), axis=-1)
    dot = (before * after).sum(axis=-1)
    return np.asarray(np.degrees(np.arctan2(cross, dot)).reshape(len(matrices), -1))


def means(turns: Array, seen: Array, matrices: Array, span: float) -> tuple[Array, Array]:
    """Return (h, moments, 3) twice: the mean of the vector before and after each moment, in the axes of the moment."""
    pieces, cells, _ = turns.shape
    size = round(cells * span / LENGTH)
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
