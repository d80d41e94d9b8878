"""Cost against size: time per sample over samples, channels, orders and cores, and memory over samples.

    python benches/cost.py [--largest 1e7] [--samples 4e6]

Writes results/cost.csv and results/cost.png beside this file. Times are the best of several rounds in which all calls of
a point have their turn; numpy.add of the same arrays is the reference. ``--largest 1e8`` needs 2.4 GB for its arrays.
"""

import argparse
import csv
import sys
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields

import numpy as np

from cost_calls import Kind, call_of, signals_of
from cost_memory import extra_bytes_in_a_fresh_process
from cost_plot import RESULTS, draw
from timing import best_times, machine

ROUNDS = 9
CHANNELS = 1, 2, 4, 8, 16, 64
ORDERS = 1, 2, 3, 4, 5, 6
SMALLEST = 100
SMALLEST_OF_MEMORY = 10_000


@dataclass(frozen=True)
class Point:
    """A line of the results; empty is what was not measured there."""

    sweep: str
    implementation: str
    samples: int
    channels: int
    order: int
    exact: bool
    workers: int
    nanoseconds_per_sample: float | str = ""
    extra_bytes: int | str = ""


def kinds(order: int) -> list[Kind]:
    """The reference, and the filter in its four ways."""
    ways = [(exact, workers) for exact in (True, False) for workers in (1, 2)]
    return [Kind("numpy.add"), *(Kind("compfilt", order, *way) for way in ways)]


def point(sweep: str, kind: Kind, samples: int, channels: int, **measured: float) -> Point:
    """A point without what was measured, or with it."""
    return Point(sweep, kind.name, samples, channels, kind.order, kind.exact, kind.workers, **measured)


def times(sweep: str, order: int, samples: int, channels: int = 1) -> Iterator[Point]:
    """The times of every kind at one size."""
    signals = signals_of(samples, channels)
    count = signals[0].size
    best = best_times([call_of(kind, signals) for kind in kinds(order)], rounds=ROUNDS)
    for kind, seconds in zip(kinds(order), best, strict=True):
        nanoseconds = round(seconds / count * 1e9, 4)
        yield point(sweep, kind, count, channels, nanoseconds_per_sample=nanoseconds)


def memory(samples: int) -> Iterator[Point]:
    """The memory of every kind at one size."""
    for kind in kinds(order=2):
        extra = extra_bytes_in_a_fresh_process(kind, samples)
        yield point("memory", kind, samples, 1, extra_bytes=extra)


def sizes(smallest: int, largest: float) -> list[int]:
    """Two in a decade."""
    steps = round(2 * np.log10(largest / smallest)) + 1
    return [round(smallest * 10 ** (step / 2)) for step in range(steps)]


def every_point(largest: float, samples: int) -> Iterator[Point]:
    """The sweeps, one after the other."""
    for size in sizes(SMALLEST, largest):
        yield from times("samples", 2, size)
    for channels in CHANNELS:
        yield from times("channels", 2, samples, channels)
    for order in ORDERS:
        yield from times("order", order, samples)
    for size in sizes(SMALLEST_OF_MEMORY, largest):
        yield from memory(size)


def main() -> int:
    """Measures every point, writes it as it comes, and draws."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--largest", type=float, default=1e7, help="samples of the largest point")
    parser.add_argument(
        "--samples", type=float, default=4e6, help="samples of all channels, and of all orders"
    )
    arguments = parser.parse_args()
    print(f"Cost against size, best of {ROUNDS} interleaved rounds; {machine()}")
    RESULTS.mkdir(exist_ok=True)
    table = RESULTS / "cost.csv"
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([field.name for field in fields(Point)])
        for measured in every_point(arguments.largest, int(arguments.samples)):
            writer.writerow(astuple(measured))
            print(".", end="", file=sys.stderr, flush=True)
    print(f"\n{table}\n{draw(table)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
