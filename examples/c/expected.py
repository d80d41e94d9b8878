"""What the C example must print, from the arrays of Python: the same signal, the same filters, float32."""

import numpy as np
import numpy.typing as npt

import compfilt as cf

SAMPLES, STILL, FS = 1000, 400, 100.0
GRAVITY = np.float32(9.75)

Values = npt.NDArray[np.float32]


def noise(count: int) -> Values:
    """Make numbers from -1 to 1 by the example's generator."""
    seed, numbers = 1, []
    for _ in range(count):
        seed = (seed * 1664525 + 1013904223) % 2**32
        numbers.append(((seed >> 8) - 8388608) / 8388608)
    return np.array(numbers, np.float32)


def fnv(words: npt.NDArray[np.uint32]) -> int:
    """Hash words, byte by byte, by FNV-1a."""
    hash_ = 2166136261
    for byte in words.astype("<u4").tobytes():
        hash_ = (hash_ ^ byte) * 16777619 % 2**32
    return hash_


def report(name: str, *columns: npt.NDArray[np.generic]) -> None:
    """Print the hash of rows made of numbers, of which the bits count, and of flags."""
    words = [
        (column.view(np.uint32) if column.dtype == np.float32 else column.astype(np.uint32)).reshape(
            SAMPLES, -1
        )
        for column in columns
    ]
    print(f"{name} 00000000 {fnv(np.hstack(words).ravel()):08x}")


def linear() -> None:
    """Run the linear filters."""
    y, u = noise(2 * SAMPLES).reshape(SAMPLES, 2).T.copy()
    gyro = y.copy()
    y[np.arange(SAMPLES) % 97 == 50] = np.nan
    third_order = cf.ThirdOrder(tau=1.0)
    designs: dict[str, cf.LinearFilter] = {
        "first_order": cf.FirstOrder(tau=0.5),
        "pi": cf.PiForm(kp=2.0, ki=1.0),
        "butterworth": cf.Butterworth(omega0=2.0, q=0.75),
        "third_order": third_order,
        "third_order_from_gains": cf.ThirdOrder.from_gains(3.0, 2.5, 0.5),
    }
    for name, design in designs.items():
        estimate = design.estimate(y, u, fs=FS)
        report(name, np.ascontiguousarray(estimate.levels.T), estimate.flags)
    for order, design in enumerate((designs["first_order"], designs["pi"], third_order), start=1):
        report(f"two_rates_{order}", two_rates(design, y, u))
    report("rate", cf.RateFilter(tau=0.5).filter(gyro, u, fs=FS, initial=0.25))


def two_rates(design: cf.LinearFilter, y: Values, u: Values) -> Values:
    """Predict with every input, and correct by every fifth measurement; level 0."""
    stream = design.stream(fs=FS, dtype=np.float32, initial=0.5)
    levels = []
    for sample in range(SAMPLES):
        levels.append(stream.predict(u[sample]))
        if sample % 5 == 4:
            levels[-1] = stream.correct(y[sample])
    return np.array(levels, np.float32)


def attitude() -> None:
    """Run the attitude filters."""
    size = np.where(np.arange(SAMPLES) < STILL, np.float32(1 / 1024), np.float32(1))
    signals = noise(9 * SAMPLES).reshape(SAMPLES, 3, 3) * size[:, None, None]
    gyr, acc, mag = (np.ascontiguousarray(signals[:, :, i]) for i in range(3))
    mag *= np.float32(0.125)
    acc[:, 2] += GRAVITY
    mag[:, 1] += np.float32(1)
    samples = np.arange(SAMPLES)
    acc[(samples % 97 == 50) & (samples >= STILL), 0] = np.nan
    for name, design, axes in (
        ("first_order", cf.FirstOrder(tau=0.5), "flu"),
        ("pi", cf.PiForm(kp=2.0, ki=1.0), "flu"),
        ("frd", cf.PiForm(kp=2.0, ki=1.0), "frd"),
        ("cube", cf.PiForm(kp=2.0, ki=1.0), "cube"),
    ):
        tilt = cf.TiltFilter(design, axes=axes).estimate(gyr, acc, fs=FS)
        report(f"tilt_{name}", tilt.angles, tilt.flags)
    mahony = cf.Mahony(kp=1.0, ki=0.25).estimate(gyr, acc, fs=FS, mag=mag)
    report("mahony", mahony.quaternion, mahony.gyro_bias, mahony.flags)
    gravity = cf.GravityFilter().estimate(gyr, acc, fs=FS, mag=mag)
    if not gravity.at_rest.any() or gravity.at_rest.all():
        raise SystemExit("the signal must have a rest and a motion")
    report("gravity", gravity.quaternion, gravity.gyro_bias, gravity.flags, gravity.at_rest)
    calibrating = cf.GravityFilter(self_calibrating=True).estimate(gyr, acc, fs=FS)
    report("calibrating", calibrating.quaternion, calibrating.gyro_bias, calibrating.flags)


if __name__ == "__main__":
    linear()
    attitude()
    print("refused 00000001 00000002 00000003 00000002 00000004")
    print("untouched 00000000")
