"""The child seat of Iontchev, Miletiev and Hristov (S2): both filters with the paper's gains, against the truth.

    python examples/child_seat/reproduce.py [folder]

Prints the tables, and writes them and the figures to ``examples/child_seat/out/`` or to the folder.
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
from compfilt.motion import GRAVITY
from compfilt.simulate import child_seat, static_length

mpl.use("agg")
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

HERE = Path(__file__).parent

RATE = 100.0  # Hz; the paper names none
A = 0.8  # the paper's weight of the gyro in (9)
PAPER_PI = cf.PiForm(kp=20.0, ki=10.0)  # the paper's gains in (11)

# Those of examples/demo, which choose_gains.py there found on the drives of seeds 1 to 8.
BETTER_FIRST_ORDER = cf.FirstOrder(tau=2.8)
BETTER_PI = cf.PiForm(kp=0.1, ki=0.005)
OTHER_DRIVES = range(101, 121)  # seeds

GYRO, ACCELEROMETER = "gyro alone", "accelerometer alone"
NINE, ELEVEN = "(9), a = 0.8", "(11), K_P = 20, K_I = 10"
BETTER_NINE, BETTER_ELEVEN = "(9), tau = 2.8 s", "(11), K_P = 0.1, K_I = 0.005"

TITLES = (("as figure 4", "as figure 5"), ("as figure 6", "as figure 7"), ("better gains", "better gains"))

TURN, AFTER = 10.0, 5.0  # s, how long the steady turn and what follows it last

Array = npt.NDArray[np.floating[Any]]


class Log(NamedTuple):
    """A simulated log in SI units, the true roll, and which samples belong to the drive."""

    t: Array
    gyr: Array
    acc: Array
    roll: Array
    driving: npt.NDArray[np.bool_]


class Errors(NamedTuple):
    """RMS roll errors in deg: static test and drive of one log, and the drives of twenty others."""

    static: float
    driving: float
    other_drives: float


class AtRate(NamedTuple):
    """The paper's gains on the road at one sample rate: RMS values in deg."""

    rate: float
    tau: float
    first_order: float  # error
    pi: float  # error
    difference: float
    short: dict[str, float]  # what is shorter than a second, in each answer


class Turn(NamedTuple):
    """Roll in a steady turn and after it; the true roll is zero."""

    t: Array
    roll: dict[str, Array]


class Result(NamedTuple):
    """The numbers of the reproduction; `difference` is between (9) and (11) as published, static and driving."""

    errors: dict[str, Errors]
    difference: tuple[float, float]
    rates: list[AtRate]
    turn: Turn


def main() -> None:
    """Reproduce into the folder that is named, or beside this file."""
    reproduce(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "out")


def reproduce(out: Path) -> Result:
    """Filter, compare, print, draw."""
    out.mkdir(parents=True, exist_ok=True)
    log = simulate(seed=0)
    rolls = answers(log)
    apart = rolls[NINE] - rolls[ELEVEN]
    result = Result(
        compare(log, rolls),
        (rms(apart[~log.driving]), rms(apart[log.driving])),
        [at_rate(rate) for rate in (25.0, 50.0, 80.0, 100.0, 200.0, 400.0)],
        steady_turn(),
    )
    show(result, out)
    draw_log(log, rolls, out / "child_seat.png")
    draw_turn(result.turn, out / "steady_turn.png")
    return result


def simulate(seed: int, rate: float = RATE) -> Log:
    """Draw one log."""
    log = child_seat(rate=rate, seed=seed)
    return Log(
        log["t"],
        np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")])),
        GRAVITY * np.column_stack([log[name] for name in ("ax", "ay", "az")]),
        np.radians(log["true_roll"]),
        log["t"] >= static_length(log["t"][-1]),
    )


def answers(log: Log) -> dict[str, Array]:
    """Return roll in rad by each sensor alone and by both filters, with the paper's gains and with better ones."""
    first_order = cf.FirstOrder(cf.alpha_to_tau(A, RATE))
    return {
        # A time constant of thirty years leaves the gyro, from the first angle of the accelerometer on.
        GYRO: tilt_filter(cf.FirstOrder(1e9), log),
        ACCELEROMETER: cf.tilt(log.acc)[:, 0],
        "the same by (6), (7)": printed_roll(log.acc),
        NINE: tilt_filter(first_order, log),
        ELEVEN: tilt_filter(PAPER_PI, log),
        BETTER_NINE: tilt_filter(BETTER_FIRST_ORDER, log),
        BETTER_ELEVEN: tilt_filter(BETTER_PI, log),
        "(9), tau = 2.8 s, gx as it is": unconverted(BETTER_FIRST_ORDER, log),
        "(11), K_P = 0.1, K_I = 0.005, gx as it is": unconverted(BETTER_PI, log),
    }


def tilt_filter(design: cf.LinearFilter, log: Log) -> Array:
    """Filter with the body rates converted at the filter's own angles, as the paper demands; return roll."""
    return cf.TiltFilter(design).estimate(log.gyr, log.acc, t=log.t).roll


def unconverted(design: cf.LinearFilter, log: Log) -> Array:
    """Filter roll with the rate about the forward axis of the body in place of the rate of roll."""
    return design.filter(cf.tilt(log.acc)[:, 0], log.gyr[:, 0], t=log.t)


