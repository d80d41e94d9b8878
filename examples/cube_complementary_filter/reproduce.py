"""The complementary filters of the cube: angle, rate, the rule for choosing them, and unequal time constants.

    python examples/cube_complementary_filter/reproduce.py [FOLDER]

prints tables and writes them, with figures, to FOLDER, by default ``out`` beside this file. The noise is taken from real
recordings where they are at hand (``COMPFILT_RECORDINGS`` names their folder), otherwise from a simulated one. Equation
numbers are those of "Komplementär-Filter" (S0 in docs/derivations.md).
"""

import csv
import os
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pyarrow import parquet
from scipy import integrate, signal

import compfilt as cf
from compfilt.motion import GRAVITY, Motion, Signal
from compfilt.simulate import SensorErrors, measure

HERE = Path(__file__).resolve().parent
RECORDINGS = Path(os.environ.get("COMPFILT_RECORDINGS", HERE.parents[2] / "shared" / "broad"))

Array = npt.NDArray[np.float64]
Table = dict[str, dict[str, float]]
"""Rows by name, cells by column."""

FS = 100.0
T = 1.0 / FS
ALPHA = 0.98
TAU = cf.alpha_to_tau(ALPHA, FS)
TAUS = np.geomspace(0.05, 100.0, 67)
"""Where the error is looked at over tau, in s: twenty a decade."""


def main() -> None:
    """Reproduce and print."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "out"
    for name, table in reproduce(out).items():
        show(name, table)
    print(f"\nfigures and tables: {out}")


def reproduce(out: Path) -> dict[str, Table]:
    """Compute everything, write tables and figures to `out`, and return the tables."""
    out.mkdir(parents=True, exist_ok=True)
    swing = swing_of_the_edge()
    source, trials = noise_records()
    still_table, rules = still_phases(source)
    tables = {
        "checks": checks(swing),
        "rates": rates(swing),
        "unequal_taus": unequal_taus(swing),
        "still": still_table,
        "motion": in_motion(trials),
    }
    for name, table in tables.items():
        write(table, out / f"{name}.csv")
    draw_rule(source.recording, rules, out / "cube_complementary_filter.png")
    draw_rates(swing, out / "rates.png")
    draw_unequal(swing, out / "unequal_taus.png")
    return tables


# The motion of the simulated cube


class Swing(NamedTuple):
    """A cube that is lifted from its side and swings about its edge, as perfect sensors see it."""

    t: Array
    angle: Array
    """rad, at the samples."""
    rate: Array
    """rad/s, mean over the period that ends at the sample, as an integrating gyro delivers it."""
    acceleration: Array
    """rad/s², the change of `rate` over that period."""


def swing_of_the_edge(duration: float = 30.0) -> Swing:
    """Return the motion; it starts at rest on the side, at -45°."""
    angle = Signal()
    angle.step(start=1.0, length=1.0, height=np.pi / 4)
    angle.sines(3.0, np.radians([8.0, 4.0, 2.0]), np.array([0.35, 0.8, 1.3]), np.array([0.0, 1.0, 2.0]))
    t = np.arange(-2, round(duration * FS)) * T
    value = angle.at(t)[0] - np.pi / 4
    rate = np.diff(value) / T
    return Swing(t[2:], value[2:], rate[1:], np.diff(rate) / T)


# §1.2 and 1.5: the two filters


def checks(swing: Swing) -> Table:
    """Return by how much the library differs from the plain loops, relative to the signal."""
    rng = np.random.default_rng(0)
    measured = swing.angle + rng.normal(0.0, 0.05, swing.t.size)
    library = cf.FirstOrder(TAU).filter(measured, swing.rate, fs=FS, initial=measured[0])
    rate = cf.RateFilter(TAU).filter(swing.rate, swing.acceleration, fs=FS, initial=0.0)
    (low, high) = cf.FirstOrder(TAU).frequency_response(np.geomspace(1e-2, 1e2, 200))

    def difference(a: Array, b: Array) -> dict[str, float]:
        return {"largest relative difference": float(np.max(abs(a - b)) / np.max(abs(b)))}

    return {
        "cf.FirstOrder, (12)": difference(library, angle_loop(measured, swing.rate)),
        "cf.RateFilter, (30)": difference(rate, rate_loop(swing.rate, swing.acceleration)),
        "LP + HP, 1": difference(low + high, np.ones(low.size)),
    }


def angle_loop(measured: Array, gyro: Array) -> Array:
    """(12), from the first measured angle."""
    angle, last = np.empty(measured.size), measured[0]
    for n in range(measured.size):
        last = angle[n] = ALPHA * (last + T * gyro[n]) + (1.0 - ALPHA) * measured[n]
    return angle


def rate_loop(gyro: Array, acceleration: Array, *, sign: float = -1.0, gain: float = 1.0 - ALPHA) -> Array:
    """(30), from rest; with `sign` = +1 it is (29) as printed, with another `gain` (26)."""
    rate, last, before, integral = np.empty(gyro.size), 0.0, 0.0, 0.0
    for n in range(gyro.size):
        integral += T * acceleration[n]
        last = rate[n] = ALPHA * last + ALPHA * (gyro[n] + sign * before) + gain * integral
        before = gyro[n]
    return rate


GYRO_BIAS, GYRO_NOISE = np.radians(0.5), np.radians(0.1)
ACCELERATION_BIAS, ACCELERATION_NOISE = 0.05, 0.1


def rate_sensors(swing: Swing) -> dict[str, tuple[Array, Array]]:
    """Return gyro in rad/s and angular acceleration in rad/s² with more and more of the sensors' errors."""
    rng = np.random.default_rng(1)
    gyro = swing.rate + GYRO_BIAS + rng.normal(0.0, GYRO_NOISE, swing.t.size)
    noisy = swing.acceleration + rng.normal(0.0, ACCELERATION_NOISE, swing.t.size)
    return {
        "none / (deg/s)": (swing.rate, swing.acceleration),
        "gyro / (deg/s)": (gyro, swing.acceleration),
        "+ noise / (deg/s)": (gyro, noisy),
        "+ bias / (deg/s)": (gyro, noisy + ACCELERATION_BIAS),
    }


