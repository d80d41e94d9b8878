"""The command `compfilt`, and ``python -m compfilt``."""

import os
import sys

__all__ = ["main"]

EXTRAS = {
    "logs": ("the command line", ("pyarrow", "tomli", "tqdm", "typer")),
    "plot": ("a picture", ("matplotlib", "tsdownsample")),
    "design": ("the choice of gains", ("scipy",)),
    "noise": ("an Allan deviation", ("allantools",)),
    "cluster": ("a scheduler", ("dask", "distributed")),
}
"""The extras: what needs them, and what they bring."""


def main() -> int:
    """Run the command line.

    Returns
    -------
    int
        0 if all went well, 1 if a log failed, 2 if the command cannot be carried out as it was given, 130 after
        Ctrl-C. No failure shows a traceback, unless the environment has ``COMPFILT_TRACEBACK=1``.
    """
    try:
        from compfilt.cli import run_app  # noqa: PLC0415 - numpy alone does not make a command line

        return run_app()
    except KeyboardInterrupt:
        return _say("interrupted", 130)
    except Exception as error:
        if isinstance(error, ModuleNotFoundError) and (needs := _needs_extra(error)):
            return _say(needs, 2)
        if os.environ.get("COMPFILT_TRACEBACK") == "1":
            raise
        kind = type(error).__name__
        return _say(f"unexpected {kind}: {error} (COMPFILT_TRACEBACK=1 shows where)".replace("\n", " "), 1)


def _needs_extra(error: ModuleNotFoundError) -> str:
    """Say which extra is missing; nothing if it is none of them."""
    package = (error.name or "").partition(".")[0]
    for extra, (what, packages) in EXTRAS.items():
        if package in packages:
            return f"{what} needs the extra \"{extra}\": pip install 'compfilt[{extra}]'"
    return ""


def _say(message: str, status: int) -> int:
    print(f"compfilt: {message}", file=sys.stderr)  # noqa: T201
    return status


if __name__ == "__main__":
    sys.exit(main())
