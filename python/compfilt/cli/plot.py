"""Draw a result."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, one_line, say
from compfilt.logs.errors import LogError

__all__ = ["plot"]


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

    with one_line():
        try:
            picture = save(result, out, force=force)
        except LogError as error:
            raise LogError(f"{result}: {error}") from None
        say(f"{result} -> {picture}")