def rate_answers(gyro: Array, acceleration: Array) -> dict[str, Array]:
    """Return the rate by every filter, in rad/s."""
    start = {"fs": FS, "initial": 0.0}
    return {
        "gyro alone": gyro,
        "acceleration integrated": np.cumsum(acceleration) * T,
        "(30), cf.RateFilter": cf.RateFilter(TAU).filter(gyro, acceleration, **start),
        "(29) as printed": rate_loop(gyro, acceleration, sign=1.0),
        "(26) as printed": rate_loop(gyro, acceleration, gain=(1.0 - ALPHA) ** 2),
        "drift-free, cf.FirstOrder": cf.FirstOrder(TAU).filter(gyro, acceleration, **start),
        "drift-free, cf.PiForm": cf.PiForm(2.0 / TAU, 1.0 / TAU**2).filter(gyro, acceleration, **start),
    }


def rates(swing: Swing) -> Table:
    """Return the RMS error of the rate after the first 10 s, in deg/s."""
    late = swing.t >= 10.0
    table: Table = {}
    for errors, sensors in rate_sensors(swing).items():
        for answer, rate in rate_answers(*sensors).items():
            table.setdefault(answer, {})[errors] = rms_degrees((rate - swing.rate)[late])
    return table


# §1.4, (22): unequal time constants

RATIOS = (0.25, 0.5, 0.9, 1.0, 1.1, 2.0, 4.0)


def summed_response(ratio: float, omega: Array) -> npt.NDArray[np.complex128]:
    """Return LP with tau1 plus HP with tau2 = `ratio` tau1."""
    low, _ = cf.FirstOrder(TAU).frequency_response(omega)
    _, high = cf.FirstOrder(ratio * TAU).frequency_response(omega)
    return low + high