def printed_roll(acc: Array) -> Array:
    """Return roll by the paper's (6) and (7), in axes forward, left, up."""
    ahead, left = acc[:, 0] / GRAVITY, acc[:, 1] / GRAVITY
    return np.asarray(np.arcsin(left / np.cos(np.arcsin(-ahead))))


def rms(angle: Array) -> float:
    """Return the root mean square of an angle in deg."""
    return float(np.degrees(np.sqrt(np.mean(angle**2))))


def compare(log: Log, rolls: dict[str, Array]) -> dict[str, Errors]:
    """Return the errors of every answer on the log and on the other drives."""
    squares = dict.fromkeys(rolls, 0.0)
    for seed in OTHER_DRIVES:
        other = simulate(seed)
        for name, roll in answers(other).items():
            squares[name] += rms((roll - other.roll)[other.driving]) ** 2 / len(OTHER_DRIVES)
    return {
        name: Errors(
            rms((roll - log.roll)[~log.driving]), rms((roll - log.roll)[log.driving]), squares[name] ** 0.5
        )
        for name, roll in rolls.items()
    }


def at_rate(rate: float) -> AtRate:
    """Run the paper's gains on the same drive, logged at another rate."""
    log = simulate(seed=0, rate=rate)
    tau = cf.alpha_to_tau(A, rate)
    rolls = {
        "truth": log.roll,
        "acc.": cf.tilt(log.acc)[:, 0],
        "(9)": tilt_filter(cf.FirstOrder(tau), log),
        "(11)": tilt_filter(PAPER_PI, log),
    }
    road = log.driving
    return AtRate(
        rate,
        tau,
        rms((rolls["(9)"] - log.roll)[road]),
        rms((rolls["(11)"] - log.roll)[road]),
        rms((rolls["(9)"] - rolls["(11)"])[road]),
        {name: rms(short_term(roll[road], rate)) for name, roll in rolls.items()},
    )


def short_term(roll: Array, rate: float) -> Array:
    """Return roll without its mean over the second around each sample."""
    width = round(rate) | 1
    return roll[width // 2 : -(width // 2)] - np.convolve(roll, np.full(width, 1.0 / width), "valid")


def steady_turn() -> Turn:
    """Turn at 60°/s with the nose 40° down and no roll, then stop turning; perfect sensors, gravity only."""
    yaw_rate, pitch = np.radians(60.0), np.radians(40.0)
    up = np.array([-np.sin(pitch), 0.0, np.cos(pitch)])  # in body axes
    t = np.arange(1, round((TURN + AFTER) * RATE) + 1) / RATE
    gyr = np.where((t <= TURN)[:, None], yaw_rate * up, 0.0)
    acc = np.tile(GRAVITY * up, (t.size, 1))
    usual, paper = (cf.FirstOrder(cf.alpha_to_tau(a, RATE)) for a in (0.98, A))
    designs = {"(9), a = 0.98": usual, NINE: paper, ELEVEN: PAPER_PI}
    rolls = {
        f"{name}, gx as it is": design.filter(cf.tilt(acc)[:, 0], gyr[:, 0], fs=RATE, initial=0.0)
        for name, design in designs.items()
    }
    return Turn(
        t, rolls | {"(9), a = 0.98, converted": cf.TiltFilter(usual).estimate(gyr, acc, fs=RATE).roll}
    )


def show(result: Result, out: Path) -> None:
    """Print the tables and write them."""
    table(
        out / "errors.csv",
        ["RMS roll error / deg", "static", "driving", "20 other drives"],
        [[name, *(f"{value:.2f}" for value in row)] for name, row in result.errors.items()],
    )
    static, driving = result.difference
    print(f"\nRMS of {NINE} minus {ELEVEN}: static {static:.3f} deg, driving {driving:.3f} deg")
    print(
        f"tau = {BETTER_FIRST_ORDER.tau} s is a = {cf.tau_to_alpha(BETTER_FIRST_ORDER.tau, RATE):.4f} at {RATE:.0f} Hz"
    )
    table(
        out / "rates.csv",
        ["RMS on the road / deg, at", "tau / s", "error (9)", "error (11)", "(9) minus (11)"]
        + [f"short {name}" for name in result.rates[0].short],
        [
            [f"{row.rate:.0f} Hz", f"{row.tau:.3f}"]
            + [f"{value:.2f}" for value in (row.first_order, row.pi, row.difference, *row.short.values())]
            for row in result.rates
        ],
    )
    t = result.turn.t
    table(
        out / "steady_turn.csv",
        ["roll in a steady turn / deg", "largest", "at its end", "largest after it"],
        [
            [name, *(f"{np.degrees(value):.2f}" for value in turn_errors(t, np.abs(roll)))]
            for name, roll in result.turn.roll.items()
        ],
    )


def turn_errors(t: Array, size: Array) -> tuple[float, float, float]:
    """Return the largest roll in the turn, the one at its end, and the largest after it."""
    turning = t <= TURN
    return size[turning].max(), size[turning][-1], size[~turning].max()


def table(path: Path, head: list[str], rows: list[list[str]]) -> None:
    """Write a table and print it."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *rows])
    first = max(len(row[0]) for row in [head, *rows])
    print()
    for row in [head, *rows]:
        cells = (f"{cell:>{len(name) + 3}}" for name, cell in zip(head[1:], row[1:], strict=True))
        print(f"{row[0]:<{first}}" + "".join(cells))


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a PNG with 64 colours, a third of the size."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    with Image.open(path) as image:
        image.quantize(64).save(path, optimize=True)


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


if __name__ == "__main__":
    main()
