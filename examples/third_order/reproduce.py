"""What K_P and K_I are, and the third-order filter for position: C(s) of order one to three.

    python examples/third_order/reproduce.py [FOLDER]

prints tables and writes them, with figures, to FOLDER, by default ``out`` beside this file. The source is the note
"互补滤波深层原理" (S3 in docs/derivations.md).
"""

import csv
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import compfilt as cf

HERE = Path(__file__).resolve().parent

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Table = dict[str, dict[str, float]]
"""Rows by name, cells by column."""

FS = 100.0
T = 1.0 / FS
DURATION = 120.0
LATE = 40.0
"""The errors are counted from here on, in s."""
TAU = 4.0
GPS_PERIOD, GPS_NOISE, GPS_DELAY = 0.2, 1.0, 0.2
"""s, m, s."""
BIAS = np.array([0.15, -0.10])
ACCELEROMETER_NOISE = 0.05
"""m/s² a sample."""


def main() -> None:
    """Reproduce and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "out"
    for name, table in reproduce(out).items():
        show(name, table)
    print(f"\nfigures and tables: {out}")


def reproduce(out: Path) -> dict[str, Table]:
    """Compute everything, write tables and figures to `out`, and return the tables."""
    out.mkdir(parents=True, exist_ok=True)
    drive = drive_an_eight()
    tables = {
        "orders": orders(),
        "gains": same_filter(drive),
        "pi_controller": pi_controller(),
        "position": position(drive),
        "bias": bias_found(),
        "taus": taus(drive),
        "sign": sign(),
    }
    for name, table in tables.items():
        write(table, out / f"{name}.csv")
    draw_position(drive, out / "third_order.png")
    draw_orders(out / "orders.png")
    draw_slips(out / "slips.png")
    return tables


# C(s) = k_1 + k_2/s + k_3/s²

OMEGA0 = 1.0
DESIGNS: dict[str, cf.LinearFilter] = {
    "order 1, C = c": cf.FirstOrder(1.0 / OMEGA0),
    "order 2, C = a + b/s": cf.PiForm(np.sqrt(2.0) * OMEGA0, OMEGA0**2),
    "order 3, C = a + b/s + c/s²": cf.ThirdOrder.butterworth(OMEGA0),
}
"""All with Butterworth poles, so that their corners are comparable."""


def closed_forms(design: cf.LinearFilter, omega: Array) -> tuple[Complex, Complex]:
    """Return C/(C + s) and s/(C + s) as the source has them."""
    s = 1j * omega
    c = sum(k / s**i for i, k in enumerate(design.coefficients))
    return c / (c + s), s / (c + s)


def orders() -> Table:
    """Compare the library's responses with the source's, and say what the order changes."""
    omega = OMEGA0 * np.geomspace(1e-8, 1e3, 11001)
    table: Table = {}
    for name, design in DESIGNS.items():
        low, high = design.frequency_response(omega)
        low_by_c, high_by_c = closed_forms(design, omega)
        above = omega > OMEGA0
        table[name] = {
            "LP, off C/(C + s)": float(np.max(abs(low - low_by_c))),
            "HP, off s/(C + s)": float(np.max(abs(high - high_by_c))),
            "LP + HP, off 1": float(np.max(abs(low + high - 1.0))),
            "LP peak / dB": float(decibel_of(np.max(abs(low)))),
            "LP at -3 dB / omega0": float(omega[above][np.argmax(abs(low[above]) < np.sqrt(0.5))] / OMEGA0),
            "HP at 0.1 omega0 / dB": float(decibel_of(np.interp(0.1 * OMEGA0, omega, abs(high)))),
        }
    return table


def decibel_of(response: Complex | float) -> Array:
    """Return the magnitude in dB."""
    return 20.0 * np.log10(np.abs(response))


def phase_of(response: Complex) -> Array:
    """Return the phase in deg without jumps, within half a turn at the last frequency."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return phase - 360.0 * np.round(phase[-1] / 360.0)


def same_filter(drive: "Drive") -> Table:
    """Filter one signal with designs that have the same coefficients; count the samples that differ in any bit."""
    rng = np.random.default_rng(1)
    angle = drive.position[:, 0] + rng.normal(0.0, 1.0, drive.t.size)
    pi, butterworth, third = cf.PiForm(20.0, 10.0), cf.Butterworth(OMEGA0), cf.ThirdOrder(TAU)
    pairs = {
        "PiForm(K_P, K_I), Chain([K_P, K_I])": (pi, cf.Chain(pi.coefficients)),
        "PiForm(K_P, K_I), Butterworth(ω0)": (cf.PiForm(*butterworth.coefficients), butterworth),
        "FirstOrder(τ), Chain([1/τ])": (cf.FirstOrder(TAU), cf.Chain([1.0 / TAU])),
        "ThirdOrder, Chain([k1, k2, k3])": (third, cf.Chain(third.coefficients, derivative_order=2)),
    }
    return {
        name: {"samples": drive.t.size, "that differ": int(np.sum(outputs[0] != outputs[1]))}
        for name, designs in pairs.items()
        for outputs in [[each.filter(angle, drive.acceleration[:, 0], fs=FS) for each in designs]]
    }


