"""The calls of which time and memory are measured against size."""

from dataclasses import dataclass
from functools import partial

import numpy as np

import compfilt as cf
from timing import Call, Signal

Signals = tuple[Signal, Signal, Signal]


@dataclass(frozen=True)
class Kind:
    """An implementation, and how it is called; the order is the filter's."""

    name: str
    order: int = 0
    exact: bool = True
    workers: int = 1


def signals_of(samples: int, channels: int) -> Signals:
    """Two signals and a place for the result in float64; all channels together have so many samples."""
    shape = (samples,) if channels == 1 else (samples // channels, channels)
    generator = np.random.default_rng(1)
    return generator.random(shape), generator.random(shape), np.zeros(shape)


def call_of(kind: Kind, signals: Signals) -> Call:
    """A call that writes into the given array."""
    y, u, out = signals
    if kind.name == "numpy.add":
        return partial(np.add, y, u, out=out)
    design = cf.Butterworth(2.0, order=kind.order)
    return partial(design.filter, y, u, fs=100.0, exact=kind.exact, workers=kind.workers, out=out)
