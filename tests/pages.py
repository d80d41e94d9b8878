"""The blocks of code of a page, run as a reader would: in order, in one folder, each by what its language names.

    python    in one namespace for the page
    sh        by bash, which stops at the first command that fails
    toml, c   stored under the name in a comment on the first line, if there is one; a recipe must load, C must compile
    rust      not here: cargo runs those of the README and of docs/embedded.md

Anything else is not run. What cannot run in a test, such as an installation, says ``text``.
"""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from compfilt.logs.recipe import parse_recipe, tomllib

__all__ = ["LANGUAGES", "Block", "blocks", "run"]

ROOT = Path(__file__).resolve().parent.parent
LANGUAGES = {"python", "sh", "toml", "c", "rust", "text"}
"""What a block may say it is, beside a directive of the site, such as {toctree}."""

BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"(?:#|//|/\*) (\w[\w.-]*\.\w+)")
HEADERS = ROOT / "python/compfilt/include"
SECONDS = 120


@dataclass(frozen=True)
class Block:
    """A block, and where its first line stands."""

    page: Path
    line: int
    language: str
    text: str

    @property
    def where(self) -> str:
        """What to call it in a message."""
        return f"{self.page.name}:{self.line}"

    @property
    def name(self) -> str | None:
        """The file that its first line names."""
        found = NAME.match(self.text)
        return found[1] if found else None


def blocks(page: Path) -> list[Block]:
    """The blocks of a page, in order."""
    text = page.read_text()
    return [
        Block(page, text.count("\n", 0, found.start()) + 2, found[1].strip(), found[2])
        for found in BLOCK.finditer(text)
    ]


def run(page: Path, folder: Path) -> None:
    """Run the blocks of a page in a folder, into which the project's examples are copied."""
    for name in ("demo", "recipes"):
        shutil.copytree(
            ROOT / "examples" / name, folder / "examples" / name, ignore=shutil.ignore_patterns("out")
        )
    names: dict[str, object] = {"__name__": "page"}
    before = Path.cwd()
    os.chdir(folder)
    try:
        for block in blocks(page):
            run_block(block, names)
    finally:
        os.chdir(before)


def run_block(block: Block, names: dict[str, object]) -> None:
    """Run a block in the current folder; `names` are those of the Python blocks before it."""
    if block.name is not None and block.language in {"toml", "c"}:
        Path(block.name).write_text(block.text)
    match block.language:
        case "python":
            # Behind as many empty lines as stand before it, so that a traceback leads to the page.
            code = compile("\n" * (block.line - 1) + block.text, str(block.page), "exec")
            exec(code, names)
        case "sh":
            shell(block)
        case "toml":
            if "version" in tomllib.loads(block.text):
                parse_recipe(block.text, block.where)
        case "c":
            compile_c(block)


def shell(block: Block) -> None:
    """Run a block with this Python's commands in front of all others."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", block.text],
        env=os.environ | {"PATH": path},
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert done.returncode == 0, f"{block.where}: exit status {done.returncode}\n{done.stdout}{done.stderr}"


def compile_c(block: Block) -> None:
    """Compile a block against the header, where there is a compiler."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return
    done = subprocess.run(
        [
            compiler,
            *["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I", ".", "-I"],
            str(HEADERS),
            "-xc",
            "-",
        ],
        input=block.text,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert done.returncode == 0, f"{block.where}: {done.stderr}"
