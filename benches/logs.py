"""A long Parquet log through a recipe, against pyarrow that reads and writes as many columns and does nothing else.

    python benches/logs.py [--rows 8000000] [--rounds 3] [--folder .]

Six columns of float64 go in and six come out: two that are filtered, and four that are carried along. pyarrow reads batches of
the same size and writes row groups of the same size with the same settings, one after the other, which is how it is used; both
end with the file on the disk. They take turns, each in a process of its own, whose peak of resident memory is taken too.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from timeit import default_timer

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from compfilt.logs import parse_recipe, run_log
from compfilt.logs.encoders import ROWS_PER_GROUP
from cost_memory import resident
from timing import table

COLUMNS = ("gx", "gy", "gz", "ax", "ay", "az")
RECIPES = {
    "PI": """
version = 1
[log]
rate = 1000.0
measurement = { column = "ax", unit = "deg" }
derivative = { column = "gx", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[output]
columns = ["estimate", "bias"]
keep = ["gy", "gz", "ay", "az"]
""",
    "tilt, PI": """
version = 1
[log]
rate = 1000.0
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "pi", kp = 2.0, ki = 1.0 }
[output]
columns = ["roll", "pitch"]
unit = "deg"
keep = ["gx", "gy", "ay", "az"]
""",
}


def make_log(path: Path, rows: int) -> None:
    """Noise, which no encoding makes smaller, as that of real sensors in float64."""
    rng = np.random.default_rng(1)
    schema = pa.schema([(name, pa.float64()) for name in COLUMNS])
    with pq.ParquetWriter(path, schema, use_dictionary=False) as writer:
        for start in range(0, rows, ROWS_PER_GROUP):
            size = min(ROWS_PER_GROUP, rows - start)
            columns = [pa.array(rng.normal(name == "az", 0.1, size)) for name in COLUMNS]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))


def copy(log: Path, out: Path) -> None:
    """Read and write with pyarrow alone."""
    with (
        pq.ParquetFile(log, buffer_size=1 << 20, pre_buffer=False) as file,
        pq.ParquetWriter(out, file.schema_arrow, use_dictionary=False) as writer,
    ):
        for batch in file.iter_batches(ROWS_PER_GROUP, columns=list(COLUMNS)):
            writer.write_table(pa.Table.from_batches([batch]))
    with out.open("rb") as written:
        os.fsync(written.fileno())


def task_of(name: str) -> Callable[[Path, Path], object]:
    """Return what is timed."""
    if name == "pyarrow":
        return copy
    recipe = parse_recipe(RECIPES[name])
    return lambda log, out: run_log(recipe, log, out)


def measure(name: str, log: Path, out: Path) -> list[float]:
    """Return the seconds, those that the cores spent, and the peak of memory in MB, in a fresh process."""
    command = [sys.executable, __file__, "--task", name, str(log), str(out)]
    answer = subprocess.check_output(command, text=True)  # noqa: S603
    out.unlink()
    return [float(figure) for figure in answer.split()]


def do_task(name: str, log: Path, out: Path) -> None:
    """Do it in this process, and tell."""
    task = task_of(name)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    spent = usage.ru_utime + usage.ru_stime
    start = default_timer()
    task(log, out)
    seconds = default_timer() - start
    usage = resource.getrusage(resource.RUSAGE_SELF)
    print(seconds, usage.ru_utime + usage.ru_stime - spent, resident("VmHWM") / 1e6)


def main() -> None:
    """Measure all in turns, and print a table; a figure is the best of the rounds."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rows", type=int, default=8_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--only", nargs="*", choices=list(RECIPES), default=list(RECIPES))
    parser.add_argument("--task", nargs=3, metavar=("NAME", "LOG", "OUT"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.task:
        do_task(arguments.task[0], *map(Path, arguments.task[1:]))
        return
    names = ["pyarrow", *arguments.only]
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        log = Path(folder, "log.parquet")
        make_log(log, arguments.rows)
        size = log.stat().st_size
        rounds = [
            [measure(name, log, Path(folder, "out.parquet")) for name in names]
            for _ in range(arguments.rounds)
        ]
    print(f"{arguments.rows} rows, {size / 1e6:.0f} MB\n")
    best = [[min(turn[place][figure] for turn in rounds) for figure in (0, 1)] for place in range(len(names))]
    lines = []
    for place, (name, (seconds, spent)) in enumerate(zip(names, best, strict=True)):
        speed = arguments.rows / seconds / 1e6
        peak = max(turn[place][2] for turn in rounds)
        figures = (seconds, speed, best[0][0] / seconds, spent, best[0][1] / spent)
        lines.append((name, *(f"{figure:.2f}" for figure in figures), f"{peak:.0f}"))
    print(table(("", "s", "Mrows/s", "x pyarrow", "core s", "x pyarrow", "peak MB"), lines))


if __name__ == "__main__":
    main()
