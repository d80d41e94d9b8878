"""The figure of the cube on its edge."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from PIL import Image

from edge_cube import DRY, T, changed, sticky
from edge_designs import plain
from edge_loops import radius
from edge_simulation import Case, simulate
from edge_study import Results

STYLES: dict[str, dict[str, Any]] = {
    "true tilt": {"color": "black", "ls": "-", "lw": 1.0},
    "observer, small Q": {"color": "tab:red", "ls": "-", "lw": 2.0},
    "observer, large Q": {"color": "tab:blue", "ls": "--", "lw": 1.5},
    "Kalman": {"color": "tab:green", "ls": "-.", "lw": 1.5},
}

FAMILIES: dict[str, dict[str, Any]] = {
    "I": {"color": "tab:red", "marker": "o", "ls": "-"},
    "I, predicted": {"color": "tab:purple", "marker": "^", "ls": ":"},
    "B Bᵀ": {"color": "tab:green", "marker": "s", "ls": "-."},
}


def draw(results: Results, path: Path) -> None:
    """Draw the oscillation, its cause, and what the choice of Q does."""
    mpl.use("agg")
    figure, axes = plt.subplots(3, 2, figsize=(10.0, 11.0), layout="constrained")
    draw_time(axes[0, 0], results)
    draw_friction(axes[1, 0], results)
    draw_motor(axes[2, 0], results)
    draw_cycles(axes[0, 1], results)
    draw_noise(axes[1, 1], results)
    draw_poles(axes[2, 1], results)
    for letter, each in zip("abcdef", axes.flat, strict=True):
        each.set_title(f"({letter}) {each.get_title()}", fontsize=11)
        each.grid(color="0.9")
    for each in axes[:, 1]:
        each.set(xscale="log", xlabel="q", xlim=(1e-11, 1e2))
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3])
    picture.quantize(64).save(path, optimize=True)
    plt.close(figure)


def draw_time(axes: Axes, results: Results) -> None:
    """Draw the tilt over time, with dry friction and noise."""
    shown = {"complementary, first order": {"color": "0.65", "ls": "-", "lw": 1.0}, **STYLES}
    runs = simulate([Case(results.schemes[name], DRY) for name in shown], 30.0)
    t = T * np.arange(len(runs.current))
    late = t >= 20.0
    for i, (name, style) in enumerate(shown.items()):
        axes.plot(t[late] - 20.0, np.degrees(runs.states[late, 0, i]), label=name, **style)
    axes.set(
        xlabel="time / s", ylabel="tilt / °", ylim=(-0.75, 1.25), xlim=(0.0, 10.0), title="with dry friction"
    )
    axes.legend(ncols=2, frameon=False, loc="upper center", fontsize=9)


def draw_friction(axes: Axes, results: Results) -> None:
    """Draw the largest eigenvalue over the viscous friction that the model does not know."""
    friction = np.geomspace(1e-4, 1e-2, 150)
    for name, style in STYLES.items():
        axes.plot(1e3 * friction, radius([sticky(one) for one in friction], results.schemes[name]), **style)
        cycle = results.linear[name].cycle
        axes.plot(1e3 * cycle.friction, 1.0, "o", color=style["color"], mfc="white", zorder=3)
        axes.annotate(
            f"{cycle.frequency:.2f} Hz" if cycle.frequency > 0.01 else "0 Hz",
            (1e3 * cycle.friction, 1.0),
            xytext=(-4, 4) if name == "true tilt" else (4, -13),
            textcoords="offset points",
            ha="right" if name == "true tilt" else "left",
        )
    axes.axhline(1.0, color="black", lw=0.8)
    axes.set(
        xscale="log",
        xlim=(0.1, 10.0),
        ylim=(0.985, 1.025),
        xlabel="friction that the model lacks / (mN m s)",
        ylabel="largest eigenvalue",
        title="as if the friction were viscous",
    )


def draw_motor(axes: Axes, results: Results) -> None:
    """Draw the largest eigenvalue over the error of the motor's constant."""
    factors = np.geomspace(0.4, 2.0, 150)
    cubes = [changed(torque_constant=factor) for factor in factors]
    for name, style in STYLES.items():
        axes.plot(factors, radius(cubes, results.schemes[name]), **style)
    axes.axhline(1.0, color="black", lw=0.8)
    axes.axvspan(0.8, 1.2, color="0.9", zorder=0)
    axes.set(
        xlim=(0.4, 2.0),
        ylim=(0.98, 1.05),
        xlabel="K_m, true / model",
        ylabel="largest eigenvalue",
        title="wrong motor constant (grey: ±20 %)",
    )


def draw_cycles(axes: Axes, results: Results) -> None:
    """Draw how far the limit cycle tilts the cube, simulated and from the describing function."""
    for name, style in FAMILIES.items():
        one = results.sweeps[name]
        line = {"color": style["color"], "ls": style["ls"]}
        axes.plot(one.q, np.degrees([cycle.tilt for cycle in one.predicted]), **line)
        marks = {"color": style["color"], "marker": style["marker"], "ls": "none", "mfc": "white", "ms": 4}
        axes.plot(one.q, np.degrees([run.tilt for run in one.simulated]), label=f"Q = q {name}", **marks)
    axes.set(
        ylabel="RMS tilt / °", ylim=(-0.02, 0.52), title="limit cycle: simulated (marks), balance (lines)"
    )
    axes.legend(frameon=False, loc="upper right")


def draw_noise(axes: Axes, results: Results) -> None:
    """Draw the current that the sensors' noise costs."""
    for name, style in FAMILIES.items():
        one = results.sweeps[name]
        axes.plot(one.q, one.noise[:, 1], label=f"Q = q {name}", mfc="white", ms=4, **style)
    axes.set(ylim=(0.0, 0.16), ylabel="RMS current / A", title="what noise costs, without model error")
    axes.legend(frameon=False, loc="upper left")


def draw_poles(axes: Axes, results: Results) -> None:
    """Draw the sizes of the observer's poles."""
    for name in ("I", "B Bᵀ"):
        one, style = results.sweeps[name], FAMILIES[name]
        lines = axes.plot(one.q, one.poles, mfc="white", ms=4, **style)
        lines[0].set_label(f"Q = q {name}")
    falling = np.abs(np.linalg.eigvals(plain().A)).max()
    axes.annotate(f"wheel's friction: {one.poles[0].max():.3f}", (3e-11, 1.02), va="bottom")
    axes.annotate(f"fall, mirrored: {1.0 / falling:.3f}", (3e-11, 0.85), va="bottom")
    axes.set(ylabel="size of the observer's poles", ylim=(0.0, 1.12), title="observer's poles")
    axes.legend(frameon=False, loc="lower left")
