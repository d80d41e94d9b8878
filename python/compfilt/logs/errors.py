"""The ways in which work on logs fails, each with a message of one line."""

__all__ = ["LogError", "RecipeError", "TruncatedLog", "UsageError", "printable", "quoted"]

LONGEST_NAME = 100
"""How much of a name or a value a message shows: a damaged file may have one of a megabyte."""


class UsageError(Exception):
    """The command cannot be carried out as it was given; nothing was read or written."""

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


class RecipeError(UsageError):
    """A recipe is wrong; the message names the file, the key and the rule."""


class LogError(Exception):
    """One log cannot be filtered; the message names the row or the column, not the file.

    Whatever stands in a log may get into the message: line breaks and control characters are escaped in it.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


class TruncatedLog(LogError):  # noqa: N818 - it says what the log is
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


def quoted(name: str) -> str:
    """Put a name or a value that stands in a log into quotes, for a message."""
    shown = name if len(name) <= LONGEST_NAME else name[:LONGEST_NAME] + "..."
    return '"' + printable(shown.replace("\\", "\\\\").replace('"', '\\"')) + '"'


def printable(text: str) -> str:
    """Escape what would start a new line, or steer a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