def unequal_error(swing: Swing, ratio: float) -> Array:
    """Return the error of (3) with tau2 = `ratio` tau1 and perfect sensors, in rad."""
    nothing = np.zeros(swing.t.size)
    low = cf.FirstOrder(TAU).filter(swing.angle, nothing, fs=FS, initial=swing.angle[0])
    high = cf.FirstOrder(ratio * TAU).filter(nothing, swing.rate, fs=FS, initial=0.0)
    return low + high - swing.angle


def unequal_taus(swing: Swing) -> Table:
    """Return how far LP + HP is from 1, and the error in angle that it makes."""
    omega = np.geomspace(1e-2, 1e2, 2001) / TAU
    table: Table = {}
    for ratio in RATIOS:
        middle = summed_response(ratio, np.array([1.0 / (TAU * np.sqrt(ratio))]))[0]
        error = unequal_error(swing, ratio)
        table[f"tau2/tau1 = {ratio:g}"] = {
            "|LP + HP| farthest from 1": abs(middle),
            "largest phase / deg": float(np.degrees(np.max(abs(np.angle(summed_response(ratio, omega)))))),
            "RMS error / deg": rms_degrees(error),
            "largest error / deg": float(np.degrees(np.max(abs(error)))),
        }
    return table


# §1.3 and 1.4: the design rule


class Recording(NamedTuple):
    """A sensor that lies still, then moves, then lies still; SI units, axes forward, left, up."""

    name: str
    fs: float
    gyr: Array
    acc: Array
    up: Array
    """Up in the sensor's frame by the optical reference, or by the simulation."""
    moves: npt.NDArray[np.bool_]

    def seconds(self, start: float, end: float) -> "Recording":
        """Return the part between two times."""
        return self.part(slice(round(start * self.fs), round(end * self.fs)))

    def part(self, chosen: slice) -> "Recording":
        """Return some of the samples."""
        arrays = (array[chosen] for array in (self.gyr, self.acc, self.up, self.moves))
        return Recording(self.name, self.fs, *arrays)


VIBRATING = "27_disturbed_phone_vibration_B"
VIBRATES = (159.5, 162.5)
"""When the sensor lies still in that trial while the phone next to it vibrates, in s."""
SIMULATED_VIBRATES = (30.0, 33.0)
LARGEST_TILT = np.radians(60.0)
"""Trials with more are left out: near 90° of pitch there is no roll angle to filter."""


class Source(NamedTuple):
    """A recording for the rule, and when it lies still and vibrates, in s."""

    recording: Recording
    vibrates: tuple[float, float]


def noise_records() -> tuple[Source, list[Recording]]:
    """Return the recording for the rule, and those to try it on in motion."""
    if not (RECORDINGS / f"{VIBRATING}.parquet").exists():
        print(f"NO RECORDINGS in {RECORDINGS}: the noise is taken from a simulated one")
        simulated = simulate()
        return Source(simulated, SIMULATED_VIBRATES), [simulated]
    trials = [read(path) for path in sorted(RECORDINGS.glob("*.parquet"))]
    rule = next(trial for trial in trials if trial.name == VIBRATING)
    return Source(rule, VIBRATES), [each for each in trials if largest_tilt(each) < LARGEST_TILT]


def read(path: Path) -> Recording:
    """Read one trial of BROAD."""
    table = parquet.read_table(path)

    def columns(*names: str) -> Array:
        return np.column_stack([table.column(name).to_numpy().astype(float) for name in names])

    w, x, y, z = columns("ref_qw", "ref_qx", "ref_qy", "ref_qz").T
    return Recording(
        path.stem,
        1.0 / float(np.median(np.diff(columns("t")[:, 0]))),
        columns("gx", "gy", "gz"),
        columns("ax", "ay", "az"),
        np.column_stack((2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)),
        table.column("movement").to_numpy().astype(bool),
    )


