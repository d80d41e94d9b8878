"""All that there is to see of a design, on one sheet."""

from pathlib import Path
from typing import Any, Literal

from matplotlib.figure import Figure

from compfilt.plot.bode import bode
from compfilt.plot.designs import DesignLike, named
from compfilt.plot.files import check_file, write
from compfilt.plot.poles import poles
from compfilt.plot.responses import bias_response, step_response

__all__ = ["design", "save_design"]

RULES = {"backward_euler": "backward Euler", "matched": "matched poles"}


def design(
    design: DesignLike,
    *,
    fs: float | None = None,
    rule: Literal["backward_euler", "matched"] = "backward_euler",
) -> Figure:
    """Draw a design on one sheet: its Bode plot, its poles, its step response and its bias response.

    Parameters
    ----------
    design : LinearFilter or mapping of str to LinearFilter
        What is drawn; several designs by their names are compared.
    fs : float, optional
        The sample rate in Hz: with it the discrete filter is drawn. The poles are those of the continuous one either way: in the
        z-plane all that are slow lie at 1.
    rule : {"backward_euler", "matched"}
        How the discrete filter is made; used with fs only.

    Returns
    -------
    Figure
        A new one, which no window shows; its ``savefig`` writes it.

    Raises
    ------
    ValueError
        fs is not positive and finite, or its samples would be too many; the rule is unknown; there are no designs or too many
        of them, or they take derivatives of different order.

    Examples
    --------
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> figure = plot.design(cf.PiForm(kp=2.0, ki=1.0), fs=100.0)
    >>> [axes.get_title("left") for axes in figure.axes]
    ['Bode plot', 'poles of the continuous filter', '', 'step response', 'bias response']
    """
    designs = named(design)
    figure = Figure(figsize=(14.0, 8.0), layout="constrained")
    places: Any = [["magnitude", "poles"], ["phase", "poles"], ["step", "bias"]]
    panels = figure.subplot_mosaic(places, height_ratios=[1.0, 1.0, 1.4])
    panels["phase"].sharex(panels["magnitude"])
    panels["magnitude"].tick_params(labelbottom=False)
    bode(designs, fs=fs, rule=rule, ax=[panels["magnitude"], panels["phase"]])
    poles(designs, ax=panels["poles"])
    step_response(designs, fs=fs, rule=rule, ax=panels["step"])
    bias_response(designs, fs=fs, rule=rule, ax=panels["bias"])
    titles = {
        "magnitude": "Bode plot",
        "poles": "poles of the continuous filter",
        "step": "step response",
        "bias": "bias response",
    }
    for name, title in titles.items():
        panels[name].set_title(title, loc="left")
    sampled = "continuous" if fs is None else f"{fs:g} Hz, {RULES[rule]}"
    alone = repr(designs[""]) + ", " if "" in designs else ""
    figure.suptitle(f"{alone}{sampled}")
    return figure


def save_design(
    recipe: str | Path, out: str | Path | None = None, *, fs: float | None = None, force: bool = False
) -> Path:
    r"""Draw the linear design of a recipe as :func:`design` does, into a file that is either complete or not there.

    Parameters
    ----------
    recipe
        A TOML file.
    out
        Where the picture goes; beside the recipe, under its name with ``.png``, where it is left out.
    fs
        The sample rate in Hz; where it is left out that of the recipe. Where the recipe has none either, because its log has a
        column of times, the continuous filter is drawn.
    force
        Replace a picture that is already there.

    Returns
    -------
    Path
        Where the picture is.

    Raises
    ------
    compfilt.logs.UsageError
        The recipe is wrong or has no linear design, fs is not positive and finite, the picture is already there, there is no
        folder for it, or its ending is not known.
    compfilt.logs.LogError
        The picture cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from compfilt import plot
    >>> text = '''
    ... version = 1
    ... [log]
    ... rate = 100.0
    ... measurement = { column = "angle", unit = "deg" }
    ... derivative = { column = "rate", unit = "deg/s" }
    ... [filter]
    ... kind = "first_order"
    ... tau = 0.5
    ... [output]
    ... columns = ["estimate"]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "angle.toml")
    ...     _ = path.write_text(text)
    ...     plot.save_design(path).name
    'angle.png'
    """
    from compfilt.logs.errors import RecipeError, UsageError  # noqa: PLC0415 - pictures do not need Arrow
    from compfilt.logs.recipe import load_recipe  # noqa: PLC0415

    target = Path(recipe).with_suffix(".png") if out is None else Path(out)
    check_file(target, force=force)
    loaded = load_recipe(recipe)
    filter_ = loaded.filter
    try:
        linear = filter_.linear
        built = None if linear is None else linear.build()
    except ValueError as error:
        raise RecipeError(f"{recipe}: [filter] {error}") from None
    if built is None:
        raise UsageError(
            f"{recipe}: a filter of {filter_.title} has no linear design to draw; plot the result of compfilt run"
        )
    rate = loaded.clock.rate if fs is None else fs
    try:
        figure = design(built, fs=rate, rule=getattr(filter_, "stream", {}).get("rule", "backward_euler"))
    except ValueError as error:
        raise UsageError(f"{recipe}: {error}") from None
    write(figure, target)
    return target
