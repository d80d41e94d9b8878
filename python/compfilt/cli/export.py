"""Write a recipe's filter as source code."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, one_line, say
from compfilt.logs.errors import UsageError

__all__ = ["export"]


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
    with_header: Annotated[
        bool, typer.Option("--with-header", help="With --to c: put compfilt.h beside FILE.")
    ] = False,
    force: Force = False,
) -> None:
    """Write a recipe's filter as source code for a chip, with the bits of compfilt run in float32.

    Exit status: 0, 1 if FILE cannot be written, 2 if nothing was done.
    """
    from compfilt.logs.export import export_recipe  # noqa: PLC0415
    from compfilt.logs.export.header import check_header  # noqa: PLC0415
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415
    from compfilt.logs.writers import check_target, complete_file  # noqa: PLC0415

    with one_line():
        if with_header and (to != "c" or out is None):
            raise UsageError("--with-header goes with --to c and -o FILE")
        source = export_recipe(load_recipe(recipe), to, fs=fs)
        if out is None:
            typer.echo(source, nl=False)
            return
        check_target(out, force=force)
        if to == "c":
            check_header(out, beside=with_header, force=force)
        with complete_file(out) as file:
            file.write(source.encode())
        say(f"{recipe} -> {out}")
        if to == "c":
            _say_what_it_needs(out, with_header=with_header)


def _say_what_it_needs(out: Path, *, with_header: bool) -> None:
    """Say where the header is and how the library is built; with `with_header` put the header beside the source."""
    from compfilt.logs.export.header import BUILD, HEADER, put_header  # noqa: PLC0415

    if with_header:
        say(f"{HEADER} -> {put_header(out)}")
    else:
        say(f"compfilt.h is in {HEADER.parent} (--with-header puts it beside {out.name})")
    say(f"its library, in the source distribution or a clone, for a Cortex-M4F: {BUILD}")
