"""Whether the installed compfilt gives the committed bits: each filter's results, in a digest, against scripts/bits.json.

    python check_bits.py [--update]

Needs compfilt and NumPy alone, so that a wheel is tested where it is installed, on every platform. The signals come from
Python's own generator, which gives the same numbers in all versions, and from sums and products: no function of the
platform's mathematics library has a part in them. Exits with 1 where a filter's bits are others.
"""

import argparse
import hashlib
import json
import random
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import compfilt as cf

BITS = Path(__file__).with_name("bits.json")
FS = 100.0
SAMPLES = 3001
"""Not a multiple of any width of vectors or length of a block."""


def numbers(seed: int, count: int, dtype: type) -> np.ndarray:
    """Numbers between -1 and 1."""
    generator = random.Random(seed)  # noqa: S311
    return np.array([2 * generator.random() - 1 for _ in range(count)], dtype=dtype)


def signal(seed: int, columns: int, dtype: type) -> np.ndarray:
    """Columns of numbers, with some missing ones."""
    values = numbers(seed, SAMPLES * columns, dtype).reshape(SAMPLES, columns)
    values[1000:1003] = np.nan
    return values


def linear(
    design: cf.LinearFilter, columns: int = 9, **keywords: object
) -> Callable[[type], list[np.ndarray]]:
    """Many channels, some of which run side by side, and one."""

    def results(dtype: type) -> list[np.ndarray]:
        y, u = signal(1, columns, dtype), signal(2, columns, dtype)
        many, one = (design.estimate(*inputs, fs=FS, **keywords) for inputs in ((y, u), (y[:, 0], u[:, 0])))
        return [many.levels, many.flags, one.levels, one.flags, design.filter(y, u, fs=FS, **keywords)]

    return results


def reordered(dtype: type) -> list[np.ndarray]:
    """Parts of one long channel side by side."""
    y, u = (numbers(seed, 100_003, dtype) for seed in (1, 2))
    return [cf.PiForm(2.0, 1.0).filter(y, u, fs=FS, exact=False, workers=2)]


def inertial(dtype: type) -> tuple[np.ndarray, np.ndarray]:
    """The gyro and the accelerometer of a body that turns and shakes, upright most of the time."""
    gyr, acc = signal(3, 3, dtype), signal(4, 3, dtype)
    acc[:, 2] += dtype(9.81)
    return gyr, acc


def tilt(dtype: type) -> list[np.ndarray]:
    """Angles, whose derivative depends on the filter's own output."""
    estimate = cf.TiltFilter(cf.PiForm(2.0, 1.0)).estimate(*inertial(dtype), fs=FS)
    return [estimate.angles, estimate.flags]


def attitude(design: cf.Mahony | cf.GravityFilter) -> Callable[[type], list[np.ndarray]]:
    """One recording, and the last of nine, which is alone in its vector registers."""

    def results(dtype: type) -> list[np.ndarray]:
        gyr, acc = inertial(dtype)
        alone = design.estimate(gyr, acc, fs=FS)
        many = design.estimate_many([gyr] * 9, [acc] * 9, fs=FS)
        return [part for each in (alone, many[8]) for part in (each.quaternion, each.gyro_bias, each.flags)]

    return results


def observer(dtype: type) -> list[np.ndarray]:
    """The estimates before and after each correction."""
    design = cf.Observer([[1.0, 0.01], [0.0, 1.0]], [[0.0], [0.01]], [[1.0, 0.0]], [[0.2], [0.5]])
    return list(design.run(signal(1, 1, dtype), signal(2, 1, dtype)))


FILTERS: dict[str, Callable[[type], list[np.ndarray]]] = {
    "first order": linear(cf.FirstOrder(0.5)),
    "first order, matched": linear(cf.FirstOrder(0.5), rule="matched"),
    "pi": linear(cf.PiForm(2.0, 1.0)),
    "pi, wrapped": linear(cf.PiForm(2.0, 1.0), period=1.0),
    "pi, late": linear(cf.PiForm(2.0, 1.0), delay=0.035),
    "pi, reordered": reordered,
    "butterworth 4": linear(cf.Butterworth(3.0, 4)),
    "third order": linear(cf.ThirdOrder(0.5), input="trapezoid"),
    "rate": linear(cf.RateFilter(0.5)),
    "tilt": tilt,
    "mahony": attitude(cf.Mahony(1.0, 0.1)),
    "gravity": attitude(cf.GravityFilter()),
    "gravity, self-calibrating": attitude(cf.GravityFilter(self_calibrating=True)),
    "observer": observer,
}


def digest(results: list[np.ndarray]) -> str:
    """A digest of the bytes, in the order of a little-endian machine."""
    digest = hashlib.sha256()
    for array in results:
        digest.update(np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes())
    return digest.hexdigest()[:16]


def all_bits() -> Iterator[tuple[str, str]]:
    """Filter and scalar type, with the digest."""
    for name, results in FILTERS.items():
        for dtype in (np.float32, np.float64):
            yield f"{name}, {dtype.__name__}", digest(results(dtype))


def others(found: dict[str, str], committed: dict[str, str]) -> list[str]:
    """What has other bits, or is in one of them only."""
    return sorted(name for name in found | committed if found.get(name) != committed.get(name))


def main() -> int:
    """Compares, or writes."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--update", action="store_true", help="write bits.json")
    update = parser.parse_args().update
    found = dict(all_bits())
    if update:
        BITS.write_text(json.dumps(found, indent=1) + "\n")
        return 0
    for name in (wrong := others(found, json.loads(BITS.read_text()))):
        print(f"other bits: {name}")
    print(
        f"compfilt {cf.__version__}: {len(found) - len(wrong)} of {len(found)} results have the committed bits"
    )
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