def simulate(fs: float = 200.0) -> Recording:
    """Return 30 s still, 3 s still and vibrating, 90 s of leaning and speeding up, 27 s still."""
    rng = np.random.default_rng(2)
    motion = Motion()
    for start in np.arange(35.0, 118.0, 4.0):
        motion.roll.pulse(start, 1.0, 1.0, rng.uniform(-0.3, 0.3))
        motion.pitch.pulse(start + 0.5, 1.0, 0.5, rng.uniform(-0.3, 0.3))
        motion.speed.pulse(start, 1.2, 0.8, rng.uniform(-4.0, 4.0))
    t = np.arange(round(150.0 * fs)) / fs
    measured = measure(motion, t, fs, SensorErrors(gyro_decimals=None, accelerometer_decimals=None), rng)
    acc, gyr = GRAVITY * measured[:, :3], np.radians(measured[:, 3:])
    vibrates = (t >= SIMULATED_VIBRATES[0]) & (t < SIMULATED_VIBRATES[1])
    for line, amplitude in ((43.3, 4.0), (86.6, 1.5)):  # Hz, m/s²
        phases = rng.uniform(0.0, 2.0 * np.pi, 3)
        wave = np.sin(2.0 * np.pi * line * t[vibrates, None] + phases)
        acc[vibrates] += amplitude * wave
        gyr[vibrates] += 0.01 * amplitude * wave[:, ::-1]  # the gyro feels it too
    roll, pitch = motion.roll.at(t)[0], motion.pitch.at(t)[0]
    moves = (t >= 35.0) & (t < 123.0)
    return Recording("simulated", fs, gyr, acc, up_of(np.column_stack((roll, pitch))), moves)


def up_of(angles: Array) -> Array:
    """Return the direction of up in the sensor's frame for roll and pitch."""
    roll, pitch = angles.T
    return np.column_stack((-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)))


def largest_tilt(recording: Recording) -> float:
    """Return the largest true tilt from level, in rad."""
    return float(np.arccos(np.nanmin(recording.up[:, 2])))


def still(recording: Recording, *, after: bool = False) -> Recording:
    """Return the samples before the sensor is touched, or those after it was put down."""
    gyr = recording.gyr[::-1] if after else recording.gyr
    touched = np.max(abs(gyr - np.median(gyr[:2000], axis=0)), axis=1) > np.radians(1.0)
    length = int(np.argmax(touched | (recording.moves[::-1] if after else recording.moves)))
    return recording.part(slice(-length, None) if after else slice(length))


class Error(NamedTuple):
    """The error of one signal on all axes: its mean, and the rest's two-sided density, averaged over the axes."""

    mean: Array
    frequency: Array
    density: Array


