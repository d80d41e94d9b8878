"""What a small call costs: one sample of a stream, and a hundred samples of a batch.

    python benches/small_calls.py [--rounds 7]

Every figure is the best of several rounds in which all have their turn. The loop around the call costs as much for all.
"""

import argparse
import sys
from collections.abc import Iterator
from functools import partial
from itertools import repeat

import numpy as np
import vqf
from scipy.signal import lfilter

import compfilt as cf
from timing import ROUNDS, Call, best_times, machine, table

FS = 100.0
CALLS = 1000
"""Calls of one sample in a measurement."""

DESIGNS = {
    "first order": cf.FirstOrder(0.5),
    "PI": cf.PiForm(2.0, 1.0),
    "third order": cf.ThirdOrder(2.0),
}


class PurePython:
    """The PI form as it is written without a library."""

    def __init__(self) -> None:
        self.dt, self.gains, self.levels = 1 / FS, (0.02, 0.0098), (0.0, 0.0)

    def update(self, y: float, u: float) -> float:
        """One sample."""
        angle, bias = self.levels
        angle += self.dt * (bias + u)
        innovation = y - angle
        self.levels = angle + self.gains[0] * innovation, bias + self.gains[1] * innovation
        return self.levels[0]


def many(call: Call) -> Call:
    """So many calls in a row."""

    def run() -> None:
        for _ in repeat(None, CALLS):
            call()

    return run


def single_samples() -> Iterator[tuple[str, Call]]:
    """One sample at a time: Python floats for the linear filters, arrays of three for the attitude."""
    yield "pure Python, PI", partial(PurePython().update, 0.1, 0.2)
    for name, design in DESIGNS.items():
        yield f"Stream.update, {name}", partial(design.stream(fs=FS).update, 0.1, 0.2)
    gyr, acc = np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.2, 9.81])
    attitudes = {
        "Mahony": cf.Mahony(kp=0.2, ki=0.003),
        "GravityFilter": cf.GravityFilter(),
        "GravityFilter, self-calibrating": cf.GravityFilter(self_calibrating=True),
    }
    for name, attitude in attitudes.items():
        yield f"AttitudeStream.update, {name}", partial(attitude.stream(fs=FS).update, gyr, acc)
    yield "vqf VQF.update", partial(vqf.VQF(1 / FS).update, gyr, acc)


def short_batches(samples: int) -> Iterator[tuple[str, Call]]:
    """A hundred samples a call."""
    y, u = np.random.default_rng(1).normal(size=(2, samples))
    out = np.empty_like(y)
    yield "numpy.add", partial(np.add, y, u, out=out)
    yield "scipy lfilter, one branch", partial(lfilter, [0.02], [1.0, -0.98], y)
    for name, design in DESIGNS.items():
        yield f"filter, {name}", partial(design.filter, y, u, fs=FS, out=out)


def main() -> int:
    """Times everything and prints the tables."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    rounds = parser.parse_args().rounds
    print(f"Small calls, best of {rounds} interleaved rounds; {machine()}")
    names, calls = zip(*single_samples(), strict=True)
    times = best_times([many(call) for call in calls], rounds=rounds)
    rows = [(name, f"{time / CALLS * 1e9:.0f}") for name, time in zip(names, times, strict=True)]
    print(f"\nOne sample a call:\n\n{table(['call', 'ns'], rows)}")
    samples = 100
    names, calls = zip(*short_batches(samples), strict=True)
    rows = [
        (name, f"{time * 1e6:.2f}")
        for name, time in zip(names, best_times(calls, rounds=rounds), strict=True)
    ]
    print(f"\n{samples} samples a call:\n\n{table(['call', 'µs'], rows)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
