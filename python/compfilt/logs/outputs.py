"""What a recipe asks for, what a filter's result offers by name, and how it is taken out."""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt.logs.errors import RecipeError
from compfilt.logs.units import Unit

__all__ = ["FLAGS", "Channel", "Offer", "Output", "absent_vector", "choose", "offer_of", "vector"]

FLAGS = "flags"
"""The output column that says what happened to each sample; it has no unit."""


@dataclass(frozen=True)
class Output:
    """The columns to write, their unit, and the input columns to carry along."""

    columns: tuple[str, ...]
    unit: Unit
    gravity_unit: Unit
    keep: tuple[str, ...]


class Channel(NamedTuple):
    """One output column: ``getattr(estimate, attribute)[index]`` in `unit`; without one it is taken as it is."""

    name: str
    attribute: str
    index: Any
    unit: Unit | None

    def take(self, estimate: object, dtype: npt.DTypeLike) -> npt.NDArray[np.generic]:
        """Take the column out of an estimate, in its unit."""
        values = np.asarray(getattr(estimate, self.attribute))[self.index]
        if self.unit is None:
            return np.ascontiguousarray(values)
        # In float64, so that float32 is rounded once.
        converted: npt.NDArray[np.float64] = np.divide(values, self.unit.factor, dtype=np.float64, order="C")
        return converted.astype(dtype, copy=False)


class Offer(NamedTuple):
    """What a recipe can ask for.

    `columns` has the columns that each name stands for. `absent` has, for names that a recipe of this kind may well ask
    for but this one does not give, the reason.
    """

    columns: Mapping[str, tuple[Channel, ...]]
    absent: Mapping[str, str]


def vector(name: str, unit: Unit, axes: str = "xyz") -> tuple[Channel, ...]:
    """List the columns of an attribute (n, len(axes)) that holds a vector in body axes."""
    return tuple(Channel(f"{name}_{axis}", name, np.s_[:, i], unit) for i, axis in enumerate(axes))


def absent_vector(name: str, reason: str) -> dict[str, str]:
    """Say of a vector and each of its columns why it is not there."""
    return dict.fromkeys((name, *(f"{name}_{axis}" for axis in "xyz")), reason)


def offer_of(groups: Mapping[str, tuple[Channel, ...]], absent: Mapping[str, str] | None = None) -> Offer:
    """Make an offer of groups of columns, of each column by itself, and of the flags."""
    columns = dict(groups)
    columns |= {channel.name: (channel,) for group in groups.values() for channel in group}
    columns[FLAGS] = (Channel(FLAGS, "flags", slice(None), None),)
    return Offer(columns, absent or {})


def choose(output: Output, offer: Offer, source: str) -> tuple[Channel, ...]:
    """Find the columns that a recipe asks for among those that its filter has.

    Raises
    ------
    RecipeError
        The filter does not have one, or one has the name of a column that is carried along.
    """
    channels: dict[str, Channel] = {}
    for name in output.columns:
        if name not in offer.columns:
            rest = _reason(name, offer.absent) or _alternatives(name, offer.columns)
            raise RecipeError(f'{source}: [output] columns: this filter has no "{name}"{rest}')
        channels |= {channel.name: channel for channel in offer.columns[name]}
    clash = [name for name in output.keep if name in channels]
    if clash:
        raise RecipeError(f'{source}: [output] "{clash[0]}" stands in both columns and keep')
    return tuple(channels.values())


def _reason(name: str, absent: Mapping[str, str]) -> str:
    return f": {absent[name]}" if name in absent else ""


def _alternatives(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    hint = f' (did you mean "{near[0]}"?)' if near else ""
    return f"{hint}; it has {', '.join(known)}"
