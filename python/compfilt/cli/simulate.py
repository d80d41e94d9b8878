"""Make a log whose truth is known."""

import contextlib
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from compfilt.cli.base import Force, app, group, one_line, say
from compfilt.logs.errors import UsageError

__all__ = ["child_seat", "imu", "simulate_app"]

simulate_app = group("Make a log whose truth is known.")
app.add_typer(simulate_app, name="simulate")


Out = Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="A CSV or Parquet file.")]


@simulate_app.command("child-seat")
def child_seat(
    out: Out,
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

    with one_line():
        target = _target(out, "child-seat.csv", force=force)
        with _usage():
            columns = simulate.child_seat(duration=duration, rate=rate, seed=seed)
        simulate.write(columns, target)
        say(f"{len(columns['t'])} samples -> {target}")


class Grade(str, Enum):
    """The sensors of `compfilt.simulate.typical`."""

    CONSUMER = "consumer"
    INDUSTRIAL = "industrial"
    TACTICAL = "tactical"


@simulate_app.command("imu")
def imu(
    out: Out,
    *,
    grade: Annotated[Grade, typer.Option(help="Whose data sheet the errors are from.")] = Grade.CONSUMER,
    motion: Annotated[
        bool, typer.Option("--motion/--rest", help="Drive as the child seat does, or lie still.")
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another sensor and another drive.")] = 0,
    duration: Annotated[float, typer.Option(help="Seconds.")] = 3600.0,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 100.0,
    force: Force = False,
) -> None:
    """Simulate an inertial sensor with the errors of a data sheet: white noise, bias, its drift, scale, cross axes.

    Columns: t in s; ax, ay, az in m/s^2; gx, gy, gz in rad/s; true_roll, true_pitch in rad. Axes: forward, left, up.
    """
    import numpy as np  # noqa: PLC0415

    from compfilt import simulate  # noqa: PLC0415

    with one_line():
        target = _target(out, "imu.csv", force=force)
        with _usage():
            simulate.samples_in(duration, rate)  # a drive of endless length would never be drawn
            drive = simulate.seat_motion(duration, np.random.default_rng(seed)) if motion else None
            errors = simulate.typical(grade.value, seed=seed)
            columns = simulate.imu_log(duration=duration, rate=rate, seed=seed, errors=errors, motion=drive)
        simulate.write(columns, target, simulate.LOG_UNITS)
        say(f"{len(columns['t'])} samples -> {target}")


def _target(out: Path, name: str, *, force: bool) -> Path:
    """Return the file to write; `name` in a folder."""
    from compfilt.logs.writers import check_ending, check_target  # noqa: PLC0415

    target = out / name if out.is_dir() else out
    check_target(target, force=force)
    check_ending(target)
    if not target.parent.is_dir():
        raise UsageError(f"{target.parent}: there is no such folder")
    return target


@contextlib.contextmanager
def _usage() -> Iterator[None]:
    """Turn a wrong number into an error of use."""
    try:
        yield
    except ValueError as error:
        raise UsageError(str(error)) from None
    except MemoryError:
        raise UsageError(
            "so long a log does not fit into memory: make --duration or --rate smaller"
        ) from None
