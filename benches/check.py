"""What compfilt check finds on recordings in which a fault was put on purpose: a table of faults against recordings.

    python benches/check.py FOLDER [--only WORDS] [--without-magnetometer]

The columns of the Parquet files are those of accuracy.py, with mx my mz. The recipe always claims what the recordings are: s,
rad/s, m/s^2, flu. A cell is "found"; "open" where the check says that the log does not tell; "MISSED"; and a "+" where something
else was called wrong than the fault. On the row "clean", "ok" is a log in which nothing was called wrong.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from compfilt.logs import parse_recipe
from compfilt.logs.check import Report, check_log

GYRO, FORCE, FIELD = ("gx", "gy", "gz"), ("ax", "ay", "az"), ("mx", "my", "mz")
Log = dict[str, np.ndarray]

RECIPE = """
version = 1
[log]
{clock}
gyro = {{ columns = ["gx", "gy", "gz"], unit = "rad/s" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "m/s^2" }}
{magnetometer}
axes = "flu"
[filter]
kind = "attitude"
[output]
columns = ["roll", "pitch"]
unit = "deg"
"""
TIME = 'time = { column = "t", unit = "s" }'


@dataclass(frozen=True)
class Fault:
    """What is done to a log, what must be called wrong, then what may be, and the clock that the recipe claims."""

    name: str
    spoil: Callable[[Log], Log]
    topics: tuple[str, ...]
    clock: str = TIME


def read(path: Path) -> Log:
    """Reads the sensors of one recording."""
    table = pq.read_table(path, columns=["t", *GYRO, *FORCE, *FIELD])
    return {name: table[name].to_numpy().astype(float) for name in table.column_names}


def scaled(names: tuple[str, ...], factor: float) -> Callable[[Log], Log]:
    """Columns in another unit."""
    return lambda log: log | {name: factor * log[name] for name in names}


def mounted(names: tuple[str, ...], order: tuple[int, ...], signs: tuple[float, ...]) -> Callable[[Log], Log]:
    """Columns that are swapped or negated."""
    return lambda log: (
        log | {name: sign * log[names[place]] for name, place, sign in zip(names, order, signs, strict=True)}
    )


def clipped(names: tuple[str, ...]) -> Callable[[Log], Log]:
    """A sensor that ends at 80 % of what it read, or lower, so that at least 20 of its samples are cut off.

    A single knock may be the largest reading by far: one sample that is cut off can be seen in no log.
    """

    def spoil(log: Log) -> Log:
        largest = np.sort(np.abs([log[name] for name in names]).max(axis=0))
        limit = min(0.8 * largest[-1], largest[-20])
        return log | {name: np.clip(log[name], -limit, limit) for name in names}

    return spoil


def taken(rows: Callable[[np.ndarray], np.ndarray]) -> Callable[[Log], Log]:
    """Other rows: left out, repeated, in another order."""

    def spoil(log: Log) -> Log:
        chosen = rows(np.arange(log["t"].size))
        return {name: values[chosen] for name, values in log.items()}

    return spoil


def with_gaps(rows: np.ndarray) -> np.ndarray:
    """Leaves out about a second of three minutes in three places."""
    return rows[~np.isin(rows // (rows.size // 190), (40, 80, 120))]


def doubled(rows: np.ndarray) -> np.ndarray:
    """Repeats every thousandth row."""
    return np.repeat(rows, 1 + (rows % 1000 == 999))


def stepped_back(rows: np.ndarray) -> np.ndarray:
    """Writes a hundred rows after those that follow them, as loggers with several buffers do."""
    at = rows.size // 3
    return np.concatenate((rows[:at], rows[at + 100 : at + 200], rows[at : at + 100], rows[at + 200 :]))


def stuck(name: str, start: float, part: float) -> Callable[[Log], Log]:
    """Holds a column for a part of the log."""

    def spoil(log: Log) -> Log:
        values = log[name].copy()
        first, count = int(start * values.size), int(part * values.size)
        values[first : first + count] = values[first]
        return log | {name: values}

    return spoil


def biased(log: Log) -> Log:
    """Adds 3 deg/s about every axis."""
    return log | {name: log[name] + np.radians(3.0) for name in GYRO}


def without_time(log: Log) -> Log:
    """Leaves only the recipe to know the rate."""
    return {name: values for name, values in log.items() if name != "t"}


def signs(name: str) -> tuple[float, ...]:
    """Which axes are negated, as +1 and -1."""
    return tuple(-1.0 if axis in name else 1.0 for axis in "xyz")


def faults() -> Iterator[Fault]:
    """The faults, one a row of the table."""
    yield Fault("clean", dict, ())
    yield Fault("accelerometer in g", scaled(FORCE, 1 / 9.80665), ("accelerometer unit",))
    yield Fault("gyro in deg/s", scaled(GYRO, 180 / np.pi), ("gyro unit",))
    yield Fault("time in ms", scaled(("t",), 1e3), ("time unit",))
    yield Fault("time in us", scaled(("t",), 1e6), ("time unit",))
    yield Fault("rate stated twice", without_time, ("rate",), "rate = 571.43")
    yield Fault("rate stated half", without_time, ("rate",), "rate = 142.86")
    for sensor, names in (("gyro", GYRO), ("acc.", FORCE)):
        for pair, order in (("x and y", (1, 0, 2)), ("x and z", (2, 1, 0)), ("y and z", (0, 2, 1))):
            yield Fault(f"{sensor} {pair} swapped", mounted(names, order, (1.0, 1.0, 1.0)), ("axes",))
    for axes in ("x", "y", "z", "xy", "yz", "xyz"):
        yield Fault(f"gyro {axes} negated", mounted(GYRO, (0, 1, 2), signs(axes)), ("axes",))
    yield Fault("acc. x negated", mounted(FORCE, (0, 1, 2), signs("x")), ("axes",))
    yield Fault("acc. xyz negated", mounted(FORCE, (0, 1, 2), signs("xyz")), ("direction of gravity",))
    yield Fault("mag. z negated", mounted(FIELD, (0, 1, 2), signs("z")), ("axes",))
    yield Fault("gyro clipped", clipped(GYRO), ("clipping",))
    yield Fault("acc. clipped", clipped(FORCE), ("clipping",))
    yield Fault("3 gaps of 1 s", taken(with_gaps), ("gaps",))
    yield Fault("rows twice", taken(doubled), ("duplicates",))
    yield Fault("time backwards", taken(stepped_back), ("backwards time", "gaps"))
    yield Fault("gyro y stuck, 2 s", stuck("gy", 0.55, 0.01), ("stuck",))
    yield Fault("acc. z stuck, all", stuck("az", 0.0, 1.0), ("stuck",))
    yield Fault("gyro bias 3 deg/s", biased, ("gyro bias",))


def check(log: Log, fault: Fault, *, magnetometer: bool = True) -> Report:
    """Puts the fault in and checks the log with the recipe of the log without it."""
    field = 'magnetometer = { columns = ["mx", "my", "mz"], unit = "uT" }' if magnetometer else ""
    recipe = parse_recipe(RECIPE.format(clock=fault.clock, magnetometer=field))
    spoilt = fault.spoil(log)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.parquet"
        pq.write_table(pa.table({name: pa.array(values) for name, values in spoilt.items()}), path)
        return check_log(path, recipe)


def verdict(report: Report, fault: Fault) -> str:
    """The cell of the table."""
    wrong = {finding.topic for finding in report.wrong}
    # Without knowing the axes or the unit nothing follows from them: that a fault hides another is no invention.
    more = "+" if wrong - set(fault.topics) else ""
    if not fault.topics:
        return "INVENTED" if wrong else "ok"
    if fault.topics[0] in wrong:
        return "found" + more
    open_topics = {finding.topic for finding in report.findings if finding.level == "unknown"}
    related = {"rate": {"gyro unit"}}
    sought = set(fault.topics).union(*(related.get(topic, set()) for topic in fault.topics))
    return ("open" if open_topics & sought else "MISSED") + more


def main() -> int:
    """Prints the table, row by row, and how often what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", metavar="WORDS", help="only faults whose name contains this")
    parser.add_argument("--without-magnetometer", action="store_true", help="leave it out of the recipe")
    arguments = parser.parse_args()
    paths = sorted(arguments.folder.glob("*.parquet"))
    if not paths:
        print(f"no recordings in {arguments.folder}", file=sys.stderr)
        return 1
    print(f"{'':24}" + "".join(f"{path.stem.split('_')[0]:>9}" for path in paths))
    count: dict[str, int] = {}
    for fault in faults():
        if arguments.only and arguments.only not in fault.name:
            continue
        if arguments.without_magnetometer and fault.name.startswith("mag."):
            continue
        cells = []
        for path in paths:
            report = check(read(path), fault, magnetometer=not arguments.without_magnetometer)
            cells.append(verdict(report, fault))
            for finding in report.wrong:
                if finding.topic not in fault.topics:
                    print(f"    {fault.name}, {path.stem}: {finding}", file=sys.stderr)
            count[cells[-1]] = count.get(cells[-1], 0) + 1
        print(f"{fault.name:24}" + "".join(f"{cell:>9}" for cell in cells), flush=True)
    print(", ".join(f"{number} {cell}" for cell, number in sorted(count.items())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
