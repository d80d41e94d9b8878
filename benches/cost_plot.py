"""Draws results/cost.csv as results/cost.png, which can also be read in black and white.

python benches/cost_plot.py
"""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

RESULTS = Path(__file__).parent / "results"
BYTES_PER_SAMPLE = 24
"""Two signals and the result in float64."""

STYLES: dict[str, dict[str, Any]] = {
    "numpy.add": {"color": "0.55", "linestyle": "-", "marker": ""},
    "exact, 1 worker": {"color": "black", "linestyle": "-", "marker": "o"},
    "exact, 2 workers": {"color": "black", "linestyle": "--", "marker": "o", "markerfacecolor": "white"},
    "not exact, 1 worker": {"color": "tab:blue", "linestyle": "-", "marker": "s"},
    "not exact, 2 workers": {
        "color": "tab:blue",
        "linestyle": "--",
        "marker": "s",
        "markerfacecolor": "white",
    },
}

Row = dict[str, str]


def label_of(row: Row) -> str:
    """The line in the picture to which a point belongs."""
    if row["implementation"] == "numpy.add":
        return "numpy.add"
    arithmetic = "exact" if row["exact"] == "True" else "not exact"
    return f"{arithmetic}, {'1 worker' if row['workers'] == '1' else '2 workers'}"


def lines(rows: list[Row], sweep: str, x: str, y: str) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """The lines of one sweep."""
    for label in STYLES:
        chosen = [row for row in rows if row["sweep"] == sweep and label_of(row) == label]
        yield label, *(np.array([float(row[name]) for row in chosen]) for name in (x, y))


def cache_sizes() -> Iterator[tuple[str, int]]:
    """The caches that hold data, in bytes, as the kernel names them."""
    for folder in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        kind, level, size = ((folder / name).read_text().strip() for name in ("type", "level", "size"))
        if kind != "Instruction":
            yield f"L{level}", int(size[:-1]) * {"K": 1 << 10, "M": 1 << 20}[size[-1]]


def draw_lines(axes: Axes, rows: list[Row], sweep: str, x: str, y: str = "nanoseconds_per_sample") -> None:
    """One sweep; every panel has the same styles."""
    for label, at, value in lines(rows, sweep, x, y):
        axes.plot(at, value, label=label, markersize=5, **STYLES[label])
    axes.grid(color="0.9")
    axes.set_axisbelow(True)


def over_samples(axes: Axes, rows: list[Row]) -> None:
    """From the cost of a call to the cost of a sample, and where the arrays leave the caches."""
    draw_lines(axes, rows, "samples", "samples")
    axes.set(xscale="log", yscale="log", xlabel="samples", ylabel="time per sample [ns]")
    axes.set_title("Order 2, one channel; dotted: the three arrays fill a cache")
    for name, size in cache_sizes():
        samples = size / BYTES_PER_SAMPLE
        axes.axvline(samples, color="0.4", linestyle=":", linewidth=1)
        text = f"{name} {size_in_words(size)} "
        place = axes.get_xaxis_transform()
        axes.text(samples, 0.98, text, rotation=90, ha="right", va="top", fontsize=8, transform=place)


def over_channels(axes: Axes, rows: list[Row]) -> None:
    """As many samples in more and more columns."""
    draw_lines(axes, rows, "channels", "channels")
    ticks = sorted({int(row["channels"]) for row in rows})
    axes.set_xscale("log", base=2)
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.set(xlabel="channels", ylabel="time per sample [ns]", ylim=(0, None))
    axes.set_title(f"Order 2, {total(rows, 'channels')} samples of all channels together, C order")


def over_orders(axes: Axes, rows: list[Row]) -> None:
    """The chain's length."""
    of_filters = [row for row in rows if row["implementation"] != "numpy.add"]
    draw_lines(axes, of_filters, "order", "order")
    add = [float(row["nanoseconds_per_sample"]) for row in rows if is_add_of(row, "order")]
    axes.axhline(min(add), **STYLES["numpy.add"])
    axes.set(xlabel="order", ylabel="time per sample [ns]", ylim=(0, None))
    axes.set_title(f"Butterworth of order 1 to 6, one channel of {total(rows, 'order')} samples")


def over_memory(axes: Axes, rows: list[Row]) -> None:
    """What a call needs beyond its arrays; the arrays themselves to compare with."""
    draw_lines(axes, rows, "memory", "samples", "extra_bytes")
    samples = np.array(sorted({int(row["samples"]) for row in rows if row["sweep"] == "memory"}))
    axes.plot(samples, BYTES_PER_SAMPLE * samples, color="0.4", linestyle=":", label="the arrays themselves")
    axes.set_xscale("log")
    axes.set_yscale("symlog", linthresh=1 << 16, base=2)
    ticks = [
        0,
        *(1 << power for power in range(16, int(max(samples) * BYTES_PER_SAMPLE).bit_length() + 2, 3)),
    ]
    axes.set_yticks(ticks, ["0", *(size_in_words(tick) for tick in ticks[1:])])
    axes.set(xlabel="samples", ylabel="peak memory beyond the arrays", ylim=(-(1 << 13), None))
    axes.set_title("Memory of a call, order 2, one channel")


def is_add_of(row: Row, sweep: str) -> bool:
    """Whether a point is the reference of a sweep."""
    return row["sweep"] == sweep and row["implementation"] == "numpy.add"


def total(rows: list[Row], sweep: str) -> str:
    """The samples of a sweep that holds them, in words."""
    (samples,) = {int(row["samples"]) for row in rows if row["sweep"] == sweep}
    return f"{samples / 1e6:g} million"


def size_in_words(size: int) -> str:
    """Bytes in KiB, MiB or GiB."""
    power = min((size.bit_length() - 1) // 10, 3)
    return f"{size >> 10 * power} {['B', 'KiB', 'MiB', 'GiB'][power]}"


def draw(table: Path) -> Path:
    """Draws the four panels; returns the picture's path."""
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    mpl.use("agg")
    figure, panels = plt.subplots(2, 2, figsize=(12, 8.5), layout="constrained")
    for panel, axes in zip((over_samples, over_channels, over_orders, over_memory), panels.flat, strict=True):
        panel(axes, rows)
    handles, labels = panels[1, 1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    path = table.with_suffix(".png")
    figure.savefig(path, dpi=130)
    return path


if __name__ == "__main__":
    print(draw(RESULTS / "cost.csv"))
