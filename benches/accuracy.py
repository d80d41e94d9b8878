"""Inclination error of the tilt and attitude filters, and of other libraries where they are installed, on recordings.

The metric is BROAD's (Laidig, Caruso, Cereatti, Seel 2021): the angle between the estimated and the true "up" in the
sensor's frame, root mean square in degrees over the samples that move and have a truth; a table gives the mean over the
recordings. Columns of the Parquet files: t, gx gy gz (rad/s), ax ay az (m/s^2), ref_qw ref_qx ref_qy ref_qz (sensor to
world, z up), movement.

    python benches/accuracy.py FOLDER [--search] [--rate-divisor 3] [--rest 0.5 | --start-in-motion] [--alone]

The others come with requirements/bench.txt.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import product
from pathlib import Path
from types import ModuleType

import numpy as np
import pyarrow.parquet as pq

import compfilt as cf

AFTER_THE_START = 5.0
"""s from the beginning of the movement to where --start-in-motion begins."""


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


def part(recording: Recording, rows: slice) -> Recording:
    """Some rows of a recording."""
    return Recording(
        name=recording.name,
        t=recording.t[rows],
        gyr=recording.gyr[rows],
        acc=recording.acc[rows],
        up=recording.up[rows],
        counts=recording.counts[rows],
    )


def at_lower_rate(recording: Recording, divisor: int) -> Recording:
    """Block means of both sensors; time and truth are those at the end of a block, to where the mean rate leads."""
    blocks = recording.t.size // divisor

    def mean(signal: np.ndarray) -> np.ndarray:
        return signal[: blocks * divisor].reshape(blocks, divisor, 3).mean(axis=1)

    ends = part(recording, slice(divisor - 1, blocks * divisor, divisor))
    return Recording(ends.name, ends.t, mean(recording.gyr), mean(recording.acc), ends.up, ends.counts)


def beginning(recording: Recording, seconds: float) -> Recording:
    """The recording from so many seconds after the movement begins on; negative: before."""
    start = recording.t[np.argmax(recording.counts)] + seconds
    return part(recording, slice(int(np.searchsorted(recording.t, start)), None))


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


# ------------------------------------------------------------------------------------------------ filters of attitude

Estimator = Callable[[Recording], np.ndarray]
"""A recording to the estimated up in the sensor's frame."""


def estimator(attitude: cf.Mahony | cf.GravityFilter) -> Estimator:
    """The filter as it runs online."""
    return lambda recording: attitude.estimate(recording.gyr, recording.acc, t=recording.t).up


def smoother(attitude: cf.GravityFilter) -> Estimator:
    """The filter with the whole recording at hand."""
    return lambda recording: attitude.smooth(recording.gyr, recording.acc, t=recording.t).up


def attitude_filters() -> dict[str, Estimator]:
    """The library's own: a line for each configuration to compare."""
    online = {
        "Mahony(kp=0.2)": cf.Mahony(kp=0.2),
        "Mahony(kp=0.2, ki=0.003)": cf.Mahony(kp=0.2, ki=0.003),
        "GravityFilter()": cf.GravityFilter(),
        "GravityFilter(gyro_delay=0.0025)": cf.GravityFilter(gyro_delay=0.0025),
        "GravityFilter(self_calibrating=True)": cf.GravityFilter(self_calibrating=True),
    }
    offline = {"GravityFilter().smooth": cf.GravityFilter()}
    return {name: estimator(attitude) for name, attitude in online.items()} | {
        name: smoother(attitude) for name, attitude in offline.items()
    }


# ------------------------------------------------------------------------------------------------------ other libraries


def period(recording: Recording) -> float:
    """The mean sample period in s: the others take no times."""
    return float(np.mean(np.diff(recording.t)))


def vqf_filters(vqf: ModuleType) -> dict[str, Estimator]:
    """The vertical of VQF's three variants with their own parameters, without magnetometer."""

    def online(name: str) -> Estimator:
        def run(recording: Recording) -> np.ndarray:
            result = getattr(vqf, name)(period(recording)).updateBatch(recording.gyr, recording.acc)
            return up_of_quaternion(result["quat6D"])

        return run

    def offline(recording: Recording) -> np.ndarray:
        result = vqf.offlineVQF(recording.gyr, recording.acc, None, period(recording))
        return up_of_quaternion(result["quat6D"])

    return {"VQF": online("VQF"), "BasicVQF": online("BasicVQF"), "offlineVQF": offline}


def ahrs_filters(ahrs: ModuleType) -> dict[str, Estimator]:
    """Mahony's filter with the package's gains and with those above, Madgwick's with the package's gain."""

    def run(name: str, **gains: float) -> Estimator:
        def estimate(recording: Recording) -> np.ndarray:
            kind = getattr(ahrs.filters, name)
            rate = 1 / period(recording)
            return up_of_quaternion(kind(recording.gyr, recording.acc, frequency=rate, **gains).Q)

        return estimate

    return {
        "ahrs Mahony": run("Mahony"),
        "ahrs Mahony(k_P=0.2, k_I=0.003)": run("Mahony", k_P=0.2, k_I=0.003),
        "ahrs Madgwick": run("Madgwick"),
    }


