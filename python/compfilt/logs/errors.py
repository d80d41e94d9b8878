"""The ways in which work on logs fails, each with a message of one line."""

__all__ = [
    "LogError",
    "RecipeError",
    "RowError",
    "TruncatedLog",
    "UsageError",
    "place_of",
    "printable",
    "quoted",
]

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


class RowError(LogError):
    """A sample of a log is wrong, and the policy is to fail.

    Attributes
    ----------
    row : int
        Its number, counted from 1.
    """

    def __init__(self, row: int, message: str) -> None:
        super().__init__(message)
        self.row = row

    def in_text(self) -> LogError:
        """Return the same for a text, whose users count lines: the message begins with the row."""
        rest = str(self).removeprefix(place_of(self.row, text=False))
        return LogError(f"{place_of(self.row, text=True)}{rest}")

    def __reduce__(self) -> tuple[type["RowError"], tuple[int, str]]:
        return RowError, (self.row, str(self))


class TruncatedLog(LogError):  # noqa: N818 - it says what the log is
    """A log can be read up to some row only; what comes before that row was read.

    Attributes
    ----------
    rows : int
        How many rows were read.
    """

    def __init__(self, rows: int, why: str, text: bool = False) -> None:
        super().__init__(f"the log cannot be read from {place_of(rows + 1, text=text)} on: {why}")
        self.rows = rows
        self._why = why
        self._text = text

    def __reduce__(self) -> tuple[type["TruncatedLog"], tuple[int, str, bool]]:
        return TruncatedLog, (self.rows, self._why, self._text)


def place_of(row: int, *, text: bool) -> str:
    """Say where a sample stands, counted from 1: its row; in a text its line, which has the header before it."""
    return f"line {row + 1}" if text else f"row {row}"


def quoted(name: str) -> str:
    """Put a name or a value that stands in a log into quotes, for a message."""
    shown = name if len(name) <= LONGEST_NAME else name[:LONGEST_NAME] + "..."
    return '"' + printable(shown.replace("\\", "\\\\").replace('"', '\\"')) + '"'


def printable(text: str) -> str:
    """Escape what would start a new line, or steer a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