def spectrum(error: Array, fs: float, seconds: float) -> Error:
    """Take the spectrum of an error, (n, axes), in pieces of `seconds`."""
    mean, length = error.mean(axis=0), min(round(seconds * fs), error.shape[0])
    frequency, density = signal.welch(
        error - mean, fs, nperseg=length, detrend=False, axis=0, return_onesided=False
    )
    chosen = slice(1, length // 2)
    return Error(mean, frequency[chosen], density[chosen].mean(axis=1))


def centred(error: Error) -> Error:
    """Return the error without its mean."""
    return error._replace(mean=np.zeros_like(error.mean))


class Rule(NamedTuple):
    """S0's design rule for the first-order filter as a number: errors of the angle and of its rate in, tau out."""

    fs: float
    angle: Error
    rate: Error

    def rms(self, tau: float) -> float:
        """Return the predicted RMS error in rad: the root of ∫ |LP|² S_y + |HP|² S_u/ω² df and what the means leave."""
        fine = np.geomspace(1e-4, 0.5 * self.fs, 500)
        frequency = np.unique(np.concatenate((fine, self.angle.frequency, self.rate.frequency)))
        low, high = cf.FirstOrder(tau).frequency_response(2.0 * np.pi * frequency, fs=self.fs)
        s = self.fs * (1.0 - np.exp(-2j * np.pi * frequency / self.fs))
        angle, rate = (np.interp(frequency, each.frequency, each.density) for each in (self.angle, self.rate))
        noise = 2.0 * integrate.trapezoid(abs(low) ** 2 * angle + abs(high / s) ** 2 * rate, frequency)
        return float(np.sqrt(noise + np.mean((self.angle.mean + tau * self.rate.mean) ** 2)))

    def best_tau(self) -> float:
        """Return the tau with the least predicted error."""
        return float(min(TAUS, key=self.rms))


def tilt_and_rates(recording: Recording, bias: Array | float = 0.0) -> tuple[Array, Array]:
    """Return roll and pitch by the accelerometer in rad, and their rates near level by the gyro in rad/s."""
    return cf.tilt(recording.acc), (recording.gyr - bias)[:, :2]


def rest_error(rest: Recording, bias: Array | float, tau: float) -> float:
    """Return the RMS error of the first-order filter while the sensor lies still, in rad."""
    angle, rate = tilt_and_rates(rest, bias)
    truth = angle.mean(axis=0)
    return rms(cf.FirstOrder(tau).filter(angle, rate, fs=rest.fs, initial=truth) - truth)


def still_phases(source: Source) -> tuple[Table, dict[str, Rule]]:
    """Apply the rule to the sensor at rest, without and with vibration; return a table and the rules."""
    fs, before, after = source.recording.fs, still(source.recording), still(source.recording, after=True)
    shaken = source.recording.seconds(*source.vibrates)
    bias = before.gyr.mean(axis=0)
    angle, rate = tilt_and_rates(before)
    calm, gyro = spectrum(angle, fs, 4.0), spectrum(rate, fs, 4.0)
    vibrating = spectrum(cf.tilt(shaken.acc) - cf.tilt(after.acc).mean(axis=0), fs, 1.5)
    rules = {
        "still, bias removed": Rule(fs, centred(calm), centred(gyro)),
        "still, bias left in": Rule(fs, centred(calm), gyro),
        "vibrating, bias removed": Rule(fs, vibrating, centred(gyro)),
        "the same, offset removed": Rule(fs, centred(vibrating), centred(gyro)),
    }
    table = {name: rule_row(rule) for name, rule in rules.items()}
    for name, removed in (("still, bias removed", bias), ("still, bias left in", 0.0)):
        tau = table[name]["tau / s"]
        later = [rest_error(after, removed, each) for each in TAUS]
        table[name] |= {
            "same rest / deg": float(np.degrees(rest_error(before, removed, tau))),
            "later rest / deg": float(np.degrees(rest_error(after, removed, tau))),
            "best tau later / s": float(TAUS[np.argmin(later)]),
        }
    return table, rules


def rule_row(rule: Rule) -> dict[str, float]:
    """Return the means and densities that go in, the closed form for white noise and what the rule says."""
    r, q = (float(np.degrees(np.sqrt(np.mean(each.density)))) for each in (rule.angle, rule.rate))
    tau = rule.best_tau()
    return {
        "offset / deg": float(np.degrees(np.linalg.norm(rule.angle.mean))),
        "bias / (deg/s)": float(np.degrees(np.linalg.norm(rule.rate.mean))),
        "r / (deg/√Hz)": r,
        "q / (deg/s/√Hz)": q,
        "r/q / s": r / q,
        "tau / s": tau,
        "predicted / deg": float(np.degrees(rule.rms(tau))),
    }


def in_motion(trials: list[Recording]) -> Table:
    """Return for every trial the tau by the rule at rest, by the rule in hindsight, and the best one in motion."""
    table: Table = {}
    for trial in trials:
        rest = still(trial)
        bias = rest.gyr.mean(axis=0)
        angle, rate = tilt_and_rates(rest, bias)
        at_rest = Rule(trial.fs, *(centred(spectrum(each, trial.fs, 4.0)) for each in (angle, rate)))
        moving = (spectrum(each, trial.fs, 60.0) for each in errors_in_motion(trial, bias))
        hindsight = Rule(trial.fs, *moving)
        best = float(min(TAUS, key=lambda tau: motion_error(trial, bias, tau)))
        row = {"accelerometer / deg": inclination_error(trial, cf.tilt(trial.acc))}
        for name, tau in (("rest", at_rest.best_tau()), ("hindsight", hindsight.best_tau()), ("best", best)):
            row |= {f"tau {name} / s": tau, f"error {name} / deg": motion_error(trial, bias, tau)}
        table[trial.name] = row
    return table


def errors_in_motion(trial: Recording, bias: Array) -> tuple[Array, Array]:
    """Return what S0 cannot record: the error of the accelerometer's angles and of the gyro's rates in motion."""
    x, y, z = fill(trial.up).T
    truth = np.column_stack((np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))))
    angle = np.angle(np.exp(1j * (cf.tilt(trial.acc) - truth)))
    change = np.diff(truth, axis=0, prepend=truth[:1]) * trial.fs
    rate = cf.angle_rates(truth, trial.gyr - bias) - change
    return angle[trial.moves], rate[trial.moves]


