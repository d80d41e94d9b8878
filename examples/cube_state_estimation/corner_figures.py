"""The figures of the cube on its corner."""

import itertools
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

import compfilt as cf
from corner_cube import ARRAY, EDGE, OPERATING_POINT, POSITIONS, ROTATIONS
from corner_filters import answers, estimate
from corner_gravity import forces
from corner_layouts import placements
from corner_motion import LATE, Swing
from corner_rates import RATE_TAU, RATE_TAUS, bias_of_the_array, rate_answers
from corner_sensors import BIASED, GYRO_NOISE, PERFECT, VIBRATING, read
from corner_slips import phi3_by_arctan, printed_phi3
from corner_tables import Array, Table, columns_of, rms

TAUS = np.geomspace(0.02, 2.0, 13)
"""Where the error of the angles is looked at over tau, in s."""

STYLES: dict[str, dict[str, object]] = {
    "truth": {"color": "0.75", "ls": "-", "lw": 4.0},
    "one sensor, 202 mm from the pivot": {"color": "tab:blue", "ls": ":", "lw": 1.6},
    "mean of the four channels": {"color": "#a65300", "ls": "--", "lw": 1.3},
    "array, rate unknown": {"color": "tab:red", "ls": "-", "lw": 1.2},
    "accelerometers alone": {"color": "0.7", "ls": "-", "lw": 0.6},
    "gyros alone": {"color": "tab:blue", "ls": ":", "lw": 1.6},
    "first order, frozen": {"color": "#a65300", "ls": "--", "lw": 1.3},
    "first order, output": {"color": "tab:red", "ls": "-", "lw": 1.2},
    "PI, output": {"color": "black", "ls": "-.", "lw": 1.2},
}


def panels(layout: list[list[str]], height: float) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure 1000 px wide and its named panels."""
    mpl.use("agg")
    figure, named = plt.subplot_mosaic(layout, figsize=(10.0, height), layout="constrained")
    for each in named.values():
        each.grid(color="0.9")
    return figure, named


def save(figure: Figure, path: Path) -> None:
    """Write the figure with few colours, which makes the file small, and forget it."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    with Image.open(path) as picture:
        picture.quantize(64).save(path, optimize=True)


def draw_angles(near: Swing, far: Swing, path: Path) -> None:
    """Draw φ2 without and with the extraction, and the errors of the filters over time and tau."""
    figure, named = panels([["extraction", "slow"], ["fast", "taus"]], 6.2)
    draw_extraction(named["extraction"], far)
    found = answers(far, read(far, VIBRATING))
    fast = (far.t >= 12.0) & (far.t < 14.0) & (np.arange(far.t.size) % 5 == 0)
    for way in ("accelerometers alone", "first order, frozen", "first order, output"):
        error = np.degrees(found[way] - far.angles)[fast, 0]
        named["fast"].plot(far.t[fast], error, label=way, **STYLES[way])
    for way in ("first order, frozen", "gyros alone", "first order, output", "PI, output"):
        error = np.degrees(found[way] - far.angles)[::20, 1]
        named["slow"].plot(far.t[::20], error, label=way, **STYLES[way])
    named["fast"].set(ylabel="error of φ2 / deg", ylim=(-10.0, 14.0), title="the filters, motors running")
    named["slow"].set(ylabel="error of φ3 / deg", ylim=(-14.0, 19.0), title="the filters, motors running")
    draw_taus(named["taus"], {"far": far, "near": near})
    for name, each in named.items():
        each.legend(frameon=False, fontsize=8.5, ncols=2 if name in {"fast", "slow"} else 1, loc="upper left")
        each.set(xlabel="tau / s" if name == "taus" else "time / s")
    save(figure, path)


