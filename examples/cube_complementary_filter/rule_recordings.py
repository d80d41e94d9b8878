"""The recordings for the design rule: real ones where they are at hand, otherwise a simulated one."""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pyarrow import parquet

import compfilt as cf
from compfilt.motion import GRAVITY, Motion
from compfilt.simulate import SensorErrors, measure
from cube_filter_tables import Array

RECORDINGS = Path(
    os.environ.get("COMPFILT_RECORDINGS", Path(__file__).resolve().parents[3] / "shared" / "broad")
)


class Recording(NamedTuple):
    """A sensor that lies still, then moves, then lies still; SI units, axes forward, left, up."""

    name: str
    fs: float
    gyr: Array
    acc: Array
    up: Array
    """Up in the sensor's frame by the optical reference, or by the simulation."""
    moves: npt.NDArray[np.bool_]

    def seconds(self, start: float, end: float) -> "Recording":
        """Return the part between two times."""
        return self.part(slice(round(start * self.fs), round(end * self.fs)))

    def part(self, chosen: slice) -> "Recording":
        """Return some of the samples."""
        arrays = (array[chosen] for array in (self.gyr, self.acc, self.up, self.moves))
        return Recording(self.name, self.fs, *arrays)


VIBRATING = "27_disturbed_phone_vibration_B"
VIBRATES = (159.5, 162.5)
"""When the sensor lies still in that trial while the phone next to it vibrates, in s."""
SIMULATED_VIBRATES = (30.0, 33.0)
LARGEST_TILT = np.radians(60.0)
"""Trials with more are left out: near 90° of pitch there is no roll angle to filter."""


class Source(NamedTuple):
    """A recording for the rule, and when it lies still and vibrates, in s."""

    recording: Recording
    vibrates: tuple[float, float]


def noise_records() -> tuple[Source, list[Recording]]:
    """Return the recording for the rule, and those to try it on in motion."""
    if not (RECORDINGS / f"{VIBRATING}.parquet").exists():
        print(f"NO RECORDINGS in {RECORDINGS}: the noise is taken from a simulated one")
        simulated = simulate()
        return Source(simulated, SIMULATED_VIBRATES), [simulated]
    trials = [read(path) for path in sorted(RECORDINGS.glob("*.parquet"))]
    rule = next(trial for trial in trials if trial.name == VIBRATING)
    return Source(rule, VIBRATES), [each for each in trials if largest_tilt(each) < LARGEST_TILT]


def read(path: Path) -> Recording:
    """Read one trial of BROAD."""
    table = parquet.read_table(path)

    def columns(*names: str) -> Array:
        return np.column_stack([table.column(name).to_numpy().astype(float) for name in names])

    w, x, y, z = columns("ref_qw", "ref_qx", "ref_qy", "ref_qz").T
    return Recording(
        path.stem,
        1.0 / float(np.median(np.diff(columns("t")[:, 0]))),
        columns("gx", "gy", "gz"),
        columns("ax", "ay", "az"),
        np.column_stack((2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)),
        table.column("movement").to_numpy().astype(bool),
    )


def simulate() -> Recording:
    """Return 30 s still, 3 s still and vibrating, 90 s of leaning and speeding up, 27 s still."""
    rng, fs = np.random.default_rng(2), 200.0
    motion = Motion()
    for start in np.arange(35.0, 118.0, 4.0):
        motion.roll.pulse(start, 1.0, 1.0, rng.uniform(-0.3, 0.3))
        motion.pitch.pulse(start + 0.5, 1.0, 0.5, rng.uniform(-0.3, 0.3))
        motion.speed.pulse(start, 1.2, 0.8, rng.uniform(-4.0, 4.0))
    t = np.arange(round(150.0 * fs)) / fs
    measured = measure(motion, t, fs, SensorErrors(gyro_decimals=None, accelerometer_decimals=None), rng)
    acc, gyr = GRAVITY * measured[:, :3], np.radians(measured[:, 3:])
    vibrates = (t >= SIMULATED_VIBRATES[0]) & (t < SIMULATED_VIBRATES[1])
    for line, amplitude in ((43.3, 4.0), (86.6, 1.5)):  # Hz, m/s²
        phases = rng.uniform(0.0, 2.0 * np.pi, 3)
        wave = np.sin(2.0 * np.pi * line * t[vibrates, None] + phases)
        acc[vibrates] += amplitude * wave
        gyr[vibrates] += 0.01 * amplitude * wave[:, ::-1]  # the gyro feels it too
    roll, pitch = motion.roll.at(t)[0], motion.pitch.at(t)[0]
    moves = (t >= 35.0) & (t < 123.0)
    return Recording("simulated", fs, gyr, acc, up_of(np.column_stack((roll, pitch))), moves)


def up_of(angles: Array) -> Array:
    """Return the direction of up in the sensor's frame for roll and pitch."""
    roll, pitch = angles.T
    return np.column_stack((-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)))


def largest_tilt(recording: Recording) -> float:
    """Return the largest true tilt from level, in rad."""
    return float(np.arccos(np.nanmin(recording.up[:, 2])))


def still(recording: Recording, *, after: bool = False) -> Recording:
    """Return the samples before the sensor is touched, or those after it was put down."""
    gyr = recording.gyr[::-1] if after else recording.gyr
    touched = np.max(abs(gyr - np.median(gyr[:2000], axis=0)), axis=1) > np.radians(1.0)
    length = int(np.argmax(touched | (recording.moves[::-1] if after else recording.moves)))
    return recording.part(slice(-length, None) if after else slice(length))


def tilt_and_rates(recording: Recording, bias: Array | float = 0.0) -> tuple[Array, Array]:
    """Return roll and pitch by the accelerometer in rad, and their rates near level by the gyro in rad/s."""
    return cf.tilt(recording.acc), (recording.gyr - bias)[:, :2]
