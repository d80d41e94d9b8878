"""Choose the gains of a filter."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compfilt.cli.base import app, one_line
from compfilt.logs.errors import LogError, UsageError

if TYPE_CHECKING:
    from compfilt.design import Designed

__all__ = ["design"]

TARGETS = ("--cutoff", "--settling-time", "--bias-time")


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
        typer.Option(metavar="R", help="Two-sided density of the measurement, rad/√Hz for an angle."),
    ] = None,
    derivative_noise: Annotated[
        float | None,
        typer.Option(
            "--derivative-noise",
            "--gyro-noise",
            metavar="Q",
            help="Two-sided density of the derivative, (rad/s)/√Hz.",
        ),
    ] = None,
    walk: Annotated[
        float,
        typer.Option(metavar="Q2", help="Two-sided density of the random walk of its bias, (rad/s²)/√Hz."),
    ] = 0.0,
    bias: Annotated[
        float, typer.Option(metavar="B", help="A constant error of the derivative, rad/s.")
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
        typer.Option(metavar="LOG", help="A log with truth; give it several times for several logs."),
    ] = None,
    recipe: Annotated[
        Path | None,
        typer.Option(metavar="RECIPE", help="How the recordings are filtered; its design is replaced."),
    ] = None,
    truth: Annotated[
        str,
        typer.Option(
            metavar="OUTPUT=COLUMN,...", help="Where the truth of an output is, in its unit: roll=true_roll."
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
    """Choose the gains of a filter: from noise, from how fast it shall be, or from recordings with truth.

    Noise alone gives the gains of the least error. With a wanted speed, noise and --fs predict the error. A one-sided
    density, as most data sheets have it, is √2 times a two-sided one. Printed are the gains, the predicted error and its
    parts, what a change of each gain would do, what speaks against the result, and the line for a recipe.

    Exit status: 0, 1 if a recording cannot be used, 2 if nothing was done.
    """
    from json import dumps  # noqa: PLC0415

    with one_line():
        try:
            from compfilt import design as gains  # noqa: PLC0415 - an extra of its own
        except ImportError as error:
            raise UsageError(str(error)) from None
        targets = (cutoff, settling_time, bias_time)
        _check_ways(targets, recording, recipe, truth)
        shape: dict[str, Any] = {"order": order, "split": split, "derivative_order": derivative_order}
        unit = ""
        try:
            if recording:
                result, unit = _from_recordings(recording, recipe, truth, kind, shape)
            else:
                known, rate = _densities(noise, measurement_noise, derivative_noise, walk)
                known |= {"bias": bias, "rule": rule}
                result = _without_recordings(gains, kind, shape, targets, known, fs or rate)
        except ValueError as error:
            raise UsageError(str(error)) from None
        typer.echo(
            dumps(result.as_json(), indent=2) if json else f"{result.table(unit)}\n{result.recipe_line()}"
        )


def _check_ways(
    targets: tuple[float | None, ...], recording: list[Path] | None, recipe: Path | None, truth: str
) -> None:
    ways = sum(target is not None for target in targets) + bool(recording)
    if ways > 1:
        raise UsageError(f"only one of {', '.join(TARGETS)}, --recording can be given")
    if bool(recording) != (recipe is not None) or bool(recording) != bool(truth):
        raise UsageError("--recording, --recipe and --truth belong together")


def _densities(
    noise: Path | None, measurement: float | None, derivative: float | None, walk: float
) -> tuple[dict[str, Any], float | None]:
    """Return the densities by the names that the library has, and the sample rate of their recording."""
    if noise is None:
        return {"measurement": measurement, "derivative": derivative or 0.0, "walk": walk}, None
    from json import loads  # noqa: PLC0415

    if measurement is not None or derivative is not None or walk:
        raise UsageError("--noise stands for --measurement-noise, --derivative-noise and --walk")
    try:
        report = loads(noise.read_text(encoding="utf-8"))
        known = {name: float(report["densities"][name]) for name in ("measurement", "derivative", "walk")}
        return known, float(report["rate"])
    except OSError as error:
        raise UsageError(f"{noise}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise UsageError(f"{noise}: must be what compfilt noise --json printed") from None


def _without_recordings(
    gains: Any,  # noqa: ANN401 - the module
    kind: str | None,
    shape: dict[str, Any],
    targets: tuple[float | None, ...],
    known: dict[str, Any],
    fs: float | None,
) -> "Designed":
    ways = (gains.from_cutoff, gains.from_settling_time, gains.from_bias_time)
    chosen = [(way, target) for way, target in zip(ways, targets, strict=True) if target is not None]
    noisy = known["measurement"] is not None
    if chosen:
        way, target = chosen[0]
        if way is gains.from_bias_time:
            if shape.pop("split") is not None:
                raise UsageError(
                    "--split does not go with --bias-time: only the full split estimates the bias"
                )
            kind = kind or "pi"
        result: Designed = way(target, kind=kind or "first_order", **shape)
        return gains.assess(result.design, fs=fs, **known) if noisy and fs is not None else result
    if not noisy:
        raise UsageError(
            f"nothing to choose by: give --measurement-noise, --noise, {', '.join(TARGETS)} or --recording"
        )
    kind = kind or ("pi" if known["walk"] else "first_order")
    if kind == "butterworth" or shape["order"] is not None or shape["split"] is not None:
        if fs is None:
            raise UsageError(
                "--fs is needed for kind butterworth, --order and --split: their error is minimised at a rate"
            )
        return gains.from_spectra(kind=kind, fs=fs, **shape, **known)
    return gains.from_densities(kind=kind, fs=fs, derivative_order=shape["derivative_order"], **known)


def _from_recordings(
    logs: list[Path], recipe: Path | None, truth: str, kind: str | None, shape: dict[str, Any]
) -> "tuple[Designed, str]":
    from compfilt.design import from_recordings  # noqa: PLC0415
    from compfilt.design.log import can_design, read_recording  # noqa: PLC0415
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415

    loaded = load_recipe(recipe or Path())
    columns = _names(truth)
    recordings = []
    for log in logs:
        try:
            recordings.append(read_recording(log, loaded, columns))
        except LogError as error:
            raise LogError(f"{log}: {error}") from None
    if kind is None and can_design(loaded):
        kind = loaded.filter.design.kind  # type: ignore[attr-defined]
        named = loaded.filter.design.parameters  # type: ignore[attr-defined]
        if kind in {"butterworth", "chain"}:
            given = {"order": len(named.get("coefficients", ())) or None} | dict(named)
            shape = {name: given.get(name) if value is None else value for name, value in shape.items()}
    return from_recordings(recordings, kind=kind or "first_order", **shape), loaded.output.unit.name


def _names(truth: str) -> dict[str, str]:
    names: dict[str, str] = {}
    for part in truth.split(","):
        output, _, column = (piece.strip() for piece in part.partition("="))
        if not output or not column or output in names:
            raise UsageError(f'--truth: "{part}" is not OUTPUT=COLUMN with an output of its own')
        names[output] = column
    return names
