"""The kinds of filter that a recipe can name, one file a family."""

from collections.abc import Callable, Mapping

from compfilt.logs import designs
from compfilt.logs.kinds.array import parse_array
from compfilt.logs.kinds.attitude import parse_attitude
from compfilt.logs.kinds.base import Filter
from compfilt.logs.kinds.cube import parse_cube
from compfilt.logs.kinds.linear import parse_linear
from compfilt.logs.kinds.tilt import parse_tilt
from compfilt.logs.table import Table

__all__ = ["KINDS", "Filter"]

KINDS: Mapping[str, Callable[[Table, Table], Filter]] = {
    **dict.fromkeys(designs.KINDS, parse_linear),
    "tilt": parse_tilt,
    "cube": parse_cube,
    "array": parse_array,
    "attitude": parse_attitude,
}
"""For each kind, what reads its part of the tables [log] and [filter]."""
