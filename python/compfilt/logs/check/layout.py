"""How a text log is laid out: what separates its fields, whether its columns have names, whether its numbers have commas."""

import csv
import re
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from compfilt.logs.check.lines import toml_text
from compfilt.logs.check.report import Finding
from compfilt.logs.errors import quoted
from compfilt.logs.readers import first_lines
from compfilt.logs.readers.text import MISSING, usual_separator

__all__ = ["Layout", "find_layout"]

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", " ": "spaces"}
SEEN = 30
"""Lines that are looked at."""
NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*|\s*[-+]?(nan|inf)\s*", re.IGNORECASE)
COMMA_NUMBER = re.compile(r"\s*[-+]?\d+,\d+([eE][-+]?\d+)?\s*")


class Layout(NamedTuple):
    """How a log is laid out.

    Attributes
    ----------
    separator
        What separates the fields, where the file's ending does not tell it.
    findings
        What a recipe must say about it, or what keeps the log from being read.
    """

    separator: str | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def readable(self) -> bool:
        """Whether a recipe can make sense of the log as it stands."""
        return all(finding.level != "wrong" for finding in self.findings)


def find_layout(path: str | Path) -> Layout:
    """Look at the first lines of a text; any other log tells its columns itself.

    Raises
    ------
    LogError
        The log cannot be read.
    """
    numbered = first_lines(path, SEEN)
    if numbered is None or len(numbered) < 2:
        return Layout()
    numbers, lines = list(numbered), list(numbered.values())
    usual = usual_separator(Path(path))
    separator = _separator(lines, usual)
    rows = [_fields(line, separator) for line in lines]
    blocking = _in_the_way(str(path), numbers, rows, separator)
    if separator == usual:
        return Layout(None, blocking)
    told = Finding(
        "separator",
        "note",
        f"the fields are separated by {SEPARATORS[separator]}, which a recipe must say",
        f"split so, the first line has {len(rows[0])} names, and {len(_fields(lines[0], usual))} otherwise",
        f"separator = {toml_text(separator)}  # in [log]",
    )
    return Layout(separator, (*blocking, told))


def _separator(lines: Sequence[str], usual: str) -> str:
    """Choose what the first line and all that follow are made of, if it is not the usual one."""
    if len(_fields(lines[0], usual)) > 1:
        return usual
    for candidate in SEPARATORS:
        counts = {len(_fields(line, candidate)) for line in lines}
        if len(counts) == 1 and counts != {1}:
            return candidate
    return usual


def _fields(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator))
    except (csv.Error, StopIteration):
        return [line]


def _in_the_way(path: str, numbers: list[int], rows: list[list[str]], separator: str) -> tuple[Finding, ...]:
    """Find what must be changed in the log itself, if anything; `numbers` are those of the lines, some of which are empty."""
    before = _lines_before_names(rows, separator)
    if before:
        what = "the names of the columns are not in the first line"
        place = numbers[before]
        evidence = f"line {numbers[0]} is {quoted(separator.join(rows[0]))}, and the names seem to be in line {place}"
        found = Finding("header", "wrong", what, evidence, f"tail -n +{place} LOG > NEW")
    elif _all_numbers(rows[0], separator):
        names = "t,gx,gy,gz,ax,ay,az".replace(",", separator)
        what = "the first row is numbers: is the header missing?"
        evidence = f"the first column would be called {quoted(rows[0][0])}; put the names of your columns before it, in their order"
        found = Finding("header", "wrong", what, evidence, f"(echo '{names}'; cat LOG) > NEW")
    elif len(rows) > 2 and _only_words(rows[1], separator) and _all_numbers(rows[2], separator):
        what = f"line {numbers[1]} holds no number: is it a second line of the header?"
        evidence = f"it begins with {quoted(rows[1][0])}, and line {numbers[2]} holds numbers"
        found = Finding("header", "wrong", what, evidence, f"sed {numbers[1]}d LOG > NEW")
    elif comma := _decimal_comma(rows[1:]):
        what = "the numbers have decimal commas, and only points are read"
        # Between commas the fields are in quotes, and no simple command tells the ones from the others.
        fix = "tr , . < LOG > NEW" if separator != "," else ""
        found = Finding("decimal commas", "wrong", what, f"a field is {quoted(comma)}", fix)
    else:
        return ()
    if not found.fix or path.endswith((".gz", ".zst")):
        return (replace(found, fix=""),)
    fix = found.fix.replace("LOG", shlex.quote(path)) + "  # makes a copy, in a shell"
    return (replace(found, fix=fix),)


def _lines_before_names(rows: list[list[str]], separator: str) -> int:
    """Count what comes before the first line with as many fields as most have, if that one holds names."""
    usual = Counter(map(len, rows)).most_common(1)[0][0]
    before = next(number for number, row in enumerate(rows) if len(row) == usual)
    return before if not _any_number(rows[before], separator) else 0


def _decimal_comma(rows: list[list[str]]) -> str:
    """Return a field that is a number with a comma, if there is one and none with a point."""
    fields = [field for row in rows for field in row]
    if any("." in field and NUMBER.fullmatch(field) for field in fields):
        return ""
    return next((field for field in fields if COMMA_NUMBER.fullmatch(field)), "")


def _all_numbers(row: list[str], separator: str) -> bool:
    filled = [field for field in row if field.strip()]
    return bool(filled) and all(_is_number(field, separator) for field in filled)


def _only_words(row: list[str], separator: str) -> bool:
    """Tell whether a row has words and no number; a sample of which all is missing has neither."""
    return not _any_number(row, separator) and any(field.strip() not in MISSING for field in row)


def _any_number(row: list[str], separator: str) -> bool:
    return any(_is_number(field, separator) for field in row)


def _is_number(field: str, separator: str) -> bool:
    return bool(NUMBER.fullmatch(field) or (separator != "," and COMMA_NUMBER.fullmatch(field)))
