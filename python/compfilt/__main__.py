"""The command `compfilt`, and ``python -m compfilt``."""

import os
import sys

__all__ = ["main"]

EXTRA = ("pyarrow", "tomli", "tqdm", "typer")
"""What the command line needs beside the library itself."""


def main() -> int:
    """Run the command line.

    Returns
    -------
    int
        0 if all went well, 1 if a log failed, 2 if the command cannot be carried out as it was given, 130 after
        Ctrl-C. No failure shows a traceback, unless the environment has ``COMPFILT_TRACEBACK=1``.
    """
    try:
        return _run()
    except KeyboardInterrupt:
        return _say("interrupted", 130)
    except Exception as error:
        if os.environ.get("COMPFILT_TRACEBACK") == "1":
            raise
        kind = type(error).__name__
        return _say(f"unexpected {kind}: {error} (COMPFILT_TRACEBACK=1 shows where)".replace("\n", " "), 1)


def _run() -> int:
    try:
        from compfilt.cli import run_app  # noqa: PLC0415 - numpy alone does not make a command line
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in EXTRA:
            raise
        return _say("the command line needs the extra \"logs\": pip install 'compfilt[logs]'", 2)
    return run_app()


def _say(message: str, status: int) -> int:
    print(f"compfilt: {message}", file=sys.stderr)  # noqa: T201
    return status


if __name__ == "__main__":
    sys.exit(main())
