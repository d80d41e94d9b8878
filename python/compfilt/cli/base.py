"""What every command has: plain text, one line for what goes wrong, an exit status."""

import contextlib
import sys
from collections.abc import Iterator
from typing import Annotated

import typer
from tqdm import tqdm  # type: ignore[import-untyped]

from compfilt.logs.errors import LogError, UsageError

__all__ = ["Force", "app", "group", "one_line", "say"]


def group(text: str) -> typer.Typer:
    """Make a group of commands in plain text: what a tool in a pipeline says is one line for one thing."""
    return typer.Typer(
        help=text,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )


app = group("Complementary filters for logs.")

Force = Annotated[bool, typer.Option("--force", help="Replace a result that is already there.")]


def say(message: str) -> None:
    """Write one line to stderr, above the progress bar if there is one."""
    tqdm.write(f"compfilt: {message}", file=sys.stderr)


@contextlib.contextmanager
def one_line(after_stop: str = "") -> Iterator[None]:
    """Turn what can go wrong into one line and an exit status; `after_stop` says what to do after Ctrl-C."""
    try:
        yield
    except UsageError as error:
        say(str(error))
        raise typer.Exit(2) from None
    except LogError as error:
        say(str(error))
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        say("interrupted" + (f"; {after_stop}" if after_stop else ""))
        raise typer.Exit(130) from None
