"""Pictures as files, each either complete or not there. Needs the extra ``logs`` as well."""

from pathlib import Path

from matplotlib.figure import Figure

__all__ = ["ENDINGS", "check_file", "write"]

ENDINGS = (".png", ".pdf", ".svg")
"""The endings of the files that can be written."""


def check_file(path: Path, *, force: bool) -> None:
    """Check that a picture can be written, before anything else is done.

    Raises
    ------
    compfilt.logs.UsageError
        It is already there, there is no folder for it, or its ending is not known.
    """
    from compfilt.logs.errors import UsageError  # noqa: PLC0415 - pictures do not need Arrow
    from compfilt.logs.writers import check_ending, check_target  # noqa: PLC0415

    check_target(path, force=force)
    check_ending(path, ENDINGS)
    if not path.parent.is_dir():
        raise UsageError(f"{path.parent}: there is no such folder")


def write(figure: Figure, path: Path) -> None:
    """Write a figure into a file that is complete or not there."""
    from compfilt.logs.writers import complete_file  # noqa: PLC0415

    with complete_file(path) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=150)
