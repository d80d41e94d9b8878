"""Say what noise a sensor has."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, one_line, say
from compfilt.logs.errors import LogError, UsageError

__all__ = ["noise"]


@app.command()
def noise(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log of the sensor at rest.")],
    recipe: Annotated[
        Path | None, typer.Option("--recipe", metavar="RECIPE", help="Which columns are what, in which unit.")
    ] = None,
    *,
    motors: Annotated[
        Path | None,
        typer.Option("--motors", metavar="LOG", help="A second log: the body fixed, the motors running."),
    ] = None,
    start: Annotated[
        float | None, typer.Option("--from", metavar="S", help="Begin at this second of the log.")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--until", metavar="S", help="End at this second of the log.")
    ] = None,
    gyro_unit: Annotated[
        str | None, typer.Option("--gyro-unit", metavar="UNIT", help="The gyro's unit, if nothing tells it.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot", metavar="FILE", help="Draw the spectra and Allan deviations: PNG, PDF or SVG."
        ),
    ] = None,
    longest_rest: Annotated[
        bool, typer.Option("--longest-rest", help="Use the longest rest of a log that holds motion.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
    force: Force = False,
) -> None:
    """Say what noise a gyro and an accelerometer have: densities, bias instability, random walks, vibration.

    The log is one of the sensor at rest, of an hour or more for the bias; motion in it is found and refused. Without a
    recipe the columns are found by their names. What gains follow from is printed at the end.

    Exit status: 0, 1 if the log cannot be used, 2 if nothing was done.
    """
    from json import dumps  # noqa: PLC0415

    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415

    with one_line():
        try:
            from compfilt.noise.log import analyse_log  # noqa: PLC0415 - an extra of its own
            from compfilt.noise.picture import check_picture, save_picture  # noqa: PLC0415
        except ModuleNotFoundError as error:
            raise UsageError(str(error)) from None
        if plot is not None:
            check_picture(plot, force=force)
        loaded = None if recipe is None else load_recipe(recipe)
        try:
            report = analyse_log(
                log,
                loaded,
                motors=motors,
                start=start,
                end=end,
                only_longest_rest=longest_rest,
                gyro_unit=gyro_unit,
            )
        except LogError as error:
            raise LogError(f"{log}: {error}") from None
        typer.echo(dumps(report.as_json(), indent=2) if json else f"{log}: {report.table()}")
        if plot is not None:
            save_picture(report, plot)
            say(f"{log} -> {plot}")
