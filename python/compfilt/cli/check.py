"""Say what a log seems to be."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import app, one_line
from compfilt.logs.errors import LogError

__all__ = ["check"]


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

    with one_line():
        loaded = None if recipe is None else load_recipe(recipe)
        try:
            report = check_log(log, loaded)
        except LogError as error:
            raise LogError(f"{log}: {error}") from None
        typer.echo(dumps(report.as_json(), indent=2) if json else str(report))
    if report.wrong:
        raise typer.Exit(1)
