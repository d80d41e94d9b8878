"""Instructions per sample of every filter, counted by callgrind and held against the budgets in benches/instructions.toml.

    python scripts/count_instructions.py [--update]

A count does not drift as a time does. Every filter runs for n and for 2n samples; the difference over n leaves out all
that happens once. Exits with 1 where a count is more than 3 % off its budget, above or below: what became faster is to
stay so. Budgets hold for the compiler that they were made with; with another the table is shown, and nothing fails.
"""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[1]
BUDGETS = ROOT / "benches" / "instructions.toml"
TOLERANCE = 0.03
SAMPLES = 4096
UPDATE = "python scripts/count_instructions.py --update"

Key = tuple[str, str]
"""The scalar type and the filter."""


# ---------------------------------------------------------------------------------------------------------- comparison


@dataclass(frozen=True)
class Row:
    """A filter's budget and its count, in instructions per sample; None where there is none."""

    key: Key
    budget: float | None
    count: float | None

    @property
    def deviation(self) -> float | None:
        """The count over the budget, minus 1."""
        if self.budget is None or self.count is None:
            return None
        return self.count / self.budget - 1

    @property
    def verdict(self) -> str:
        """What is wrong; empty where nothing is."""
        if self.budget is None:
            return "has no budget"
        if self.count is None:
            return "is no longer there"
        if abs(self.count - self.budget) <= TOLERANCE * self.budget:
            return ""
        return "over its budget" if self.count > self.budget else "below its budget"


def compare(budgets: dict[Key, float], counts: dict[Key, float]) -> list[Row]:
    """A row for every filter that has a budget, a count or both, in the order of the counts."""
    keys = [*counts, *(key for key in budgets if key not in counts)]
    return [Row(key, budgets.get(key), counts.get(key)) for key in keys]


def table(rows: list[Row]) -> str:
    """The rows in Markdown."""

    def number(value: float | None) -> str:
        return "" if value is None else f"{value:.1f}"

    lines = [
        "| filter | scalar | budget | instructions | deviation | |",
        "| --- | --- | --: | --: | --: | --- |",
    ]
    for row in rows:
        scalar, name = row.key
        deviation = "" if row.deviation is None else f"{row.deviation:+.1%}"
        cells = (name, scalar, number(row.budget), number(row.count), deviation, row.verdict)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def judge(rows: list[Row], budgeted_for: dict[str, str], made_with: dict[str, str]) -> tuple[bool, str]:
    """Whether the check passes, and a sentence that says why."""
    theirs, ours = (f"rustc {of['rustc']} on {of['target']}" for of in (budgeted_for, made_with))
    if ours != theirs:
        return True, f"NOT CHECKED: the budgets are for {theirs}, this is {ours}"
    if budgeted_for["settings"] != made_with["settings"]:
        return False, f"the settings of the build have changed; if that is meant: {UPDATE}"
    wrong = sum(bool(row.verdict) for row in rows)
    if wrong:
        return False, f"{wrong} of {len(rows)} instruction counts are off; if that is meant: {UPDATE}"
    return True, f"{len(rows)} instruction counts within {TOLERANCE:.0%} of their budgets"


# ------------------------------------------------------------------------------------------------------------- budgets


def read(text: str) -> tuple[dict[str, str], dict[Key, float]]:
    """What the budgets were made with, and the budgets."""
    content = tomllib.loads(text)
    made_with = content.pop("made_with")
    return made_with, {
        (scalar, name): budget for scalar, of in content.items() for name, budget in of.items()
    }


def write(made_with: dict[str, str], counts: dict[Key, float]) -> str:
    """The file of the budgets."""
    lines = [f"# Instructions per sample, counted by callgrind. Made by: {UPDATE}", "", "[made_with]"]
    lines += [f'{what} = "{value}"' for what, value in made_with.items()]
    for scalar in dict.fromkeys(scalar for scalar, _ in counts):
        lines += ["", f"[{scalar}]"]
        lines += [f'"{name}" = {count:.1f}' for (of, name), count in counts.items() if of == scalar]
    return "\n".join(lines) + "\n"


# ------------------------------------------------------------------------------------------------------------ counting


def environment() -> dict[str, str]:
    """The caller's, without flags for the compiler: the budgets are for the project's own settings."""
    return {name: value for name, value in os.environ.items() if not name.endswith("RUSTFLAGS")}


def compiler() -> dict[str, str]:
    """The compiler, its target and the settings of the optimised build."""
    version = subprocess.check_output(["rustc", "--version", "--verbose"], text=True, cwd=ROOT)
    lines = dict(line.split(": ", 1) for line in version.splitlines() if ": " in line)
    profile = tomllib.loads((ROOT / "Cargo.toml").read_text())["profile"]["release"]
    settings = ", ".join(f"{name} = {value}" for name, value in profile.items())
    return {"rustc": version.split()[1], "target": lines["host"], "settings": settings}


def build() -> str:
    """Builds the bench; returns its path."""
    package = ["--locked", "--package", "compfilt-core", "--bench", "instructions"]
    command = [
        "cargo",
        "bench",
        "--quiet",
        "--no-run",
        *package,
        "--message-format",
        "json-render-diagnostics",
    ]
    messages = subprocess.check_output(command, text=True, cwd=ROOT, env=environment())
    built = [json.loads(line) for line in messages.splitlines()]
    (path,) = (message["executable"] for message in built if message.get("executable"))
    return path


def filters(bench: str) -> Iterator[Key]:
    """What the bench can run."""
    for line in subprocess.check_output([bench], text=True).splitlines():
        scalar, name = line.split(" ", 1)
        yield scalar, name


def instructions(bench: str, key: Key, samples: int) -> int:
    """All instructions of one run."""
    callgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command = [*callgrind, bench, *key, str(samples)]
    # An environment of its own: its size moves the stack.
    run = subprocess.run(
        command, check=True, capture_output=True, text=True, env={"PATH": os.environ["PATH"]}
    )
    (collected,) = re.findall(r"Collected : (\d+)", run.stderr)
    return int(collected)


def count(bench: str) -> dict[Key, float]:
    """Instructions per sample of every filter."""

    def per_sample(key: Key) -> float:
        once, twice = (instructions(bench, key, factor * SAMPLES) for factor in (1, 2))
        return round((twice - once) / SAMPLES, 1)

    keys = list(filters(bench))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(keys, pool.map(per_sample, keys), strict=True))


def there_is_valgrind() -> bool:
    """Looks for valgrind; tries to install it where that needs nobody's password."""
    if not shutil.which("valgrind") and shutil.which("apt-get") and os.geteuid() == 0:
        for command in (["update"], ["install", "--yes", "--no-install-recommends", "valgrind"]):
            subprocess.run(["apt-get", "--quiet", "--quiet", *command], check=False)
    return shutil.which("valgrind") is not None


def main() -> int:
    """Counts, compares, and prints the table."""
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    parser.add_argument("--update", action="store_true", help="write what was counted as the budgets")
    arguments = parser.parse_args()
    if not there_is_valgrind():
        print("instruction counts left out: valgrind is not installed", file=sys.stderr)
        return 1 if os.environ.get("CI") else 0
    made_with = compiler()
    counts = count(build())
    if arguments.update:
        BUDGETS.write_text(write(made_with, counts))
    budgeted_for, budgets = read(BUDGETS.read_text())
    rows = compare(budgets, counts)
    passes, why = judge(rows, budgeted_for, made_with)
    print(f"{table(rows)}\n\n{why}")
    return 0 if passes else 1


if __name__ == "__main__":
    sys.exit(main())
