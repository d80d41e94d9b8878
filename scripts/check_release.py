"""Whether a tag may be published: it is the version of Cargo.toml, and the changelog has a chapter about it.

python scripts/check_release.py v1.2.3
"""

import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def faults(tag: str, manifest: str, changelog: str) -> list[str]:
    """One sentence for each reason not to publish."""
    version = re.search(r'^version = "(.*)"', manifest, re.MULTILINE).group(1)
    found = []
    if tag != f"v{version}":
        found.append(f"the tag must be v{version}, the version of Cargo.toml, got {tag}")
    if not re.search(rf"^## {re.escape(version)} - \d{{4}}-\d\d-\d\d$", changelog, re.MULTILINE):
        found.append(f'CHANGELOG.md must have the chapter "## {version} - YEAR-MONTH-DAY"')
    # A path dependency is published as the version that is written beside it.
    if f'compfilt-core = {{ path = "crates/compfilt-core", version = "{version}" }}' not in manifest:
        found.append(f"the workspace's dependency on compfilt-core must ask for {version}")
    return found


def main() -> int:
    """Print the reasons."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tag", help="the tag, v and the version")
    found = faults(
        parser.parse_args().tag, (ROOT / "Cargo.toml").read_text(), (ROOT / "CHANGELOG.md").read_text()
    )
    for fault in found:
        print(fault, file=sys.stderr)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
