"""The Butterworth filter of Jeon (S4): its simulation for Q = 1, 0.1, 0.01, and its experiment as a simulation.

    python examples/butterworth/reproduce.py [folder]

Prints the tables, and writes them and the figures to ``examples/butterworth/out/`` or to the folder.
"""

import csv
import sys
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from PIL import Image

import compfilt as cf
from compfilt.motion import GRAVITY, Motion
from compfilt.simulate import SensorErrors, measure

mpl.use("agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

HERE = Path(__file__).parent

OMEGA0 = 10.0  # rad/s
QUOTED = {1.0: 10.0, 0.625: 13.0, 0.1: 50.0, 0.01: 500.0}  # Q: the cut-off that the paper quotes, rad/s
SIMULATED = (1.0, 0.1, 0.01)  # the values of Q in the paper's simulation
STYLES = {1.0: ("black", "-"), 0.1: ("tab:red", "--"), 0.01: ("0.7", "-")}

RATE, LENGTH = 10_000.0, 5.0  # Hz, s
RUNS, FEW_RUNS, AT_ONCE = 200, 20, 20
ANGLES = ("phi", "theta", "psi")

Array = npt.NDArray[np.floating[Any]]
Complex = npt.NDArray[np.complex128]


class Noise(NamedTuple):
    """One reading of the paper's noise: uniform between bounds, in rad/s and rad, and the wrong start in rad."""

    rate: tuple[float, float]
    angle: tuple[float, float]
    start: float = 0.0


AS_READ = Noise((-0.5, 0.5), (-0.1, 0.1))
DEGREE = np.pi / 180.0
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


class Response(NamedTuple):
    """One filter in the frequency domain: rad/s, and the peak of the low-pass in dB."""

    poles: Complex
    cutoff: float
    midpoint: float  # of the band edges by the paper's (16)
    peak: float


class Run(NamedTuple):
    """One run of the simulation: true angles and rates, and the estimates for each Q; (n, 3), rad and rad/s."""

    t: Array
    angle: Array
    estimates: dict[float, Array]


class Experiment(NamedTuple):
    """The hardware experiment as a simulation; angles in rad, yaw without and with ``period``."""

    t: Array
    truth: dict[str, Array]
    measured: dict[str, Array]
    estimates: dict[str, Array]


class Result(NamedTuple):
    """The numbers of the reproduction; RMS errors in deg."""

    responses: dict[float, Response]
    rms: dict[float, Array]  # of phi, theta, psi
    expected: dict[float, float]  # from the frequency response
    best_q: float
    readings: dict[str, dict[float, float]]
    experiment: Experiment


def main() -> None:
    """Reproduce into the folder that is named, or beside this file."""
    reproduce(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "out")


def reproduce(out: Path) -> Result:
    """Simulate, compare, print, draw."""
    out.mkdir(parents=True, exist_ok=True)
    sweep = {q: expected_rms(q) for q in np.geomspace(0.003, 30.0, 201).tolist()}
    result = Result(
        {q: response(q) for q in QUOTED},
        simulate(AS_READ, RUNS),
        {q: expected_rms(q) for q in SIMULATED},
        min(sweep, key=sweep.__getitem__),
        {name: pooled(simulate(noise, FEW_RUNS)) for name, noise in READINGS.items()},
        experiment(),
    )
    show(result, out)
    draw_summary(result, sweep, out / "butterworth.png")
    draw_run(one_run(), out / "angles.png")
    draw_experiment(result.experiment, out / "experiment.png")
    return result


def butterworth(q: float) -> cf.Butterworth:
    """Return the paper's (14), (15)."""
    return cf.Butterworth(OMEGA0, q=q)


def response(q: float) -> Response:
    """Return what the paper says of a filter, as computed."""
    omega = np.geomspace(1.0, 1e4, 20_001)
    low = np.abs(butterworth(q).frequency_response(omega)[0])
    falls = low.argmax()
    return Response(
        butterworth(q).poles,
        float(np.interp(-np.sqrt(0.5), -low[falls:], omega[falls:])),
        OMEGA0 * np.sqrt(1.0 + 0.25 / q**2),
        20.0 * np.log10(low.max()),
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


def experiment() -> Experiment:
    """Roll by hand from 7 s to 12 s, pitch from 12 s to 14 s, rest; Q = 0.625, 1 kHz.

    Roll and pitch are measured by a simulated cheap accelerometer. The paper does not say how it measures yaw. Here it
    is a heading sensor that stands at 2° and picks up 8 % of the tilt, and tells angles between 0 and 360°.
    """
    rng = np.random.default_rng(0)
    t = np.arange(1, 20_001) / 1000.0
    body = Motion(arm=0.05)
    for start, length, change in (
        (7.0, 1.0, 40),
        (8.0, 1.0, -80),
        (9.0, 1.0, 80),
        (10.0, 1.0, -80),
        (11.0, 1.0, 40),
    ):
        body.roll.step(start, length, change * DEGREE)
    for start, length, change in ((12.0, 0.5, 50), (12.5, 1.0, -100), (13.5, 0.5, 50)):
        body.pitch.step(start, length, change * DEGREE)
    log = measure(body, t, 1000.0, SensorErrors(), rng)
    tilt, gyr = cf.tilt(GRAVITY * log[:, :3]), DEGREE * log[:, 3:]
    roll, pitch = body.roll.at(t)[0], body.pitch.at(t)[0]
    heading = 2.0 * DEGREE + 0.08 * (roll + pitch) + rng.normal(0.0, 0.3 * DEGREE, t.size)
    heading %= 2.0 * np.pi
    design = butterworth(0.625)
    # The rates need no conversion: one angle is zero while the other moves, and yaw rests.
    return Experiment(
        t,
        {"roll": roll, "pitch": pitch, "yaw": np.full(t.size, 2.0 * DEGREE)},
        {"roll": tilt[:, 0], "pitch": tilt[:, 1], "yaw": heading},
        {
            "roll": design.filter(tilt[:, 0], gyr[:, 0], fs=1000.0),
            "pitch": design.filter(tilt[:, 1], gyr[:, 1], fs=1000.0),
            "yaw": design.filter(heading, gyr[:, 2], fs=1000.0),
            "yaw, period = 2 pi": design.filter(heading, gyr[:, 2], fs=1000.0, period=2.0 * np.pi),
        },
    )


def experiment_errors(run: Experiment) -> dict[str, Array]:
    """Return the error of each estimate in deg."""
    return {name: np.degrees(angle - run.truth[name.split(",")[0]]) for name, angle in run.estimates.items()}


def show(result: Result, out: Path) -> None:
    """Print the tables and write them."""
    table(
        out / "responses.csv",
        ["Q", "poles / (rad/s)", "-3 dB / (rad/s)", "quoted / (rad/s)", "midpoint / (rad/s)", "peak / dB"],
        [
            [
                f"{q:g}",
                poles(row.poles),
                f"{row.cutoff:.1f}",
                f"{QUOTED[q]:g}",
                f"{row.midpoint:.1f}",
                f"{row.peak:.2f}",
            ]
            for q, row in result.responses.items()
        ],
    )
    table(
        out / "simulation.csv",
        ["Q", *(f"RMS of {angle} / deg" for angle in ANGLES), "expected / deg"],
        [
            [f"{q:g}", *(f"{value:.3f}" for value in row), f"{result.expected[q]:.3f}"]
            for q, row in result.rms.items()
        ],
    )
    print(f"\nThe least RMS error is at Q = {result.best_q:.2f}: {expected_rms(result.best_q):.3f} deg")
    table(
        out / "readings.csv",
        ["RMS / deg if the noise is", *(f"Q = {q:g}" for q in SIMULATED), "paper's order"],
        [
            [name, *(f"{value:.3f}" for value in row.values()), "yes" if papers_order(row) else "no"]
            for name, row in result.readings.items()
        ],
    )
    rest = result.experiment.t > 16.0
    table(
        out / "experiment.csv",
        ["error / deg, Q = 0.625", "RMS", "largest", "largest at rest"],
        [
            [name]
            + [f"{value:.2f}" for value in (np.sqrt(np.mean(e**2)), np.abs(e).max(), np.abs(e[rest]).max())]
            for name, e in experiment_errors(result.experiment).items()
        ],
    )


def poles(values: Complex) -> str:
    """Write a pair of poles."""
    first, second = values
    if first.imag:
        return f"{first.real:.2f} +- {abs(first.imag):.2f}j"
    return f"{first.real:.2f} {second.real:.2f}"


def papers_order(rms: dict[float, float]) -> bool:
    """Tell whether a smaller Q gave a smaller error."""
    return rms[0.01] < rms[0.1] < rms[1.0]


def table(path: Path, head: list[str], rows: list[list[str]]) -> None:
    """Write a table and print it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    print()
    for first, *cells in [head, *rows]:
        print(
            f"{first:<{widths[0]}}" + "".join(f"{c:>{w + 3}}" for c, w in zip(cells, widths[1:], strict=True))
        )


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG with 64 colours, a third of the size."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    with Image.open(path) as image:
        image.quantize(64).save(path, optimize=True)


def draw_summary(result: Result, sweep: dict[float, float], path: Path) -> None:
    """Draw one run's errors, RMS against Q, the low-passes, and the wrap of yaw."""
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 7.5), layout="constrained")
    draw_errors(axes[0, 0], one_run(), 0)
    axes[0, 0].set(title="Error of phi in one run", xlabel="time / s", ylabel="error / deg", ylim=(-3.5, 4.5))
    axes[0, 0].legend(loc="upper right", ncols=3)
    draw_rms(axes[0, 1], result, sweep)
    draw_low_pass(axes[1, 0], result)
    draw_yaw(axes[1, 1], result.experiment)
    axes[1, 1].set(title="Yaw near 0, measured from 0 to 360 deg", xlabel="time / s", ylabel="yaw / deg")
    axes[1, 1].legend(loc="center left", markerscale=5)
    for axis in axes.flat:
        axis.grid(color="0.9")
    save(figure, path)


