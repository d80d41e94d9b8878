"""The figures of the Butterworth filter."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from butterworth_experiment import Experiment
from butterworth_family import QUOTED, butterworth
from butterworth_simulation import ANGLES, LENGTH, RUNS, START_OFF, Run, one_run, pooled
from butterworth_tables import Result

mpl.use("agg")
from matplotlib import pyplot as plt

STYLES = {1.0: ("black", "-"), 0.1: ("tab:red", "--"), 0.01: ("0.7", "-")}


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


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG with 64 colours, a third of the size."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    with Image.open(path) as image:
        image.quantize(64).save(path, optimize=True)
