"""The figures of the child seat."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from seat_filters import ACCELEROMETER, BETTER_ELEVEN, BETTER_NINE, ELEVEN, GYRO, NINE
from seat_log import Array, Log
from seat_turn import AFTER, TURN, Turn

mpl.use("agg")
from matplotlib import pyplot as plt

TITLES = (("as figure 4", "as figure 5"), ("as figure 6", "as figure 7"), ("better gains", "better gains"))


def draw_log(log: Log, rolls: dict[str, Array], path: Path) -> None:
    """Draw the paper's figures 4 to 7, and below them the same half minute with better gains."""
    static, road = ~log.driving, (log.t >= 82.0) & (log.t <= 112.0)
    figure, axes = plt.subplots(3, 2, figsize=(10.0, 8.0), sharex="row", sharey="row", layout="constrained")
    for column, names in enumerate(((NINE, NINE, BETTER_NINE), (ELEVEN, ELEVEN, BETTER_ELEVEN))):
        for row, (name, shown) in enumerate(zip(names, (static, road, road), strict=True)):
            axis, t = axes[row, column], log.t[shown]
            measured = np.degrees(rolls[ACCELEROMETER][shown])
            axis.plot(t, measured, color="0.75", lw=0.8, label=ACCELEROMETER)
            if row == 0:  # far out of the picture on the road
                axis.plot(t, np.degrees(rolls[GYRO][shown]), "tab:blue", ls=":", lw=1.5, label=GYRO)
            axis.plot(t, np.degrees(log.roll[shown]), "black", ls="--", lw=1.5, label="truth")
            axis.plot(t, np.degrees(rolls[name][shown]), "tab:red", lw=1.1, label="filter")
            axis.set(title=f"{TITLES[row][column]}: {name}", xlim=(t[0], round(t[-1])))
            axis.grid(color="0.9")
    for axis, low, high in zip(axes[:, 0], (-50.0, -17.0, -17.0), (35.0, 17.0, 17.0), strict=True):
        axis.set(ylabel="roll / deg", ylim=(low, high))
    for axis in axes[2]:
        axis.set(xlabel="time / s")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    save(figure, path)


def draw_turn(turn: Turn, path: Path) -> None:
    """Draw roll in the steady turn."""
    figure, axis = plt.subplots(figsize=(10.0, 4.0), layout="constrained")
    for (name, roll), style in zip(turn.roll.items(), ("-", "--", "-.", ":"), strict=True):
        axis.plot(turn.t, np.degrees(roll), ls=style, lw=1.6, label=name)
    axis.axvline(TURN, color="black", lw=0.8)
    axis.set(xlabel="time / s", ylabel="roll / deg", xlim=(0.0, TURN + AFTER))
    axis.grid(color="0.9")
    axis.legend()
    save(figure, path)


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG with 64 colours, a third of the size."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    with Image.open(path) as image:
        image.quantize(64).save(path, optimize=True)
