"""The designs that a recipe can name, and their parameters."""

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import compfilt
from compfilt.logs.table import Table
from compfilt.logs.units import ANGULAR_RATE, TIME

__all__ = ["KINDS", "Design", "parse_design"]


class _Form(NamedTuple):
    """One way to give a design: the constructor in `compfilt` and its parameters."""

    constructor: str
    required: tuple[str, ...]
    optional: tuple[str, ...] = ()


_FORMS = {
    "first_order": (_Form("FirstOrder", ("tau",)),),
    "pi": (_Form("PiForm", ("kp", "ki")),),
    "butterworth": (_Form("Butterworth", ("omega0",), ("order", "q", "split")),),
    "third_order": (
        _Form("ThirdOrder", ("tau",)),
        _Form("ThirdOrder.from_gains", ("k1", "k2", "k3")),
        _Form("ThirdOrder.butterworth", ("omega0",)),
    ),
    "second_order_inertial": (
        _Form("SecondOrderInertial", ("tau",)),
        _Form("SecondOrderInertial.butterworth", ("omega0",)),
    ),
    "chain": (_Form("Chain", ("coefficients",), ("derivative_order", "split")),),
    "rate": (_Form("RateFilter", ("tau",)),),
}

KINDS = tuple(_FORMS)
"""Every kind of design, as it is written in a recipe."""


@dataclass(frozen=True)
class Design:
    """A design as a recipe names it: a kind and its parameters in SI.

    Examples
    --------
    >>> Design("first_order", "FirstOrder", {"tau": 0.5}).derivative_order
    1
    """

    kind: str
    constructor: str
    parameters: Mapping[str, Any]

    @property
    def derivative_order(self) -> int:
        """Which derivative of the measurement the filter takes beside it (M)."""
        if self.kind in ("third_order", "second_order_inertial"):
            return 2
        return int(self.parameters.get("derivative_order", 1))

    def build(self) -> Any:  # noqa: ANN401 - any of the designs of compfilt
        """Make the design.

        Raises
        ------
        ValueError
            A parameter breaks its rule; the text comes from the core and names both.
        """
        constructor = operator.attrgetter(self.constructor)(compfilt)
        return constructor(**self.parameters)


def parse_design(table: Table) -> Design:
    """Read `kind` and the parameters of that kind, leaving the table's other keys alone."""
    kind = table.choice("kind", KINDS)
    form = _choose(table, kind)
    parameters = {name: _parameter(table, name) for name in form.required}
    parameters |= {name: _parameter(table, name) for name in form.optional if name in table}
    return Design(kind, form.constructor, parameters)


def _choose(table: Table, kind: str) -> _Form:
    """Find the one form whose parameters are given."""
    forms = _FORMS[kind]
    if len(forms) == 1:
        return forms[0]
    # A list and no generator: every name is looked up, so that each counts as known to the table.
    given = [form for form in forms if any([name in table for name in form.required])]  # noqa: C419
    if len(given) != 1:
        ways = ", or ".join(" and ".join(form.required) for form in forms)
        table.fail(f'kind = "{kind}" takes either {ways}')
    return given[0]


def _parameter(table: Table, name: str) -> object:
    """Read one parameter in the form that its name asks for."""
    match name:
        case "tau":
            return table.quantity(name, TIME)
        case "omega0":
            return table.quantity(name, ANGULAR_RATE)
        case "coefficients":
            return list(table.numbers(name))
        case "order" | "split" | "derivative_order":
            return table.get(name, table.as_integer)
        case _:
            return table.number(name)
