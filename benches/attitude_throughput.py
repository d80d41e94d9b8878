"""Throughput of the attitude filters against vqf, ahrs and imufusion, all in one run.

    python benches/attitude_throughput.py [--samples 1e5] [--rounds 5]

Every other library is called as its documentation does for a log: vqf and ahrs take the arrays (vqf loops in C++, ahrs in
Python), imufusion takes one sample a call. What loops in Python gets a twentieth of the log, and so many logs are not
timed with it. Every figure is the best of several rounds in which all have their turn.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import ahrs
import imufusion
import numpy as np
import vqf

import compfilt as cf
from timing import Call, Signal, best_times, machine, ratio, table

FS = 200.0
LOGS = 64
SHORTER = 20
"""What loops in Python gets so much less to do."""

OURS: dict[str, Any] = {
    "Mahony(kp=0.2, ki=0.003)": cf.Mahony(kp=0.2, ki=0.003),
    "GravityFilter()": cf.GravityFilter(),
    "GravityFilter(self_calibrating=True)": cf.GravityFilter(self_calibrating=True),
}
REFERENCE = "GravityFilter()"

Log = tuple[Signal, Signal]
Contender = tuple[str, int, Call]
"""A name, the samples of a call, and the call."""


def motion(samples: int) -> Log:
    """A gyro in rad/s and an accelerometer in m/s² that turn and shake, with noise and a bias."""
    generator = np.random.default_rng(1)
    t = np.arange(samples) / FS
    gyr = np.column_stack([0.5 * np.sin(t), 0.3 * np.cos(2 * t), 0.2 * np.sin(0.7 * t)]) + 0.01
    acc = np.column_stack([np.sin(1.3 * t), np.cos(0.9 * t), np.full(samples, 9.81)])
    return gyr + 0.01 * generator.normal(size=gyr.shape), acc + 0.1 * generator.normal(size=acc.shape)


def vqf_log(kind: Callable[[float], Any], log: Log) -> object:
    """The filters of vqf on arrays."""
    return kind(1 / FS).updateBatch(*log)


def ahrs_log(kind: Callable[..., Any], log: Log) -> object:
    """The filters of ahrs on arrays: the constructor runs over them."""
    return kind(gyr=log[0], acc=log[1], frequency=FS).Q


def imufusion_log(log: Log) -> object:
    """Imufusion's algorithm, a sample at a time; its units are degrees and g."""
    attitude = imufusion.Ahrs().set_settings(imufusion.AhrsSettings(sample_rate=FS))
    quaternion = np.empty((len(log[0]), 4))
    for n, (gyr, acc) in enumerate(zip(np.degrees(log[0]), log[1] / 9.80665, strict=True)):
        attitude.update_no_magnetometer(gyr, acc)
        quaternion[n] = attitude.get_quaternion()
    return quaternion


def one_log(samples: int) -> Iterator[Contender]:
    """Every filter on one log."""
    log = motion(samples)
    for name, attitude in OURS.items():
        yield name, samples, partial(attitude.estimate, *log, fs=FS)
    yield "vqf VQF, arrays", samples, partial(vqf_log, vqf.VQF, log)
    yield "vqf BasicVQF, arrays", samples, partial(vqf_log, vqf.BasicVQF, log)
    short = samples // SHORTER
    part = log[0][:short], log[1][:short]
    yield "ahrs Mahony, arrays", short, partial(ahrs_log, ahrs.filters.Mahony, part)
    yield "ahrs Madgwick, arrays", short, partial(ahrs_log, ahrs.filters.Madgwick, part)
    yield "imufusion Ahrs, sample by sample", short, partial(imufusion_log, part)


def many_logs(samples: int) -> Iterator[Contender]:
    """Many logs of several lengths: in a loop, and where there is a method for it, by that."""
    lengths = np.random.default_rng(2).integers(samples // (2 * LOGS), 3 * samples // (2 * LOGS), LOGS)
    gyr, acc = (list(signals) for signals in zip(*map(motion, lengths), strict=True))
    total = int(lengths.sum())

    def each(run: Callable[[Log], object]) -> Call:
        return lambda: [run(log) for log in zip(gyr, acc, strict=True)]

    for name, attitude in OURS.items():
        yield name, total, each(lambda log, attitude=attitude: attitude.estimate(*log, fs=FS))  # type: ignore[misc]
        if not hasattr(attitude, "estimate_many"):
            print(f"left out: {name} has no estimate_many", file=sys.stderr)
            continue
        for workers in (1, 2):
            label = f"{name}, estimate_many, {workers} worker{'s' * (workers > 1)}"
            yield label, total, partial(attitude.estimate_many, gyr, acc, fs=FS, workers=workers)
    yield "vqf VQF", total, each(partial(vqf_log, vqf.VQF))


def show(title: str, contenders: list[Contender], rounds: int) -> None:
    """Times them and prints the table."""
    best = best_times([call for *_, call in contenders], rounds=rounds)
    times = {name: time / samples * 1e9 for (name, samples, _), time in zip(contenders, best, strict=True)}
    rows = [
        (name, f"{1e3 / time:.3g}", f"{time:.4g}", ratio(time, times[REFERENCE]))
        for name, time in times.items()
    ]
    header = ["filter", "million samples a second", "ns a sample", f"time x {REFERENCE}"]
    print(f"\n{title}:\n\n{table(header, rows)}", flush=True)


def main() -> int:
    """Times everything and prints the tables."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--samples", type=float, default=1e5)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    samples = int(arguments.samples)
    print(f"Attitude filters, best of {arguments.rounds} interleaved rounds; {machine()}")
    show(f"One log of {samples} samples", list(one_log(samples)), arguments.rounds)
    show(f"{LOGS} logs, {samples} samples in all", list(many_logs(samples)), arguments.rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
