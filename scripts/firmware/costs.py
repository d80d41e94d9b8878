"""The table of costs in docs/firmware-costs.md: written, read back, and compared with what was measured."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "firmware-costs.md"
BEGIN, END = "<!-- measured -->", "<!-- end of what was measured -->"
COLUMNS = (
    "state",
    *("M4F instructions", "M4F most", "M4F stack", "M4F code"),
    *("M0 instructions", "M0 most", "M0 stack", "M0 code"),
)
# The packaged compiler can advance: a count may be off by a tenth and a few.
SHARE, FEW = 0.10, 8

Row = tuple[int, ...]


def table(rows: dict[str, Row]) -> str:
    """The rows in Markdown."""
    head = f"| filter | {' | '.join(COLUMNS)} |"
    rule = f"| --- |{' --: |' * len(COLUMNS)}"
    lines = [f"| {name.replace('_', ' ')} | {' | '.join(map(str, row))} |" for name, row in rows.items()]
    return "\n".join([head, rule, *lines])


def split(page: str) -> tuple[str, str, str]:
    """The page before the table, the table, the page after it."""
    before, rest = page.split(BEGIN)
    middle, after = rest.split(END)
    return before, middle, after


def write(rows: dict[str, Row], made_with: str) -> None:
    """Puts the table into the page."""
    before, _, after = split(PAGE.read_text(encoding="utf-8"))
    middle = f"{BEGIN}\n\n{table(rows)}\n\n{made_with}\n\n{END}"
    PAGE.write_text(before + middle + after, encoding="utf-8")


def read() -> dict[str, Row]:
    """The rows of the page."""
    _, middle, _ = split(PAGE.read_text(encoding="utf-8"))
    rows = re.findall(r"^\| (.+?) \|((?: \d+ \|)+)$", middle, re.MULTILINE)
    return {name.replace(" ", "_"): tuple(map(int, cells.split("|")[:-1])) for name, cells in rows}


def complaints(budgets: dict[str, Row], measured: dict[str, Row]) -> list[str]:
    """A sentence for every cost above its budget, and for every filter that has none or is gone."""
    found = [f"{name} is not on the page" for name in measured if name not in budgets]
    found += [f"{name} is on the page and was not measured" for name in budgets if name not in measured]
    for name in measured.keys() & budgets.keys():
        for column, cost, budget in zip(COLUMNS, measured[name], budgets[name], strict=True):
            if cost > budget * (1 + SHARE) + FEW:
                found.append(f"{name}, {column}: {cost} where the page has {budget}")
    return sorted(found)
