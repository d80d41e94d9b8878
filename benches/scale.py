"""Throughput against workers: many logs and one long one, in order, on threads, on processes and on a Dask cluster.

    python benches/scale.py [--rows 8000000] [--logs 16] [--workers 1 2] [--rounds 3] [--folder .]

Six columns of float64 go in and six come out: two that are filtered, and four that are carried along. What is compared takes
turns within one run, and a figure is the best of the rounds. A cluster is started before. The processor time is that of all
processes, whoever else is at work on the machine. A second table has the processor time
of each step on one core, and the bytes, which docs/scale.md plans with.
"""

import argparse
import resource
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from timeit import default_timer
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from distributed import Client

from compfilt.logs import parse_recipe, run_in_parts, run_log, run_logs
from compfilt.logs.cluster import LOCAL, connect, run_logs_on, run_long_log_on
from compfilt.logs.outcome import Job
from compfilt.logs.partition import BATCH_ROWS, open_in_parts
from compfilt.logs.parts import PART_ROWS
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import Recipe
from compfilt.logs.writers import ROWS_PER_GROUP
from logs import COLUMNS, RECIPES
from timing import machine, table

RECIPE = RECIPES["PI"]
SLOW = RECIPE.replace("kp = 2.0", "kp = 2e-6").replace("ki = 1.0", "ki = 1e-12")


class Task(NamedTuple):
    """What it is called, how many workers it has, what does it, into a folder, and whose workers they are."""

    name: str
    workers: int
    run: Callable[[Path], object]
    client: Client | None = None

    def processor_time(self) -> float:
        """The time in s that this process, its children that have ended and the cluster have had of all processors."""
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        elsewhere = self.client.run(time.process_time).values() if self.client else ()
        return time.process_time() + children.ru_utime + children.ru_stime + sum(elsewhere)


def make_log(path: Path, rows: int) -> None:
    """Noise, which no encoding makes smaller, as that of real sensors in float64."""
    rng = np.random.default_rng(1)
    columns = {name: rng.normal(name == "az", 0.1, rows) for name in COLUMNS}
    pq.write_table(pa.table(columns), path, row_group_size=ROWS_PER_GROUP, use_dictionary=False)


def many_logs(
    recipe: Recipe, logs: Sequence[Path], workers: Sequence[int], stack: ExitStack
) -> Iterator[Task]:
    """Many logs, each by one worker."""

    def jobs(folder: Path) -> list[Job]:
        return [Job(log, folder / log.name) for log in logs]

    for count in workers:
        yield Task(
            "processes", count, lambda folder, count=count: run_logs(recipe, jobs(folder), workers=count)
        )
    for count in workers:
        client = stack.enter_context(connect(LOCAL, workers=count))
        yield Task(
            "Dask", count, lambda folder, client=client: run_logs_on(client, recipe, jobs(folder)), client
        )


def one_log(recipe: Recipe, log: Path, workers: Sequence[int], stack: ExitStack) -> Iterator[Task]:
    """One long log."""
    yield Task("in order", 1, lambda folder: run_log(recipe, log, folder / "out.parquet"))
    clients = {count: stack.enter_context(connect(LOCAL, workers=count)) for count in workers}
    for kind in ("one file", "a folder"):
        options = {"as_folder": kind == "a folder"}
        for count in workers:
            run = partial(run_in_parts, recipe, log, workers=count, **options)
            yield Task(
                f"parts to {kind}, threads", count, lambda folder, run=run: run(folder / "out.parquet")
            )
        for count, client in clients.items():
            run = partial(run_long_log_on, client, recipe, **options)
            yield Task(
                f"parts to {kind}, Dask",
                count,
                lambda folder, run=run: run(Job(log, folder / "out.parquet")),
                client,
            )