def draw_errors(axis: Axes, run: Run, column: int) -> None:
    """Draw the errors of one angle for each Q, the noisiest behind the others."""
    for q, (color, line) in reversed(STYLES.items()):
        error = np.degrees(run.estimates[q] - run.angle)[::10, column]
        axis.plot(run.t[::10], error, color=color, ls=line, lw=1.0, label=f"Q = {q:g}")
    axis.set(xlim=(0.0, LENGTH))


def draw_rms(axis: Axes, result: Result, sweep: dict[float, float]) -> None:
    """Draw the RMS error against Q: expected, simulated, and the paper's claim."""
    axis.loglog(list(sweep), list(sweep.values()), "black", lw=1.2, label="noise as read, expected")
    simulated, other = pooled(result.rms), result.readings[START_OFF]
    axis.loglog(
        list(simulated), list(simulated.values()), "ko", ms=7, mfc="white", label=f"the same, {RUNS} runs"
    )
    axis.loglog(list(other), list(other.values()), "s--", color="0.5", label=START_OFF)
    axis.loglog(0.01, 0.5, "v", color="tab:red", ms=8, label="paper: about 0.5 deg or less")
    axis.set(title="RMS error", xlabel="Q", ylabel="RMS error / deg", ylim=(0.05, 30.0))
    axis.legend(loc="upper right")