def draw_extraction(panel: Axes, far: Swing) -> None:
    """Draw φ2 by perfect accelerometers without and with the extraction."""
    shown = (far.t >= 12.0) & (far.t < 16.0)
    panel.plot(far.t[shown], np.degrees(far.angles[shown, 0]), label="truth", **STYLES["truth"])
    for way, force in forces(read(far, PERFECT)).items():
        if way in STYLES:
            angle = np.degrees(cf.tilt(force[shown], axes="cube")[:, 0])
            panel.plot(far.t[shown], angle, label=way, **STYLES[way])
    panel.set(ylabel="φ2 / deg", ylim=(-5.0, 145.0), title="perfect accelerometers")


def draw_taus(panel: Axes, swings: dict[str, Swing]) -> None:
    """Draw the RMS error of the first-order filter over tau, near and far, with both matrices."""
    for where, true in swings.items():
        readings = read(true, VIBRATING)
        for rate_matrix, mark in (("frozen", "s"), ("output", "o")):
            runs = (estimate(cf.FirstOrder(tau), rate_matrix, readings) for tau in TAUS)
            errors = [rms((run.angles - true.angles)[true.t >= LATE]) for run in runs]
            style = STYLES[f"first order, {rate_matrix}"] | {"ls": "-" if where == "far" else ":"}
            label = f"{where}, {rate_matrix}"
            panel.loglog(TAUS, np.degrees(errors), marker=mark, ms=4.0, mfc="white", label=label, **style)
    panel.set(ylabel="RMS error of both angles / deg", title="first order, motors running")


def draw_geometry(far: Swing, path: Path) -> None:
    """Draw the cube with its sensors, the noise gains of other layouts, and (1.8) as printed."""
    figure, named = panels([["cube", "gains", "slip"]], 3.7)
    draw_cube(named["cube"])
    draw_gains(named["gains"])
    draw_slip(named["slip"], far)
    for each in (named["gains"], named["slip"]):
        each.legend(frameon=False, fontsize=8.5)
    save(figure, path)


def draw_gains(panel: Axes) -> None:
    """Draw what share of the layouts has at most a noise gain, and where the one chosen here lies."""
    without, known = placements()
    for gains, gain, label, mark, style in (
        (without, ARRAY.noise_gain[0], "rate unknown", "o", {"color": "tab:red", "ls": "-"}),
        (known, ARRAY.noise_gain_with_gyro[0], "rate by the gyros", "s", {"color": "tab:blue", "ls": "--"}),
    ):
        panel.semilogx(np.sort(gains), np.arange(1, gains.size + 1) / gains.size, label=label, **style)
        here = np.mean(gains < gain + 1e-9)
        panel.plot(gain, here, mark, color="black", mfc="white", label="the same, chosen here")
    panel.set(xlabel="noise gain", ylabel="share of 625 layouts", xlim=(0.5, 100.0), title="where they sit")


def draw_slip(panel: Axes, far: Swing) -> None:
    """Draw φ3 by (1.8)."""
    shown = (far.t >= 12.0) & (far.t < 16.0)
    for label, angle, style in (
        ("truth", far.angles[:, 1], STYLES["truth"]),
        ("k3 below, as printed", printed_phi3(far.gravity), {"color": "#a65300", "ls": "--"}),
        ("k1 below", phi3_by_arctan(far.gravity), {"color": "tab:red", "ls": "-"}),
    ):
        panel.plot(far.t[shown], np.degrees(angle[shown]), label=label, **style)
    panel.set(xlabel="time / s", ylabel="φ3 / deg", title="(1.8), perfect sensors", ylim=(-5.0, 110.0))


