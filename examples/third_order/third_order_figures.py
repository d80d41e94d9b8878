"""The figures of the third order."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from figure_of_eight import BIAS, FS, GPS_PERIOD, Drive, T
from orders_of_c import DESIGNS, closed_forms, decibel_of
from pi_gains import printed_pi
from position_filters import LATE, TAU, Answer, answers, bias_rise
from sign_of_the_figure import as_drawn
from third_order_tables import Array, Complex


def panels(layout: list[list[str]], height: float) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure 1000 px wide and its named panels."""
    mpl.use("agg")
    figure, named = plt.subplot_mosaic(layout, figsize=(10.0, height), layout="constrained")
    for each in named.values():
        each.grid(color="0.9")
    return figure, named


def save(figure: Figure, path: Path) -> None:
    """Write the figure and forget it."""
    figure.savefig(path, dpi=100)
    plt.close(figure)


STYLES: dict[str, dict[str, object]] = {
    "integrated twice": {"color": "tab:blue", "ls": ":", "lw": 1.6},
    "second order": {"color": "#a65300", "ls": "--", "lw": 1.3},
    "third order, delay not told": {"color": "0.5", "ls": "-.", "lw": 1.3},
    "third order": {"color": "tab:red", "ls": "-", "lw": 1.5},
}


def draw_position(drive: Drive, path: Path) -> None:
    """Draw the way, the errors in position and the estimate of the bias."""
    figure, named = panels([["way", "error"], ["way", "bias"]], 5.2)
    found = answers(drive)
    draw_way(named["way"], drive, found)
    error, bias = named["error"], named["bias"]
    for name, style in STYLES.items():
        off = np.linalg.norm(found[name].position - drive.position, axis=1)
        error.semilogy(drive.t[::5], off[::5], label=name, **style)
    error.set(ylabel="error in position / m", ylim=(5e-2, 3e5))
    error.legend(frameon=False, fontsize=8.5, ncols=2, loc="upper left")
    bias.plot(drive.t[::5], found["third order"].bias[::5], **STYLES["third order"])
    for b in BIAS:
        bias.plot(drive.t, b * bias_rise(drive.t / TAU), "k--", lw=1.0)
        bias.axhline(b, color="black", lw=0.8, ls=":")
    bias.set(xlabel="time / s", ylabel="bias / (m/s²)")
    save(figure, path)


def draw_way(panel: Axes, drive: Drive, found: dict[str, Answer]) -> None:
    """Draw 40 s of the way seen from above."""
    shown = (drive.t >= LATE) & (drive.t < LATE + 40.0)
    fixes = shown & (np.arange(drive.t.size) % round(GPS_PERIOD * FS) == 0)
    panel.plot(*found["GPS held"].position[fixes].T, "x", color="0.6", ms=3.5, label="GPS")
    panel.plot(*drive.position[shown].T, "k-", lw=3.0, alpha=0.3, label="truth")
    for name in ("second order", "third order"):
        panel.plot(*found[name].position[shown].T, label=name, **STYLES[name])
    panel.set(xlabel="east / m", ylabel="north / m", aspect="equal", ylim=(-28.0, 42.0))
    panel.legend(frameon=False, fontsize=8.5, ncols=2, loc="upper center")


def draw_orders(path: Path) -> None:
    """Draw magnitude and phase of all three orders, with the closed forms as marks."""
    figure, named = panels([["magnitude", "phase"]], 4.4)
    omega, marks = np.geomspace(0.03, 30.0, 400), np.geomspace(0.03, 30.0, 13)
    looks = zip((":", "--", "-"), ("tab:blue", "#a65300", "tab:red"), strict=True)
    for (name, design), (style, color) in zip(DESIGNS.items(), looks, strict=True):
        named["magnitude"].plot([], [], ls=style, color=color, label=name)
        pairs = zip(design.frequency_response(omega), closed_forms(design, marks), "ov", strict=True)
        for curve, exact, mark in pairs:
            for panel, shown in (("magnitude", decibel_of), ("phase", phase_of)):
                named[panel].semilogx(omega, shown(curve), ls=style, color=color)
                named[panel].semilogx(marks, shown(exact), mark, color=color, ms=4.5, mfc="white")
    for mark, label in (("ko", "C/(C + s)"), ("kv", "s/(C + s)")):
        named["phase"].plot([], [], mark, mfc="white", ms=4.5, label=label)
    named["magnitude"].set(xlabel="ω/ω0", ylabel="magnitude / dB", ylim=(-60.0, 15.0))
    named["magnitude"].legend(frameon=False, fontsize=8.5, loc="lower right")
    named["phase"].set(xlabel="ω/ω0", ylabel="phase / deg", yticks=range(-90, 271, 90))
    named["phase"].legend(frameon=False, fontsize=8.5)
    save(figure, path)


def phase_of(response: Complex) -> Array:
    """Return the phase in deg without jumps, within half a turn at the last frequency."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return phase - 360.0 * np.round(phase[-1] / 360.0)


def draw_slips(path: Path) -> None:
    """Draw the PI loop as printed beside the filter, and the last figure with both signs."""
    figure, named = panels([["pi", "sign"]], 4.0)
    omega = np.geomspace(0.03, 100.0, 300)
    low = DESIGNS["order 2, C = a + b/s"].frequency_response(omega)[0]
    named["pi"].semilogx(omega, decibel_of(low), "-", color="tab:red", label="C/(C + s), the low-pass")
    named["pi"].semilogx(omega, decibel_of(printed_pi(omega)), "k--", label="C/(C + 1), as printed")
    named["pi"].set(xlabel="ω/ω0", ylabel="magnitude / dB", title="PI controller and filter")
    t = np.arange(1, round(12.0 * FS) + 1) * T
    for direction, label, style in ((1.0, "e = s_c - s_m, as drawn", "k--"), (-1.0, "e = s_m - s_c", "r-")):
        named["sign"].semilogy(t, abs(as_drawn(direction)), style, label=label)
    named["sign"].set(xlabel="time / s", ylabel="error in position / m", title="last figure, begun 1 cm off")
    for each in named.values():
        each.legend(frameon=False, fontsize=9.0)
    save(figure, path)
