"""The picture of a report: spectra and Allan deviations of both sensors. Needs the extra ``plot`` as well."""

from importlib import import_module
from pathlib import Path
from typing import Any

from compfilt.logs.errors import UsageError
from compfilt.noise.channel import ChannelNoise
from compfilt.noise.curves import Spectrum
from compfilt.noise.motors import Vibration
from compfilt.noise.report import NoiseReport

__all__ = ["check_picture", "draw", "save_picture"]


def draw(report: NoiseReport) -> Any:  # noqa: ANN401 - a figure of matplotlib
    """Draw the spectra and the Allan deviations with their fits; gyro above, accelerometer below.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure  # noqa: PLC0415

    plot = import_module("compfilt.plot")
    figure = Figure(figsize=(15.0, 8.0), layout="constrained")
    axes = figure.subplots(2, 2)
    for row, sensor in zip(axes, (report.gyro, report.accelerometer), strict=True):
        names = {channel.name for channel in sensor}
        running = [vibration for vibration in report.motors if vibration.name in names]
        for name, spectrum in _spectra(sensor, running):
            plot.spectrum(spectrum, label=name, unit=sensor[0].unit, ax=row[0])
        for channel in sensor:
            if channel.curve is not None:
                plot.allan(channel.curve, channel.fit, label=channel.name, unit=channel.unit, ax=row[1])
    return figure


def _spectra(sensor: tuple[ChannelNoise, ...], running: list[Vibration]) -> list[tuple[str, Spectrum]]:
    at_rest = [(channel.name, channel.spectrum) for channel in sensor]
    return at_rest + [(f"{vibration.name}, motors", vibration.spectrum) for vibration in running]


def check_picture(path: Path, *, force: bool) -> None:
    """Check that a picture can be written, before anything else is done.

    Raises
    ------
    UsageError
        It is already there, there is no folder for it, its ending is not known, or matplotlib is missing.
    """
    try:
        files = import_module("compfilt.plot.files")
    except ModuleNotFoundError as error:
        raise UsageError(str(error)) from None
    files.check_file(path, force=force)


def save_picture(report: NoiseReport, path: Path) -> None:
    """Draw a report into a file that is either complete or not there."""
    import_module("compfilt.plot.files").write(draw(report), path)
