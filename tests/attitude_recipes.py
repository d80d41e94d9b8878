"""Recipes of attitude filters, a log for them, and what the library is to be given for it."""

import numpy as np
import pyarrow as pa

DEGREE = np.pi / 180.0
G = 9.80665
FLIP = np.array([1.0, -1.0, -1.0])
ROWS = 600

ATTITUDE = """
version = 1
[log]
time = { column = "t", unit = "ms" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
magnetometer = { columns = ["mx", "my", "mz"], unit = "uT" }
axes = "flu"
[filter]
kind = "attitude"
[policy]
gap = { longer_than = "1 s", do = "reset" }
[output]
columns = ["quaternion", "roll", "pitch", "yaw", "up", "gyro_bias", "at_rest", "flags"]
unit = "deg"
keep = ["t"]
"""

MAGNETOMETER = 'magnetometer = { columns = ["mx", "my", "mz"], unit = "uT" }\n'
INERTIAL = ATTITUDE.replace(MAGNETOMETER, "")
FRD = ATTITUDE.replace('"flu"', '"frd"')
MAHONY = ATTITUDE.replace('"attitude"', '"attitude"\nmethod = "mahony"\nkp = 1.0\nki = 0.1').replace(
    ', "at_rest"', ""
)
SELF_CALIBRATING = ATTITUDE.replace('"attitude"', '"attitude"\nmethod = "self_calibrating"')
ALL = {"gravity": ATTITUDE, "frd": FRD, "mahony": MAHONY, "self_calibrating": SELF_CALIBRATING}


def signals(n=ROWS, seed=0):
    """Time in ms, gyro, accelerometer and magnetometer in SI: at rest, then turning, with holes and a gap."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(5.0, 15.0, n))
    t[n // 2 :] += 5000.0
    t[n // 4] = t[n // 4 - 1]
    moving = np.linspace(0.0, 1.0, n)[:, None] > 0.3
    gyr = 0.01 + rng.normal(0.0, 1e-3, (n, 3)) + moving * rng.normal(0.0, 0.5, (n, 3))
    acc = np.array([0.5, 3.0, 9.0]) + rng.normal(0.0, 0.02, (n, 3)) + moving * rng.normal(0.0, 1.0, (n, 3))
    mag = np.array([15e-6, 5e-6, -40e-6]) + rng.normal(0.0, 1e-6, (n, 3))
    gyr[rng.integers(n // 3, n, 10), rng.integers(0, 3, 10)] = np.nan
    gyr[n // 3 : n // 3 + 30] = np.nan  # longer than a gyro is held
    acc[rng.integers(n // 3, n, 10), rng.integers(0, 3, 10)] = np.nan
    acc[n // 2 : n // 2 + 3] = np.nan  # also right after the gap
    mag[np.arange(n) % 5 != 0] = np.nan  # a slower sensor
    return t, gyr, acc, mag


def log(*values, dtype=np.float64):
    """The same as a log, in the units of the recipes."""
    t, gyr, acc, mag = values or signals()
    columns = {"t": t}
    for letter, vectors, unit in (("g", gyr, DEGREE), ("a", acc, G), ("m", mag, 1e-6)):
        columns |= {f"{letter}{axis}": (vectors[:, i] / unit).astype(dtype) for i, axis in enumerate("xyz")}
    return pa.RecordBatch.from_pydict(columns)


def taken(batch, dtype=np.float64):
    """Time in s, gyro, accelerometer and magnetometer of a log in SI, each rounded once."""
    units = {"g": DEGREE, "a": G, "m": 1e-6}
    vectors = (
        np.column_stack([
            (batch.column(f"{letter}{axis}").to_numpy().astype(float) * unit).astype(dtype)
            for axis in "xyz"
        ])
        for letter, unit in units.items()
    )  # fmt: skip
    return batch.column("t").to_numpy() * 1e-3, *vectors
