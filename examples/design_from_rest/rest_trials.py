"""The recordings: a sensor that lies still, then moves, with the true vertical by optical tracking."""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pyarrow import parquet

Array = npt.NDArray[np.float64]

RECORDINGS = Path(
    os.environ.get("COMPFILT_RECORDINGS", Path(__file__).resolve().parents[3] / "shared" / "broad")
)

TOUCHED = np.radians(1.0)
"""A rate further than this from its median at the start is no rest any more, in rad/s."""

MARGIN = 0.9
"""The share of the first rest that counts as such: the hand comes near before it touches."""


class Trial(NamedTuple):
    """One recording in SI units; the gyro without the mean of the first rest."""

    name: str
    fs: float
    gyro: Array
    acc: Array
    up: Array
    """Up in the sensor's axes by optical tracking; NaN where it was not seen."""
    moves: npt.NDArray[np.bool_]
    rest: int
    """How many samples the first rest has."""


def trials() -> list[Trial]:
    """Return all recordings that are at hand."""
    return [read(path) for path in sorted(RECORDINGS.glob("*.parquet"))]


def read(path: Path) -> Trial:
    """Read one trial of BROAD."""
    table = parquet.read_table(path)

    def columns(*names: str) -> Array:
        return np.column_stack([table.column(name).to_numpy().astype(float) for name in names])

    w, x, y, z = columns("ref_qw", "ref_qx", "ref_qy", "ref_qz").T
    gyro = columns("gx", "gy", "gz")
    away = np.max(np.abs(gyro - np.median(gyro[:2000], axis=0)), axis=1)
    rest = int(MARGIN * np.argmax(away > TOUCHED))
    return Trial(
        path.stem,
        1.0 / float(np.median(np.diff(columns("t")[:, 0]))),
        gyro - gyro[:rest].mean(axis=0),
        columns("ax", "ay", "az"),
        np.column_stack((2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)),
        table.column("movement").to_numpy().astype(bool),
        rest,
    )
