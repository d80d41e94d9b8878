"""The kinds of design that gains are chosen for, each as a family of stable filters."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from compfilt._core import (
    Butterworth,
    Chain,
    FirstOrder,
    LinearFilter,
    PiForm,
    SecondOrderInertial,
    ThirdOrder,
)
from compfilt.constants import HIGHEST_ORDER

__all__ = ["KINDS", "Family", "family"]

Array = npt.NDArray[np.float64]

_ORDERS = {"first_order": (1, 1), "pi": (2, 1), "third_order": (3, 2), "second_order_inertial": (2, 2)}
"""Order and derivative order of the kinds that leave no choice."""

KINDS = ("first_order", "pi", "butterworth", "third_order", "second_order_inertial", "chain")
"""Every kind, as it is written in a recipe."""


@dataclass(frozen=True)
class Family:
    """The designs of one kind, order and split.

    A kind with one free gain (`first_order`, `butterworth`, `second_order_inertial` with Butterworth poles) is scaled in
    time only. The others are free in all their gains.
    """

    kind: str
    order: int
    derivative_order: int
    split: int

    @property
    def walks_absorbed(self) -> int:
        """How many times a random error of the derivative may be integrated and the estimate still stays near."""
        return self.split - self.derivative_order

    @property
    def free(self) -> int:
        """How many numbers choose a member."""
        return 1 if self.kind in {"first_order", "butterworth", "second_order_inertial"} else self.order

    def butterworth(self, omega0: float) -> LinearFilter:
        """Return the member with Butterworth poles at omega0 rad/s."""
        if self.kind == "butterworth":
            return Butterworth(omega0, self.order, split=self.split)
        if self.kind == "second_order_inertial":
            return SecondOrderInertial.butterworth(omega0)
        return self.of_coefficients(Butterworth(omega0, self.order).coefficients)

    def of_coefficients(self, coefficients: tuple[float, ...]) -> LinearFilter:
        """Return the member with the gains k_1 ... k_N; where one gain is free, the one with that k_N."""
        match self.kind:
            case "first_order":
                return FirstOrder(1.0 / coefficients[0])
            case "pi":
                return PiForm(*coefficients)
            case "third_order":
                return ThirdOrder.from_gains(*coefficients)
            case "chain":
                return Chain(coefficients, self.derivative_order, self.split)
            case _:
                return self.butterworth(coefficients[-1] ** (1.0 / self.order))

    def member(self, logarithms: Array) -> LinearFilter:
        """Return the member that `free` numbers choose: every choice is a stable filter, and every member has one.

        The numbers are the logarithms of Schwarz's b_1 ... b_N: P_k = s P_(k-1) + b_k P_(k-2) with P_0 = 1 and
        P_1 = s + b_1 makes every polynomial P_N whose roots lie in the left half-plane once, from positive numbers. (Products of
        quadratic factors make some of them twice, and a search gets stuck there.) With one free gain it is omega0.
        """
        if self.free == 1:
            return self.butterworth(float(np.exp(logarithms[0])))
        first, *others = np.exp(logarithms)
        before, product = np.ones(1), np.array([1.0, first])
        for b in others:
            before, product = product, np.append(product, 0.0) + np.concatenate(([0.0, 0.0], b * before))
        return self.of_coefficients(tuple(product[1:]))

    def start(self, omega0: float) -> Array:
        """Return the numbers of `member` for Butterworth poles: b_k by the first column c of Routh's array."""
        if self.free == 1:
            return np.log([omega0])
        polynomial = np.array([1.0, *Butterworth(omega0, self.order).coefficients, 0.0])
        upper, lower = polynomial[0::2], polynomial[1::2]
        column = []
        for _ in range(self.order + 1):
            column.append(upper[0])
            lower = np.append(lower, np.zeros(upper.size - lower.size))
            upper, lower = lower, np.append(upper[1:] - upper[0] / (lower[0] or 1.0) * lower[1:], 0.0)
        c = np.array(column)
        logarithms: Array = np.log(np.concatenate((c[1:2], c[2:] / c[:-2])))
        return logarithms


def family(
    kind: str, order: int | None = None, split: int | None = None, derivative_order: int | None = None
) -> Family:
    """Check a kind and what belongs to it.

    Raises
    ------
    ValueError
        If the kind is unknown, or order, split and derivative order do not go with it.
    """
    if kind not in KINDS:
        raise ValueError(f"kind must be one of {', '.join(KINDS)}, not {kind!r}")
    if kind in _ORDERS:
        for name, value in (("order", order), ("split", split), ("derivative_order", derivative_order)):
            if value is not None:
                raise ValueError(
                    f"{name} does not belong to kind {kind!r}: it belongs to 'butterworth' and 'chain'"
                )
        order, derivative = _ORDERS[kind]
        return Family(kind, order, derivative, order)
    if kind == "butterworth" and derivative_order not in {None, 1}:
        raise ValueError("derivative_order does not belong to kind 'butterworth': use 'chain'")
    order = _whole("order", 2 if order is None else order, 1, HIGHEST_ORDER)
    derivative = _whole("derivative_order", 1 if derivative_order is None else derivative_order, 1, order)
    split = _whole("split", order if split is None else split, 1, order)
    if split < order and derivative > 1:
        raise ValueError("split must be the order where derivative_order is above 1")
    return Family(kind, order, derivative, split)


def _whole(name: str, value: int, least: int, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
        raise ValueError(f"{name} must be a whole number from {least} to {most}, not {value!r}")
    return int(value)
