"""Compare a device's recording with the filter."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import app, one_line, say
from compfilt.logs.errors import LogError

__all__ = ["replay"]


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

    with one_line():
        try:
            report = replay_trace(load_recipe(recipe), trace, parse_names(out_columns))
        except LogError as error:
            raise LogError(f"{trace}: {error}") from None
        for line in report.lines():
            say(f"{trace}: {line}")
    if report.differences:
        raise typer.Exit(1)
