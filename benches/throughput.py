"""Throughput of the linear filters against numpy.add, scipy.signal.lfilter and numba, all in one run.

    python benches/throughput.py [--samples 4e6] [--rounds 7]

Every figure is the best of several rounds in which all have their turn, because the machine's speed drifts: the ratios
count, not the nanoseconds. All write into a given array, as ``numpy.add(a, b, out=c)`` does.
"""

import argparse
import sys
from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import DTypeLike

import compfilt as cf
from peers import numba_loop, two_lfilters
from timing import ROUNDS, Call, Signal, add_on_two_threads, best_times, machine, ratio, table

FS = 100.0
DESIGNS = {
    "first order": cf.FirstOrder(0.5),
    "PI": cf.PiForm(2.0, 1.0),
    "Butterworth 2, split 1": cf.Butterworth(2.0, split=1),
    "Butterworth 4": cf.Butterworth(2.0, order=4),
    "third order": cf.ThirdOrder(2.0),
}
ADD, ADD_ON_TWO = "numpy.add", "numpy.add, two threads"

Signals = tuple[Signal, Signal, Signal]
Contender = tuple[str, str, Call]
"""The filter, the implementation, and a call of it."""


def signals_of(shape: tuple[int, ...], dtype: DTypeLike, order: str = "C") -> Signals:
    """Measurement, derivative, and where the result goes."""
    generator = np.random.default_rng(1)
    y, u = (np.asarray(generator.normal(size=shape), dtype=dtype, order=order) for _ in range(2))
    return y, u, np.empty_like(y)


def baselines(signals: Signals) -> Iterator[Contender]:
    """What reads and writes as much and computes nothing, on one core and on two."""
    y, u, out = signals
    yield "", ADD, partial(np.add, y, u, out=out)
    yield "", ADD_ON_TWO, add_on_two_threads(y, u, out)


def ours(name: str, signals: Signals) -> Iterator[Contender]:
    """The filter with and without the exact order of arithmetic, on one core and on two."""
    y, u, out = signals
    for exact in (True, False):
        for workers in (1, 2):
            label = "compfilt" + ("" if exact else ", exact=False") + (", 2 workers" if workers > 1 else "")
            call = partial(DESIGNS[name].filter, y, u, fs=FS, exact=exact, workers=workers, out=out)
            yield name, label, call


def others(name: str, signals: Signals) -> Iterator[Contender]:
    """The same filter by numba and by scipy."""
    yield name, "numba", numba_loop(name, DESIGNS[name], FS, signals)
    # In float32 the coefficients of a higher order are too coarse for lfilter's form.
    if signals[0].dtype == np.float64 or DESIGNS[name].order <= 2:
        yield name, "scipy lfilter", two_lfilters(DESIGNS[name], FS, signals)


def check(contender: Contender, signals: Signals) -> None:
    """Refuses to time what computes something else; another start has died away at the end."""
    y, u, out = signals
    name, label, call = contender
    expected = DESIGNS[name].filter(y, u, fs=FS)
    call()
    tolerance = 1e-6 if y.dtype == np.float64 else 1e-2
    if not np.allclose(out[-1000:], expected[-1000:], atol=tolerance):
        msg = f"{label} is not the filter {name}"
        raise ValueError(msg)


def timed(contenders: list[Contender], samples: int, rounds: int) -> Iterator[tuple[str, ...]]:
    """The rows of the table: nanoseconds a sample, and ratios."""
    best = best_times([call for _, _, call in contenders], rounds=rounds)
    times = {
        (name, label): seconds / samples * 1e9
        for (name, label, _), seconds in zip(contenders, best, strict=True)
    }
    for (name, label), time in times.items():
        to = times["", ADD], times["", ADD_ON_TWO], times.get((name, "compfilt"))
        yield name, label, f"{time:.2f}", *(ratio(time, other) for other in to)


def one_channel(dtype: DTypeLike, samples: int, rounds: int) -> None:
    """Every filter and its peers."""
    signals = signals_of((samples,), dtype)
    contenders = list(baselines(signals))
    for name in DESIGNS:
        rivals = list(others(name, signals))
        for rival in rivals:
            check(rival, signals)
        contenders += [*ours(name, signals), *rivals]
    show(f"One channel of {samples} samples, {np.dtype(dtype)}", timed(contenders, samples, rounds))


def many_channels(channels: int, order: str, samples: int, rounds: int) -> None:
    """Two filters on columns; the samples of all channels together are as many."""
    signals = signals_of((samples // channels, channels), np.float64, order)
    contenders = list(baselines(signals))
    for name in ("first order", "PI"):
        contenders += ours(name, signals)
    shape = f"({samples // channels}, {channels})"
    title = f"{shape} in {'C' if order == 'C' else 'Fortran'} order, float64"
    show(title, timed(contenders, signals[0].size, rounds))


def show(title: str, rows: Iterator[tuple[str, ...]]) -> None:
    """Prints one table."""
    header = ["filter", "implementation", "ns a sample", f"x {ADD}", f"x {ADD_ON_TWO}", "x compfilt"]
    print(f"\n{title}:\n\n{table(header, rows)}", flush=True)


def main() -> int:
    """Times everything and prints the tables."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--samples", type=float, default=4e6)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    arguments = parser.parse_args()
    samples, rounds = int(arguments.samples), arguments.rounds
    print(f"Linear filters, best of {rounds} interleaved rounds; {machine()}")
    for dtype in (np.float64, np.float32):
        one_channel(dtype, samples, rounds)
    for channels in (3, 8, 64):
        for order in ("C", "F"):
            many_channels(channels, order, samples, rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
