"""The command line: one file a command, each a thin face on a function of the library."""

import signal
import sys
from typing import NoReturn

from compfilt.cli import check, design, export, noise, plot, replay, run, simulate
from compfilt.cli.base import app, say

__all__ = ["check", "design", "export", "noise", "plot", "replay", "run", "run_app", "simulate"]


def run_app() -> NoReturn:
    """Run the command line and leave the process with its status."""
    signal.signal(signal.SIGTERM, _terminate)
    app(prog_name="compfilt")
    sys.exit(0)


def _terminate(_signal: int, _frame: object) -> NoReturn:
    """Leave by way of every `finally`, so that no temporary file stays behind."""
    say("terminated")
    sys.exit(128 + signal.SIGTERM)
