"""The child seat of Iontchev et al.: roll from an accelerometer alone, a gyro alone, and both filters.

Filters the bundled log as ``compfilt run`` does, prints how far each answer is from the truth, and draws them::

    python examples/demo/demo.py

The results go to ``examples/demo/out/``.
"""

from os.path import relpath
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from pyarrow import csv, parquet

import compfilt as cf
from compfilt.logs import load_recipe, run_log
from compfilt.motion import GRAVITY
from compfilt.simulate import static_length

HERE = Path(__file__).parent
LOG = HERE / "child_seat.csv"
OUT = HERE / "out"

Array = npt.NDArray[np.float64]


class Curve(NamedTuple):
    """One answer for the roll angle, in deg, and how it is drawn so that it can be told apart without colour."""

    label: str
    roll: Array
    style: dict[str, object]


def main() -> None:
    """Filter, compare, draw."""
    OUT.mkdir(exist_ok=True)
    t, truth, accelerometer, gyro = single_sensors()
    curves = [
        Curve("accelerometer alone", accelerometer, {"color": "0.72", "lw": 0.6, "ls": "-"}),
        Curve("gyro alone", gyro, {"color": "tab:blue", "lw": 1.3, "ls": ":"}),
        Curve("first order", filtered("first_order"), {"color": "#a65300", "lw": 1.3, "ls": "--"}),
        Curve("PI", filtered("pi"), {"color": "tab:red", "lw": 1.3, "ls": "-"}),
    ]
    driving = t >= static_length(t[-1])
    learning = t < 30.0  # the PI form finds the bias of the gyro meanwhile
    print_table(
        curves,
        truth,
        {"static, first 30 s": learning, "static, last 30 s": ~learning & ~driving, "driving": driving},
    )
    draw(t, truth, curves, t[driving][0], OUT / "child_seat.png")


def filtered(name: str) -> Array:
    """Filter the log with one of the recipes beside this file; return roll in deg."""
    out = OUT / f"child_seat.{name}.parquet"
    summary = run_log(load_recipe(HERE / f"{name}.toml"), LOG, out)
    print(f"{name}.toml: {summary} -> {relpath(out)}")
    return column(parquet.read_table(out), "roll")


def single_sensors() -> tuple[Array, Array, Array, Array]:
    """Return time in s, and in deg the true roll and what each sensor says of it alone."""
    log = csv.read_csv(LOG)
    t = column(log, "t")
    acc = GRAVITY * np.column_stack([column(log, name) for name in ("ax", "ay", "az")])
    gyr = np.radians(np.column_stack([column(log, name) for name in ("gx", "gy", "gz")]))
    # A time constant of thirty years leaves the gyro, from the first angle of the accelerometer on.
    gyro_only = cf.TiltFilter(cf.FirstOrder(tau=1e9), axes="flu").stream().estimate(gyr, acc, t)
    accelerometer_only = cf.tilt(acc, axes="flu")
    return (
        t,
        column(log, "true_roll"),
        np.degrees(accelerometer_only[:, 0]),
        np.degrees(gyro_only.angles[:, 0]),
    )


def column(table: object, name: str) -> Array:
    """Take one column out of an Arrow table."""
    return table.column(name).to_numpy()  # type: ignore[attr-defined]


def print_table(curves: list[Curve], truth: Array, phases: dict[str, npt.NDArray[np.bool_]]) -> None:
    """Print the error of each answer in each phase."""
    print(f"\n{'roll error in deg':<22}" + "".join(f"{phase:^22}" for phase in phases))
    print(f"{'':<22}" + f"{'RMS':>10}{'largest':>10}  " * len(phases))
    for curve in curves:
        errors = [np.abs(curve.roll - truth)[chosen] for chosen in phases.values()]
        cells = (f"{np.sqrt(np.mean(error**2)):>10.2f}{error.max():>10.2f}  " for error in errors)
        print(f"{curve.label:<22}" + "".join(cells))


def draw(t: Array, truth: Array, curves: list[Curve], start: float, path: Path) -> None:
    """Draw the answers and their errors, with the driving phase in close-up beside them."""
    mpl.use("agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415 - the backend comes first

    near = (start + 22.0, start + 52.0)
    figure, axes = plt.subplots(
        2, 2, figsize=(13, 7.5), sharex="col", sharey="row", width_ratios=(1.5, 1.0), layout="constrained"
    )
    for column_axes, limits in zip(axes.T, ((t[0], t[-1]), near), strict=True):
        shown = (t >= limits[0]) & (t <= limits[1])
        angle, error = column_axes
        for curve in curves:
            if curve.label == "gyro alone" and limits is near:
                continue  # far out of the picture by then
            angle.plot(t[shown], curve.roll[shown], label=curve.label, **curve.style)
            error.plot(t[shown], (curve.roll - truth)[shown], **curve.style)
        angle.plot(t[shown], truth[shown], label="truth", color="black", lw=2.0, zorder=1.9)
        error.axhline(0.0, color="black", lw=1.0, zorder=1.9)
        error.set(xlabel="time / s", xlim=limits)
        for each in column_axes:
            each.grid(color="0.9")
            each.axvline(start, color="black", lw=0.8, ls=(0, (6, 6)))
    axes[0, 0].set(ylabel="roll / deg", ylim=(-32.0, 42.0), title="held at both sides, then on the road")
    axes[0, 1].set(title="30 s of the road")
    axes[1, 0].set(ylabel="roll error / deg", ylim=(-12.0, 12.0))
    axes[1, 0].text(start - 1.0, -11.3, "static test", ha="right")
    axes[1, 0].text(start + 1.0, -11.3, "driving")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(path, dpi=130)
    print(f"\nplot: {relpath(path)}")


if __name__ == "__main__":
    main()
