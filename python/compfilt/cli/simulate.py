"""Make a log whose truth is known."""

from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, group, one_line, say
from compfilt.logs.errors import UsageError

__all__ = ["child_seat", "simulate_app"]

simulate_app = group("Make a log whose truth is known.")
app.add_typer(simulate_app, name="simulate")


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

    with one_line():
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
        say(f"{len(columns['t'])} samples -> {target}")