def imufusion_filters(imufusion: ModuleType) -> dict[str, Estimator]:
    """The AHRS algorithm with its own parameters, with and without its estimate of the bias; in g and degrees."""

    def run(*, bias: bool) -> Estimator:
        def estimate(recording: Recording) -> np.ndarray:
            rate = 1 / period(recording)
            attitude = imufusion.Ahrs().set_settings(imufusion.AhrsSettings(sample_rate=rate))
            offset = imufusion.Bias().set_settings(imufusion.BiasSettings(sample_rate=rate))
            q = np.empty((recording.t.size, 4))
            rows = zip(np.degrees(recording.gyr), recording.acc / 9.80665, strict=True)
            for n, (gyr, acc) in enumerate(rows):
                attitude.update_no_magnetometer(offset.update(gyr) if bias else gyr, acc)
                q[n] = attitude.get_quaternion()
            return up_of_quaternion(q)

        return estimate

    return {"imufusion": run(bias=False), "imufusion with bias": run(bias=True)}


PEERS = {"vqf": vqf_filters, "ahrs": ahrs_filters, "imufusion": imufusion_filters}


def peers() -> Iterator[tuple[str, Estimator]]:
    """The filters of the packages that are installed."""
    for package, filters in PEERS.items():
        try:
            module = import_module(package)
        except ImportError:
            print(f"{package} is not installed: pip install -r requirements/bench.txt", file=sys.stderr)
            continue
        yield from filters(module).items()


# --------------------------------------------------------------------------------------------------------------- table


def euler_rows(recordings: list[Recording], *, search: bool) -> Iterator[tuple[str, list[float]]]:
    """The accelerometer alone, and roll and pitch by linear filters."""
    yield "accelerometer alone", [inclination_error(r, up_of_angles(cf.tilt(r.acc))) for r in recordings]
    designs: list[cf.LinearFilter] = [cf.FirstOrder(3.0), cf.PiForm(0.35, 0.0006)]
    if search:
        halves = recordings[::2], recordings[1::2]
        for family in (first_orders(), pi_forms()):
            designs.append(best(family, recordings))
            for tune, score in (halves, halves[::-1]):
                chosen = best(family, tune)
                yield f"{chosen} tuned on one half, scored on the other", error_of(chosen, score)
    for design in designs:
        yield str(design), error_of(design, recordings)


def attitude_rows(recordings: list[Recording], *, alone: bool) -> Iterator[tuple[str, list[float]]]:
    """The filters of attitude, the library's own and the others'."""
    estimators = list(attitude_filters().items())
    if not alone:
        estimators += peers()
    for name, estimate in estimators:
        yield name, [inclination_error(recording, estimate(recording)) for recording in recordings]


def show(rows: list[tuple[str, list[float]]], recordings: list[Recording]) -> None:
    """A column for each recording."""
    names = [recording.name.split("_")[0][:6] for recording in recordings]
    print("\n" + " ".join(f"{name:>6}" for name in [*names, "mean"]) + "   deg")
    for name, errors in rows:
        if len(errors) == len(recordings):
            print(" ".join(f"{error:6.2f}" for error in [*errors, np.mean(errors)]) + f"   {name}")


def changed(recording: Recording, arguments: argparse.Namespace) -> Recording:
    """The recording as the options want it."""
    if arguments.start_in_motion:
        recording = beginning(recording, AFTER_THE_START)
    elif arguments.rest is not None:
        recording = beginning(recording, -arguments.rest)
    return at_lower_rate(recording, arguments.rate_divisor) if arguments.rate_divisor > 1 else recording


def main() -> int:
    """Prints the table."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--search", action="store_true", help="look for the best gains, also on halves")
    parser.add_argument(
        "--rate-divisor", type=int, default=1, metavar="N", help="means over blocks of N samples"
    )
    start = parser.add_mutually_exclusive_group()
    start.add_argument(
        "--rest", type=float, metavar="SECONDS", help="only so much before the movement begins"
    )
    start.add_argument(
        "--start-in-motion", action="store_true", help=f"begin {AFTER_THE_START:g} s after the movement does"
    )
    parser.add_argument("--alone", action="store_true", help="leave out the other libraries")
    arguments = parser.parse_args()
    paths = sorted(arguments.folder.glob("*.parquet"))
    if not paths:
        print(f"no recordings in {arguments.folder}", file=sys.stderr)
        return 1
    recordings = [changed(read(path), arguments) for path in paths]
    rows = []
    for name, errors in (
        *euler_rows(recordings, search=arguments.search),
        *attitude_rows(recordings, alone=arguments.alone),
    ):
        print(f"{np.mean(errors):8.3f} deg mean, {np.max(errors):8.3f} worst   {name}")
        rows.append((name, errors))
    show(rows, recordings)
    return 0


if __name__ == "__main__":
    sys.exit(main())
