"""Inclination error of the roll and pitch filters on a folder of recordings with optical truth.

The metric is BROAD's (Laidig, Caruso, Cereatti, Seel 2021): the angle between the estimated and the true "up" in the
sensor's frame, root mean square in degrees over the samples that move and have a truth; a table gives the mean over the
recordings. Columns of the Parquet files: t, gx gy gz (rad/s), ax ay az (m/s^2), ref_qw ref_qx ref_qy ref_qz (sensor to
world, z up), movement.

    python benches/accuracy.py FOLDER [--search]
"""

import argparse
import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

import compfilt as cf


@dataclass(frozen=True)
class Recording:
    """One recording and its truth."""

    name: str
    t: np.ndarray
    gyr: np.ndarray
    acc: np.ndarray
    up: np.ndarray
    counts: np.ndarray


def up_of_quaternion(q: np.ndarray) -> np.ndarray:
    """The world's up in the body frame: the third row of the rotation body to world."""
    w, x, y, z = q.T
    return np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z])


def up_of_angles(angles: np.ndarray) -> np.ndarray:
    """The up direction of roll and pitch in flu axes: (-sin pitch, cos pitch sin roll, cos pitch cos roll)."""
    roll, pitch = angles.T
    return np.column_stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])


def read(path: Path) -> Recording:
    """Reads one recording."""
    table = pq.read_table(path)

    def columns(*names: str) -> np.ndarray:
        return np.column_stack([table[name].to_numpy() for name in names]).astype(float)

    q = columns("ref_qw", "ref_qx", "ref_qy", "ref_qz")
    counts = table["movement"].to_numpy().astype(bool) & np.isfinite(q).all(axis=1)
    return Recording(
        name=path.stem,
        t=columns("t")[:, 0],
        gyr=columns("gx", "gy", "gz"),
        acc=columns("ax", "ay", "az"),
        up=up_of_quaternion(q),
        counts=counts,
    )


def inclination_error(recording: Recording, up: np.ndarray) -> float:
    """Root mean square of the angle between two up directions, in degrees."""
    a, b = up[recording.counts], recording.up[recording.counts]
    angle = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
    return float(np.degrees(np.sqrt(np.mean(angle**2))))


def error_of(design: cf.LinearFilter, recordings: list[Recording]) -> list[float]:
    """The error of a tilt filter with this design on each recording."""
    tilt = cf.TiltFilter(design, axes="flu")
    return [inclination_error(r, up_of_angles(tilt.estimate(r.gyr, r.acc, t=r.t).angles)) for r in recordings]


def best(designs: list[cf.LinearFilter], recordings: list[Recording]) -> cf.LinearFilter:
    """The design with the least mean error."""
    return min(designs, key=lambda design: np.mean(error_of(design, recordings)))


def first_orders() -> list[cf.LinearFilter]:
    """Time constants from 0.25 s to 30 s."""
    return [cf.FirstOrder(tau) for tau in np.geomspace(0.25, 30, 22).round(3)]


def pi_forms() -> list[cf.LinearFilter]:
    """Proportional gains from 0.03 to 2 1/s with damping ratios from 0.5 to 16."""
    gains = product(np.geomspace(0.03, 2, 12), np.geomspace(0.5, 16, 6))
    return [cf.PiForm(round(kp, 4), round((kp / (2 * zeta)) ** 2, 8)) for kp, zeta in gains]


def main() -> int:
    """Prints the table."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--search", action="store_true", help="look for the best gains, also on halves")
    arguments = parser.parse_args()
    recordings = [read(path) for path in sorted(arguments.folder.glob("*.parquet"))]
    if not recordings:
        print(f"no recordings in {arguments.folder}", file=sys.stderr)
        return 1
    alone = [inclination_error(r, up_of_angles(cf.tilt(r.acc))) for r in recordings]
    rows: list[tuple[str, list[float]]] = [("accelerometer alone", alone)]
    designs: list[cf.LinearFilter] = [cf.FirstOrder(3.0), cf.PiForm(0.35, 0.0006)]
    if arguments.search:
        halves = recordings[::2], recordings[1::2]
        for family in (first_orders(), pi_forms()):
            designs.append(best(family, recordings))
            for tune, score in (halves, halves[::-1]):
                chosen = best(family, tune)
                rows.append((f"{chosen} tuned on one half, scored on the other", error_of(chosen, score)))
    rows += [(str(design), error_of(design, recordings)) for design in designs]
    for name, errors in rows:
        print(f"{np.mean(errors):8.3f} deg mean, {np.max(errors):8.3f} worst   {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
