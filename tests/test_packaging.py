"""What a release is made from agrees: versions, the changelog, the workflows and what they call."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import check_release
import compfilt

ROOT = Path(__file__).resolve().parent.parent
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
MANIFEST = """
version = "1.2.3"
compfilt-core = { path = "crates/compfilt-core", version = "1.2.3" }
"""
CHANGELOG = "## Unreleased\n\n## 1.2.3 - 2027-01-31\n\n### Added\n"

workflows = pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)


@pytest.mark.parametrize(
    "manifest", sorted(ROOT.glob("crates/compfilt-*/Cargo.toml")), ids=lambda p: p.parent.name
)
def test_crates_take_the_version_of_the_workspace(manifest):
    assert re.findall(r"^version.*", manifest.read_text(), re.MULTILINE) == ["version.workspace = true"]


def test_lock_files_know_the_version():
    for lock in ROOT.glob("*/*/Cargo.lock"):
        assert f'name = "compfilt-core"\nversion = "{compfilt.__version__}"' in lock.read_text(), lock


def test_the_extensions_version_is_the_only_one_in_python():
    assert 'dynamic = ["version"]' in (ROOT / "pyproject.toml").read_text()


def test_a_release_that_agrees_has_no_faults():
    assert check_release.faults("v1.2.3", MANIFEST, CHANGELOG) == []


@pytest.mark.parametrize(
    ("tag", "manifest", "changelog", "word"),
    [
        ("1.2.3", MANIFEST, CHANGELOG, "the tag must be v1.2.3"),
        ("v1.2.4", MANIFEST, CHANGELOG, "got v1.2.4"),
        ("v1.2.3", MANIFEST, "## Unreleased\n", "CHANGELOG.md must have"),
        ("v1.2.3", MANIFEST, "## 1.2.3\n", "CHANGELOG.md must have"),
        ("v1.2.3", MANIFEST, "## 1x2.3 - 2027-01-31\n", "CHANGELOG.md must have"),
        (
            "v1.2.3",
            MANIFEST.replace('core", version = "1.2.3"', 'core", version = "1.2.2"'),
            CHANGELOG,
            "must ask for",
        ),
    ],
)
def test_a_release_that_does_not_agree_is_named(tag, manifest, changelog, word):
    (fault,) = check_release.faults(tag, manifest, changelog)
    assert word in fault


def test_only_the_date_is_missing_from_this_version():
    """The release's other rules hold at any time."""
    faults = check_release.faults(
        f"v{compfilt.__version__}",
        (ROOT / "Cargo.toml").read_text(),
        f"## {compfilt.__version__} - 2027-01-31",
    )
    assert faults == []


def test_the_source_distribution_builds_the_c_library(tmp_path):
    """Its crate is a member of the workspace there, and the lock file fits: cargo says what it would build."""
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    maturin = shutil.which("maturin", path=path)
    if maturin is None or shutil.which("cargo") is None:
        pytest.skip("needs maturin and cargo")
    command(maturin, "sdist", "--out", str(tmp_path), cwd=ROOT)
    (archive,) = tmp_path.glob("*.tar.gz")
    # Python 3.10's tarfile does not know the safe filter in all its releases, and later ones ask for it.
    command("tar", "-xzf", str(archive), cwd=tmp_path)
    folder = tmp_path / archive.name.removesuffix(".tar.gz")
    header = "python/compfilt/include/compfilt.h"
    assert (folder / header).read_bytes() == (ROOT / header).read_bytes()
    tree = command(
        *["cargo", "tree", "--locked", "--offline", "--package", "compfilt-capi", "--edges", "normal"],
        cwd=folder,
    )
    assert tree.startswith("compfilt-capi v")
    assert "compfilt-core v" in tree


def command(*words, cwd):
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@workflows
def test_jobs_have_limits_and_no_rights_by_default(workflow):
    loaded = yaml.safe_load(workflow.read_text())
    assert loaded["permissions"] == {}
    for job in loaded["jobs"].values():
        assert job["timeout-minutes"] <= 90
        assert job["permissions"].keys() <= {"contents", "id-token", "attestations"}
        assert job["permissions"].get("contents", "read") == "read"


@workflows
def test_what_a_workflow_calls_is_there(workflow):
    text = workflow.read_text()
    for called in re.findall(r"(scripts/\w+\.\w+|\.ci/run)", text):
        assert (ROOT / called).exists(), called
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"make (\w+)$", text, re.MULTILINE):
        assert f"\n{target}:" in makefile, target


def test_publishing_waits_for_every_other_job():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text())["jobs"]
    assert set(jobs["pypi"]["needs"]) == jobs.keys() - {"pypi", "crates"}
    assert jobs["crates"]["needs"] == ["pypi"]
