"""Draw a result, or the design of a recipe."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, one_line, say
from compfilt.logs.errors import LogError, UsageError

__all__ = ["plot"]


@app.command()
def plot(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT|RECIPE",
            help="A CSV or Parquet file that compfilt run wrote; or a recipe, a TOML file.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="FILE",
            help="A PNG, PDF or SVG file; without it the name of what is drawn, with .png.",
        ),
    ] = None,
    fs: Annotated[
        float | None,
        typer.Option(
            "--fs",
            metavar="HZ",
            help="With a recipe: the sample rate of the filter. Without it the recipe's; where that has none, the continuous "
            "filter is drawn.",
        ),
    ] = None,
    *,
    force: Force = False,
) -> None:
    """Draw a result, or the design of a recipe.

    A result: angles, rates and biases over time, where the body rests, and the flags. The time is the column "t" or
    "time" if the recipe kept it, otherwise the number of the row. A Parquet file knows the units of its columns, a CSV
    does not.

    A recipe with a linear design (kind tilt, cube, first_order, pi, butterworth and the like, or Mahony's filter): its Bode
    plot, its poles, its step response and its bias response, on one sheet.

    Exit status: 0, 1 if the result cannot be drawn, 2 if nothing was done.
    """
    from compfilt.plot import save, save_design  # noqa: PLC0415 - matplotlib is an extra of its own

    with one_line():
        try:
            if source.suffix.lower() == ".toml":
                picture = save_design(source, out, fs=fs, force=force)
            elif fs is not None:
                raise UsageError("--fs goes with a recipe: a result has its own times")
            else:
                picture = save(source, out, force=force)
        except LogError as error:
            raise LogError(f"{source}: {error}") from None
        say(f"{source} -> {picture}")
