"""Results as pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt._core import AttitudeEstimate
from compfilt.angles import quaternion_to_angles
from compfilt.plot.panels import draw_flags, draw_legend, draw_lines, draw_rest, set_flags, with_unit

__all__ = ["ENDINGS", "attitude", "result", "save"]

ENDINGS = (".png", ".pdf", ".svg")
"""The endings of the files that :func:`save` can write."""


def attitude(
    estimate: AttitudeEstimate,
    *,
    fs: float | None = None,
    t: npt.ArrayLike | None = None,
    ax: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Draw roll, pitch, yaw and the gyro's bias in degrees, and where the body rests.

    Parameters
    ----------
    estimate : AttitudeEstimate
        From any attitude filter. The angles are those of body axes forward, left, up.
    fs : float, optional
        The sample rate in Hz.
    t : array_like, shape (n,), optional
        The time of every sample in s. Without it and without fs the samples are counted.
    ax : Axes or two of them, optional
        Where to draw: the angles on the first, the bias on the second where there is one. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on.

    Raises
    ------
    ValueError
        Both fs and t are given, t does not have a time for every sample, or there are more than two axes.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> from compfilt import plot
    >>> acc = np.tile([0.0, 6.94, 6.94], (300, 1))
    >>> estimate = cf.GravityFilter().estimate(np.full((300, 3), 0.001), acc, fs=100.0)
    >>> figure = plot.attitude(estimate, fs=100.0)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['angle / deg', 'gyro bias / (deg/s)']
    """
    angles = np.degrees(quaternion_to_angles(estimate.quaternion))
    bias = np.degrees(estimate.gyro_bias.astype(np.float64))
    x, label = _clock(len(angles), fs, t)
    axes = _two_new_axes() if ax is None else list(np.ravel(np.array(ax, dtype=object)))
    if len(axes) not in (1, 2):
        raise ValueError(f"ax must be one or two axes, got {len(axes)}")
    lines = dict(zip(("roll", "pitch", "yaw"), angles.T, strict=True))
    draw_lines(axes[0], x, lines, "angle", "deg", wraps=True)
    for each in axes[1:]:
        draw_lines(each, x, dict(zip("xyz", bias.T, strict=True)), "gyro bias", "deg/s")
    for i, each in enumerate(axes):
        draw_rest(each, x, estimate.at_rest)
        draw_legend(each, rest=i == 0)
    axes[-1].set_xlabel(label)
    figure: Figure = axes[0].figure.figure
    return figure


def result(path: str | Path) -> Figure:
    r"""Draw what ``compfilt run`` wrote: a panel for each kind of column, rest as shaded spans, flags as a rug.

    The horizontal axis is the column ``t`` or ``time`` if it was kept, otherwise the number of the row. Units are those that
    the file tells: a Parquet file does, a CSV does not. Needs the extra ``logs`` as well.

    Parameters
    ----------
    path
        A CSV or Parquet file.

    Returns
    -------
    Figure
        One that no window shows; its ``savefig`` writes it.

    Raises
    ------
    compfilt.logs.LogError
        The file cannot be read, or has none of the columns that a result has.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from compfilt import plot
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "seat.csv")
    ...     _ = path.write_text("t,roll,flags\n0.0,1.0,0\n0.1,1.5,1\n")
    ...     figure = plot.result(path)
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['angle', 'flags']
    """
    from compfilt.logs.results import read_result  # noqa: PLC0415 - the other pictures do not need Arrow

    found = read_result(path)
    shown = [] if found.flags is None else set_flags(found.flags)
    heights = [2.2] * len(found.groups)
    if found.flags is not None or not found.groups:
        heights.append(0.4 + 0.2 * max(len(shown), 1))
    figure = Figure(figsize=(10.0, 0.8 + sum(heights)), layout="constrained")
    axes = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for each, group in zip(axes, found.groups, strict=False):
        wraps = group.title == "angle"
        draw_lines(each, found.time, group.columns, group.title, group.unit, wraps=wraps)
    if len(heights) > len(found.groups):
        flags = np.zeros(found.time.size) if found.flags is None else found.flags
        draw_flags(axes[-1], found.time, flags, shown)
    for i, each in enumerate(axes):
        if found.at_rest is not None:
            draw_rest(each, found.time, found.at_rest)
        draw_legend(each, rest=i == 0)
    axes[-1].set_xlabel(with_unit(found.time_name, found.time_unit))
    return figure


def save(path: str | Path, out: str | Path | None = None, *, force: bool = False) -> Path:
    r"""Draw a result of ``compfilt run`` as :func:`result` does, into a file that is either complete or not there.

    Parameters
    ----------
    path
        A CSV or Parquet file.
    out
        Where the picture goes; beside the result, under its name with ``.png``, where it is left out.
    force
        Replace a picture that is already there.

    Returns
    -------
    Path
        Where the picture is.

    Raises
    ------
    compfilt.logs.UsageError
        The picture is already there, there is no folder for it, or its ending is not known.
    compfilt.logs.LogError
        The result cannot be read or has nothing to draw, or the picture cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from compfilt import plot
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "seat.csv")
    ...     _ = path.write_text("t,roll\n0.0,1.0\n0.1,1.5\n")
    ...     plot.save(path).name
    'seat.png'
    """
    from compfilt.logs.errors import UsageError  # noqa: PLC0415
    from compfilt.logs.writers import check_ending, check_target, complete_file  # noqa: PLC0415

    target = Path(path).with_suffix(".png") if out is None else Path(out)
    check_target(target, force=force)
    check_ending(target, ENDINGS)
    if not target.parent.is_dir():
        raise UsageError(f"{target.parent}: there is no such folder")
    figure = result(path)
    with complete_file(target) as file:
        figure.savefig(file, format=target.suffix[1:].lower(), dpi=150)
    return target


def _clock(samples: int, fs: float | None, t: npt.ArrayLike | None) -> tuple[npt.NDArray[np.float64], str]:
    """Return the horizontal axis and its label."""
    if fs is not None and t is not None:
        raise ValueError("give fs in Hz or t in seconds, not both")
    if t is not None:
        times = np.asarray(t, np.float64)
        if times.shape != (samples,):
            raise ValueError(f"t must have the shape ({samples},), got {times.shape}")
        return times, "time / s"
    counted = np.arange(samples, dtype=np.float64)
    return (counted, "sample") if fs is None else (counted / fs, "time / s")


def _two_new_axes() -> list[Axes]:
    """Make a figure that a window or a notebook shows, if there is one."""
    from matplotlib import pyplot as plt  # noqa: PLC0415 - only this needs windows

    figure = plt.figure(figsize=(10.0, 6.0), layout="constrained")
    return list(figure.subplots(2, sharex=True))
