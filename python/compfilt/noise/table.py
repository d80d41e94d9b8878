"""A report as text."""

from collections.abc import Iterator, Sequence

from compfilt.noise.channel import ChannelNoise
from compfilt.noise.fit import TERMS
from compfilt.noise.lines import Line
from compfilt.noise.motors import Vibration
from compfilt.noise.report import NoiseReport
from compfilt.noise.units import SHEETS, Quantity

__all__ = ["report_as_table"]

LABEL, CELL = 42, 26
SHOWN = 8
"""Lines of a spectrum that are printed: the strongest."""
FALSE_LINES = "noise alone shows a line in about 1 of 100 channels, so in 1 of 13 logs: believe a weak one if it comes again"
"""Measured; see `find_lines`, whose probability is one of each channel."""


def report_as_table(report: NoiseReport) -> str:
    """Return a report as text of about 110 columns."""
    lines = [f"{report.duration:.6g} s at rest, {report.fs:.6g} Hz", ""]
    for sensor in (report.gyro, report.accelerometer):
        lines += [*_sensor(sensor), ""]
    if report.motors:
        lines += [*_motors(report.motors), ""]
    lines += _densities(report)
    notes = [*report.notes, *_joined(report.channels)]
    if any(channel.lines for channel in report.channels) or any(motor.lines for motor in report.motors):
        notes.append(FALSE_LINES)
    if notes:
        lines += ["", *(f"note: {note}" for note in notes)]
    return "\n".join(lines)


def _sensor(channels: Sequence[ChannelNoise]) -> Iterator[str]:
    sheet = SHEETS[channels[0].unit]
    yield _row("", (channel.name for channel in channels)).rstrip()
    yield _numbers(sheet.mean, [channel.mean for channel in channels])
    if any(channel.step for channel in channels):
        yield _numbers(sheet.step, [channel.step for channel in channels])
    one_sided = sheet.density._replace(title="noise density, one-sided")
    yield _numbers(one_sided, [channel.density for channel in channels])
    for name in TERMS:
        quantity = sheet.terms[name]
        yield _row(_title(quantity), (_term(channel, name, quantity.factor) for channel in channels))
    yield from _spectral_lines([(channel.name, channel.lines) for channel in channels], sheet.line)


def _term(channel: ChannelNoise, name: str, factor: float) -> str:
    """Write a fitted value and its interval, or its bound."""
    if channel.fit is None:
        return "-"
    fitted = getattr(channel.fit, name)
    if fitted is None:
        return f"< {channel.fit.upper[name] * factor:.3g}"
    return f"{fitted.value * factor:.3g} ({fitted.low * factor:.3g} to {fitted.high * factor:.3g})"


def _motors(motors: Sequence[Vibration]) -> Iterator[str]:
    yield "with the motors running:"
    for sensor in (motors[:3], motors[3:]):
        sheet = SHEETS[sensor[0].unit]
        yield _row("", (vibration.name for vibration in sensor)).rstrip()
        vibration_rms = Quantity("vibration, rms", sheet.line.unit, sheet.line.factor)
        yield _numbers(vibration_rms, [vibration.rms for vibration in sensor])
        slow = sheet.density._replace(title="slow density, one-sided")
        yield _numbers(slow, [vibration.slow_density for vibration in sensor])
        yield _row("  times that at rest", (_number(vibration.slow_ratio) for vibration in sensor))
        change = Quantity("bias changes by", sheet.line.unit, sheet.line.factor)
        yield _numbers(change, [vibration.bias_change for vibration in sensor])
        yield from _spectral_lines([(vibration.name, vibration.lines) for vibration in sensor], sheet.line)


def _spectral_lines(found: Sequence[tuple[str, tuple[Line, ...]]], quantity: Quantity) -> Iterator[str]:
    for name, lines in found:
        if not lines:
            continue
        strongest = sorted(sorted(lines, key=lambda line: line.rms)[-SHOWN:])
        shown = ", ".join(f"{line.frequency:.4g} Hz ({line.rms * quantity.factor:.2g})" for line in strongest)
        more = f" and {len(lines) - SHOWN} weaker" if len(lines) > SHOWN else ""
        yield f"  {name}: lines (rms in {quantity.unit}) at {shown}{more}"


def _densities(report: NoiseReport) -> Iterator[str]:
    measurement, derivative, walk = report.densities()
    yield "for gains, two-sided: compfilt.design.from_densities("
    walk_text = f"{walk:.3g}" if walk else "0.0"
    yield f"    measurement={measurement:.3g}, derivative={derivative:.3g}, walk={walk_text})"


def _joined(channels: Sequence[ChannelNoise]) -> Iterator[str]:
    """Give a note that several channels share once."""
    names: dict[str, list[str]] = {}
    for channel in channels:
        for note in channel.notes:
            names.setdefault(note, []).append(channel.name)
    for note, those in names.items():
        yield f"{', '.join(those)}: {note}"


def _numbers(quantity: Quantity, values: Sequence[float | None]) -> str:
    return _row(_title(quantity), (_number(value, quantity.factor) for value in values))


def _number(value: float | None, factor: float = 1.0) -> str:
    return "-" if value is None else f"{value * factor:.3g}"


def _title(quantity: Quantity) -> str:
    return f"  {quantity.title} / {quantity.unit}"


def _row(label: str, cells: Iterator[str] | Sequence[str]) -> str:
    return f"{label:<{LABEL}}" + "".join(f" {cell:<{CELL}}" for cell in cells).rstrip()
