"""The README's and the documents' examples run, and what they show twice is the same."""

import re
import shutil
from pathlib import Path

import pytest

import compfilt
import pages

ROOT = Path(__file__).resolve().parent.parent
README = ROOT / "README.md"
PAGES = [README, *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs/howto").glob("*.md"))]
OTHERS = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("[ad]*/*.md"), *ROOT.glob("examples/**/README.md")]
RUN = {"python", "sh", "toml", "c"}


@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if RUN & {block.language for block in pages.blocks(page)}],
    ids=lambda page: page.stem,
)
def test_blocks_run(page, tmp_path):
    pages.run(page, tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_says_what_it_is(page):
    """A block is left out only if it says that it is no code."""
    unknown = [
        block.where
        for block in pages.blocks(page)
        if block.language not in pages.LANGUAGES and not block.language.startswith("{")
    ]
    assert unknown == []


def test_rust_blocks_are_those_that_cargo_runs():
    """The core's README and docs/embedded.md are documentation of crates, whose examples cargo runs."""
    tested = [
        *pages.blocks(ROOT / "crates/compfilt-core/README.md"),
        *pages.blocks(ROOT / "docs/embedded.md"),
    ]
    known = {block.text for block in tested if block.language == "rust"}
    assert [
        b.where for page in PAGES for b in pages.blocks(page) if b.language == "rust" and b.text not in known
    ] == []


def test_readme_shows_python_rust_and_a_recipe():
    assert {"python", "rust", "toml", "sh"} <= {block.language for block in pages.blocks(README)}


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ('python\nraise ValueError("seen")\n', "seen"),
        ("sh\nfalse\ntrue\n", "exit status 1"),
        ("sh\nfalse | true\n", "exit status 1"),
        ('toml\nversion = 1\n[filter]\nkind = "none"\n', "log is missing"),
        ("c\nint main(void) { return compfilt; }\n", "compfilt"),
    ],
)
def test_a_block_can_fail(block, message, tmp_path):
    if block.startswith("c\n") and not (shutil.which("gcc") or shutil.which("cc")):
        pytest.skip("no C compiler")
    page = tmp_path / "page.md"
    page.write_text(f"# Page\n\n```{block}```\n")
    with pytest.raises(Exception, match=re.escape(message)):
        pages.run(page, tmp_path)


@pytest.mark.parametrize("page", [*PAGES, *OTHERS], ids=lambda page: str(page.relative_to(ROOT)))
def test_links_to_files_lead_somewhere(page):
    targets = re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", page.read_text())
    missing = [target for target in targets if not (page.parent / target).exists()]
    assert missing == []


@pytest.mark.parametrize("page", [*PAGES, *OTHERS], ids=lambda page: str(page.relative_to(ROOT)))
def test_links_to_other_sites_are_encrypted_and_whole(page):
    assert re.findall(r"\]\((?!https://[\w.-]+/|mailto:)\w+:[^)]*\)", page.read_text()) == []


def test_versions_agree():
    manifest = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{compfilt.__version__}"' in manifest