def draw_cube(panel: Axes) -> None:
    """Draw the cube on its corner from the side, its sensors and the two axes that each uses."""
    corners = np.array(list(itertools.product((-EDGE, 0.0), (0.0, EDGE), (-EDGE, 0.0))))
    hidden = np.argmin(seen_from_the_side(corners)[:, 2])
    for one, other in itertools.combinations(range(8), 2):
        if np.count_nonzero(corners[one] != corners[other]) == 1:
            across, up, _ = seen_from_the_side(corners[[one, other]]).T
            panel.plot(across, up, color="0.4", lw=1.0, ls=":" if hidden in {one, other} else "-")
    for number, (place, rotation) in enumerate(zip(POSITIONS, ROTATIONS, strict=True), start=1):
        points = seen_from_the_side(
            np.array([place, place + 0.025 * rotation[0], place + 0.025 * rotation[1]])
        )
        for end, style in ((1, "-"), (2, (0, (2, 1)))):
            panel.plot(*points[[0, end], :2].T, color="tab:red", lw=1.5, ls=style)
        panel.plot(*points[0, :2], "ko", ms=4.0)
        panel.annotate(str(number), points[0, :2], xytext=(4, 4), textcoords="offset points", fontsize=9.0)
    panel.plot(0.0, 0.0, "k^", ms=8.0)
    panel.set(xlabel="across / mm", ylabel="up / mm", aspect="equal", title="the sensors (x solid, y dashed)")


def seen_from_the_side(places: Array) -> Array:
    """Return across, up and towards the eye in mm, (n, 3), for places in body axes at the operating point."""
    k1, k2, k3 = 1e3 * places.T
    down, east = turned(OPERATING_POINT[1]) @ [k1, k2]
    south, down = turned(OPERATING_POINT[0]) @ [k3, down]
    across, towards = turned(np.radians(-20.0)) @ [east, south]
    up, towards = turned(np.radians(15.0)) @ [-down, towards]
    return np.column_stack((across, up, towards))


def turned(angle: float) -> Array:
    """Return the matrix that turns by an angle in a plane."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def draw_rates(far: Swing, taus: Table, path: Path) -> None:
    """Draw the errors of the rate about k2 over time, and the error of the drift-free rate over tau."""
    figure, named = panels([["time", "taus"]], 4.4)
    draw_drift(named["time"], far)
    marks = zip(columns_of(taus), ("o-", "s-", "o--", "s--"), ("tab:blue", "tab:red") * 2, strict=True)
    for column, mark, color in marks:
        values = [row[column] for row in taus.values()]
        named["taus"].loglog(
            RATE_TAUS, values, mark, color=color, ms=4.0, mfc="white", label=column.split(" / ")[0]
        )
    for label, count, style in (("one gyro alone", 1, ":"), ("six gyros alone", 6, "-.")):
        level = np.degrees(GYRO_NOISE) / np.sqrt(count)
        named["taus"].axhline(level, color="black", lw=1.2, ls=style, label=label)
    named["taus"].set(xlabel="tau / s", ylabel="RMS error of the rate / (deg/s)", ylim=(0.012, 5.0))
    named["taus"].set_title("drift-free pair, no biases")
    for each in named.values():
        each.legend(frameon=False, fontsize=8.5, ncols=2 if each is named["taus"] else 1, loc="lower left")
    save(figure, path)


def draw_drift(panel: Axes, far: Swing) -> None:
    """Draw the errors of the rate about k2 with all errors of the sensors."""
    found = rate_answers(read(far, BIASED))
    for way, style in {
        "drift-free: mean and array, 0.1 s": {"color": "0.7", "ls": "-", "lw": 0.5},
        "mean of six gyros": {"color": "black", "ls": "-", "lw": 0.5},
        "S0 (30): mean and array, 0.1 s": {"color": "tab:red", "ls": "-", "lw": 1.3},
    }.items():
        panel.plot(far.t[::20], np.degrees(found[way] - far.rate)[::20, 1], label=way, **style)
    ramp = np.degrees(bias_of_the_array()[1]) * (far.t - RATE_TAU * (1.0 - np.exp(-far.t / RATE_TAU)))
    panel.plot(far.t[::2000], ramp[::2000], "k+", ms=7.0, label="β (t - τ + τ exp(-t/τ))")
    panel.set(xlabel="time / s", ylabel="error of u_K2 / (deg/s)", title="all errors of the sensors")
