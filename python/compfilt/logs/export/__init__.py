"""A recipe's filter as source code for a chip: the numbers that the core runs with, as constants in float32."""

from collections.abc import Callable, Mapping

from compfilt.logs.errors import UsageError
from compfilt.logs.export.c import c_source
from compfilt.logs.export.rust import rust_source
from compfilt.logs.export.subject import Subject
from compfilt.logs.recipe import Recipe

__all__ = ["LANGUAGES", "export_recipe"]

LANGUAGES: Mapping[str, Callable[[Subject], str]] = {"c": c_source, "rust": rust_source}
"""The languages, and what writes them."""


def export_recipe(recipe: Recipe, to: str, *, fs: float | None = None) -> str:
    """Write the filter of a recipe as source code.

    Linear filters become the constants of their gains at the sample rate, tilt filters the same with their axes.
    Attitude filters become a function that makes them from constants, because their gains vary with the time since the
    start. Either way the chip computes in float32 with the bits of ``compfilt run`` on float32 signals in SI units.

    Parameters
    ----------
    recipe
        What was tuned. Columns, units, policies for gaps, and outputs are the log's, and are left out; factors of columns
        stand in a comment, for the chip to apply.
    to
        "c", a header on top of compfilt.h, or "rust", a module on top of compfilt-core.
    fs
        The chip's sample rate in Hz; that of the recipe where it has one.

    Returns
    -------
    str
        The source.

    Raises
    ------
    UsageError
        There is no sample rate, the filter cannot be built at it, or the language has no such filter.

    Examples
    --------
    >>> print(export_recipe(load_recipe("angle.toml"), "c", fs=100.0))  # doctest: +SKIP
    """
    if to not in LANGUAGES:
        raise UsageError(f'"{to}" is no language to export to: it is one of {", ".join(LANGUAGES)}')
    return LANGUAGES[to](Subject.of(recipe, fs))
