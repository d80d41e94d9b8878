"""What the firmware wrote down: every filter's outputs and costs."""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

NAME = 32
SETTLED = 4096
NUMBERS = struct.Struct("<5I")


@dataclass(frozen=True)
class Measured:
    """One filter on one board."""

    outputs: NDArray[np.float32]
    """(samples, outputs)."""
    state: int
    """Bytes."""
    stack: int
    """Bytes below the caller."""
    most: int
    """Instructions of the dearest update."""
    mean: float
    """Instructions of an update, once the filter's start is over."""


def read(path: Path, samples: int) -> dict[str, Measured]:
    """The report of examples/firmware/src/report.rs."""
    content = path.read_bytes()
    filters = {}
    place = 0
    while place < len(content):
        name = content[place : place + NAME].rstrip(b"\0").decode()
        columns, state, stack, most, settled = NUMBERS.unpack_from(content, place + NAME)
        place += NAME + NUMBERS.size
        outputs = np.frombuffer(content, "<f4", samples * columns, place).reshape(samples, columns)
        place += outputs.nbytes
        filters[name] = Measured(outputs, state, stack, most, settled / SETTLED)
    return filters


def first_difference(name: str, got: NDArray[np.float32], wanted: NDArray[np.float32]) -> str | None:
    """A sentence that names the first output with other bits, or None where all are the same."""
    if got.shape != wanted.shape:
        return f"{name}: the firmware has {got.shape} outputs, Python {wanted.shape}"
    ours, theirs = got.view("<u4"), np.ascontiguousarray(wanted).view("<u4")
    differing = np.argwhere(ours != theirs)
    if not differing.size:
        return None
    sample, column = differing[0]
    return (
        f"{name}: sample {sample}, output {column} is {got[sample, column]!s} ({ours[sample, column]:#010x}), "
        f"in Python {wanted[sample, column]!s} ({theirs[sample, column]:#010x}); "
        f"{len(differing)} of {ours.size} outputs differ"
    )