def draw_low_pass(axis: Axes, result: Result) -> None:
    """Draw the low-passes, their -3 dB frequencies and those that the paper quotes."""
    omega = np.geomspace(1.0, 1e4, 1000)
    for (q, row), line in zip(result.responses.items(), ("-", ":", "--", "-."), strict=True):
        low = 20.0 * np.log10(np.abs(butterworth(q).frequency_response(omega)[0]))
        axis.semilogx(omega, low, ls=line, lw=1.4, color="black", label=f"Q = {q:g}")
        axis.plot(row.cutoff, -3.0, "ko", mfc="white")
        axis.plot(QUOTED[q], -3.0, "x", color="tab:red", ms=8, mew=2)
    axis.set(title="Low-pass: -3 dB (o) and as quoted (x)", xlabel="angular frequency / (rad/s)")
    axis.set(ylabel="magnitude / dB", ylim=(-12.0, 4.0), xlim=(1.0, 1e4))
    axis.legend(loc="lower left")


def draw_yaw(axis: Axes, run: Experiment) -> None:
    """Draw yaw without and with the period."""
    axis.plot(run.t, np.degrees(run.measured["yaw"]), ".", color="0.6", ms=2, label="measured")
    axis.plot(
        run.t, np.degrees(run.estimates["yaw"]), "tab:red", ls="--", lw=1.0, label="filter without period"
    )
    name = "yaw, period = 2 pi"
    axis.plot(run.t, np.degrees(run.estimates[name]), "black", lw=1.5, label="filter with period = 2 pi")
    axis.set(xlim=(0.0, 16.0))


