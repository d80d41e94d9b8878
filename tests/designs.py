"""Every linear design beside its reference, and what the tests of the binding share."""

from __future__ import annotations

import copy
import pickle
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pytest

import compfilt as cf
import reference as ref

if TYPE_CHECKING:
    from collections.abc import Callable

CHAIN_4 = (6.0, 13.0, 12.0, 4.0)


@dataclass(frozen=True)
class Case:
    """A design as a function of how fast it is (rad/s), its reference, and the rule it runs with."""

    name: str
    make: Callable[[float], cf.LinearFilter]
    reference: Callable[[float], ref.Design]
    rule: str = "backward_euler"

    @property
    def design(self):
        return self.make(3.0)

    @property
    def is_rate(self):
        return isinstance(self.design, cf.RateFilter)

    @property
    def can_match(self):
        return self.design.split == self.design.order and not self.is_rate


def scaled(coefficients, omega):
    return [k * omega ** (i + 1) for i, k in enumerate(coefficients)]


def butterworth(order, **keywords):
    name = ", ".join([f"butterworth {order}", *(f"{key} {value}" for key, value in keywords.items())])
    return Case(
        name,
        lambda omega: cf.Butterworth(omega, order, **keywords),
        lambda omega: ref.butterworth(omega, order, **keywords),
    )


def chain(derivative_order=1, split=None):
    return Case(
        f"chain 4, derivative {derivative_order}, split {split or 4}",
        lambda omega: cf.Chain(scaled(CHAIN_4, omega), derivative_order, split),
        lambda omega: ref.chain(scaled(CHAIN_4, omega), derivative_order, split or 0),
    )


PLAIN = [
    Case("first order", lambda w: cf.FirstOrder(1 / w), lambda w: ref.first_order(1 / w)),
    Case("pi", lambda w: cf.PiForm(w, w**2 / 3), lambda w: ref.pi_form(w, w**2 / 3)),
    *(butterworth(order) for order in range(1, 7)),
    butterworth(2, q=0.1),
    *(butterworth(order, split=split) for order in (2, 3, 4) for split in range(1, order)),
    butterworth(2, q=2.0, split=1),
    butterworth(6, split=3),
    Case("third order", lambda w: cf.ThirdOrder(1 / w), lambda w: ref.third_order(1 / w)),
    Case(
        "third order, gains",
        lambda w: cf.ThirdOrder.from_gains(w, w**2, w**3 / 2),
        lambda w: ref.chain((w, w**2, w**3 / 2), 2),
    ),
    Case("third order, butterworth", cf.ThirdOrder.butterworth, ref.third_order_butterworth),
    Case("inertial", lambda w: cf.SecondOrderInertial(1 / w), lambda w: ref.second_order_inertial(1 / w)),
    Case("inertial, butterworth", cf.SecondOrderInertial.butterworth, ref.second_order_inertial_butterworth),
    *(chain(derivative_order) for derivative_order in range(1, 5)),
    chain(split=2),
    Case("rate", lambda w: cf.RateFilter(1 / w), lambda w: ref.first_order(1 / w)),
]
MATCHED = [
    Case(f"{case.name}, matched", case.make, case.reference, "matched") for case in PLAIN if case.can_match
]
# One of every kind of code: orders 1 to 3, matched, a split, the rate filter.
FEW_NAMES = ("first order", "pi, matched", "butterworth 3, split 1", "third order", "rate")

all_plain = pytest.mark.parametrize("case", PLAIN, ids=lambda case: case.name)
all_cases = pytest.mark.parametrize("case", PLAIN + MATCHED, ids=lambda case: case.name)
# The rate filter takes the change of its first signal: it has no impulse response from rest, and no separate prediction.
all_linear_cases = pytest.mark.parametrize(
    "case", [case for case in PLAIN + MATCHED if not case.is_rate], ids=lambda case: case.name
)
all_matched = pytest.mark.parametrize("case", MATCHED, ids=lambda case: case.name)
few_cases = pytest.mark.parametrize(
    "case", [case for case in PLAIN + MATCHED if case.name in FEW_NAMES], ids=lambda case: case.name
)
precisions = pytest.mark.parametrize("dtype", [np.float32, np.float64], ids=["float32", "float64"])


def random_signals(rows, channels=None, *, seed=1, dtype=float):
    """A measurement and a derivative of unit size."""
    rng = np.random.default_rng(seed)
    shape = (rows,) if channels is None else (rows, channels)
    return rng.normal(size=shape).astype(dtype), rng.normal(size=shape).astype(dtype)


def bits(array):
    """The numbers as integers: NaN and minus zero compare like everything else."""
    array = np.ascontiguousarray(array)
    return array.view(f"u{array.dtype.itemsize}") if array.dtype.kind == "f" else array


def assert_same_bits(got, expected):
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.dtype == expected.dtype
    np.testing.assert_array_equal(bits(got), bits(expected))


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


def same(thing):
    return thing


def restored(stream):
    """A new stream of the same kind that is given the state: only the state may matter."""
    other = copy.deepcopy(stream)
    other.reset()
    other.state = stream.state
    return other
