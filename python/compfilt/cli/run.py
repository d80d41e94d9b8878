"""Filter logs with a recipe."""

import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compfilt.cli.base import Force, app, one_line

if TYPE_CHECKING:
    from collections.abc import Callable

    from compfilt.logs.outcome import Outcome

__all__ = ["run"]


@app.command()
def run(
    recipe: Annotated[
        Path, typer.Argument(metavar="RECIPE", help="A TOML file: columns, units, filter, output.")
    ],
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Files of any format that can be read.")
    ],
    out: Annotated[
        str,
        typer.Option("-o", "--out", metavar="OUT", help='A file; or a folder, or anything that ends in "/".'),
    ],
    *,
    workers: Annotated[
        int,
        typer.Option(
            min=0,
            help="How many logs to filter at a time, or parts of a single long one; 0 is one for each core.",
        ),
    ] = 1,
    as_json: Annotated[
        bool, typer.Option("--json", help="Tell how each log ended in a line of JSON on stdout.")
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on after a run that was stopped; what it completed stays.")
    ] = False,
    force: Force = False,
    scheduler: Annotated[
        str,
        typer.Option(
            metavar="ADDRESS",
            help='A Dask scheduler, such as tcp://10.0.0.1:8786; or "local": processes here.',
        ),
    ] = "",
    parts: Annotated[
        bool,
        typer.Option("--parts", help="Leave the parts of a single long log in a folder of Parquet files."),
    ] = False,
) -> None:
    """Filter logs with a recipe.

    Logs may be CSV, Parquet, Arrow, NumPy's .npz, HDF5, PX4's ULog, ROS bags and MCAP; a result is CSV, Parquet or Arrow by
    its ending. With several logs OUT is a folder, and each result has the name of its log. A result appears under its
    name only when it is complete; beside it, with ".quality.json" behind its name, a report on the log. A log that fails
    does not stop the others. One that is damaged from some row on fails too, but its result has what could be read.

    A single long log goes through a linear filter in parts, if there are several workers; the result is that of one part to
    rounding. With a scheduler its workers do the work.

    Exit status: 0, 1 if a log failed, 2 if nothing was done.
    """
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415 - help and usage errors do not wait for Arrow
    from compfilt.logs.run import plan, run_logs  # noqa: PLC0415
    from compfilt.logs.watch import JsonLines, Terminal  # noqa: PLC0415

    run_all: Callable[..., list[Outcome]] = run_logs
    if scheduler:
        from compfilt.logs.cluster import run_scheduled  # noqa: PLC0415 - an extra of its own

        run_all = partial(run_scheduled, scheduler)

    with one_line("the same command with --resume does the rest"):
        loaded = load_recipe(recipe)
        jobs = plan(logs, out, force=force, resume=resume, as_folder=parts)
        watch = JsonLines(jobs) if as_json else Terminal(jobs)
        try:
            outcomes = run_all(
                loaded,
                jobs,
                workers=workers or os.cpu_count() or 1,
                force=force,
                resume=resume,
                as_folder=parts,
                watch=watch,
            )
        finally:
            watch.close()
    if any(outcome.failed for outcome in outcomes):
        raise typer.Exit(1)