def compare(tasks: Sequence[Task], rounds: int, rows: int, folder: Path) -> None:
    """Time all in turns, and print a table; the first is what the others are compared with."""
    best = [(float("inf"), float("inf"))] * len(tasks)
    for _ in range(rounds):
        for place, task in enumerate(tasks):
            with tempfile.TemporaryDirectory(dir=folder) as out:
                busy, start = task.processor_time(), default_timer()
                task.run(Path(out))
                taken = default_timer() - start
                busy = task.processor_time() - busy
            best[place] = (min(best[place][0], taken), min(best[place][1], busy))
    lines = table(
        ("", "workers", "s", "Mrows/s", "speed / first", "ns of a core a row"),
        [
            (
                task.name,
                str(task.workers),
                f"{taken:.2f}",
                f"{rows / taken / 1e6:.1f}",
                f"{best[0][0] / taken:.2f}",
                f"{busy / rows * 1e9:.0f}",
            )
            for task, (taken, busy) in zip(tasks, best, strict=True)
        ],
    )
    print(f"{lines}\n")


def steps(recipe: Recipe, slow: Recipe, log: Path, folder: Path) -> None:
    """Time each step on one core, and print a table."""
    pa.set_cpu_count(1)
    whole = open_in_parts(recipe, log)
    names = whole.schema.names
    with pq.ParquetFile(log, buffer_size=1 << 20, pre_buffer=False) as file:
        begin = time.process_time()
        batches = list(file.iter_batches(BATCH_ROWS, columns=names, use_threads=False))
        reading = time.process_time() - begin
    rows = sum(batch.num_rows for batch in batches)
    pipeline = Pipeline(recipe, whole.schema)
    begin = time.process_time()
    results = [pipeline.process(batch) for batch in batches]
    filtering = time.process_time() - begin
    result = pa.Table.from_batches(results).combine_chunks()
    begin = time.process_time()
    pq.write_table(result, folder / "out.parquet", row_group_size=ROWS_PER_GROUP, use_dictionary=False)
    writing = time.process_time() - begin
    lines = [
        ("read", reading, log.stat().st_size),
        ("filter", filtering, 0),
        ("write", writing, (folder / "out.parquet").stat().st_size),
    ]
    for name, one in (("fast", recipe), ("slow", slow)):
        long = open_in_parts(one, log)
        part = long.cut(min(PART_ROWS, rows // 3))[1]
        begin = time.process_time()
        long.summarise(part)
        size = part.stop - part.seam.row
        lines.append((f"summarise, {name} filter", (time.process_time() - begin) * rows / size, 0))
    cells = [
        (name, f"{taken / rows * 1e9:.1f}", f"{size / rows:.0f}" if size else "")
        for name, taken, size in lines
    ]
    print(table(("step", "ns a row", "bytes a row"), cells))


def main() -> None:
    """Measure all, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rows", type=int, default=8_000_000)
    parser.add_argument("--logs", type=int, default=16)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--folder", type=Path)
    parser.add_argument(
        "--only", nargs="+", choices=["many", "one", "steps"], default=["many", "one", "steps"]
    )
    arguments = parser.parse_args()
    recipe = parse_recipe(RECIPE)
    print(f"{machine()}; {arguments.rows} rows\n")
    with tempfile.TemporaryDirectory(dir=arguments.folder) as name, ExitStack() as stack:
        folder = Path(name)
        log = folder / "log.parquet"
        if arguments.only != ["many"]:
            make_log(log, arguments.rows)
        if "many" in arguments.only:
            logs = [folder / f"{number}.parquet" for number in range(arguments.logs)]
            for path in logs:
                make_log(path, arguments.rows // arguments.logs)
            tasks = list(many_logs(recipe, logs, arguments.workers, stack))
            compare(tasks, arguments.rounds, arguments.rows, folder)
        if "one" in arguments.only:
            tasks = list(one_log(recipe, log, arguments.workers, stack))
            compare(tasks, arguments.rounds, arguments.rows, folder)
        if "steps" in arguments.only:
            steps(recipe, parse_recipe(SLOW), log, folder)


if __name__ == "__main__":
    main()
