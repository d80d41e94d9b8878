"""What a stretch of samples does to the state of a linear filter."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["FORGOTTEN", "AffineMap"]

Array = npt.NDArray[np.float64]

FORGOTTEN = 1e-24
"""What is left of a state that does not matter any more: nothing of it reaches the result's last digit."""


@dataclass(frozen=True)
class AffineMap:
    """``x_end = end + A (x_start - about)``: the filter's levels after a stretch of samples, from those before it.

    The map is written about a start that is near the true one. A filter that remembers for long has an `A` near the identity,
    and its rounding is then multiplied by a small difference instead of by the state.

    Attributes
    ----------
    about
        (order,) a start.
    end
        (order,) where that start leads to.
    matrix
        (order, order) A.

    Examples
    --------
    >>> halved = AffineMap(np.zeros(1), np.ones(1), np.full((1, 1), 0.5))
    >>> halved(np.array([4.0]))
    array([3.])
    >>> halved.then(halved)(np.array([4.0]))
    array([2.5])
    """

    about: Array
    end: Array
    matrix: Array

    @classmethod
    def constant(cls, end: Array) -> "AffineMap":
        """Make the map to one end, whatever the start."""
        return cls(np.zeros_like(end), end, np.zeros((end.size, end.size)))

    def __call__(self, start: Array) -> Array:
        """Return the levels at the end."""
        # What overflows shows when the part is filtered.
        with np.errstate(over="ignore", invalid="ignore"):
            return self.end + self.matrix @ (start - self.about)

    def then(self, later: "AffineMap") -> "AffineMap":
        """Return the map over this stretch and the one that follows it."""
        return AffineMap(self.about, later(self.end), later.matrix @ self.matrix)

    @property
    def forgets(self) -> bool:
        """Whether the end does not depend on the start."""
        return bool(np.abs(self.matrix).max() < FORGOTTEN)
