"""A report as plain numbers."""

from typing import Any

from compfilt.noise.channel import ChannelNoise
from compfilt.noise.fit import TERMS, AllanFit
from compfilt.noise.lines import Line
from compfilt.noise.motors import Vibration
from compfilt.noise.report import NoiseReport
from compfilt.noise.units import ONE_SIDED, SHEETS, Quantity, Sheet

__all__ = ["report_as_json"]


def report_as_json(report: NoiseReport) -> dict[str, Any]:
    """Return a report as what JSON can hold; values in SI, `data_sheet` in the unit that it names."""
    return {
        "rate": report.fs,
        "duration": report.duration,
        "gravity": report.gravity,
        "densities": report.densities()._asdict(),
        "channels": [_channel(channel) for channel in report.channels],
        "motors": [_vibration(vibration) for vibration in report.motors],
        "notes": list(report.notes),
    }


def _channel(channel: ChannelNoise) -> dict[str, Any]:
    sheet = SHEETS[channel.unit]
    curve = channel.curve
    return {
        "name": channel.name,
        "unit": channel.unit,
        "mean": channel.mean,
        "std": channel.std,
        "resolution": channel.step,
        "density": {
            "two_sided": channel.density,
            "one_sided": ONE_SIDED * channel.density,
            "upper_half_of_spectrum": channel.white,
            "data_sheet": {"value": channel.density * sheet.density.factor, "unit": sheet.density.unit},
        },
        "fit": None if channel.fit is None else _fit(channel.fit, sheet),
        "allan": None
        if curve is None
        else {"tau": curve.tau.tolist(), "deviation": curve.deviation.tolist()},
        "lines": _lines(channel.lines),
        "notes": list(channel.notes),
    }


def _fit(fit: AllanFit, sheet: Sheet) -> dict[str, Any]:
    terms = {name: _term(fit, name, sheet.terms[name]) for name in TERMS}
    return {
        **terms,
        "level": fit.level,
        "shortest_averaging_time": fit.shortest,
        "consistent": fit.consistent,
    }


def _term(fit: AllanFit, name: str, quantity: Quantity) -> dict[str, Any]:
    fitted = getattr(fit, name)
    if fitted is None:
        below = fit.upper[name]
        return {
            "value": None,
            "below": below,
            "data_sheet": {"below": below * quantity.factor, "unit": quantity.unit},
        }
    sheet = {key: value * quantity.factor for key, value in fitted._asdict().items()}
    return {**fitted._asdict(), "data_sheet": {**sheet, "unit": quantity.unit}}


def _vibration(vibration: Vibration) -> dict[str, Any]:
    return {
        "name": vibration.name,
        "unit": vibration.unit,
        "rms": vibration.rms,
        "slow_density": vibration.slow_density,
        "slow_ratio": vibration.slow_ratio,
        "bias_change": vibration.bias_change,
        "lines": _lines(vibration.lines),
    }


def _lines(lines: tuple[Line, ...]) -> list[dict[str, float]]:
    return [line._asdict() for line in lines]