def draw_run(run: Run, path: Path) -> None:
    """Draw the paper's figures 5 to 7: the angles, their errors, and the RMS errors so far."""
    figure, axes = plt.subplots(3, 3, figsize=(10.0, 8.0), sharex=True, layout="constrained")
    count = np.arange(1, run.t.size + 1)[::10]
    for column, (row, name) in enumerate(zip(axes, ANGLES, strict=True)):
        row[0].plot(run.t, np.degrees(run.angle[:, column]), "black", lw=1.2)
        row[0].set(ylabel=f"{name} / deg")
        draw_errors(row[1], run, column)
        for q, (color, line) in STYLES.items():
            squares = np.cumsum((run.estimates[q] - run.angle)[:, column] ** 2)[::10]
            row[2].plot(
                run.t[::10], np.degrees(np.sqrt(squares / count)), color=color, ls=line, label=f"Q = {q:g}"
            )
        row[1].set(ylim=(-3.5, 3.5))
        row[2].set(ylim=(0.0, 1.0))
    axes[2, 0].set(ylim=(-1.0, 1.0))
    for axis, title in zip(
        axes[0],
        ("angle, as figure 5", "error / deg, as figure 6", "RMS so far / deg, as figure 7"),
        strict=True,
    ):
        axis.set(title=title)
    for axis in axes.flat:
        axis.grid(color="0.9")
    for axis in axes[2]:
        axis.set(xlabel="time / s")
    figure.legend(*axes[0, 2].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    save(figure, path)


def draw_experiment(run: Experiment, path: Path) -> None:
    """Draw the paper's figure 8: roll, pitch and yaw."""
    figure, axes = plt.subplots(3, 1, figsize=(10.0, 8.0), sharex=True, layout="constrained")
    for axis, name in zip(axes, ("roll", "pitch"), strict=False):
        axis.plot(run.t, np.degrees(run.measured[name]), color="0.75", lw=0.6, label="accelerometer")
        axis.plot(run.t, np.degrees(run.estimates[name]), "tab:red", lw=1.3, label="filter")
        axis.plot(run.t, np.degrees(run.truth[name]), "black", lw=1.3, ls="--", label="truth")
        axis.set(ylabel=f"{name} / deg")
    draw_yaw(axes[2], run)
    axes[2].set(ylabel="yaw / deg", xlabel="time / s", xlim=(0.0, 20.0))
    for axis in axes:
        axis.grid(color="0.9")
        axis.legend(loc="upper left")
    save(figure, path)


if __name__ == "__main__":
    main()