def printed_pi(omega: Array) -> Complex:
    """Return the note's U/R = C/(C + 1), which it compares with C/(C + s)."""
    k_p, k_i = DESIGNS["order 2, C = a + b/s"].coefficients
    c = k_p + k_i / (1j * omega)
    return c / (c + 1.0)


def pi_controller() -> Table:
    """Compare the PI loop as printed with the filter of the same two numbers."""
    design = DESIGNS["order 2, C = a + b/s"]
    table: Table = {}
    for factor in (0.01, 0.1, 1.0, 10.0, 100.0):
        omega = np.array([factor * OMEGA0])
        table[f"omega = {factor:g} omega0"] = {
            "|C/(C + s)|, LP": float(abs(design.frequency_response(omega)[0][0])),
            "|C/(C + 1)|, as printed": float(abs(printed_pi(omega)[0])),
        }
    return table


# The third order: position from GPS and accelerometer


class Drive(NamedTuple):
    """A vehicle on a horizontal plane; (n, 2) east and north."""

    t: Array
    position: Array
    velocity: Array
    acceleration: Array
    """m/s², mean over the period that ends at the sample."""


def drive_an_eight() -> Drive:
    """Return a figure of eight with a weave in it, begun at rest."""
    t = np.arange(-1, round(DURATION * FS)) * T
    # The clock of the eight runs up to full speed with a time constant of 3 s.
    after = np.maximum(t, 0.0)
    s, speed = after - 3.0 * (1.0 - np.exp(-after / 3.0)), 1.0 - np.exp(-after / 3.0)
    amplitudes = np.array([[40.0, 2.0], [20.0, 3.0]])  # m
    omegas = 2.0 * np.pi / np.array([[40.0, 9.0], [20.0, 7.0]])  # rad/s
    phases = omegas * s[:, None, None]
    position = np.sum(amplitudes * np.sin(phases), axis=2)
    velocity = speed[:, None] * np.sum(amplitudes * omegas * np.cos(phases), axis=2)
    return Drive(t[1:], position[1:], velocity[1:], np.diff(velocity, axis=0) / T)


def sensors(drive: Drive, seed: int = 0) -> tuple[Array, Array]:
    """Return GPS, NaN where no fix has come, and the accelerometer."""
    rng = np.random.default_rng(seed)
    acceleration = drive.acceleration + BIAS + rng.normal(0.0, ACCELEROMETER_NOISE, drive.acceleration.shape)
    late, every = round(GPS_DELAY * FS), round(GPS_PERIOD * FS)
    fixes = np.arange(late, drive.t.size, every)
    gps = np.full(drive.position.shape, np.nan)
    gps[fixes] = drive.position[fixes - late] + rng.normal(0.0, GPS_NOISE, (fixes.size, 2))
    return gps, acceleration


class Answer(NamedTuple):
    """Position, velocity and bias by one filter, (n, 2); NaN where it has none."""

    position: Array
    velocity: Array
    bias: Array


def answers(drive: Drive) -> dict[str, Answer]:
    """Return what every filter makes of the same sensors."""
    gps, acceleration = sensors(drive)
    third, second = cf.ThirdOrder(TAU), cf.SecondOrderInertial(TAU)
    return {
        "GPS held": held(gps),
        "integrated twice": integrated(drive, acceleration),
        "second order": answer(second, gps, acceleration, GPS_DELAY),
        "third order, delay not told": answer(third, gps, acceleration, 0.0),
        "third order": answer(third, gps, acceleration, GPS_DELAY),
    }


def answer(design: cf.LinearFilter, gps: Array, acceleration: Array, delay: float) -> Answer:
    """Run one of the library's filters."""
    estimate = design.estimate(gps, acceleration, fs=FS, delay=delay)
    bias = estimate.bias if design.order == 3 else np.full(gps.shape, np.nan)
    return Answer(estimate.position, estimate.velocity, bias)


def held(gps: Array) -> Answer:
    """Hold the last fix, and as velocity the difference of the last two."""
    fixes = np.flatnonzero(np.isfinite(gps[:, 0]))
    velocity = np.diff(gps[fixes], axis=0, prepend=gps[fixes[:1]]) / GPS_PERIOD
    last = np.searchsorted(fixes, np.arange(gps.shape[0]), side="right") - 1
    known = (last >= 0)[:, None]
    missing = np.full(gps.shape, np.nan)
    return Answer(np.where(known, gps[fixes][last], np.nan), np.where(known, velocity[last], np.nan), missing)


def integrated(drive: Drive, acceleration: Array) -> Answer:
    """Integrate twice from the true start."""
    velocity = drive.velocity[0] + T * np.cumsum(acceleration, axis=0)
    position = drive.position[0] + T * np.cumsum(velocity, axis=0)
    return Answer(position, velocity, np.full(velocity.shape, np.nan))


