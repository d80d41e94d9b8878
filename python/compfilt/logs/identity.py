"""What a result is made from, so that it is known whether a draft or a result belongs to a recipe and a log."""

import hashlib
from pathlib import Path
from typing import Any

import compfilt
from compfilt.logs.recipe import Recipe

__all__ = ["describe"]

HEAD = 1 << 16
"""How many of a file's first bytes are looked at."""


def describe(recipe: Recipe, log: Path) -> dict[str, Any]:
    """Describe the program, the recipe and the log by what does not change when they are copied.

    The log is known by its size and its beginning: to read all of it would take about as long as to filter it.
    """
    digest, size = hashlib.sha256(), 0
    # Some logs are folders.
    for path in sorted(log.rglob("*")) if log.is_dir() else [log]:
        if path.is_file():
            with path.open("rb") as file:
                digest.update(file.read(HEAD))
            size += path.stat().st_size
    return {
        "version": compfilt.__version__,
        "recipe": recipe.digest,
        "log": {"bytes": size, "sha256_of_head": digest.hexdigest()},
    }
