"""Throughput of the linear filters against numpy.add, scipy.signal.lfilter and a numba loop, all in one run.

    python benches/throughput.py [SAMPLES]

Every figure is the best of several interleaved rounds, because the machine's speed drifts; the ratios count, not the
nanoseconds. All write into a given array, as ``numpy.add(a, b, out=c)`` does.
"""

import sys
from collections.abc import Callable
from timeit import default_timer

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

import compfilt as cf

FS = 100.0
TAU = 0.5
KP, KI = 2.0, 1.0
ROUNDS = 7

Signal = NDArray[np.float64]


@numba.njit
def numba_first_order(y: Signal, u: Signal, out: Signal, dt: float, gain: float) -> None:
    """The first-order recurrence, predict and correct."""
    x = y[0]
    for n in range(y.size):
        x += dt * u[n]
        x += gain * (y[n] - x)
        out[n] = x


@numba.njit
def numba_pi(y: Signal, u: Signal, out: Signal, dt: float, gain0: float, gain1: float) -> None:
    """The PI recurrence, predict and correct."""
    x0, x1 = y[0], 0.0
    for n in range(y.size):
        x0 += dt * (x1 + u[n])
        innovation = y[n] - x0
        x0 += gain0 * innovation
        x1 += gain1 * innovation
        out[n] = x0


def lfilter_first_order(y: Signal, u: Signal) -> Signal:
    """The same filter as two calls of lfilter: low branch on y, high branch on u."""
    alpha = cf.tau_to_alpha(TAU, FS)
    return lfilter([1 - alpha], [1, -alpha], y) + lfilter([alpha / FS], [1, -alpha], u)


def lfilter_pi(y: Signal, u: Signal) -> Signal:
    """LP and HP/s of the PI form by s = (1 - 1/z)/dt, as two calls of lfilter."""
    dt = 1 / FS
    denominator = np.array([1 + KP * dt + KI * dt**2, -2 - KP * dt, 1.0])
    low = lfilter([KP * dt + KI * dt**2, -KP * dt], denominator, y)
    return low + lfilter([dt, -dt], denominator, u)


def contenders(y: Signal, u: Signal, out: Signal) -> dict[str, dict[str, Callable[[], object]]]:
    """What is timed: by filter, then by name."""
    dt = 1 / FS
    scale = 1 + KP * dt + KI * dt**2
    gains = (KP * dt + KI * dt**2) / scale, KI * dt / scale
    first_order, pi = cf.FirstOrder(TAU), cf.PiForm(KP, KI)
    others = {
        "Butterworth 2, split 1": cf.Butterworth(2.0, split=1),
        "Butterworth 4": cf.Butterworth(2.0, order=4),
        "third order": cf.ThirdOrder(2.0),
    }
    timed: dict[str, dict[str, Callable[[], object]]] = {
        "": {"numpy.add": lambda: np.add(y, u, out=out)},
        "first order": {
            "compfilt": lambda: first_order.filter(y, u, fs=FS, out=out),
            "numba": lambda: numba_first_order(y, u, out, dt, dt / (TAU + dt)),
            "scipy lfilter": lambda: lfilter_first_order(y, u),
        },
        "PI": {
            "compfilt": lambda: pi.filter(y, u, fs=FS, out=out),
            "numba": lambda: numba_pi(y, u, out, dt, *gains),
            "scipy lfilter": lambda: lfilter_pi(y, u),
        },
    }
    for name, design in others.items():
        timed[name] = {"compfilt": lambda design=design: design.filter(y, u, fs=FS, out=out)}  # type: ignore[misc]
    return timed


def main() -> int:
    """Times everything in turn and prints nanoseconds a sample and ratios."""
    samples = int(float(sys.argv[1])) if len(sys.argv) > 1 else 4_000_000
    generator = np.random.default_rng(1)
    y, u = generator.normal(size=(2, samples))
    out = np.empty_like(y)
    timed = [(f, name, call) for f, calls in contenders(y, u, out).items() for name, call in calls.items()]
    best = [np.inf] * len(timed)
    for _ in range(ROUNDS):
        for index, (_, _, call) in enumerate(timed):
            start = default_timer()
            call()
            best[index] = min(best[index], (default_timer() - start) / samples * 1e9)
    ours = {f: ns for (f, name, _), ns in zip(timed, best, strict=True) if name == "compfilt"}
    print(f"{samples} float64 samples, one channel, best of {ROUNDS} interleaved rounds\n")
    print("| filter | implementation | ns a sample | x numpy.add | x compfilt |")
    print("| --- | --- | --- | --- | --- |")
    for (family, name, _), ns in zip(timed, best, strict=True):
        ratio = f"{ns / ours[family]:.2f}" if family in ours else ""
        print(f"| {family} | {name} | {ns:.2f} | {ns / best[0]:.2f} | {ratio} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
