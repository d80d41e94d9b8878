"""The ways in which work on logs fails, each with a message of one line."""

__all__ = ["LogError", "RecipeError", "TruncatedLog", "UsageError"]


class UsageError(Exception):
    """The command cannot be carried out as it was given; nothing was read or written."""


class RecipeError(UsageError):
    """A recipe is wrong; the message names the file, the key and the rule."""


class LogError(Exception):
    """One log cannot be filtered; the message names the row or the column, not the file."""


class TruncatedLog(LogError):  # noqa: N818 - what the log is, not what went wrong in the program
    """A log can be read up to some row only; what comes before that row was read.

    Attributes
    ----------
    rows : int
        How many rows were read.
    """

    def __init__(self, rows: int, why: str) -> None:
        super().__init__(f"the log cannot be read from row {rows + 1} on: {why}")
        self.rows = rows
        self._why = why

    def __reduce__(self) -> tuple[type["TruncatedLog"], tuple[int, str]]:
        return TruncatedLog, (self.rows, self._why)