def position(drive: Drive) -> Table:
    """Return RMS errors in the plane after the start."""
    return {name: errors(drive, each) for name, each in answers(drive).items()}


def errors(drive: Drive, found: Answer) -> dict[str, float]:
    """Return RMS errors in the plane; of a bias also after what time it stays within a fifth."""
    late = drive.t >= LATE
    row = {
        "position / m": rms(found.position[late] - drive.position[late]),
        "velocity / (m/s)": rms(found.velocity[late] - drive.velocity[late]),
    }
    off = np.linalg.norm(found.bias - BIAS, axis=1)
    if np.isfinite(off[-1]):
        row["bias / (m/s²)"] = rms(found.bias[late] - BIAS)
        inside = off <= 0.2 * np.linalg.norm(BIAS)
        row["bias within 20 % from / s"] = (
            float(drive.t[np.flatnonzero(~inside)[-1] + 1]) if inside[-1] else np.nan
        )
    return row


def rms(error: Array) -> float:
    """Return the root mean square of the length of a vector."""
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def bias_rise(x: Array) -> Array:
    """Return the share of a bias that the filter has found after x time constants: three lags in a row."""
    return 1.0 - np.exp(-x) * (1.0 + x + x**2 / 2.0)


def bias_found() -> Table:
    """Compare the estimate of a bias, all else perfect and at rest, with the closed form."""
    x = np.array([1.0, 2.0, 4.0, 6.0, 8.0])
    still = np.zeros(round(10.0 * TAU * FS))
    estimate = cf.ThirdOrder(TAU).estimate(still, np.ones(still.size), fs=FS, initial=0.0)
    seen = estimate.bias[np.round(x * TAU * FS).astype(int) - 1]
    return {
        f"after {each:g} tau": {"share found": float(share), "closed form": float(exact)}
        for each, share, exact in zip(x, seen, bias_rise(x), strict=True)
    }


def taus(drive: Drive) -> Table:
    """Return the error in position over the time constant."""
    gps, acceleration = sensors(drive)
    return {
        f"tau = {tau:g} s": {
            f"{name} / m": errors(drive, answer(kind(tau), gps, acceleration, delay))["position / m"]
            for name, kind, delay in (
                ("second order", cf.SecondOrderInertial, GPS_DELAY),
                ("delay not told", cf.ThirdOrder, 0.0),
                ("third order", cf.ThirdOrder, GPS_DELAY),
            )
        }
        for tau in (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
    }


# The last figure's sign


def as_drawn(direction: float, duration: float = 12.0, offset: float = 0.01) -> Array:
    """Run the last figure on a body at rest with perfect sensors, begun `offset` m off; return s_c.

    e = s_c - s_m is added three times, times `direction`: +1 as drawn, -1 as it should be. C_i = k/s.
    """
    k1, k2, k3 = cf.ThirdOrder(TAU).coefficients
    s, v, a = offset, 0.0, 0.0
    positions = np.empty(round(duration * FS))
    for n in range(positions.size):
        e = direction * s
        s, v, a = s + T * (v + k1 * e), v + T * (a + k2 * e), a + T * k3 * e
        positions[n] = s
    return positions


def sign() -> Table:
    """Return the roots of both loops, and the growth of the one as drawn."""
    k = np.array(cf.ThirdOrder(TAU).coefficients)
    table: Table = {}
    for name, direction in (("e = s_c - s_m, as drawn", 1.0), ("e = s_m - s_c", -1.0)):
        s = abs(as_drawn(direction))
        table[name] = {
            "largest Re s / (1/s)": float(np.max(np.roots([1.0, *(-direction * k)]).real)),
            "0.01 m after 12 s / m": float(s[-1]),
        }
        if direction > 0.0:
            table[name]["growth, last 4 s / (1/s)"] = float(np.log(s[-1] / s[-1 - round(4.0 * FS)]) / 4.0)
    return table


# Tables and figures


def columns_of(table: Table) -> list[str]:
    """Return the columns of all rows, in order."""
    return list(dict.fromkeys(name for row in table.values() for name in row))


def show(title: str, table: Table) -> None:
    """Print a table; a cell that a row does not have stays empty."""
    names, width = columns_of(table), max(map(len, [title, *table])) + 2
    print("\n" + title.ljust(width) + "".join(f"{name:>{len(name) + 3}}" for name in names))
    for row, cells in table.items():
        texts = (cell(cells.get(name)).rjust(len(name) + 3) for name in names)
        print(row.ljust(width) + "".join(texts))


def cell(number: float | None) -> str:
    """Write three digits of a number and all of a count."""
    return "" if number is None else str(number) if isinstance(number, int) else f"{number:.3g}"


def write(table: Table, path: Path) -> None:
    """Write a table to a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, ["case", *columns_of(table)], lineterminator="\n")
        writer.writeheader()
        writer.writerows({"case": row, **cells} for row, cells in table.items())


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


if __name__ == "__main__":
    main()
