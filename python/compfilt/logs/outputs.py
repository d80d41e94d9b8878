"""What a filter's result offers by name, and how it is taken out."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt.logs.recipe import FLAGS

__all__ = ["Channel", "linear_channels", "tilt_channels"]


class Channel(NamedTuple):
    """One output column.

    It is taken as ``getattr(estimate, attribute)[index]``; its unit is the recipe's per second to the power `rate`.
    """

    name: str
    attribute: str
    index: Any
    rate: int

    def take(self, estimate: object, factor: float, dtype: npt.DTypeLike) -> npt.NDArray[np.generic]:
        """Take the column out of an estimate, in the output's unit."""
        values = np.asarray(getattr(estimate, self.attribute))[self.index]
        if self.name == FLAGS:
            return np.ascontiguousarray(values)
        # In float64, so that float32 is rounded once.
        return np.ascontiguousarray(values.astype(np.float64) / factor).astype(dtype, copy=False)

    def unit(self, name: str) -> str | None:
        """Return the name of the column's unit, given the recipe's."""
        if self.name == FLAGS:
            return None
        per_second = {0: "", 1: "/s"}.get(self.rate, f"/s^{self.rate}")
        return name + per_second


Offer = Mapping[str, tuple[Channel, ...]]
"""For each name that a recipe can ask for, the columns that it stands for."""


def linear_channels(estimate: object, derivative_order: int) -> Offer:
    """List what an estimate of a linear filter offers.

    Parameters
    ----------
    estimate
        An estimate of one channel, of any length: it says how many levels there are and whether there is a bias.
    derivative_order
        Which derivative of the measurement the filter takes (M); the bias is one of that derivative.
    """
    levels = len(np.asarray(estimate.levels))  # type: ignore[attr-defined]
    channels = [Channel(f"level{i}", "levels", i, i) for i in range(levels)]
    channels += [Channel("estimate", "levels", 0, 0)]
    if derivative_order == 2:
        channels += [Channel("position", "levels", 0, 0), Channel("velocity", "levels", 1, 1)]
    if _has(estimate, "bias"):
        channels += [Channel("bias", "bias", slice(None), derivative_order)]
    channels += [Channel(FLAGS, "flags", slice(None), 0)]
    return {channel.name: (channel,) for channel in channels}


def tilt_channels(estimate: object) -> Offer:
    """List what an estimate of roll and pitch offers; `bias` stands for both of its columns."""
    roll, pitch = (Channel(name, "angles", np.s_[:, i], 0) for i, name in enumerate(("roll", "pitch")))
    offer: dict[str, tuple[Channel, ...]] = {"roll": (roll,), "pitch": (pitch,)}
    if _has(estimate, "bias"):
        names = ("roll_bias", "pitch_bias")
        biases = tuple(Channel(name, "bias", np.s_[:, i], 1) for i, name in enumerate(names))
        offer |= {"bias": biases} | {channel.name: (channel,) for channel in biases}
    return offer | {FLAGS: (Channel(FLAGS, "flags", slice(None), 0),)}


def _has(estimate: object, name: str) -> bool:
    return getattr(estimate, name, None) is not None
