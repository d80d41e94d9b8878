"""What the benches share: calls timed in turns, and tables in Markdown."""

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from timeit import default_timer
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROUNDS = 7
SHORTEST = 2e-3
"""s that one measurement lasts at least: a short call is repeated."""

Call = Callable[[], object]
Signal = NDArray[np.floating[Any]]


def best_times(calls: Sequence[Call], *, rounds: int = ROUNDS) -> list[float]:
    """The least time of each call in s, over rounds in which every call has its turn.

    The machine's speed drifts: the turns let it drift for all alike, and the least time is the one least disturbed.
    """
    repeats = [repeats_of(call) for call in calls]
    best = [np.inf] * len(calls)
    for _ in range(rounds):
        for index, (call, repeat) in enumerate(zip(calls, repeats, strict=True)):
            best[index] = min(best[index], time_of(call, repeat))
    return best


def repeats_of(call: Call) -> int:
    """How often to call for a measurement that is long enough; the first call is not counted."""
    call()
    repeats = 1
    while (taken := time_of(call, repeats) * repeats) < SHORTEST:
        repeats = max(2 * repeats, int(repeats * SHORTEST / max(taken, 1e-7)))
    return repeats


def time_of(call: Call, repeats: int) -> float:
    """The mean time of a call in s."""
    start = default_timer()
    for _ in range(repeats):
        call()
    return (default_timer() - start) / repeats


def add_on_two_threads(a: Signal, b: Signal, out: Signal) -> Call:
    """numpy.add by two threads, a half of the rows each: what both cores can read and write."""
    pool = ThreadPoolExecutor(2)
    middle = len(a) // 2
    halves = [(a[rows], b[rows], out[rows]) for rows in (slice(middle), slice(middle, None))]

    def add_half(half: tuple[Signal, Signal, Signal]) -> None:
        np.add(half[0], half[1], out=half[2])

    return lambda: list(pool.map(add_half, halves))


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown; what stands right of the words are numbers."""
    lines = [list(header), ["---"] * len(header), *map(list, rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def ratio(value: float, to: float | None) -> str:
    """How many times; empty where there is nothing to compare with."""
    return "" if to is None else f"{value / to:.2f}"


def machine() -> str:
    """The processor and its cores in a line."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:  # noqa: PTH123
        names = [line.split(": ", 1)[1].strip() for line in file if line.startswith("model name")]
    return f"{names[0] if names else 'unknown processor'}, {os.cpu_count()} cores, numpy {np.__version__}"
