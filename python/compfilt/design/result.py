"""What choosing gains returns: the design, what it will do, and what stands against it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compfilt._core import Butterworth, FirstOrder, LinearFilter, PiForm, SecondOrderInertial, ThirdOrder
from compfilt.design.prediction import Prediction
from compfilt.design.sensitivity import GainSensitivity
from compfilt.design.speed import bias_time, cutoff, settling_time

__all__ = ["Designed"]

CAUSES = {
    "measurement": "noise of the measurement",
    "derivative": "noise of the derivative",
    "walk": "walk of its bias",
    "bias": "constant bias of the derivative",
}


@dataclass(frozen=True)
class Designed:
    """A design and how its gains came about.

    Attributes
    ----------
    design : LinearFilter
        The design, ready to filter.
    prediction : Prediction or None
        The predicted error; None where no noise or no sample rate was given.
    sensitivity : tuple of GainSensitivity
        What a change of each gain does to the predicted error; empty without a prediction.
    warnings : tuple of str
        Where an assumption behind the gains fails, a sentence each.
    measured : tuple of (str, float)
        What was reached on recordings with truth, by `from_recordings`, by name; empty otherwise.
    """

    design: LinearFilter
    prediction: Prediction | None = None
    sensitivity: tuple[GainSensitivity, ...] = ()
    warnings: tuple[str, ...] = ()
    measured: tuple[tuple[str, float], ...] = ()

    def with_warning(self, warning: str) -> "Designed":
        """Return the same with one more warning."""
        return replace(self, warnings=(*self.warnings, warning))

    def parameters(self) -> dict[str, Any]:
        """Return the design as a recipe writes it: "kind" and its parameters, in SI units."""
        return _parameters(self.design)

    def recipe_line(self) -> str:
        """Return the line for the table ``[filter]`` of a recipe, with every digit.

        It is that of the kinds that take a design (``tilt``, ``cube``, ``attitude``). A recipe whose own kind is the
        design's has the same keys directly under ``[filter]``.

        Examples
        --------
        >>> from compfilt.design import from_densities
        >>> from_densities(measurement=0.01, derivative=0.002, kind="first_order").recipe_line()
        'design = { kind = "first_order", tau = 5.0 }'
        """
        parts = (f"{name} = {_toml(value)}" for name, value in self.parameters().items())
        return f"design = {{ {', '.join(parts)} }}"

    def as_json(self) -> dict[str, Any]:
        """Return everything in numbers, lists, texts and None, for ``json.dumps``; None stands for infinity."""
        predicted = self.prediction
        return {
            "design": self.parameters(),
            "gains": list(self.design.coefficients),
            "poles": [[pole.real, pole.imag] for pole in self.design.poles],
            "prediction": None
            if predicted is None
            else {
                "sigma": _finite(predicted.sigma),
                "parts": {name: _finite(part) for name, part in predicted.parts.items()},
                "fs": predicted.fs,
                "rule": predicted.rule,
            },
            "sensitivity": [
                {
                    "gain": each.gain,
                    "value": each.value,
                    "slope": _finite(each.slope),
                    "halved": _finite(each.halved),
                    "doubled": _finite(each.doubled),
                }
                for each in self.sensitivity
            ],
            "measured": {name: _finite(value) for name, value in self.measured},
            "warnings": list(self.warnings),
        }

    def table(self, unit: str = "") -> str:
        """Return everything as text to read; `unit` is that of the measurement."""
        per = f" / {unit}" if unit else ""
        lines = [repr(self.design)]
        lines += [
            f"  k{i} = {gain:.6g} 1/s{'' if i == 1 else f'^{i}'}"
            for i, gain in enumerate(self.design.coefficients, start=1)
        ]
        lines.append("  poles / (rad/s): " + ", ".join(_pole(pole) for pole in _one_of_a_pair(self.design)))
        lines.append("  " + self._speed())
        if self.prediction is not None:
            lines.append(f"predicted error at {self.prediction.fs:g} Hz{per}: {self.prediction.sigma:.4g}")
            lines += [f"  {CAUSES[name]:<32}{part:>12.4g}" for name, part in self.prediction.parts.items()]
        if self.sensitivity:
            lines.append(
                f"  {'if a gain changes':<20}{'halved':>12}{'doubled':>12}{'d ln error / d ln gain':>26}"
            )
            lines += [
                f"  {each.gain:<20}{each.halved:>12.4g}{each.doubled:>12.4g}{each.slope:>26.3f}"
                for each in self.sensitivity
            ]
        lines += [f"{name + per}: {value:.4g}" for name, value in self.measured]
        lines += [f"warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def _speed(self) -> str:
        parts = [
            f"cut-off {cutoff(self.design):.4g} Hz",
            f"settles to 2 % in {settling_time(self.design):.4g} s",
        ]
        if self.design.split == self.design.order > self.design.derivative_order:
            parts.append(f"bias to 10 % in {bias_time(self.design):.4g} s")
        return ", ".join(parts)


def _parameters(design: LinearFilter) -> dict[str, Any]:
    gains = design.coefficients
    split = {} if design.split == design.order else {"split": design.split}
    match design:
        case FirstOrder():
            found: dict[str, Any] = {"kind": "first_order", "tau": design.tau}
        case PiForm():
            found = {"kind": "pi", "kp": design.kp, "ki": design.ki}
        case Butterworth():
            q = {} if design.q == 1.0 else {"q": design.q}
            found = {"kind": "butterworth", "omega0": design.omega0, "order": design.order} | q | split
        case ThirdOrder():
            found = {"kind": "third_order", "k1": gains[0], "k2": gains[1], "k3": gains[2]}
        case SecondOrderInertial() if (
            gains[0] ** 2 < 3.0 * gains[1]
        ):  # 2 with Butterworth poles, 4 with a double one
            found = {"kind": "second_order_inertial", "omega0": float(np.sqrt(gains[1]))}
        case SecondOrderInertial():
            found = {"kind": "second_order_inertial", "tau": 1.0 / float(np.sqrt(gains[1]))}
        case _:
            derivative = {"derivative_order": design.derivative_order}
            found = {"kind": "chain", "coefficients": list(gains)} | derivative | split
    return found


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _one_of_a_pair(design: LinearFilter) -> list[complex]:
    return [pole for pole in design.poles if pole.imag >= 0.0]


def _pole(pole: complex) -> str:
    return f"{pole.real:.4g}" if pole.imag == 0.0 else f"{pole.real:.4g} ± {pole.imag:.4g}j"
