"""The paper's simulation, with its noise read in several ways."""

from typing import NamedTuple

import numpy as np

from butterworth_family import DEGREE, Array, butterworth

SIMULATED = (1.0, 0.1, 0.01)  # the values of Q in the paper's simulation

ANGLES = ("phi", "theta", "psi")

RATE, LENGTH = 10_000.0, 5.0  # Hz, s
RUNS, FEW_RUNS, AT_ONCE = 200, 20, 20


class Noise(NamedTuple):
    """One reading of the paper's noise: uniform between bounds, in rad/s and rad, and the wrong start in rad."""

    rate: tuple[float, float]
    angle: tuple[float, float]
    start: float = 0.0


AS_READ = Noise((-0.5, 0.5), (-0.1, 0.1))

START_OFF = "0.5 and 0.1 wide, start 0.5 rad off"
READINGS = {
    "zero mean, +-0.5 and +-0.1": AS_READ,
    "zero mean, 0.5 and 0.1 wide": Noise((-0.25, 0.25), (-0.05, 0.05)),
    "one-sided rate, 0 to 0.5": Noise((0.0, 0.5), (-0.1, 0.1)),
    "one-sided, 0 to 0.5 and 0 to 0.1": Noise((0.0, 0.5), (0.0, 0.1)),
    "+-0.5 and +-0.1, start 1 rad off": AS_READ._replace(start=1.0),
    START_OFF: Noise((-0.25, 0.25), (-0.05, 0.05), 0.5),
    "+-0.5 rad/s and +-0.1 deg": Noise((-0.5, 0.5), (-0.1 * DEGREE, 0.1 * DEGREE)),
    "one-sided, 0 to 0.5 rad/s and 0 to 0.1 deg": Noise((0.0, 0.5), (0.0, 0.1 * DEGREE)),
}


class Run(NamedTuple):
    """One run of the simulation: true angles and rates, and the estimates for each Q; (n, 3), rad and rad/s."""

    t: Array
    angle: Array
    estimates: dict[float, Array]


def motion() -> tuple[Array, Array, Array]:
    """Return time, and the paper's angles and rates: phi, theta = -phi, psi = 0; (n, 3)."""
    t = np.arange(round(LENGTH * RATE) + 1) / RATE
    rate = np.interp(t, (0.0, 1.0, 2.0), (0.0, 2.0 * np.pi, 4.0 / 3.0 * np.pi))
    # The rate is linear between samples, so the trapezoidal rule is exact.
    angle = np.cumsum((rate[1:] + rate[:-1]) / (2.0 * RATE))
    signs = np.array([1.0, -1.0, 0.0])
    return t[1:], angle[:, None] * signs, rate[1:, None] * signs


def sensors(noise: Noise, runs: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return true angles, measured angles and measured rates of some runs, (n, 3 runs)."""
    _, angle, rate = motion()
    angle, rate = np.tile(angle, (1, runs)), np.tile(rate, (1, runs))
    return angle, angle + rng.uniform(*noise.angle, angle.shape), rate + rng.uniform(*noise.rate, rate.shape)


def simulate(noise: Noise, runs: int) -> dict[float, Array]:
    """Return the RMS errors of phi, theta and psi in deg over all runs, for each Q."""
    rng = np.random.default_rng(0)
    squares = {q: np.zeros(3) for q in SIMULATED}
    for _ in range(runs // AT_ONCE):
        angle, measured, rate = sensors(noise, AT_ONCE, rng)
        for q in SIMULATED:
            error = butterworth(q).filter(measured, rate, fs=RATE, initial=noise.start) - angle
            squares[q] += np.mean(error**2, axis=0).reshape(AT_ONCE, 3).sum(axis=0)
    return {q: np.degrees(np.sqrt(total / runs)) for q, total in squares.items()}


def pooled(rms: dict[float, Array]) -> dict[float, float]:
    """Take the three angles together."""
    return {q: float(np.sqrt(np.mean(values**2))) for q, values in rms.items()}


def one_run() -> Run:
    """Return one run for the figures."""
    angle, measured, rate = sensors(AS_READ, 1, np.random.default_rng(0))
    return Run(
        motion()[0],
        angle,
        {q: butterworth(q).filter(measured, rate, fs=RATE, initial=0.0) for q in SIMULATED},
    )


def expected_rms(q: float) -> float:
    """Return the RMS error in deg that the frequency response makes of the noise as read, the start forgotten."""
    omega = np.geomspace(1e-3, np.pi * RATE, 3000)
    low, high = butterworth(q).frequency_response(omega, fs=RATE)
    integral = 1.0 / (RATE * (1.0 - np.exp(-1j * omega / RATE)))  # of the rate, by backward Euler
    density = np.abs(low) ** 2 * uniform_variance(AS_READ.angle)
    density += np.abs(high * integral) ** 2 * uniform_variance(AS_READ.rate)
    return float(np.degrees(np.sqrt(np.sum(density * np.gradient(omega)) / (np.pi * RATE))))


def uniform_variance(bounds: tuple[float, float]) -> float:
    """Return the variance of uniform noise."""
    return (bounds[1] - bounds[0]) ** 2 / 12.0
