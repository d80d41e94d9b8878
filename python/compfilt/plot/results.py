"""Results as pictures."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compfilt._core import AttitudeEstimate
from compfilt.angles import quaternion_to_angles
from compfilt.plot.bins import Bins
from compfilt.plot.files import check_file, write
from compfilt.plot.panels import REST, draw_flags, draw_lines, draw_rest, set_flags
from compfilt.plot.sheet import AxesLike, axes_for, draw_legend, figure_of, with_unit

__all__ = ["attitude", "result", "save"]

Array = npt.NDArray[np.float64]

BLOCK = 1 << 18
"""How many samples are looked at together: memory does not grow with the length of a recording."""


def attitude(
    estimate: AttitudeEstimate,
    *,
    fs: float | None = None,
    t: npt.ArrayLike | None = None,
    ax: AxesLike | None = None,
) -> Figure:
    """Draw roll, pitch, yaw and the gyro's bias in degrees, and where the body rests.

    Long recordings stay fast: of each of some thousand stretches the least and the greatest value are drawn, so that
    no spike is lost. A bar at the bottom tells where there is no value.

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
    quaternion, bias, rest = estimate.quaternion, estimate.gyro_bias, estimate.at_rest
    clock, label = _clock(len(quaternion), fs, t)
    axes = axes_for(ax, (1, 2), (10.0, 6.0))
    angles, biases = ("roll", "pitch", "yaw"), ("x", "y", "z")
    bins = Bins((*angles, *biases))
    for begin in range(0, len(quaternion), BLOCK):
        rows = slice(begin, min(begin + BLOCK, len(quaternion)))
        columns = np.hstack([quaternion_to_angles(quaternion[rows]), bias[rows].astype(np.float64)])
        named = dict(zip((*angles, *biases), np.degrees(columns).T, strict=True))
        bins.add(clock(rows), named, at_rest=rest[rows])
    draw_lines(axes[0], bins, {name: name for name in angles}, "angle", "deg", wraps=True)
    for each in axes[1:]:
        draw_lines(each, bins, {name: name for name in biases}, "gyro bias", "deg/s")
    for i, each in enumerate(axes):
        draw_rest(each, bins)
        draw_legend(each, without=[REST] if i else [])
    axes[-1].set_xlabel(label)
    return figure_of(axes)


def result(path: str | Path, *, ax: AxesLike | None = None) -> Figure:
    r"""Draw what ``compfilt run`` wrote: a panel for each kind of column, rest as shaded spans, flags as a rug.

    The horizontal axis is the column ``t`` or ``time`` if it was kept, otherwise the number of the row. Units are those that
    the file tells: a Parquet file does, a CSV does not. Needs the extra ``logs`` as well.

    The file is read once, in little memory whatever its length. Of long results the least and the greatest value of each
    of some thousand stretches are drawn, and every stretch with a flag, a rest or a missing value is marked: nothing
    that lasts one sample is lost.

    Parameters
    ----------
    path
        A CSV or Parquet file, or any other that recipes can read.
    ax : Axes or several of them, optional
        Where to draw, one for each panel. A new figure where it is left out.

    Returns
    -------
    Figure
        What was drawn on. A new one is shown by no window; its ``savefig`` writes it.

    Raises
    ------
    ValueError
        There are not as many axes as panels.
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
    from compfilt.logs.results import open_result  # noqa: PLC0415 - the other pictures do not need Arrow

    with open_result(path) as found:
        bins = Bins(name for group in found.groups for name in group.columns)
        for block in found.blocks:
            bins.add(block.time, block.columns, at_rest=block.at_rest, flags=block.flags)
    heights = [2.2] * len(found.groups)
    if found.has_flags or not heights:
        heights.append(0.4 + 0.2 * max(len(set_flags(bins.flags)), 1))
    axes = _stacked(heights) if ax is None else axes_for(ax, [len(heights)])
    for each, group in zip(axes, found.groups, strict=False):
        names = {name: name for name in group.columns}
        draw_lines(each, bins, names, group.title, group.unit, wraps=group.title == "angle")
    if len(heights) > len(found.groups):
        draw_flags(axes[-1], bins)
    for i, each in enumerate(axes):
        draw_rest(each, bins)
        draw_legend(each, without=[REST] if i else [])
    axes[-1].set_xlabel(with_unit(found.time_name, found.time_unit))
    return figure_of(axes)


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
    target = Path(path).with_suffix(".png") if out is None else Path(out)
    check_file(target, force=force)
    write(result(path), target)
    return target


def _clock(samples: int, fs: float | None, t: npt.ArrayLike | None) -> tuple[Callable[[slice], Array], str]:
    """Return what tells the time of some of the rows, and its label."""
    if fs is not None and t is not None:
        raise ValueError("give fs in Hz or t in seconds, not both")
    if t is not None:
        times = np.asarray(t, np.float64)
        if times.shape != (samples,):
            raise ValueError(f"t must have the shape ({samples},), got {times.shape}")
        return times.__getitem__, "time / s"
    period = 1.0 if fs is None else 1.0 / fs
    label = "sample" if fs is None else "time / s"
    return lambda rows: np.arange(rows.start, rows.stop) * period, label


def _stacked(heights: list[float]) -> list[Axes]:
    """Make panels of these heights on a figure that no window shows: many may be written in one go."""
    figure = Figure(figsize=(10.0, 0.8 + sum(heights)), layout="constrained")
    axes = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)
    return list(axes[:, 0])
