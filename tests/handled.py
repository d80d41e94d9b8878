"""A sensor that somebody takes in the hand, turns and puts down again, in every orientation: its log, and ways to spoil it.

Nothing here knows the library: turns by Rodrigues' formula in small steps.
"""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

G = 9.81
FIELD = np.array([0.0, 20.0, -44.0])  # uT: north and down
GYRO, FORCE, MAG = ("gx", "gy", "gz"), ("ax", "ay", "az"), ("mx", "my", "mz")


def turn(v, r):
    """Turn vectors (..., 3) by the rotation vector r."""
    angle = np.linalg.norm(r)
    if angle == 0.0:
        return v
    k = r / angle
    along = np.multiply.outer(v @ k, k)
    return along + (v - along) * np.cos(angle) + np.cross(k, v) * np.sin(angle)


def handled(seconds=120.0, rate=100.0, seed=0, speed=1.0, bias=0.004):
    """A log in SI: t, gyro, accelerometer, magnetometer; 4 s of rest, then 6 s of motion, over and over."""
    rng = np.random.default_rng(seed)
    count = round(seconds * rate)
    t = np.arange(count) / rate
    rates, shove = np.zeros((count, 3)), np.zeros((count, 3))
    for start in np.arange(4.0, seconds, 10.0):
        inside = (t >= start) & (t < start + 6.0)
        s = (t[inside] - start) / 6.0
        for axis in range(3):
            waves = sum(rng.normal() * np.sin(np.pi * (k + 1) * s + rng.uniform(0, 6)) for k in range(4))
            rates[inside, axis] = speed * np.sin(np.pi * s) ** 2 * waves
            shove[inside, axis] = np.sin(np.pi * s) ** 2 * np.sin(2 * np.pi * rng.uniform(1, 3) * 6 * s)
    # The world's up and field in the body's axes; the gyro's sample is the mean rate of the step that ends with it.
    seen = np.array([[0.0, 0.0, G], FIELD])
    force, field = np.empty((count, 3)), np.empty((count, 3))
    for n in range(count):
        seen = turn(seen, -rates[n] / rate)
        force[n], field[n] = seen
    gyro = rates + rng.normal(0, 0.002, (count, 3)) + bias * np.array([1.0, -1.0, 0.5])
    force += shove + rng.normal(0, 0.02, (count, 3))
    field += rng.normal(0, 0.2, (count, 3))
    columns = {"t": t}
    for names, values in ((GYRO, gyro), (FORCE, force), (MAG, field)):
        columns |= {name: values[:, i] for i, name in enumerate(names)}
    return columns


def save(log, path):
    """Write a log as Parquet."""
    pq.write_table(pa.table({name: pa.array(values) for name, values in log.items()}), path)
    return path
