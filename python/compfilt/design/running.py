"""The filter that runs at a sample rate, as matrices."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_discrete_lyapunov, solve_sylvester  # type: ignore[import-untyped]

from compfilt._core import LinearFilter, RateFilter
from compfilt.checks import sample_rate

__all__ = ["Rule", "Running", "rate_for"]

Array = npt.NDArray[np.float64]
Rule = Literal["backward_euler", "matched"]

LONGEST_STEP, SHORTEST_STEP = 1e3, 1e-12
"""Of a pole times the sample period. Beyond them the equations of the prediction lose all digits."""


def rate_for(design: LinearFilter, fs: float) -> float:
    """Return a sample rate in Hz, checked: one for which the error of a design can be predicted.

    Raises
    ------
    ValueError
        If it is no sample rate, or far off the filter's poles.
    """
    rate = sample_rate("fs", fs)
    if not isinstance(design, LinearFilter):
        return rate  # Running says so.
    speeds = np.abs(design.poles)
    lowest, highest = float(speeds.max()) / LONGEST_STEP, float(speeds.min()) / SHORTEST_STEP
    if not lowest <= rate <= highest:
        raise ValueError(
            f"fs must lie between {lowest:.3g} and {highest:.3g} Hz to predict the error of this filter, whose poles lie at "
            f"{speeds.min():.3g} to {speeds.max():.3g} rad/s, not {rate:g}"
        )
    return rate


@dataclass(frozen=True)
class Running:
    """A design at a sample rate: x(n) = A x(n-1) + B_y y(n) + B_u u(n), and the estimate is the first state.

    The matrices are read off the filter's own step, so that what is computed from them holds for the filter that runs,
    by either rule, and not for its continuous idealisation.

    Attributes
    ----------
    design : LinearFilter
        Any design but a `RateFilter`, whose first signal enters by its change.
    fs : float
        Sample rate in Hz.
    rule : {"backward_euler", "matched"}
        How the design becomes gains.
    """

    design: LinearFilter
    fs: float
    rule: Rule = "backward_euler"

    def __post_init__(self) -> None:
        if not isinstance(self.design, LinearFilter):
            raise TypeError(f"design must be a design of compfilt, not {type(self.design).__name__}")
        if isinstance(self.design, RateFilter):
            raise TypeError("design must not be a RateFilter: use its drift_free")

    @cached_property
    def _step(self) -> Array:
        """What one step makes of each state alone, of y alone and of u alone: (states, states + 2)."""
        order = self.design.order
        alone = np.eye(order + 2)
        levels = self.design.estimate(
            alone[order : order + 1],
            alone[order + 1 :],
            fs=self.fs,
            initial=alone[:order],
            rule=self.rule,
        ).levels
        # State i has the unit of the estimate per s^i. In units of the filter's own time all numbers are of one size.
        units = float(np.prod(np.abs(self.design.poles))) ** (np.arange(order) / order)
        step: Array = levels[:, 0].astype(np.float64) / units[:, np.newaxis]
        step[:, :order] *= units
        return step

    @property
    def A(self) -> Array:
        """What is left of the state after a step."""
        return self._step[:, :-2]

    @property
    def B_y(self) -> Array:
        """What a measurement adds to the state."""
        return self._step[:, -2]

    @property
    def B_u(self) -> Array:
        """What a derivative adds to the state."""
        return self._step[:, -1]

    @property
    def walks_absorbed(self) -> int:
        """How many times a random error of the derivative may be integrated and the estimate still stays near.

        HP has a zero of the order `split` at frequency 0; the integration of the derivative takes
        `derivative_order` of them.
        """
        return self.design.split - self.design.derivative_order

    def variance(self, enters: Array) -> float:
        """Return the variance of the estimate when noise of variance 1 a sample enters the state this way."""
        covariance = solve_discrete_lyapunov(self.A, np.outer(enters, enters), method="direct")
        return max(float(covariance[0, 0]), 0.0)

    def residual_variance(self) -> float:
        """Return the variance of measurement minus estimate when the measurement has noise of variance 1 a sample."""
        return 1.0 + self.variance(self.B_y) - 2.0 * float(self.B_y[0])

    def variance_of_walk(self, times: int) -> float:
        """Return the variance of the estimate when white noise of density 1, integrated `times` times, is added to u.

        The integrals b(n) = F b(n-1) + w(n) grow without bound, and so does the state that follows them, X b. What stays
        bounded is e = x - X b, if X F = A X + B_u b(n)'s share; the estimate follows b where the first row of X is 0.
        """
        if times > self.walks_absorbed:
            return np.inf
        T = 1.0 / self.fs
        level = np.arange(times)
        F = np.triu(T ** np.maximum(level - level[:, np.newaxis], 0.0))
        enters = np.outer(self.B_u, np.eye(times)[0])
        X = solve_sylvester(-self.A, F, enters @ F)
        return T * self.variance((enters - X) @ F[:, -1])

    def left_of_bias(self) -> float:
        """Return the error that a constant error of 1 of the derivative leaves in the estimate."""
        if self.walks_absorbed > 0:
            return 0.0
        return float(np.linalg.solve(np.eye(self.design.order) - self.A, self.B_u)[0])

    def responses(self, frequency: Array) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.complex128]]:
        """Return the complex responses from the measurement and from the derivative at frequencies in Hz."""
        z = np.exp(2j * np.pi * frequency / self.fs)[:, np.newaxis, np.newaxis]
        inputs = np.broadcast_to(self._step[:, -2:], (frequency.size, *self._step[:, -2:].shape))
        states = np.linalg.solve(np.eye(self.design.order) - self.A / z, inputs)
        return states[:, 0, 0], states[:, 0, 1]