def fill(columns: Array) -> Array:
    """Bridge the moments that the optical reference has not seen."""
    n = np.arange(columns.shape[0])
    seen = np.isfinite(columns).all(axis=1)
    return np.column_stack([np.interp(n, n[seen], column[seen]) for column in columns.T])


def motion_error(trial: Recording, bias: Array, tau: float) -> float:
    """Return the RMS inclination error of the first-order filter in motion, in deg."""
    tilt = cf.TiltFilter(cf.FirstOrder(tau), axes="flu")
    return inclination_error(trial, tilt.estimate(trial.gyr - bias, trial.acc, fs=trial.fs).angles)


def inclination_error(trial: Recording, angles: Array) -> float:
    """Return the RMS angle between estimated and true up in motion, in deg."""
    counts = trial.moves & np.isfinite(trial.up).all(axis=1)
    a, b = up_of(angles)[counts], trial.up[counts]
    return rms_degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


# Tables and figures


def rms(error: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))


def rms_degrees(error: Array) -> float:
    """Return the root mean square of an error in rad, in deg."""
    return float(np.degrees(rms(error)))


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
    """Write three digits of a number, nothing for none."""
    return "" if number is None else f"{number:.3g}"


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


def draw_rule(recording: Recording, rules: dict[str, Rule], path: Path) -> None:
    """Draw what goes into the design rule, and what comes out beside what the filter does."""
    figure, named = panels([["spectra", "error"]], 4.6)
    calm, biased, shaken = (
        rules[name] for name in ("still, bias removed", "still, bias left in", "the same, offset removed")
    )
    gyro = calm.rate._replace(density=calm.rate.density / (2.0 * np.pi * calm.rate.frequency) ** 2)
    for label, error, slope, style in (
        ("accelerometer's angle, vibrating", shaken.angle, 0.0, {"color": "tab:red", "ls": "-"}),
        ("accelerometer's angle, still", calm.angle, 0.0, {"color": "0.45", "ls": "-"}),
        ("gyro, integrated", gyro, -1.0, {"color": "tab:blue", "ls": "--"}),
    ):
        density, lowest = np.degrees(np.sqrt(error.density)), error.frequency[0]
        named["spectra"].loglog(error.frequency, density, label=label, lw=1.2, **style)
        # The record is too short for lower frequencies; there the rule takes white noise.
        beyond = np.array([0.01, lowest])
        named["spectra"].loglog(
            beyond, density[0] * (beyond / lowest) ** slope, ":", color=style["color"], lw=1.6
        )
    named["spectra"].set(
        xlabel="frequency / Hz",
        ylabel="error density / (deg/√Hz)",
        title="what is recorded at rest",
        ylim=(3e-6, 3e2),
    )
    draw_errors(named["error"], recording, (calm, biased, shaken))
    for each in named.values():
        each.legend(fontsize=8.5, loc="upper left", frameon=False)
    save(figure, path)


