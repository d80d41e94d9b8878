"""What every kind of filter has in common for the pipeline: signals in, a stream, columns out."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from compfilt.logs.designs import Design
from compfilt.logs.outputs import Offer, Output
from compfilt.logs.signals import Signal
from compfilt.logs.units import Dimension, Unit

__all__ = ["Filter"]

Values = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Filter(ABC):
    """The filter of a recipe: which signals it reads, how it is made, and what it offers.

    Attributes
    ----------
    kind : str
        As the recipe names it.
    has_state : bool
        Whether a sample's result depends on the samples before it. One without state needs no time, and has no use for
        `hold`.
    gives_gravity : bool
        Whether gravity is among its results, which has a unit of its own.
    """

    kind: str

    has_state: ClassVar[bool] = True
    gives_gravity: ClassVar[bool] = False

    @property
    @abstractmethod
    def signals(self) -> tuple[Signal, ...]:
        """What it reads from the log."""

    @property
    @abstractmethod
    def dimension(self) -> Dimension:
        """What the output's unit must measure."""

    @property
    def default_unit(self) -> Unit | None:
        """The output's unit where the recipe names none; ``None`` if it must."""
        return None

    @property
    def title(self) -> str:
        """What it is, for messages, in the words of the recipe."""
        return f'kind = "{self.kind}"'

    @property
    def linear(self) -> Design | None:
        """The linear design whose gains it has; ``None`` if it has none."""
        return getattr(self, "design", None)

    def with_design(self, design: Design) -> "Filter":
        """Return the same filter with another linear design; for one that has a design."""
        return replace(self, design=design)  # type: ignore[call-arg]  # of those that have one

    @abstractmethod
    def start(self, fs: float | None, dtype: npt.DTypeLike, **policy: Any) -> Any:  # noqa: ANN401 - any stream
        """Make a stream: ``estimate(*arguments, t=...)`` runs it over a block, ``reset()`` starts it anew.

        Parameters
        ----------
        fs
            The sample rate in Hz; ``None`` where the log has a column of times, which go in as `t`.
        dtype
            That of the arithmetic.
        **policy
            ``missing`` and ``hold``, as the streams of the library take them.

        Raises
        ------
        ValueError, TypeError
            The library refuses what the recipe asks for.
        """

    def arguments(self, values: Sequence[Values]) -> tuple[Values, ...]:
        """Bring the signals, in the order of `signals`, into the order and shape that the stream takes."""
        return tuple(values)

    @abstractmethod
    def offer(self, estimate: Any, output: Output) -> Offer:  # noqa: ANN401 - any estimate
        """List the columns that a recipe can ask for.

        Parameters
        ----------
        estimate
            One of the stream's, of any length: it shows what the filter has.
        output
            Has the units.
        """
