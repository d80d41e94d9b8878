"""What is exported: a filter at a sample rate, and how its numbers are written."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

import compfilt
from compfilt.logs.errors import RecipeError, UsageError, printable
from compfilt.logs.kinds.attitude import Attitude
from compfilt.logs.kinds.linear import Linear
from compfilt.logs.kinds.tilt import Tilt, angle_names
from compfilt.logs.recipe import Recipe

__all__ = ["Number", "Subject", "numbers"]

KEYWORDS = frozenset(
    """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while alignas alignof
    bool constexpr false nullptr static_assert thread_local true typeof typeof_unqual
    abstract as async await become box crate dyn final fn gen impl in let loop macro match mod move mut override priv
    pub ref self super trait try type unsafe unsized use virtual where yield
    and and_eq asm bitand bitor catch class compl concept delete explicit export friend main mutable namespace new not
    not_eq operator or or_eq private protected public requires template this throw typeid typename using xor xor_eq
    """.split()  # noqa: SIM905 - a hundred words are read more easily than a hundred strings
)
"""The words of C, of Rust and of C++ (whose sources include the header) that cannot name anything."""


_BY_HAND = {"cube": "compfilt_core::Cube", "array": "compfilt_core::AccelerometerArray"}
"""The kinds that are not exported, and what the core has for them."""


@dataclass(frozen=True)
class Number:
    """A number as a chip has it, float32."""

    value: np.float32

    @property
    def bits(self) -> str:
        """Its bits in hexadecimal digits."""
        return f"0x{int(self.value.view(np.uint32)):08x}"

    @property
    def decimal(self) -> str:
        """The shortest decimal that is read as this number."""
        return str(self.value)


def numbers(values: npt.ArrayLike) -> list[Number]:
    """Round numbers to float32, as the core rounds parameters."""
    return [Number(value) for value in np.atleast_1d(np.asarray(values, np.float64).astype(np.float32))]


@dataclass(frozen=True)
class Subject:
    """A recipe's filter at a sample rate.

    Attributes
    ----------
    filter
        As the recipe has it.
    design
        The object of the library: a linear design, or an attitude filter.
    fs
        In Hz.
    hold
        How long in s a missing derivative or gyro is bridged.
    source
        The recipe's file, without folders.
    """

    filter: Linear | Tilt | Attitude
    design: Any
    fs: float
    hold: float
    source: str

    @classmethod
    def of(cls, recipe: Recipe, fs: float | None) -> "Subject":
        """Build the filter, and refuse what a chip cannot have."""
        filter_ = recipe.filter
        if not isinstance(filter_, (Linear, Tilt, Attitude)):
            raise UsageError(
                f'{recipe.source}: a filter of kind = "{filter_.kind}" cannot be exported: '
                f"for a chip write it in Rust, with {_BY_HAND[filter_.kind]}"
            )
        fs = recipe.clock.rate if fs is None else fs
        if fs is None:
            raise UsageError(
                f"{recipe.source}: the log's times are in a column: give the chip's sample rate in Hz with --fs"
            )
        if filter_.stream.get("delay", 0.0):
            raise UsageError(
                f"{recipe.source}: [filter] delay cannot be exported: it takes a store of past estimates; "
                "leave it out, or write it in Rust, with compfilt_core::History"
            )
        if isinstance(filter_, Tilt) and filter_.structure.get("rates", "output") != "output":
            raise UsageError(
                f'{recipe.source}: [filter] rates = "frozen" cannot be exported: it is for logs; leave rates and '
                "at out, and the gyro is turned at the filter's own output"
            )
        hold = 0.1 if recipe.policy.hold is None else recipe.policy.hold
        try:
            # The same checks as for a log, at this rate.
            filter_.start(fs, np.float32, hold=hold)
            parts = filter_.method if isinstance(filter_, Attitude) else filter_.design
            # The name stands in a comment: a line break in it must not end that, and be code.
            return cls(filter_, parts.build(), fs, hold, printable(Path(recipe.source).name))
        except (ValueError, TypeError) as error:
            raise RecipeError(f"{recipe.source}: [filter] {error}") from None

    @property
    def name(self) -> str:
        """An identifier made from the recipe's name."""
        stem = re.sub(r"\W+", "_", Path(self.source).stem.lower(), flags=re.ASCII).strip("_") or "recipe"
        return f"recipe_{stem}" if stem[0].isdigit() or stem in KEYWORDS else stem

    @property
    def heading(self) -> list[str]:
        """What stands at the top: where it comes from, what it is."""
        period = numbers(1.0)[0].value / np.float32(self.fs)
        lines = [
            f"Written by compfilt {compfilt.__version__} from {self.source}: do not change it by hand.",
            f"{self.title}, sample rate {self.fs:g} Hz, sample period {Number(period).decimal} s.",
            "Signals in SI units: rad, rad/s, m/s^2; float32 (binary32) throughout.",
        ]
        lines += [
            f"The recipe multiplies {signal.name} by {', '.join(f'{factor:g}' for factor in signal.scale)}: "
            "so must the chip, before the filter."
            for signal in self.filter.signals
            if set(signal.scale) != {1.0}
        ]
        if isinstance(self.filter, Tilt):
            angles = " and ".join(angle_names(self.axes))
            lines.append(
                f"Gyro and accelerometer in the recipe's axes, {self.axes}; the angles are {angles}."
            )
        if isinstance(self.filter, Attitude) and self.filter.axes == "frd":
            lines.append(
                "The filter's axes are forward, left, up: change the sign of y and z of the recipe's frd."
            )
        if "initial" in self.filter.stream:
            lines.append(f"The recipe starts at {self.filter.stream['initial']}: start the state there.")
        return lines

    @property
    def title(self) -> str:
        """The filter as Python writes it."""
        if isinstance(self.filter, Tilt):
            return f"TiltFilter({self.design!r}, axes={self.axes!r})"
        return repr(self.design)

    @property
    def axes(self) -> str:
        """The body's axes, of a tilt filter."""
        return str(cast("Tilt", self.filter).structure["axes"])

    @property
    def rule(self) -> str:
        """How the gains are made."""
        return str(self.filter.stream.get("rule", "backward_euler"))

    def gains(self) -> dict[str, list[Number]]:
        """Return the numbers of a linear design's gains, as the core has them."""
        parts = self.design._gains(self.fs, rule=self.rule)  # noqa: SLF001 - the library's own
        return {name: numbers(values) for name, values in cast("dict[str, Any]", parts).items()}

    def refuse(self, reason: str) -> UsageError:
        """Say why a language does not have it."""
        return UsageError(f"{self.source}: {self.title} cannot be exported: {reason}")
