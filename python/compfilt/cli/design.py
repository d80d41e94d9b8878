"""Choose the gains of a filter."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from compfilt.cli.base import app, one_line
from compfilt.logs.errors import UsageError

if TYPE_CHECKING:
    from compfilt.design import Designed

__all__ = ["design"]

Shape: TypeAlias = dict[str, Any]

UNITS = {1: "rad", 2: "m"}
"""What is measured, by the order of the derivative beside it, where the densities have the units of the options."""


@app.command()
def design(
    kind: Annotated[
        str | None,
        typer.Option(
            help="first_order, pi, butterworth, third_order, second_order_inertial or chain. Without it: the recipe's; "
            "pi if there is a walk or --bias-time; otherwise first_order."
        ),
    ] = None,
    order: Annotated[int | None, typer.Option(help="Of butterworth and chain.")] = None,
    split: Annotated[
        int | None,
        typer.Option(
            help="Of butterworth and chain: 1 is the steepest low-pass, the order the steepest high-pass."
        ),
    ] = None,
    derivative_order: Annotated[
        int | None, typer.Option(help="Of chain: which derivative the second signal is.")
    ] = None,
    *,
    measurement_noise: Annotated[
        float | None,
        typer.Option(
            metavar="R",
            help="Two-sided density of the measurement: rad/√Hz; m/√Hz for a kind that takes an acceleration.",
        ),
    ] = None,
    derivative_noise: Annotated[
        float | None,
        typer.Option(
            "--derivative-noise",
            "--gyro-noise",
            metavar="Q",
            help="Two-sided density of the derivative: (rad/s)/√Hz, or (m/s²)/√Hz.",
        ),
    ] = None,
    walk: Annotated[
        float | None,
        typer.Option(
            metavar="Q2",
            help="Two-sided density of the random walk of its bias: (rad/s²)/√Hz, or (m/s³)/√Hz. With --noise in place of the file's.",
        ),
    ] = None,
    bias: Annotated[
        float, typer.Option(metavar="B", help="A constant error of the derivative: rad/s, or m/s².")
    ] = 0.0,
    noise: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The three densities as compfilt noise --json printed them."),
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option(metavar="HZ", help="Where the low-pass is at -3 dB.")
    ] = None,
    settling_time: Annotated[
        float | None, typer.Option(metavar="S", help="When 2 % of a wrong start are left.")
    ] = None,
    bias_time: Annotated[
        float | None, typer.Option(metavar="S", help="When the bias is known to 10 %.")
    ] = None,
    recording: Annotated[
        list[Path] | None,
        typer.Option(metavar="LOG", help="A log of the motion; give it several times for several logs."),
    ] = None,
    recipe: Annotated[
        Path | None,
        typer.Option(
            metavar="RECIPE",
            help="How the recordings are filtered; its design is replaced, or the gains of Mahony's filter.",
        ),
    ] = None,
    truth: Annotated[
        str,
        typer.Option(
            metavar="OUTPUT=COLUMN,...",
            help="Where the truth of an output is, in its unit: roll=true_roll. Without it the offline estimate stands in for it.",
        ),
    ] = "",
    fs: Annotated[
        float | None,
        typer.Option(
            "--fs", metavar="HZ", help="The rate at which the filter will run, to predict its error."
        ),
    ] = None,
    rule: Annotated[str, typer.Option(help="backward_euler or matched.")] = "backward_euler",
    json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Choose the gains of a filter: from noise, from how fast it shall be, or from recordings.

    Noise alone gives the gains of the least error. With a wanted speed, noise and --fs predict the error. A one-sided
    density, as most data sheets have it, is √2 times a two-sided one. Printed are the gains, the predicted error and its
    parts, what a change of each gain would do, what speaks against the result, and the line for a recipe.

    Exit status: 0, 1 if a recording cannot be used, 2 if nothing was done.
    """
    from json import dumps  # noqa: PLC0415

    with one_line():
        targets = {"cutoff": cutoff, "settling_time": settling_time, "bias_time": bias_time}
        wanted = {name: target for name, target in targets.items() if target is not None}
        if len(wanted) + bool(recording) > 1:
            raise UsageError(
                "--cutoff, --settling-time, --bias-time and --recording are different ways: give one"
            )
        if bool(recording) != (recipe is not None) or (truth and not recording):
            raise UsageError("--recording and --recipe belong together, and --truth goes with them")
        noisy = measurement_noise is not None or noise is not None
        predicts = (
            noisy
            or derivative_noise is not None
            or walk is not None
            or bias
            or fs is not None
            or rule != "backward_euler"
        )
        if recording and predicts:
            raise UsageError(
                "--recording goes with no noise, --fs or --rule: the recipe and its errors count"
            )
        if wanted and noise is None and noisy != (fs is not None):
            raise UsageError(
                "--measurement-noise and --fs belong together: both are needed to predict the error"
            )
        if wanted and predicts and not noisy:
            raise UsageError(
                "--derivative-noise, --walk, --bias and --rule go with --measurement-noise and --fs, to predict the error"
            )
        if noisy and noise is None and fs is None and (bias or rule != "backward_euler"):
            raise UsageError("--bias and --rule go with --fs: they count for the error that it predicts")
        shape: Shape = {"order": order, "split": split, "derivative_order": derivative_order}
        try:
            if recording and recipe is not None:
                result, unit = _from_logs(recording, recipe, truth, kind, shape)
            else:
                known = _noise(noise, measurement_noise, derivative_noise, walk)
                known |= {"bias": bias, "rule": rule} | ({} if fs is None else {"fs": fs})
                if wanted:
                    (way,) = wanted.items()
                    result = _from_target(*way, kind, shape, known)
                else:
                    result = _from_noise(kind, shape, known, "" if noise is None else f"{noise}: ")
                unit = UNITS.get(result.design.derivative_order, "")
        except ValueError as error:
            raise UsageError(str(error)) from None
        typer.echo(
            dumps(result.as_json(), indent=2) if json else f"{result.table(unit)}\n{result.recipe_line()}"
        )


