"""What is wrong with a row of a log."""

from enum import IntFlag

__all__ = ["FAULTS", "Faults", "names_of"]

FAULTS = "faults"
"""The output column that says what was wrong with each row of the log; it has no unit."""


class Faults(IntFlag):
    """What is wrong with a row of a log: a set of bits in the output column "faults".

    The column "flags" says what the filter did about it.

    Attributes
    ----------
    MISSING
        A channel has no number.
    INFINITE
        A channel is infinite.
    STUCK
        A channel has had the same value for too long.
    CLIPPED
        A channel is at the end of its range.
    DUPLICATE
        The time is that of the row before.
    BACKWARDS
        The time lies before that of an earlier row.
    GAP
        The row comes after a gap.

    Examples
    --------
    >>> Faults(5)
    <Faults.MISSING|STUCK: 5>
    """

    MISSING = 1
    INFINITE = 2
    STUCK = 4
    CLIPPED = 8
    DUPLICATE = 16
    BACKWARDS = 32
    GAP = 64


def names_of(kind: type[IntFlag]) -> list[str]:
    """Return the names of the flags in small letters, in the order of their bits."""
    return [name.lower() for name in kind.__members__]
