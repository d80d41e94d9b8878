"""The memory that a call needs beyond its arrays, at its worst.

It is the peak of the resident memory (VmHWM of /proc/self/status, set back before the call) less what was resident
before, in a process of its own for every point. What the first call of a process sets up is left out. Linux only.

    python benches/cost_memory.py IMPLEMENTATION ORDER EXACT WORKERS SAMPLES
"""

import subprocess
import sys
from pathlib import Path

from cost_calls import Kind, call_of, signals_of

ENOUGH = 600_000
"""Samples of a first call that goes all ways of a larger one: the code itself becomes resident."""


def extra_bytes_in_a_fresh_process(kind: Kind, samples: int) -> int:
    """The extra memory of one call on so many samples."""
    arguments = [kind.name, str(kind.order), str(int(kind.exact)), str(kind.workers), str(samples)]
    return int(subprocess.check_output([sys.executable, __file__, *arguments], text=True))  # noqa: S603


def extra_bytes(kind: Kind, samples: int) -> int:
    """The same in this process."""
    call_of(kind, signals_of(min(samples, ENOUGH), 1))()
    signals = signals_of(samples, 1)
    signals[2][:] = 1.0  # Zeros are not resident before they are written.
    call = call_of(kind, signals)
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # Sets VmHWM back.
    before = resident("VmRSS")
    call()
    return resident("VmHWM") - before


def resident(what: str) -> int:
    """VmRSS or VmHWM of this process in bytes."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    (kilobytes,) = (line.split()[1] for line in lines if line.startswith(what))
    return 1024 * int(kilobytes)


if __name__ == "__main__":
    name, order, exact, workers, samples = sys.argv[1:]
    print(extra_bytes(Kind(name, int(order), bool(int(exact)), int(workers)), int(samples)))
