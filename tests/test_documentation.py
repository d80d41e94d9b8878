"""The README's and the documents' examples run, and what they show twice is the same."""

import re
from pathlib import Path

import pytest

import compfilt
from compfilt.logs.recipe import load_recipe

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    """The code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_blocks_run(page):
    names: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, page.name, "exec"), names)


def test_readme_shows_python_rust_and_a_recipe():
    readme = PAGES[0]
    assert all(blocks(readme, language) for language in ("python", "rust", "toml", "sh"))


def test_the_rust_example_is_the_tested_one():
    """The core's README is its documentation, whose examples cargo runs."""
    assert blocks(PAGES[0], "rust") == blocks(ROOT / "crates/compfilt-core/README.md", "rust")


def test_the_recipe_example_loads(tmp_path):
    path = tmp_path / "readme.toml"
    path.write_text(blocks(PAGES[0], "toml")[0])
    assert load_recipe(path).filter.kind == "tilt"


@pytest.mark.parametrize("page", [*PAGES, *sorted(ROOT.glob("*.md"))], ids=lambda page: page.name)
def test_links_to_files_lead_somewhere(page):
    targets = re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", page.read_text())
    missing = [target for target in targets if not (page.parent / target).exists()]
    assert missing == []


def test_versions_agree():
    manifest = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{compfilt.__version__}"' in manifest