def draw_errors(panel: Axes, recording: Recording, rules: tuple[Rule, Rule, Rule]) -> None:
    """Draw the error over tau: predicted, at rest, and in motion."""
    bias = still(recording).gyr.mean(axis=0)
    calm, biased, shaken = (np.degrees([rule.rms(tau) for tau in TAUS]) for rule in rules)
    rest = np.degrees([rest_error(still(recording), bias, tau) for tau in TAUS])
    later = np.degrees([rest_error(still(recording, after=True), bias, tau) for tau in TAUS])
    motion = np.array([motion_error(recording, bias, tau) for tau in TAUS])
    panel.loglog(TAUS, motion, "k-", lw=2.0, label="in motion")
    panel.loglog(TAUS, shaken, "-", color="tab:red", lw=1.2, label="rule: vibrating (offset removed)")
    panel.loglog(TAUS, biased, "-.", color="tab:blue", lw=1.2, label="rule: still, gyro bias left in")
    panel.loglog(TAUS, later, ":", color="tab:green", lw=1.6, label="at rest again, later")
    panel.loglog(TAUS, calm, "-", color="0.45", lw=1.2, label="rule: still, bias removed")
    panel.loglog(TAUS[::4], rest[::4], "ko", ms=4.0, mfc="white", label="the same rest, filtered")
    for curve in (motion, shaken, biased, later, calm):
        panel.loglog(TAUS[np.argmin(curve)], curve.min(), "kv", ms=7.0)
    panel.set(
        xlabel="tau / s", ylabel="RMS error / deg", title="what the filter does with it", ylim=(4e-3, 1e3)
    )


def draw_rates(swing: Swing, path: Path) -> None:
    """Draw the errors of the rate with all sensor errors."""
    figure, named = panels([["drift", "close"]], 4.2)
    answers = rate_answers(*rate_sensors(swing)["+ bias / (deg/s)"])
    styles = {
        "gyro alone": {"color": "0.75", "ls": "-", "lw": 0.7},
        "(30), cf.RateFilter": {"color": "tab:red", "ls": "-", "lw": 1.5},
        "drift-free, cf.FirstOrder": {"color": "tab:blue", "ls": "--", "lw": 1.3},
        "drift-free, cf.PiForm": {"color": "black", "ls": "-", "lw": 1.2},
    }
    for panel in named.values():
        for answer, style in styles.items():
            panel.plot(swing.t, np.degrees(answers[answer] - swing.rate), label=answer, **style)
        panel.set(xlabel="time / s", ylabel="error of the rate / (deg/s)")
    drift = np.degrees(left_of_bias(swing.t))
    named["drift"].plot(swing.t[::150], drift[::150], "k+", ms=7.0, label="β (t - τ + τ exp(-t/τ))")
    named["drift"].set_title("the integral drifts, the low-pass lets it pass")
    named["close"].set(ylim=(-2.0, 5.0), title="close up")
    named["drift"].legend(frameon=False, fontsize=8.5)
    save(figure, path)


def left_of_bias(t: Array) -> Array:
    """Return what a bias of the angular acceleration leaves in (30), in rad/s: a ramp behind the low-pass."""
    return ACCELERATION_BIAS * (t - TAU + TAU * np.exp(-t / TAU))


def draw_unequal(swing: Swing, path: Path) -> None:
    """Draw LP + HP over frequency, and the error that it makes of a motion."""
    figure, named = panels([["magnitude", "error"], ["phase", "error"]], 4.6)
    omega = np.geomspace(0.02, 50.0, 300) / TAU
    styles = {0.25: ":", 0.5: "--", 1.0: "-", 2.0: "-.", 4.0: (0, (5, 1, 1, 1, 1, 1))}
    for (ratio, style), color in zip(styles.items(), ("C0", "C1", "k", "C2", "C3"), strict=True):
        response, label = summed_response(ratio, omega), f"tau2/tau1 = {ratio:g}"
        named["magnitude"].semilogx(omega, abs(response), ls=style, color=color)
        named["phase"].semilogx(omega, np.degrees(np.angle(response)), ls=style, color=color)
        error = np.degrees(unequal_error(swing, ratio))
        named["error"].plot(swing.t, error, ls=style, color=color, lw=1.2, label=label)
    named["magnitude"].set(ylabel="|LP + HP|", title="response to the motion itself")
    named["error"].legend(frameon=False, fontsize=9.0)
    named["phase"].set(xlabel="angular frequency / (rad/s)", ylabel="phase / deg")
    named["error"].set(xlabel="time / s", ylabel="error of the angle / deg", xlim=(0.0, 15.0))
    named["error"].set_title("perfect sensors on a cube that swings")
    save(figure, path)


if __name__ == "__main__":
    main()
