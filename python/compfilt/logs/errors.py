"""The three ways in which work on logs fails, each with a message of one line."""

__all__ = ["LogError", "RecipeError", "UsageError"]


class UsageError(Exception):
    """The command cannot be carried out as it was given; nothing was read or written."""


class RecipeError(UsageError):
    """A recipe is wrong; the message names the file, the key and the rule."""


class LogError(Exception):
    """One log cannot be filtered; the message names the row or the column, not the file."""
