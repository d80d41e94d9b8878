"""Recipes with several sensors, a log for them, and what the library is to be given for it."""

import numpy as np
import pyarrow as pa

import compfilt as cf

DEGREE = np.pi / 180.0
G = 9.80665

SENSORS = """
[[log.sensors]]
position = [0.05, "2 cm", 0]
rotation = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
accelerometer = { columns = ["a1x", "a1y", "-"], unit = "g" }
gyro = { columns = ["g1x", "g1y", "g1z"], unit = "deg/s" }
noise = "4 mg"
[[log.sensors]]
position = [0.1, 0.05, "150 mm"]
accelerometer = { columns = ["a2x", "a2y", "a2z"], unit = "g", scale = [1, -1, 1] }
gyro = { columns = ["g2x", "g2y", "g2z"], unit = "deg/s" }
noise = ["4 mg", 0.04, "0.01 g"]
[[log.sensors]]
position = [0.0, 0.05, 0.02]
accelerometer = { columns = ["a3x", "a3y", "a3z"], unit = "m/s^2" }
gyro = { columns = ["g3x", "g3y", "g3z"], unit = "rad/s" }
noise = "4 mg"
[[log.sensors]]
position = [0.15, 0.09, 0.08]
accelerometer = { columns = ["a4x", "a4y", "a4z"], unit = "g" }
gyro = { columns = ["g4x", "g4y", "g4z"], unit = "deg/s" }
noise = "4 mg"
[[log.sensors]]
position = [0.02, 0.0, 0.08]
accelerometer = { columns = ["a5x", "a5y", "a5z"], unit = "g" }
gyro = { columns = ["g5x", "g5y", "g5z"], unit = "deg/s" }
noise = "4 mg"
"""

CUBE = f"""
version = 1
[log]
time = {{ column = "t", unit = "ms" }}
wheels = {{ columns = ["w1", "w2", "w3"], unit = "rpm" }}
{SENSORS}
[filter]
kind = "cube"
design = {{ kind = "pi", kp = 2.0, ki = 0.5 }}
[policy]
gap = {{ longer_than = "1 s", do = "reset" }}
[output]
columns = ["phi2", "phi3", "bias", "body_rate", "wheel_rate", "gravity", "flags"]
unit = "deg"
keep = ["t"]
"""

ARRAY = f"""
version = 1
[log]
{SENSORS}
[filter]
kind = "array"
[output]
columns = ["gravity", "angular_acceleration", "body_rate", "flags"]
"""

GAP = 'gap = { longer_than = "1 s", do = "reset" }'
TIMED = ARRAY.replace("[log]\n", '[log]\ntime = { column = "t", unit = "ms" }\n') + f"[policy]\n{GAP}\n"
WITHOUT_GYROS = "".join(line for line in ARRAY.splitlines(keepends=True) if not line.startswith("gyro"))
WITHOUT_GYROS = WITHOUT_GYROS.replace(', "body_rate"', "")

PLATE = """
version = 1
[log]
[[log.sensors]]
position = ["12 cm", 0, "3 cm"]
accelerometer = { columns = ["a2x", "a2y", "a2z"], unit = "g" }
[[log.sensors]]
position = ["-6 cm", "10 cm", "3 cm"]
accelerometer = { columns = ["a3x", "a3y", "a3z"], unit = "g" }
[[log.sensors]]
position = ["-6 cm", "-10 cm", "3 cm"]
accelerometer = { columns = ["a4x", "a4y", "a4z"], unit = "g" }
[filter]
kind = "array"
[output]
columns = ["angular_acceleration", "flags"]
unit = "deg"
"""

SCALES = [[1, 1, np.nan], [1, -1, 1], [1 / G, 1 / G, 1 / G], [1, 1, 1], [1, 1, 1]]  # times g
USED = [
    f"{kind}{i}{axis}"
    for i in range(1, 6)
    for kind in "ag"
    for axis in "xyz"
    if (kind, i, axis) != ("a", 1, "z")
]


def array(**changes):
    rotations = np.tile(np.eye(3), (5, 1, 1))
    rotations[0] = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]
    channels = np.ones((5, 3), bool)
    channels[0, 2] = False
    noise = np.full((5, 3), 4.0 * 1e-3 * G)
    noise[1, 1:] = 0.04, 0.01 * G
    positions = [[0.05, 0.02, 0], [0.1, 0.05, 0.15], [0, 0.05, 0.02], [0.15, 0.09, 0.08], [0.02, 0, 0.08]]
    return cf.AccelerometerArray(
        positions, **({"rotations": rotations, "channels": channels, "noise": noise} | changes)
    )


def log(n=300, seed=0, dtype=np.float64):
    """A log with missing fields, a gap, and a repeated time; the unused channel is not in it."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(5.0, 15.0, n))
    t[n // 2 :] += 5000.0
    t[n // 4] = t[n // 4 - 1]
    columns = {name: rng.normal(0.0, 1.0, n) for name in (*USED, "w1", "w2", "w3")}
    for name in ("a1x", "a4z", "g2x", "g3z", "w2"):
        columns[name][rng.integers(2, n, 10)] = np.nan
    for sensor in range(1, 6):
        columns[f"g{sensor}x"][n // 3 : n // 3 + 30] = np.nan  # no gyro at all for a while
    columns["a2y"][n // 2 : n // 2 + 3] = np.nan  # also right after the gap
    return pa.RecordBatch.from_pydict(
        {"t": t} | {name: values.astype(dtype) for name, values in columns.items()}
    )


def complete(n=50):
    rng = np.random.default_rng(1)
    columns = {name: rng.normal(0.0, 1.0, n) for name in (*USED, "w1", "w2", "w3")}
    return pa.RecordBatch.from_pydict({"t": 10.0 * np.arange(n)} | columns)


def signals(batch, dtype=np.float64):
    """Gyros, accelerometers and wheels of a log in SI, each rounded once."""

    def take(name, factor):
        return (batch.column(name).to_numpy().astype(float) * factor).astype(dtype)

    unused = np.full(batch.num_rows, np.nan, dtype)
    acc = [
        [unused if np.isnan(scale) else take(f"a{i}{axis}", 1.0 if i == 3 else G * scale)
         for axis, scale in zip("xyz", scales, strict=True)]
        for i, scales in enumerate(SCALES, 1)
    ]  # fmt: skip
    gyr = [[take(f"g{i}{axis}", 1.0 if i == 3 else DEGREE) for axis in "xyz"] for i in range(1, 6)]
    wheels = np.column_stack([take(name, np.pi / 30.0) for name in ("w1", "w2", "w3")])
    return np.moveaxis(gyr, 2, 0), np.moveaxis(acc, 2, 0), wheels
