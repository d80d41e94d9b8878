"""The command line. Each command is a thin face on a function of the library."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from tqdm import tqdm  # type: ignore[import-untyped]

from compfilt.logs.errors import LogError, UsageError

if TYPE_CHECKING:
    from compfilt.logs.outcome import Outcome

__all__ = ["run_app"]


def _group(text: str) -> typer.Typer:
    """Make a group of commands in plain text: what a tool in a pipeline says is one line for one thing."""
    return typer.Typer(
        help=text,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )


app = _group("Complementary filters for logs.")
simulate_app = _group("Make a log whose truth is known.")
app.add_typer(simulate_app, name="simulate")

Force = Annotated[bool, typer.Option("--force", help="Replace a result that is already there.")]


def run_app() -> NoReturn:
    """Run the command line and leave the process with its status."""
    signal.signal(signal.SIGTERM, _terminate)
    app(prog_name="compfilt")
    sys.exit(0)


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

    with _one_line("the same command with --resume does the rest"):
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


@app.command()
def plot(
    result: Annotated[
        Path, typer.Argument(metavar="RESULT", help="A CSV or Parquet file that compfilt run wrote.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="OUT", help="A PNG, PDF or SVG file; without it RESULT's name with .png."
        ),
    ] = None,
    *,
    force: Force = False,
) -> None:
    """Draw a result: angles, rates and biases over time, where the body rests, and the flags.

    The time is the column "t" or "time" if the recipe kept it, otherwise the number of the row. A Parquet file knows the
    units of its columns, a CSV does not.

    Exit status: 0, 1 if the result cannot be drawn, 2 if nothing was done.
    """
    from compfilt.plot import save  # noqa: PLC0415 - matplotlib is an extra of its own

    with _one_line():
        try:
            picture = save(result, out, force=force)
        except LogError as error:
            raise LogError(f"{result}: {error}") from None
        _say(f"{result} -> {picture}")


@app.command()
def check(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log that recipes can read.")],
    recipe: Annotated[
        Path | None, typer.Option("--recipe", metavar="RECIPE", help="What the log is claimed to be.")
    ] = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print the findings as JSON.")] = False,
) -> None:
    """Say what a log seems to be: rate, units, axes, gaps, rests, bias, and what would make a filter wrong.

    Without a recipe the columns are found by their names or by what they do, and a recipe that fits is printed. What
    cannot be told from the log is said.

    Exit status: 0, 1 if something would make a filter wrong or the log cannot be read, 2 if nothing was done.
    """
    from json import dumps  # noqa: PLC0415

    from compfilt.logs.check import check_log  # noqa: PLC0415
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415

    with _one_line():
        loaded = None if recipe is None else load_recipe(recipe)
        try:
            report = check_log(log, loaded)
        except LogError as error:
            raise LogError(f"{log}: {error}") from None
        typer.echo(dumps(report.as_json(), indent=2) if json else str(report))
    if report.wrong:
        raise typer.Exit(1)


@app.command()
def export(
    recipe: Annotated[Path, typer.Argument(metavar="RECIPE", help="A TOML file, as for compfilt run.")],
    to: Annotated[
        str,
        typer.Option("--to", metavar="LANGUAGE", help='"c", for compfilt.h; or "rust", for compfilt-core.'),
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Without it the source is printed.")
    ] = None,
    fs: Annotated[
        float | None,
        typer.Option("--fs", metavar="HZ", help="The chip's sample rate; the recipe's where it has one."),
    ] = None,
    *,
    force: Force = False,
) -> None:
    """Write a recipe's filter as source code for a chip, with the bits of compfilt run in float32.

    Exit status: 0, 1 if FILE cannot be written, 2 if nothing was done.
    """
    from compfilt.logs.export import export_recipe  # noqa: PLC0415
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415
    from compfilt.logs.writers import check_target, complete_file  # noqa: PLC0415

    with _one_line():
        source = export_recipe(load_recipe(recipe), to, fs=fs)
        if out is None:
            typer.echo(source, nl=False)
            return
        check_target(out, force=force)
        with complete_file(out) as file:
            file.write(source.encode())
        _say(f"{recipe} -> {out}")


@app.command()
def replay(
    trace: Annotated[
        Path,
        typer.Argument(
            metavar="TRACE", help="What a device recorded: the recipe's inputs, and its own outputs."
        ),
    ],
    recipe: Annotated[Path, typer.Argument(metavar="RECIPE", help="The filter that ran there.")],
    out_columns: Annotated[
        str,
        typer.Option(
            "--out-columns",
            metavar="NAME=COLUMN,...",
            help="Where an output has another name in TRACE: roll=est_roll.",
        ),
    ] = "",
) -> None:
    """Say whether a device's outputs are the filter's, bit for bit, and where they part.

    Both are float32 in SI units; a number is a decimal that is read as itself, or its bits: 0x3c23d70a. The inputs go
    through the recipe as in compfilt run.

    Exit status: 0 if all bits are the same, 1 if they are not or TRACE cannot be read, 2 if nothing was done.
    """
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415
    from compfilt.logs.replay import parse_names, replay_trace  # noqa: PLC0415

    with _one_line():
        try:
            report = replay_trace(load_recipe(recipe), trace, parse_names(out_columns))
        except LogError as error:
            raise LogError(f"{trace}: {error}") from None
        for line in report.lines():
            _say(f"{trace}: {line}")
    if report.differences:
        raise typer.Exit(1)


@simulate_app.command("child-seat")
def child_seat(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="A CSV or Parquet file.")],
    *,
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another drive with another sensor.")] = 0,
    duration: Annotated[float, typer.Option(help="Seconds.")] = 150.0,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 100.0,
    force: Force = False,
) -> None:
    """Simulate a child seat in a moving car, with a cheap inertial sensor on it.

    Columns: t in s; ax, ay, az in g; gx, gy, gz in deg/s; true_roll, true_pitch in deg. Axes: forward, left, up.
    """
    from compfilt import simulate  # noqa: PLC0415
    from compfilt.logs.writers import check_ending, check_target  # noqa: PLC0415

    with _one_line():
        target = out / "child-seat.csv" if out.is_dir() else out
        check_target(target, force=force)
        check_ending(target)
        if not target.parent.is_dir():
            raise UsageError(f"{target.parent}: there is no such folder")
        try:
            columns = simulate.child_seat(duration=duration, rate=rate, seed=seed)
        except ValueError as error:
            raise UsageError(str(error)) from None
        simulate.write(columns, target)
        _say(f"{len(columns['t'])} samples -> {target}")


def _say(message: str) -> None:
    """Write one line to stderr, above the progress bar if there is one."""
    tqdm.write(f"compfilt: {message}", file=sys.stderr)


@contextlib.contextmanager
def _one_line(after_stop: str = "") -> Iterator[None]:
    """Turn what can go wrong into one line and an exit status; `after_stop` says what to do after Ctrl-C."""
    try:
        yield
    except UsageError as error:
        _say(str(error))
        raise typer.Exit(2) from None
    except LogError as error:
        _say(str(error))
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        _say("interrupted" + (f"; {after_stop}" if after_stop else ""))
        raise typer.Exit(130) from None


def _terminate(_signal: int, _frame: object) -> NoReturn:
    """Leave by way of every `finally`, so that no temporary file stays behind."""
    _say("terminated")
    sys.exit(128 + signal.SIGTERM)
