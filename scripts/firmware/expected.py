"""What every filter of the firmware has to give: the same recording through the batch functions, in float32."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import compfilt as cf

Array = NDArray[np.float32]

LOG = Path(__file__).parents[2] / "examples" / "demo" / "child_seat.csv"
AT_REST = 2048
MOVING = 12288
SAMPLES = AT_REST + MOVING
FIRST_GAPS = 4096
FS = 1000.0


def recording() -> tuple[Array, Array]:
    """Gyro in rad/s and accelerometer in m/s², as examples/firmware/build.rs makes them."""
    with LOG.open(encoding="utf-8", newline="") as file:
        rows = np.array([row[1:7] for row in csv.reader(file)][1 : 1 + MOVING], dtype=np.float64)
    force, gyro = rows[:, :3] * 9.80665, rows[:, 3:] * (np.pi / 180.0)
    still = np.zeros(AT_REST, dtype=int)
    order = np.concatenate((still, np.arange(MOVING)))
    return gyro[order].astype(np.float32), force[order].astype(np.float32)


def with_gaps(signal: Array, every: int, length: int) -> Array:
    """The signal with missing samples, as examples/firmware/src/recording.rs makes them."""
    n = np.arange(SAMPLES)
    missing = (n >= FIRST_GAPS) & (n % every < length)
    return np.where(missing[:, None], np.float32(np.nan), signal)


def rows(*columns: NDArray[np.generic]) -> Array:
    """Outputs side by side, a row a sample."""
    return np.column_stack(columns).astype(np.float32)


class Expected:
    """The outputs of every filter, by its name."""

    def __init__(self) -> None:
        self.gyro, self.force = recording()
        self.gyro_gaps = with_gaps(self.gyro, 512, 3)
        self.force_gaps = with_gaps(self.force, 640, 5)
        self.angle = self.force[:, 1] * np.float32(0.1)
        self.rate = self.gyro[:, 0]

    def outputs(self) -> dict[str, Array]:
        """All of them, in the firmware's order."""
        return {
            "first_order": self.linear(cf.FirstOrder(tau=0.5)),
            "pi": self.linear(cf.PiForm(kp=2.0, ki=0.5)),
            "butterworth_2": self.linear(cf.Butterworth(omega0=5.0)),
            "split_2": self.linear(cf.Butterworth(omega0=5.0, split=1)),
            "third_order": self.linear(cf.ThirdOrder(tau=1.5)),
            "rate": self.rate_filter(),
            "stream_pi": self.stream_pi(),
            "tilt_of_gravity": cf.tilt(self.force),
            "tilt": self.tilt(),
            "cube_first_order": self.cube(),
            "observer": self.observer(),
            "mahony_explicit": self.attitude(cf.Mahony(kp=1.0, ki=0.25)),
            "gravity": self.attitude(cf.GravityFilter(tau=3.0, zeta=0.5)),
            "self_calibrating": self.attitude(cf.GravityFilter(tau=5.0, zeta=0.5, self_calibrating=True)),
        }

    def linear(self, design: cf.LinearFilter) -> Array:
        """All levels of a chain."""
        estimate = design.estimate(self.angle, self.rate, fs=FS, initial=0.0)
        return rows(*estimate.levels)

    def rate_filter(self) -> Array:
        """The accelerometer stands for an angular acceleration."""
        return rows(cf.RateFilter(tau=1.0).filter(self.rate, self.force[:, 1], fs=FS, initial=0.0))

    def stream_pi(self) -> Array:
        """The PI form with samples that are missing."""
        angle, rate = self.force_gaps[:, 1] * np.float32(0.1), self.gyro_gaps[:, 0]
        estimate = cf.PiForm(kp=2.0, ki=0.5).estimate(angle, rate, fs=FS, initial=0.0)
        return rows(*estimate.levels, estimate.flags)

    def tilt(self) -> Array:
        """Roll and pitch."""
        tilt = cf.TiltFilter(cf.PiForm(kp=2.0, ki=0.5))
        estimate = tilt.estimate(self.gyro_gaps, self.force_gaps, fs=FS)
        return rows(estimate.angles, estimate.flags)

    def cube(self) -> Array:
        """Six sensors that read the recording one after the other."""
        first = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
        third = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
        fifth = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        positions = [
            [0.05, 0.02, 0.0],
            [0.10, 0.05, 0.15],
            [0.0, 0.05, 0.02],
            [0.15, 0.09, 0.08],
            [0.02, 0.0, 0.08],
            [0.05, 0.15, 0.12],
        ]
        array = cf.AccelerometerArray(
            positions,
            rotations=[first, first, third, third, fifth, fifth],
            channels=[[True, True, False]] * 6,
        )
        order = (np.arange(SAMPLES)[:, None] + np.arange(6)) % SAMPLES
        cube = cf.Cube(array, cf.FirstOrder(tau=0.5))
        estimate = cube.estimate(self.gyro_gaps[order], self.force[order], wheel=self.gyro, fs=FS)
        return rows(estimate.angles, estimate.body_rate, estimate.gravity, estimate.flags)

    def observer(self) -> Array:
        """Three states, two outputs, one input."""
        observer = cf.Observer(
            A=[[1.0, 0.5, 0.0], [0.0, 0.5, 0.25], [0.0, 0.0, 0.75]],
            B=[[0.001], [-0.2], [0.9]],
            C=[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            L=[[0.25, 0.125], [0.1875, 0.125], [0.09375, 0.1875]],
            correction=[[0.09375, 0.0625], [0.3125, 0.125], [0.125, 0.25]],
        )
        measured = rows(self.force_gaps[:, 0], self.gyro_gaps[:, 1])
        estimate = observer.estimate(measured, self.rate[:, None])
        return rows(estimate.predicted, estimate.filtered)

    def attitude(self, attitude_filter: cf.Mahony | cf.GravityFilter) -> Array:
        """The quaternion, the gyro's bias, the flags."""
        estimate = attitude_filter.estimate(self.gyro_gaps, self.force_gaps, fs=FS)
        return rows(estimate.quaternion, estimate.gyro_bias, estimate.flags)