def _noise(
    file: Path | None, measurement: float | None, derivative: float | None, walk: float | None
) -> dict[str, Any]:
    """Return the densities and the rate by the names that the library has."""
    from compfilt.design.noise_file import read_densities  # noqa: PLC0415

    if file is None:
        return {"measurement": measurement, "derivative": derivative or 0.0, "walk": walk or 0.0}
    if measurement is not None or derivative is not None:
        raise UsageError(
            "--noise stands for --measurement-noise and --derivative-noise: give one or the other"
        )
    try:
        found = read_densities(file)
    except OSError as error:
        raise UsageError(f"{file}: cannot be read: {error.strerror}") from None
    return (found if walk is None else found._replace(walk=walk))._asdict()


def _from_target(
    name: str, target: float, kind: str | None, shape: Shape, known: dict[str, Any]
) -> "Designed":
    from compfilt import design as gains  # noqa: PLC0415

    kind = kind or ("pi" if name == "bias_time" else "first_order")
    if name == "bias_time":
        if shape["split"] is not None:
            raise UsageError("--split does not go with --bias-time: only split = order estimates the bias")
        result = gains.from_bias_time(
            target, kind=kind, order=shape["order"], derivative_order=shape["derivative_order"]
        )
    else:
        way = gains.from_cutoff if name == "cutoff" else gains.from_settling_time
        result = way(target, kind=kind, **shape)
    predicted = known["measurement"] is not None and "fs" in known
    return gains.assess(result.design, **known) if predicted else result


def _from_noise(kind: str | None, shape: Shape, known: dict[str, Any], file: str) -> "Designed":
    """Choose gains for known noise; `file` is the beginning of a message about what stands in one."""
    from compfilt import design as gains  # noqa: PLC0415

    if known["measurement"] is None:
        raise UsageError(
            "nothing to choose by: give --measurement-noise, --noise, --cutoff, --settling-time, --bias-time or --recording"
        )
    kind = kind or ("pi" if known["walk"] else "first_order")
    closed = kind != "butterworth" and shape["order"] is None and shape["split"] is None
    if not closed and "fs" not in known:
        raise UsageError(
            "--fs is needed for kind butterworth, --order and --split: their error is minimised at a rate"
        )
    if kind in {"pi", "third_order"} and not known["walk"]:
        raise UsageError(
            f"{file}kind {kind} chooses its gains by the random walk of the bias, which is 0: give it with --walk, or give "
            "--bias-time, the time in which the bias is to be known"
        )
    try:
        if closed:
            return gains.from_densities(kind=kind, derivative_order=shape["derivative_order"], **known)
        return gains.from_spectra(kind=kind, **shape, **known)
    except ValueError as error:
        # Of what is wrong, only this stands in the file.
        in_file = str(error).startswith(("measurement ", "derivative ", "walk ", "the ratios "))
        raise UsageError(f"{file if in_file else ''}{error}") from None


def _from_logs(
    logs: list[Path], recipe: Path, truth: str, kind: str | None, shape: Shape
) -> "tuple[Designed, str]":
    from compfilt.design.log import from_logs  # noqa: PLC0415
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415

    loaded = load_recipe(recipe)
    return from_logs(
        logs, loaded, _names(truth) if truth else None, kind=kind, **shape
    ), loaded.output.unit.name


def _names(truth: str) -> dict[str, str]:
    names: dict[str, str] = {}
    for part in truth.split(","):
        output, _, column = (piece.strip() for piece in part.partition("="))
        if not output or not column or output in names:
            raise UsageError(f'--truth: "{part}" is not OUTPUT=COLUMN with an output of its own')
        names[output] = column
    return names
